//! Runs a plan: schedule after schedule, all materials of a tile at once.
//!
//! Jobs run one after the other and the stages are parallel inside, so that a stage's time means
//! something and no byte of the results but the seconds depends on the number of threads. As many
//! materials are in memory as [`Extent::memory`] has room for.

mod follow;

use super::choices::Material;
use super::counts::Stage;
use super::instruments::PlannedInstrument;
use super::judge::{Judge, Truth};
use super::key::{self, Expected, Identity, RowKey};
use super::observer::{Event, Job, Observer, ScheduleKey, Stop, Summary, Teller, Wish, timed};
use super::plan::Plan;
use super::priors;
use super::readings::Readings;
use super::record::{Experiment, Extent, Known, Shard};
use super::route::{Route, Router};
use super::row::{Quantities, Row};
use super::schedules::{Share, name_of};
use super::unit::Unit;
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::measurement::Outcome;
use crate::reconstruct::{Coverage, present};
use std::collections::HashMap;
use std::sync::Arc;

impl Experiment for Plan {
    type Record = Row;

    fn question(&self) -> Option<&str> {
        self.question.as_deref()
    }

    fn resolved(&self) -> &toml::Table {
        &self.resolved
    }

    fn seeds(&self) -> Vec<u64> {
        self.seeds.clone()
    }

    fn materials(&self) -> &[Material] {
        &self.materials
    }

    fn missing(&self) -> &[String] {
        &self.missing
    }

    fn expected(&self, shard: Option<Shard>) -> Vec<Expected> {
        let share = self.share(shard);
        let rows = self.rows_of(&share.units);
        let of = |(material, m): (usize, &Material)| {
            let of_material = |row: &Expected| Expected {
                material,
                job: format!("{}, {}", m.name, row.job),
                ..row.clone()
            };
            rows.iter().map(of_material).collect::<Vec<_>>()
        };
        let all = self.materials.iter().enumerate();
        let mine = all.filter(|(i, _)| share.materials.has(*i));
        mine.flat_map(of).collect()
    }

    fn run(
        &self,
        extent: &Extent,
        known: &Known<Row>,
        observer: &mut dyn Observer<Row>,
    ) -> Result<Summary, Error> {
        let mut runner = Runner::new(self, extent, known, observer)?;
        let of_sets = self.sample_sets.iter().filter_map(|set| set.set.prior());
        let of_methods = self.methods.iter().filter_map(|m| m.method.prior());
        runner.teller.summary.inputs = priors::inputs(of_sets.chain(of_methods));
        let result = runner.tiles();
        runner.teller.summary.seconds.plan += runner.router.seconds();
        let mut tunings = self.sample_sets.iter().filter_map(|s| s.tuning.as_ref());
        runner.teller.summary.tuned = tunings.next().map_or(Vec::new(), |t| t.found());
        runner.teller.ended(result)
    }
}

/// A material of a tile.
struct Member<'a> {
    material: &'a Material,
    /// True if rows are made of it.
    is_mine: bool,
    /// Its hashes; `None` if its files cannot be read.
    identity: Option<&'a Identity>,
    /// Its BRDF and values; `None` where nothing is to be made of it, or it cannot be built.
    truth: Option<Truth>,
}

/// Readings of a material and their wall time.
struct Measured<'t> {
    member: &'t Member<'t>,
    identity: &'t Identity,
    truth: &'t Truth,
    readings: Readings,
    seconds: f64,
}

/// Materials with readings at the same poses.
struct Group<'t> {
    present: [Vec<bool>; 2],
    /// The coverage of the counted test pairs.
    coverage: Arc<Vec<Coverage>>,
    members: Vec<Measured<'t>>,
}

/// A method on a unit; `parts` has one hash per measure: all of a row's key but the material.
struct Task {
    method: usize,
    parts: Vec<blake3::Hash>,
}

impl Task {
    fn keys(&self, identity: &Identity) -> impl Iterator<Item = RowKey> {
        let parts = self.parts.iter();
        parts.map(move |part| key::of_part(&identity.key, part))
    }
}

struct Runner<'a> {
    plan: &'a Plan,
    extent: &'a Extent,
    known: &'a Known<Row>,
    units: Vec<Unit>,
    /// Shard of the materials that rows are made of.
    mine: Shard,
    /// Tasks, one list per unit.
    tasks: Vec<Vec<Task>>,
    teller: Teller<'a, Row>,
    judge: Judge<'a>,
    router: Router,
}

impl<'a> Runner<'a> {
    fn new(
        plan: &'a Plan,
        extent: &'a Extent,
        known: &'a Known<Row>,
        observer: &'a mut dyn Observer<Row>,
    ) -> Result<Self, Error> {
        let Share {
            units, materials, ..
        } = plan.share(extent.shard);
        let tasks = units.iter().map(|unit| {
            let task = |method| {
                let part = plan.part(unit, method);
                let parts = plan.measures.iter().map(|m| part.with(m.name()));
                Task {
                    method,
                    parts: parts.collect(),
                }
            };
            plan.methods_on(unit).into_iter().map(task).collect()
        });
        let teller = Teller::new(observer);
        Ok(Self {
            tasks: tasks.collect(),
            units,
            mine: materials,
            plan,
            extent,
            known,
            judge: Judge::new(plan, &teller.ledger)?,
            router: Router::counting(&teller.ledger),
            teller,
        })
    }

    fn tiles(&mut self) -> Result<(), Stop> {
        let tasks = self.units.iter().zip(&self.tasks);
        let each: f64 = tasks.map(|(u, t)| u.work() * t.len() as f64).sum();
        let positions = 0..self.plan.materials.len();
        let all = positions.filter(|i| self.mine.has(*i)).count() as f64 * each;
        self.teller.observer.begins(all);
        let identities = self.identify()?;
        let materials: Vec<_> = self.plan.materials.iter().zip(&identities).collect();
        let mut first = 0;
        while first < materials.len() {
            let size = self.tile_size(first);
            let several = size < materials.len();
            self.tile(first, &materials[first..first + size], several)?;
            first += size;
        }
        Ok(())
    }

    /// Number of materials from position `first` on that fit in memory; at least one.
    fn tile_size(&self, first: usize) -> usize {
        let plan = self.plan;
        let number = size_of::<f64>();
        let value = number * plan.channels.count();
        let readings = self.units.iter().map(|unit| {
            // Values, and among those of all materials.
            let ideal = 2 * value + size_of::<Outcome>();
            let a_pose = match self.instrument(unit) {
                None => ideal,
                // Uncertainties of two types; with and without limits, if that is asked.
                Some(i) => (ideal + 2 * value) * if i.use_of.holes { 2 } else { 1 },
            };
            unit.readings() * a_pose
        });
        // Of the truth, of all channels of the reconstruction and of their luminance.
        let pairs = self.judge.pairs() * (2 * number + value);
        let values = readings.max().unwrap_or(0) + pairs;
        let mut bytes = 0;
        let fits = |m: &&Material| {
            bytes += m.spec.tables().channel_bytes * plan.channels.count() + values;
            bytes <= self.extent.memory
        };
        let rest = plan.materials[first..].iter();
        rest.take_while(fits).count().max(1)
    }

    /// Hashes the files of the materials of the shard, and lists the keys of all rows.
    fn identify(&mut self) -> Result<Vec<Option<Identity>>, Stop> {
        let mut identities = Vec::new();
        for (i, material) in self.plan.materials.iter().enumerate() {
            if !self.mine.has(i) {
                self.teller.summary.materials.push(None);
                identities.push(None);
                continue;
            }
            self.teller
                .doing(&format_args!("reading {}", material.name))?;
            let jobs = self.jobs();
            let identity = self.teller.identified(material, jobs)?;
            if let Some(identity) = &identity {
                let tasks = self.tasks.iter().flatten();
                let keys = tasks.flat_map(|t| t.keys(identity));
                self.teller.summary.keys.extend(keys);
            }
            identities.push(identity);
        }
        Ok(identities)
    }

    /// Number of reconstructions of a material.
    fn jobs(&self) -> usize {
        self.tasks.iter().map(Vec::len).sum()
    }

    /// True if a row of this job is missing.
    fn lacks(&self, identity: &Identity, task: &Task) -> bool {
        task.keys(identity)
            .any(|key| !self.known.contains_key(&key))
    }

    /// True if a row of this job is missing, or the observer wants a by-product of it.
    fn wanted(&self, member: &Member<'_>, unit: &Unit, task: &Task) -> bool {
        let Some(identity) = member.identity else {
            return false;
        };
        self.lacks(identity, task)
            || (self.plan.output.slices && {
                let schedule = self.schedule_key(unit, member.material.symmetry);
                let job = Job {
                    schedule: Some(schedule),
                    method: Some(&self.plan.methods[task.method]),
                    ..Job::of(member.material)
                };
                let wish = Wish::Reconstruction(&job);
                self.teller.observer.wants(&wish)
            })
    }

    fn tile(
        &mut self,
        first: usize,
        tile: &[(&'a Material, &Option<Identity>)],
        several: bool,
    ) -> Result<(), Stop> {
        let mut members = Vec::new();
        for (i, (material, identity)) in tile.iter().enumerate() {
            let mut member = Member {
                material,
                is_mine: self.mine.has(first + i),
                identity: identity.as_ref(),
                truth: None,
            };
            self.load(first + i, &mut member)?;
            members.push(member);
        }
        let mut symmetries: Vec<Symmetry> = Vec::new();
        for member in &members {
            if !symmetries.contains(&member.material.symmetry) {
                symmetries.push(member.material.symmetry);
            }
        }
        for symmetry in symmetries {
            let alike = members.iter();
            let alike = alike.filter(|m| m.is_mine && m.material.symmetry == symmetry);
            let alike: Vec<&Member<'_>> = alike.collect();
            for u in 0..self.units.len() {
                let tasks = std::mem::take(&mut self.tasks[u]);
                let result = self.unit(symmetry, &alike, u, &tasks, several);
                self.tasks[u] = tasks;
                result?;
            }
        }
        Ok(())
    }

    /// Builds a material, if something of it is to be made.
    fn load(&mut self, position: usize, member: &mut Member<'_>) -> Result<(), Stop> {
        let (material, Some(identity)) = (member.material, member.identity) else {
            return Ok(());
        };
        let all = self.units.iter().zip(&self.tasks);
        let mut all = all.flat_map(|(u, tasks)| tasks.iter().map(move |t| (u, t)));
        let rows = all.any(|(unit, task)| self.wanted(member, unit, task));
        let wish = Wish::Material(position, material, &identity.key);
        let shown = self.teller.observer.wants(&wish);
        if !rows && !shown {
            return Ok(());
        }
        self.teller
            .doing(&format_args!("loading {}", material.name))?;
        let (channels, jobs) = (self.plan.channels.clone(), self.jobs());
        let Some(brdf) = self.teller.built(material, identity, channels, jobs)? else {
            return Ok(());
        };
        if shown {
            self.teller.loaded(material, &identity.key, &brdf)?;
        }
        if !rows {
            return Ok(());
        }
        let truth = self.judge.truth(brdf, &mut self.teller)?;
        member.truth = self.teller.or_failed(&material.name, truth, jobs)?;
        Ok(())
    }

    /// The schedule key of a unit; its budget is not known yet.
    fn schedule_key(&self, unit: &Unit, symmetry: Symmetry) -> ScheduleKey<'a> {
        let plan = self.plan;
        ScheduleKey {
            coordinates: &plan.parametrizations[unit.coordinates],
            symmetry,
            sample_set: &plan.sample_sets[unit.sample_set],
            allowance: unit.allowance,
            instrument: self.instrument(unit),
            seed: unit.seed,
            material: None,
        }
    }

    fn instrument(&self, unit: &Unit) -> Option<&'a PlannedInstrument> {
        unit.instrument.map(|i| &self.plan.instruments[i])
    }

    /// Runs one schedule: makes it, measures every material, and makes every reconstruction.
    fn unit(
        &mut self,
        symmetry: Symmetry,
        members: &[&Member<'_>],
        u: usize,
        tasks: &[Task],
        several: bool,
    ) -> Result<(), Stop> {
        let unit = self.units[u];
        let made = self.make(symmetry, members, &unit, tasks, several)?;
        let made: HashMap<&str, &Row> = made.iter().map(|r| (r.key.as_str(), r)).collect();
        let mut all = Vec::new();
        for identity in members.iter().filter_map(|m| m.identity) {
            for key in tasks.iter().flat_map(|t| t.keys(identity)) {
                let row = made.get(key.as_str()).copied();
                all.extend(row.or_else(|| self.known.get(&key).map(Arc::as_ref)));
            }
        }
        self.teller.complete(&all)
    }

    /// Makes the rows of a unit that are not known.
    fn make(
        &mut self,
        symmetry: Symmetry,
        members: &[&Member<'_>],
        unit: &Unit,
        tasks: &[Task],
        several: bool,
    ) -> Result<Vec<Row>, Stop> {
        let work = unit.work();
        let wanting: Vec<&Member<'_>> = members
            .iter()
            .filter(|m| m.truth.is_some() && tasks.iter().any(|t| self.wanted(m, unit, t)))
            .copied()
            .collect();
        let known = members.len() - wanting.len();
        self.teller.advanced((known * tasks.len()) as f64 * work)?;
        let schedule = self.schedule_key(unit, symmetry);
        let observer = &*self.teller.observer;
        let written = self.plan.output.schedules.0.is_some();
        if wanting.is_empty() && !(written && observer.wants(&Wish::Schedule(&schedule))) {
            return Ok(Vec::new());
        }
        let text = self.plan.describe(unit);
        self.teller.doing(&format_args!("planning {text}"))?;
        if schedule.sample_set.learns() {
            return self.learn(&wanting, &schedule, unit, tasks, &text);
        }
        let observer = &*self.teller.observer;
        let cancelled = || observer.cancelled();
        // Another tile asks again.
        let found = self.router.route(&schedule, several, &cancelled)?;
        let route = match found {
            Ok(route) => route,
            Err(reason) => {
                self.lose(&wanting, unit, tasks, &text, &reason)?;
                return Ok(Vec::new());
            }
        };
        if route.is_new {
            let itinerary = route.itinerary();
            let event = Event::Planned(&schedule, &route.schedule, itinerary);
            self.teller.observer.tell(&event)?;
        }
        self.follow(&wanting, &schedule, &route, (unit, tasks, &text))
    }

    /// Measures materials, and puts together those whose readings are at the same poses.
    fn measure<'t>(
        &mut self,
        members: &[&'t Member<'t>],
        schedule: &ScheduleKey<'_>,
        route: &Route,
        text: &str,
    ) -> Result<Vec<Group<'t>>, Stop> {
        let mut groups: Vec<Group<'t>> = Vec::new();
        for &member in members {
            let (Some(identity), Some(truth)) = (member.identity, &member.truth) else {
                continue;
            };
            self.teller
                .doing(&format_args!("measuring {}, {text}", member.material.name))?;
            let observer = &*self.teller.observer;
            let cancelled = || observer.cancelled();
            let brdf = truth.brdf.at(&self.teller.ledger, Stage::Measure);
            let (readings, seconds) =
                timed(|| Readings::take(&brdf, route, schedule.seed, &cancelled));
            let readings = readings?;
            readings.count(&self.teller.ledger);
            self.teller.summary.seconds.measure += seconds;
            let whole = readings.whole.as_ref().map(present);
            let present = [present(&readings.measured), whole.unwrap_or_default()];
            let measured = Measured {
                member,
                identity,
                truth,
                readings,
                seconds,
            };
            let mut alike = groups.iter_mut();
            // Alone, where each is to be a BRDF of its own.
            match alike.find(|g| !self.plan.needs_brdfs() && g.present == present) {
                Some(group) => group.members.push(measured),
                None => {
                    let mut alike = groups.iter().filter(|g| g.present[0] == present[0]);
                    let coverage = match alike.next() {
                        Some(group) => Arc::clone(&group.coverage),
                        None => {
                            let seconds = &mut self.teller.summary.seconds;
                            let measured = &measured.readings.measured;
                            Arc::new(self.judge.coverage(measured, seconds))
                        }
                    };
                    groups.push(Group {
                        present,
                        coverage,
                        members: vec![measured],
                    });
                }
            }
        }
        Ok(groups)
    }

    /// The rows of one method on a group; none if it fails.
    fn reconstruct(
        &mut self,
        schedule: &ScheduleKey<'_>,
        route: &Route,
        group: &Group<'_>,
        unit: &Unit,
        task: &Task,
        text: &str,
    ) -> Result<Vec<Row>, Stop> {
        let plan = self.plan;
        let method = &plan.methods[task.method];
        let members: Vec<&Measured<'_>> = group
            .members
            .iter()
            .filter(|m| self.wanted(m.member, unit, task))
            .collect();
        if members.is_empty() {
            return Ok(Vec::new());
        }
        let name = format!("{text}, {}", method.label());
        self.teller.doing(&format_args!("reconstructing {name}"))?;
        let truths: Vec<(&Material, &Truth, &Readings)> = members
            .iter()
            .map(|m| (m.member.material, m.truth, &m.readings))
            .collect();
        let teller = &mut self.teller;
        let compared =
            match self
                .judge
                .compared(schedule, &truths, &group.coverage, method, teller)?
            {
                Ok(compared) => compared,
                Err(reason) => {
                    for m in members {
                        let job = format!("{}, {name}", m.member.material.name);
                        self.teller.failed(job, &reason, 1)?;
                    }
                    return Ok(Vec::new());
                }
            };
        let mut rows = Vec::with_capacity(members.len() * plan.measures.len());
        for (i, m) in members.into_iter().enumerate() {
            let keys = task.keys(m.identity).zip(&plan.measures).enumerate();
            for (at, (key, measure)) in keys {
                if self.known.contains_key(&key) {
                    continue;
                }
                let compared = &compared[i];
                let mut quantities = Quantities::default();
                let errors = compared.write(at, &mut quantities);
                m.truth.write(at, &mut quantities);
                let facts = &m.readings.facts;
                rows.push(Row {
                    key,
                    material: m.member.material.name.clone(),
                    material_key: m.identity.key.clone(),
                    truth: m.member.material.truth().into(),
                    alignment: m.truth.alignment,
                    parametrization: schedule.coordinates.name().into(),
                    warp: schedule.coordinates.warp.clone(),
                    sample_set: schedule.sample_set.name.clone(),
                    reconstruction: method.name.clone(),
                    coordinates: method.coordinates.clone(),
                    instrument: name_of(schedule.instrument).into(),
                    budget: facts.budget,
                    allowed: schedule.allowance.to_string(),
                    readings: facts.readings,
                    seed: schedule.seed,
                    measure: measure.name().into(),
                    quantities,
                    poses: facts.poses,
                    no_data: facts.no_data,
                    reachable: facts.reachable,
                    unreachable: facts.unreachable.clone(),
                    saturated: facts.saturated,
                    below_noise: facts.below_noise,
                    instrument_seconds: facts.instrument_seconds,
                    unphysical_share: facts.unphysical_share,
                    pairs: errors.pairs,
                    converged: compared.converged[at],
                    pairs_missing: errors.pairs_missing,
                    pairs_unreconstructed: errors.pairs_unreconstructed,
                    plan_seconds: Some(route.seconds),
                    measure_seconds: Some(m.seconds),
                    reconstruct_seconds: Some(compared.reconstruct_seconds),
                    evaluate_seconds: Some(compared.evaluate_seconds),
                    moment_seconds: compared.moment_seconds,
                });
            }
        }
        Ok(rows)
    }
}
