//! What a config of this kind means.

use super::config::{PictureSpec, Reach, StudyConfig};
use super::key;
use super::row::StudyRow;
use crate::error::Error;
use crate::experiment::checks::below;
use crate::experiment::plan::{Allowance, Coordinates as SampledIn, Plan};
use crate::experiment::resolved::{insert_list, section};
use crate::experiment::row::IDEAL;
use crate::experiment::source::{KeyPath, Source};
use crate::metrics::Measure;
use crate::reconstruct::{self, Coordinates, Reconstruct};
use std::fmt;
use std::str::FromStr;
use toml::Value;
use toml::de::DeTable;

/// What `coordinates` calls those of the schedule.
pub const OWN: &str = "own";

/// A reconstruction in one kind of coordinates.
#[derive(Debug)]
pub struct StudyMethod {
    /// Name of the reconstruction.
    pub name: String,
    /// The coordinates it works in: `own` for those of the schedule, else e.g. `hybrid+h_bar:square-root`.
    pub coordinates: String,
    /// The method.
    pub method: Box<dyn Reconstruct>,
    /// The largest budget it is used at.
    pub up_to: Option<usize>,
    /// The one sample set it is used on, by position.
    pub on: Option<usize>,
}

/// A schedule: what it is uniform in, how large, by whom it is visited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Position of its coordinates in the plan.
    pub coordinates: usize,
    /// Position of its sample set.
    pub sample_set: usize,
    /// Position of its instrument; `None`: the ideal one.
    pub instrument: Option<usize>,
    /// How large it may be.
    pub allowance: Allowance,
    /// Seed.
    pub seed: u64,
}

/// A line of the cross table but for material, measure and seed.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Choice {
    /// Parametrization the schedule is uniform in.
    pub parametrization: String,
    /// Its warps, or `none`.
    pub warp: String,
    /// Sample set.
    pub sample_set: String,
    /// Instrument.
    pub instrument: String,
    /// Reconstruction.
    pub reconstruction: String,
    /// The coordinates it works in.
    pub coordinates: String,
}

/// What a row is of.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Label {
    /// Material.
    pub material: String,
    /// Sampling and reconstruction.
    pub choice: Choice,
    /// What the schedule was allowed.
    pub allowed: String,
    /// Seed.
    pub seed: u64,
    /// Distribution of the test pairs.
    pub measure: String,
}

/// A row that a plan asks for, of a material whatever is in its files.
#[derive(Clone, Debug)]
pub struct Expected {
    /// What it is of.
    pub label: Label,
    job: blake3::Hash,
    measure: Measure,
}

impl Expected {
    /// True if a row is this one: of this plan, and of the material it says.
    pub fn is(&self, row: &StudyRow) -> bool {
        row.key == key::of_row(&row.material_key, &self.job, self.measure)
    }
}

/// A part of the schedules: `i/n`, 1 ≤ i ≤ n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 1.
    pub part: usize,
    /// Of how many.
    pub of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/');
        let parsed = parts.and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parsed {
            Some((part, of)) if 1 <= part && part <= of && of <= 100_000 => Ok(Self { part, of }),
            _ => Err("allowed: i/n with 1 <= i <= n, e.g. 1/8".into()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.part, self.of)
    }
}

/// A study that can be run.
pub struct StudyPlan {
    /// What it has in common with an acquisition.
    pub plan: Plan,
    /// Every reconstruction in each of its coordinates.
    pub methods: Vec<StudyMethod>,
    /// The largest ratio of errors that counts as no difference.
    pub band: f64,
    /// What is drawn.
    pub pictures: PictureSpec,
    /// The config with every default filled in.
    pub resolved: toml::Table,
}

impl StudyPlan {
    /// Reads a config and checks it.
    ///
    /// # Errors
    /// [`Error::Config`] and [`Error::Data`] as [`Plan::new`].
    pub fn read(source: &Source) -> Result<Self, Error> {
        let StudyConfig {
            common,
            coordinates,
            reach,
            pictures,
            band,
        } = StudyConfig::read(source)?;
        let plan = Plan::new(common)?;
        for (i, c) in coordinates.iter().enumerate().filter(|c| c.1.kind != OWN) {
            for symmetry in plan.symmetries() {
                c.form(symmetry).map_err(|e| {
                    let path = KeyPath::of("coordinates").index(i);
                    let key = e.key.trim_start_matches("coordinates.").to_owned();
                    let allowed = if key == "kind" { ", own" } else { "" };
                    source.error_at(&below(&path, &key), format!("{e}{allowed}"))
                })?;
            }
        }
        let mut methods = Vec::new();
        for (i, planned) in plan.reconstructions.iter().enumerate() {
            let reach = reach.get(i).cloned().unwrap_or_default();
            let up_to = reach.up_to.map(|n| n.unsigned_abs() as usize);
            let on = on(source, &plan, i, &reach)?;
            let table = planned.method.resolved();
            let fixed = planned.method.needs_grid() || table.contains_key("coordinates");
            let mut add = |coordinates: String, table: &toml::Table| {
                methods.push(StudyMethod {
                    name: planned.name.clone(),
                    coordinates,
                    method: read_again(table)?,
                    up_to,
                    on,
                });
                Ok::<_, Error>(())
            };
            match table.get("coordinates").cloned() {
                Some(own) => {
                    let own: Coordinates = own.try_into().map_err(internal)?;
                    add(own.label(), &table)?;
                }
                None if fixed || coordinates.is_empty() => add(OWN.into(), &table)?,
                None => {
                    for c in &coordinates {
                        let mut table = table.clone();
                        if c.kind != OWN {
                            let value = Value::try_from(c).map_err(internal)?;
                            table.insert("coordinates".into(), value);
                        }
                        add(c.label(), &table)?;
                    }
                }
            }
        }
        let mut resolved = plan.resolved.clone();
        insert_list(
            &mut resolved,
            "coordinates",
            coordinates.iter().map(section),
        );
        if let Some(Value::Array(list)) = resolved.get_mut("reconstruction") {
            for (table, reach) in list.iter_mut().zip(&reach) {
                if let Some(table) = table.as_table_mut() {
                    table.extend(section(reach));
                }
            }
        }
        resolved.insert("band".into(), band.into());
        resolved.insert("pictures".into(), pictures.resolved().into());
        let study = Self {
            plan,
            methods,
            band,
            pictures,
            resolved,
        };
        study.check_use(source)?;
        Ok(study)
    }

    /// Every reconstruction must have a schedule, and every schedule a reconstruction.
    fn check_use(&self, source: &Source) -> Result<(), Error> {
        let units = self.units();
        for (i, planned) in self.plan.reconstructions.iter().enumerate() {
            let mine = |m: &usize| self.methods[*m].name == planned.name;
            let used = |u: &Unit| self.methods_on(u).iter().any(mine);
            if !units.iter().any(used) {
                let path = KeyPath::of("reconstruction").index(i);
                let message = format!(
                    "{path} \"{}\" is never used; allowed: an up_to that a budget stays within, \
                     and a grid for what needs one",
                    planned.name
                );
                return Err(source.error_at(&path, message));
            }
        }
        for (i, set) in self.plan.sample_sets.iter().enumerate() {
            let mine = |u: &&Unit| u.sample_set == i;
            if units
                .iter()
                .filter(mine)
                .all(|u| self.methods_on(u).is_empty())
            {
                let path = KeyPath::of("sample_set").index(i);
                let message = format!(
                    "{path} \"{}\" has no reconstruction; allowed: one that works on it",
                    set.name
                );
                return Err(source.error_at(&path, message));
            }
        }
        Ok(())
    }

    /// Every schedule, in the order of results.
    pub fn units(&self) -> Vec<Unit> {
        let plan = &self.plan;
        let instruments: Vec<Option<usize>> = match plan.instruments.len() {
            0 => vec![None],
            n => (0..n).map(Some).collect(),
        };
        let mut units = Vec::new();
        for coordinates in 0..plan.parametrizations.len() {
            for sample_set in 0..plan.sample_sets.len() {
                for &instrument in &instruments {
                    for allowance in plan.allowances() {
                        units.extend(plan.seeds.iter().map(|&seed| Unit {
                            coordinates,
                            sample_set,
                            instrument,
                            allowance,
                            seed,
                        }));
                    }
                }
            }
        }
        units
    }

    /// Positions of the methods that are used on a schedule.
    pub fn methods_on(&self, unit: &Unit) -> Vec<usize> {
        let set = &self.plan.sample_sets[unit.sample_set].set;
        let size = match unit.allowance {
            Allowance::Poses(n) | Allowance::Readings(n) => Some(n),
            // Known when it is found.
            Allowance::Minutes(_) => None,
        };
        let suits = |m: &StudyMethod| {
            (set.is_grid() || !m.method.needs_grid())
                && m.on.is_none_or(|s| s == unit.sample_set)
                && size.is_none_or(|n| m.up_to.is_none_or(|most| n <= most))
        };
        // In coordinates that are the schedule's own it would be made twice.
        let own = own_label(&self.plan.parametrizations[unit.coordinates]);
        let twice = |m: &StudyMethod| {
            let mut same = self.methods.iter().filter(|o| o.name == m.name);
            m.coordinates == own && same.any(|o| o.coordinates == OWN)
        };
        let all = self.methods.iter().enumerate();
        all.filter(|(_, m)| suits(m) && !twice(m))
            .map(|(i, _)| i)
            .collect()
    }

    /// The units of a shard: dealt out from the largest, so that every shard has as much to do.
    pub fn shard(&self, shard: Option<Shard>) -> Vec<Unit> {
        let units = self.units();
        let Some(Shard { part, of }) = shard else {
            return units;
        };
        let size = |u: &Unit| match u.allowance {
            Allowance::Poses(n) | Allowance::Readings(n) => n as f64,
            Allowance::Minutes(m) => 1e3 * m,
        };
        let mut order: Vec<usize> = (0..units.len()).collect();
        order.sort_by(|&a, &b| size(&units[b]).total_cmp(&size(&units[a])).then(a.cmp(&b)));
        let mut mine: Vec<usize> = order.into_iter().skip(part - 1).step_by(of).collect();
        mine.sort_unstable();
        mine.into_iter().map(|i| units[i]).collect()
    }

    /// Reconstructions of one material in some units.
    pub fn jobs_of(&self, units: &[Unit]) -> usize {
        units.iter().map(|u| self.methods_on(u).len()).sum()
    }

    /// The rows of a complete run, in the order of results.
    pub fn expected(&self) -> Vec<Expected> {
        let common = &self.plan;
        let mut rows = Vec::new();
        for material in &common.materials {
            for unit in self.units() {
                let coordinates = &common.parametrizations[unit.coordinates];
                let instrument = unit.instrument.map(|i| common.instruments[i].name.clone());
                for m in self.methods_on(&unit) {
                    let choice = Choice {
                        parametrization: coordinates.name().into(),
                        warp: coordinates.warp.clone(),
                        sample_set: common.sample_sets[unit.sample_set].name.clone(),
                        instrument: instrument.clone().unwrap_or_else(|| IDEAL.into()),
                        reconstruction: self.methods[m].name.clone(),
                        coordinates: self.methods[m].coordinates.clone(),
                    };
                    let job = key::of_job(self, &unit, m);
                    rows.extend(common.measures.iter().map(|&measure| Expected {
                        label: Label {
                            material: material.name.clone(),
                            choice: choice.clone(),
                            allowed: unit.allowance.to_string(),
                            seed: unit.seed,
                            measure: measure.name().into(),
                        },
                        job,
                        measure,
                    }));
                }
            }
        }
        rows
    }

    /// Rows of a complete run.
    pub fn rows(&self) -> usize {
        self.jobs_of(&self.units()) * self.plan.materials.len() * self.plan.measures.len()
    }
}

/// Coordinates of a schedule, as those of a reconstruction are called.
fn own_label(coordinates: &SampledIn) -> String {
    let kind = coordinates.name().to_owned();
    let warp = coordinates.warps.clone();
    Coordinates { kind, warp }.label()
}

/// The sample set that `on` names.
fn on(source: &Source, plan: &Plan, i: usize, reach: &Reach) -> Result<Option<usize>, Error> {
    let Some(name) = &reach.on else {
        return Ok(None);
    };
    let found = plan.sample_sets.iter().position(|s| s.name == *name);
    if found.is_none() {
        let path = KeyPath::of("reconstruction").index(i).key("on");
        let names: Vec<_> = plan.sample_sets.iter().map(|s| s.name.as_str()).collect();
        let message = format!(
            "{path} = \"{name}\" is no sample set of this config; allowed: {}",
            names.join(", ")
        );
        return Err(source.error_at(&path, message));
    }
    Ok(found)
}

/// A method from its resolved table.
fn read_again(table: &toml::Table) -> Result<Box<dyn Reconstruct>, Error> {
    let text = toml::to_string(table).map_err(internal)?;
    let table = DeTable::parse(&text).map_err(internal)?;
    reconstruct::read(table).map_err(internal)
}

fn internal(e: impl fmt::Display) -> Error {
    Error::Internal(e.to_string())
}
