//! The schedules of a plan, the reconstructions made on each, and the resulting rows.

use super::choices::{Allowance, Choice, Coordinates, IDEAL, Method, OWN, POSES_A_MINUTE};
use super::instruments::PlannedInstrument;
use super::key::{Expected, Part};
use super::moments::MomentsTable;
use super::observer::ScheduleKey;
use super::plan::Plan;
use super::record::Shard;
use super::tables::section;
use crate::geometry::Symmetry;
use crate::instrument::PictureSpec;

/// Values of a reconstruction that the moments of a view are integrated from, about.
const VIEW_VALUES: f64 = 4.5e4;

/// A schedule of a plan, by positions in the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Position of its coordinates in the plan; `None` of a sample set that depends on no parametrization.
    pub coordinates: Option<usize>,
    /// Position of its sample set.
    pub sample_set: usize,
    /// Position of its instrument; `None`: the ideal one.
    pub instrument: Option<usize>,
    /// Its size limit.
    pub allowance: Allowance,
    /// Seed.
    pub seed: u64,
}

impl Plan {
    /// Every schedule, in the order of results.
    pub fn units(&self) -> Vec<Unit> {
        let instruments: Vec<Option<usize>> = match self.instruments.len() {
            0 => vec![None],
            n => (0..n).map(Some).collect(),
        };
        let mut units = Vec::new();
        // What depends on no parametrization stands before all that do.
        let guided = (0..self.parametrizations.len()).map(Some);
        for coordinates in std::iter::once(None).chain(guided) {
            let sets = self.sample_sets.iter().enumerate();
            let sets = sets.filter(|(_, s)| s.set.is_unguided() == coordinates.is_none());
            for (sample_set, planned) in sets {
                let is_on = |i: usize| planned.on.is_empty() || planned.on.contains(&i);
                for &instrument in instruments.iter().filter(|i| i.is_none_or(is_on)) {
                    let most = planned.most();
                    let fits = |a: &Allowance| a.count().is_none_or(|n| n <= most);
                    for allowance in self.allowances().into_iter().filter(fits) {
                        units.extend(self.seeds.iter().map(|&seed| Unit {
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

    pub(crate) fn coordinates_of(&self, unit: &Unit) -> &Coordinates {
        unit.coordinates
            .map_or(&self.unguided, |i| &self.parametrizations[i])
    }

    /// Positions of the methods that are used on a schedule.
    pub fn methods_on(&self, unit: &Unit) -> Vec<usize> {
        let size = unit.allowance.count();
        let picture = unit
            .instrument
            .and_then(|i| self.instruments[i].spec.picture.as_ref());
        let moves = picture.is_some_and(PictureSpec::is_near);
        let suits = |m: &Method| {
            self.suits(m, unit.sample_set, unit.coordinates)
                && !(moves && m.method.needs_grid())
                && size.is_none_or(|n| m.up_to.is_none_or(|most| n <= most))
        };
        // In coordinates that are the schedule's own it would be made twice.
        let own = self.coordinates_of(unit).of_reconstructions().label();
        let twice = |m: &Method| {
            let mut same = self.methods.iter().filter(|o| o.name == m.name);
            m.coordinates == own && unit.coordinates.is_some() && same.any(|o| o.coordinates == OWN)
        };
        let all = self.methods.iter().enumerate();
        let suitable = all.filter(|(_, m)| suits(m) && !twice(m));
        suitable.map(|(i, _)| i).collect()
    }

    /// True if a method works on schedules of a sample set in coordinates, both by position.
    pub(super) fn suits(&self, m: &Method, set: usize, coordinates: Option<usize>) -> bool {
        let is_on = m.on.is_empty() || m.on.contains(&set);
        let is_grid = self.sample_sets[set].set.is_grid();
        is_on && (is_grid || !m.method.needs_grid()) && m.used_in.has(coordinates)
    }

    /// The units and materials of a shard: units are dealt out from the largest, and materials where units are too few.
    pub fn share(&self, shard: Option<Shard>) -> Share {
        let units = self.units();
        let Shard { part, of } = shard.unwrap_or(Shard::WHOLE);
        let blocks = (of / units.len().max(1)).clamp(1, self.materials.len());
        let (group, block) = ((part - 1) / blocks, (part - 1) % blocks);
        let groups = of / blocks;
        let mut order: Vec<usize> = (0..units.len()).collect();
        let work = |unit: &Unit| {
            let methods = self.methods_on(unit).into_iter();
            methods.map(|m| self.job_seconds(unit, m)).sum()
        };
        let work: Vec<f64> = units.iter().map(work).collect();
        order.sort_by(|&a, &b| work[b].total_cmp(&work[a]).then(a.cmp(&b)));
        // Those that are left over have nothing to do.
        let mine = order.into_iter().skip(group).step_by(groups);
        let mut mine: Vec<usize> = mine.filter(|_| group < groups).collect();
        mine.sort_unstable();
        Share {
            units: mine.into_iter().map(|i| units[i]).collect(),
            materials: Shard {
                part: block + 1,
                of: blocks,
            },
            group: Shard {
                part: group + 1,
                of: groups,
            },
        }
    }

    /// Schedules that a reconstruction is made on, each with the positions of its methods.
    pub(crate) fn used_units(&self) -> Vec<(Unit, Vec<usize>)> {
        let units = self.units().into_iter();
        let used = units.map(|unit| (unit, self.methods_on(&unit)));
        used.filter(|(_, methods)| !methods.is_empty()).collect()
    }

    /// Time to reconstruct a material on one core, and to compare it, s: about, without that of planning.
    pub(super) fn job_seconds(&self, unit: &Unit, method: usize) -> f64 {
        let method = &self.methods[method].method;
        let readings = unit.allowance.readings(POSES_A_MINUTE);
        // How many pairs suffice is not known beforehand.
        let [fewest, most] = [
            self.metrics.pairs,
            self.metrics.max_pairs.max(self.metrics.pairs),
        ];
        let pairs = (fewest as f64 * most as f64).sqrt() * self.measures.len() as f64;
        let of_moments = self.moments.as_ref().map_or(0, |m| m.spec.views) as f64 * VIEW_VALUES;
        // The truth at the pairs, and the readings.
        let fixed = 1e-7 * pairs + 1e-6 * readings as f64;
        fixed + method.fit_seconds(readings) + (pairs + of_moments) * method.value_seconds(readings)
    }

    /// Time of all reconstructions on schedules and by each method on one core, s.
    pub(crate) fn seconds_by_method(&self, used: &[(Unit, Vec<usize>)]) -> Vec<f64> {
        let mut seconds = vec![0.0; self.methods.len()];
        for (unit, methods) in used {
            for &method in methods {
                let jobs = self.materials.len() as f64;
                seconds[method] += jobs * self.job_seconds(unit, method);
            }
        }
        seconds
    }

    /// Number of reconstructions of a complete run.
    pub fn jobs(&self) -> usize {
        let units = self.units();
        let of_material: usize = units.iter().map(|u| self.methods_on(u).len()).sum();
        of_material * self.materials.len()
    }

    /// Number of rows of a complete run.
    pub fn rows(&self) -> usize {
        self.jobs() * self.measures.len()
    }

    /// A schedule for materials of some symmetries.
    pub(crate) fn schedule_key(&self, unit: &Unit, symmetry: Symmetry) -> ScheduleKey<'_> {
        ScheduleKey {
            coordinates: self.coordinates_of(unit),
            symmetry,
            sample_set: &self.sample_sets[unit.sample_set],
            allowance: unit.allowance,
            instrument: unit.instrument.map(|i| &self.instruments[i]),
            seed: unit.seed,
            material: None,
        }
    }

    /// Hasher of everything that determines the rows of a reconstruction but material and measure.
    pub(super) fn part(&self, unit: &Unit, method: usize) -> Part {
        let mut part = Part::new();
        part.feed(&format!("{:?}", self.channels));
        part.feed(&self.coordinates_of(unit).label());
        if unit.coordinates.is_none() {
            part.feed(&self.unguided.of_reconstructions().label());
        }
        let set = &self.sample_sets[unit.sample_set];
        part.feed(&set.name);
        part.feed_member(set.set.resolved(), set.set.prior());
        if let Some(tuning) = &set.tuning {
            part.feed(&tuning.key);
        }
        let instrument = unit.instrument.map(|i| self.instruments[i].resolved());
        part.feed(&instrument.unwrap_or_default().to_string());
        // A preset is named in a config; what it is belongs to the key all the same.
        let spec = unit.instrument.map(|i| section(&self.instruments[i].spec));
        part.feed(&spec.unwrap_or_default().to_string());
        part.feed(&unit.allowance.to_string());
        part.feed(&unit.seed.to_string());
        let method = &self.methods[method];
        part.feed(&method.name);
        part.feed_member(method.method.resolved(), method.method.prior());
        part.feed(&section(&self.metrics).to_string());
        part.feed(if self.albedo { "albedo" } else { "" });
        part.feed(if self.uncertainty { "uncertainty" } else { "" });
        let moments = self.moments.as_ref().map(MomentsTable::resolved);
        part.feed(&moments.unwrap_or_default().to_string());
        if self.moments.is_some() {
            // Their random estimators have the first seed, whatever the schedule's.
            part.feed(&self.seeds[0].to_string());
        }
        part
    }

    /// The rows expected of any material on some units.
    pub(super) fn rows_of(&self, units: &[Unit]) -> Vec<Expected> {
        let mut rows = Vec::new();
        for unit in units {
            // Neither its text nor the label of a row depends on the symmetry.
            let schedule = self.schedule_key(unit, Symmetry::FULL);
            for m in self.methods_on(unit) {
                let method = &self.methods[m];
                let choice = Choice {
                    parametrization: schedule.coordinates.name().into(),
                    warp: schedule.coordinates.warp.clone(),
                    sample_set: schedule.sample_set.name.clone(),
                    instrument: name_of(schedule.instrument).into(),
                    reconstruction: method.name.clone(),
                    coordinates: method.coordinates.clone(),
                };
                let allowed = unit.allowance.to_string();
                let part = self.part(unit, m);
                for measure in &self.measures {
                    let label = choice.label(&allowed, unit.seed, measure.name());
                    let job = format!("{schedule}, {}", method.label());
                    let part = part.hash_with(measure.name());
                    rows.push(Expected::of_any(&label, &job, part));
                }
            }
        }
        rows
    }
}

/// The part of a plan that is run.
pub struct Share {
    /// Its schedules, in the order of results.
    pub units: Vec<Unit>,
    /// Its materials, by position.
    pub materials: Shard,
    /// Among the parts that have the same materials.
    group: Shard,
}

impl Share {
    /// True if the material at a position is drawn by this part, and by no other.
    pub(crate) fn draws(&self, position: usize) -> bool {
        self.materials.has(position) && self.group.has(position / self.materials.of)
    }
}

pub(super) fn name_of(instrument: Option<&PlannedInstrument>) -> &str {
    instrument.map_or(IDEAL, |i| i.name.as_str())
}
