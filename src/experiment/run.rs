//! Runs a plan: schedule after schedule, all materials of a tile at once.
//!
//! Jobs run one after the other and the stages are parallel inside, so that no byte of the results but the seconds depends on
//! the number of threads. As many materials are in memory as [`Extent::memory`] has room for.

mod follow;

use super::checks::each_once;
use super::choices::{MINUTE_WORK, Material};
use super::counts::{Counters, Spent, Stage};
use super::evaluator::{Evaluator, Truth};
use super::key::{self, Expected, Identity, RowKey};
use super::observer::{ByProduct, Event, EventSink, Job, Observer, ScheduleKey, Stop, Summary};
use super::plan::Plan;
use super::priors;
use super::readings::Readings;
use super::record::{Experiment, Extent, Head, Known, Shard};
use super::route::{Route, Router};
use super::row::{Quantities, Row};
use super::schedules::{Share, Unit, name_of};
use crate::error::Error;
use crate::measurement::Outcome;
use crate::reconstruct::{Coverage, present};
use std::collections::HashMap;
use std::sync::Arc;

impl Experiment for Plan {
    type Record = Row;

    fn head(&self) -> Head<'_> {
        Head {
            question: self.question.as_deref(),
            resolved: &self.resolved,
            seeds: &self.seeds,
            materials: &self.materials,
            missing: &self.missing,
        }
    }

    fn of_each(&self, shard: Option<Shard>) -> (Shard, Vec<Expected>) {
        let share = self.share(shard);
        (share.materials, self.rows_of(&share.units))
    }

    fn run(
        &self,
        extent: &Extent,
        known: &Known<Row>,
        observer: &mut dyn Observer<Row>,
    ) -> Result<Summary, Error> {
        let Share {
            units, materials, ..
        } = self.share(extent.shard);
        let task = |unit: &Unit, method| {
            let part = self.part(unit, method);
            let parts = self.measures.iter().map(|m| part.hash_with(m.name()));
            Task {
                method,
                parts: parts.collect(),
                work: 1e6 * self.job_seconds(unit, method),
            }
        };
        let with_tasks = |unit| {
            let methods = self.methods_on(&unit).into_iter();
            let tasks = methods.map(|method| task(&unit, method));
            (unit, tasks.collect())
        };
        let units: Vec<(Unit, Vec<Task>)> = units.into_iter().map(with_tasks).collect();
        let mut events = EventSink::new(observer);
        events.counters.repeat_seconds = self.output.repeat_seconds;
        let mut runner = Runner {
            plan: self,
            extent,
            known,
            units: &units,
            mine: materials,
            again: false,
            judge: Evaluator::new(self, &events.counters)?,
            router: Router::counting(&events.counters),
            events,
        };
        let of_sets = self.sample_sets.iter().filter_map(|set| set.set.prior());
        let of_methods = self.methods.iter().filter_map(|m| m.method.prior());
        runner.events.summary.inputs = priors::inputs(of_sets.chain(of_methods));
        let result = runner.tiles();
        let mut tunings = self.sample_sets.iter().filter_map(|s| s.tuning.as_ref());
        runner.events.summary.tuned = tunings.next().map_or(Vec::new(), |t| t.found());
        runner.events.ended(result)
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
    spent: Spent,
}

/// Materials with readings at the same poses.
struct Group<'t> {
    present: [Vec<bool>; 2],
    /// The coverage of the counted test pairs.
    coverage: Arc<Vec<Coverage>>,
    members: Vec<Measured<'t>>,
}

/// A method on a unit.
struct Task {
    method: usize,
    /// A hash per measure, of all of a row's key but the material.
    parts: Vec<blake3::Hash>,
    /// Estimated time for one material on one core, µs.
    work: f64,
}

impl Task {
    fn keys(&self, identity: &Identity) -> impl Iterator<Item = RowKey> {
        let parts = self.parts.iter();
        parts.map(move |part| key::of_part(&identity.key, part))
    }
}

/// A schedule, and the reconstructions that are made of some materials on it.
struct Batch<'b> {
    schedule: ScheduleKey<'b>,
    tasks: &'b [Task],
    members: Vec<&'b Member<'b>>,
}

impl Batch<'_> {
    /// Estimated work of the reconstructions of so many materials.
    fn work(&self, materials: usize) -> f64 {
        materials as f64 * self.tasks.iter().map(|task| task.work).sum::<f64>()
    }
}

struct Runner<'a> {
    plan: &'a Plan,
    extent: &'a Extent,
    known: &'a Known<Row>,
    units: &'a [(Unit, Vec<Task>)],
    /// Shard of the materials that rows are made of.
    mine: Shard,
    /// True if another tile asks for the same schedules again.
    again: bool,
    events: EventSink<'a, Row>,
    judge: Evaluator<'a>,
    router: Router,
}

impl<'a> Runner<'a> {
    fn tiles(&mut self) -> Result<(), Stop> {
        let tasks = self.units.iter().flat_map(|(_, tasks)| tasks);
        let each: f64 = tasks.map(|task| task.work).sum();
        let positions = 0..self.plan.materials.len();
        let all = positions.filter(|i| self.mine.has(*i)).count() as f64 * each;
        self.events.observer.begins(all);
        let identities = self.identify()?;
        let materials: Vec<_> = self.plan.materials.iter().zip(&identities).collect();
        let mut first = 0;
        while first < materials.len() {
            let size = self.tile_size(first);
            self.again = size < materials.len();
            self.tile(first, &materials[first..first + size])?;
            first += size;
        }
        Ok(())
    }

    /// Number of materials from position `first` on that fit in memory; at least one.
    fn tile_size(&self, first: usize) -> usize {
        let plan = self.plan;
        let number = size_of::<f64>();
        let value = number * plan.channels.count();
        let readings = self.units.iter().map(|(unit, _)| {
            // Values, and among those of all materials.
            let ideal = 2 * value + size_of::<Outcome>();
            let a_pose = match unit.instrument.map(|i| &plan.instruments[i]) {
                None => ideal,
                // Uncertainties of two types; with and without limits, if that is asked.
                Some(i) => (ideal + 2 * value) * if i.use_of.holes { 2 } else { 1 },
            };
            unit.allowance.readings(MINUTE_WORK) * a_pose
        });
        // Values of reconstructions are of a slice of the pairs at a time, and small beside these.
        let values = readings.max().unwrap_or(0) + self.judge.pairs() * number;
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
                self.events.summary.materials.push(None);
                identities.push(None);
                continue;
            }
            self.events
                .doing(&format_args!("reading {}", material.name))?;
            let jobs = self.jobs();
            let identity = self.events.identified(material, jobs)?;
            if let Some(identity) = &identity {
                let tasks = self.units.iter().flat_map(|(_, tasks)| tasks);
                let keys = tasks.flat_map(|t| t.keys(identity));
                self.events.summary.keys.extend(keys);
            }
            identities.push(identity);
        }
        Ok(identities)
    }

    /// Number of reconstructions of a material.
    fn jobs(&self) -> usize {
        self.units.iter().map(|(_, tasks)| tasks.len()).sum()
    }

    /// True if a row of this job is missing, or the observer requests a by-product of it.
    fn wanted(&self, member: &Member<'_>, schedule: &ScheduleKey<'_>, task: &Task) -> bool {
        let Some(identity) = member.identity else {
            return false;
        };
        let mut keys = task.keys(identity);
        let job = Job {
            material: member.material,
            // As it is asked for, before its poses are chosen for a material.
            schedule: ScheduleKey {
                material: None,
                ..*schedule
            },
            method: &self.plan.methods[task.method],
        };
        let wish = ByProduct::Reconstruction(&job);
        keys.any(|key| !self.known.contains_key(&key))
            || (self.plan.output.slices && self.events.observer.requests(&wish))
    }

    fn tile(
        &mut self,
        first: usize,
        tile: &[(&'a Material, &Option<Identity>)],
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
        for symmetry in each_once(members.iter().map(|m| m.material.symmetry)) {
            let alike = |m: &&Member<'_>| m.is_mine && m.material.symmetry == symmetry;
            for (unit, tasks) in self.units {
                self.batch(&Batch {
                    schedule: self.plan.schedule_key(unit, symmetry),
                    tasks,
                    members: members.iter().filter(alike).collect(),
                })?;
            }
        }
        Ok(())
    }

    /// Builds a material, if something of it is to be made.
    fn load(&mut self, position: usize, member: &mut Member<'_>) -> Result<(), Stop> {
        let (material, Some(identity)) = (member.material, member.identity) else {
            return Ok(());
        };
        let rows = self.units.iter().any(|(unit, tasks)| {
            let schedule = self.plan.schedule_key(unit, material.symmetry);
            let mut tasks = tasks.iter();
            tasks.any(|task| self.wanted(member, &schedule, task))
        });
        let wish = ByProduct::Material(position, material, &identity.key);
        let shown = self.events.observer.requests(&wish);
        if !rows && !shown {
            return Ok(());
        }
        self.events
            .doing(&format_args!("loading {}", material.name))?;
        let (channels, jobs) = (self.plan.channels.clone(), self.jobs());
        let Some(brdf) = self.events.built(material, identity, channels, jobs)? else {
            return Ok(());
        };
        if shown {
            self.events.loaded(material, &identity.key, &brdf)?;
        }
        if !rows {
            return Ok(());
        }
        let truth = self.judge.truth(brdf, &self.events);
        let name = [material.name.clone()];
        member.truth = self.events.or_failed(truth, name, jobs)?;
        Ok(())
    }

    /// Runs one schedule: makes it, measures every material, and makes every reconstruction.
    fn batch(&mut self, batch: &Batch<'_>) -> Result<(), Stop> {
        let made = self.make(batch)?;
        let made: HashMap<&str, &Row> = made.iter().map(|r| (r.key.as_str(), r)).collect();
        let mut all = Vec::new();
        for identity in batch.members.iter().filter_map(|m| m.identity) {
            for key in batch.tasks.iter().flat_map(|t| t.keys(identity)) {
                let row = made.get(key.as_str()).copied();
                all.extend(row.or_else(|| self.known.get(&key).map(Arc::as_ref)));
            }
        }
        self.events.complete(&all)
    }

    /// Makes the rows of a batch that are not known.
    fn make(&mut self, batch: &Batch<'_>) -> Result<Vec<Row>, Stop> {
        let schedule = &batch.schedule;
        let lacks = |m: &&Member<'_>| {
            let mut tasks = batch.tasks.iter();
            m.truth.is_some() && tasks.any(|t| self.wanted(m, schedule, t))
        };
        let (members, known): (Vec<_>, Vec<_>) = batch.members.iter().copied().partition(lacks);
        self.events.advanced(batch.work(known.len()))?;
        let batch = &Batch { members, ..*batch };
        let observer = &*self.events.observer;
        let is_wished = self.plan.output.schedules.0.is_some()
            && observer.requests(&ByProduct::Schedule(schedule));
        if batch.members.is_empty() && !is_wished {
            return Ok(Vec::new());
        }
        self.events.doing(&format_args!("planning {schedule}"))?;
        if schedule.sample_set.learns() {
            return self.learn(batch);
        }
        let events = &self.events;
        let found = self
            .router
            .route(schedule, true, self.again, &|| events.go_on());
        let Some(route) = self.or_lost(found, batch)? else {
            return Ok(Vec::new());
        };
        if route.is_new {
            let event = Event::Planned(schedule, &route.schedule, route.itinerary());
            self.events.observer.observe(&event)?;
        }
        self.follow(batch, &route)
    }

    /// Measures materials, and puts together those whose readings are at the same poses.
    fn measure<'t>(&mut self, batch: &Batch<'t>, route: &Route) -> Result<Vec<Group<'t>>, Stop> {
        let (mut groups, schedule): (Vec<Group<'t>>, _) = (Vec::new(), &batch.schedule);
        for &member in &batch.members {
            let (Some(identity), Some(truth)) = (member.identity, &member.truth) else {
                continue;
            };
            self.events.doing(&format_args!(
                "measuring {}, {schedule}",
                member.material.name
            ))?;
            let events = &self.events;
            let take = |counters: &Counters| {
                let brdf = truth.brdf.counted_at(counters, Stage::Measure);
                Readings::take(&brdf, route, schedule.seed, &|| events.go_on())
            };
            let (readings, spent) = events.counters.repeated(Stage::Measure, take);
            let readings = readings?;
            readings.count(&events.counters);
            let whole = readings.whole.as_ref().map(present);
            let present = [present(&readings.measured), whole.unwrap_or_default()];
            let measured = Measured {
                member,
                identity,
                truth,
                readings,
                spent,
            };
            let mut alike = groups.iter_mut();
            // Alone, where each is to be a BRDF of its own.
            match alike.find(|g| !self.plan.needs_brdfs() && g.present == present) {
                Some(group) => group.members.push(measured),
                None => {
                    let mut alike = groups.iter().filter(|g| g.present[0] == present[0]);
                    let coverage = match alike.next() {
                        Some(group) => Arc::clone(&group.coverage),
                        None => Arc::new(self.judge.coverage(&measured.readings.measured)),
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
        group: &Group<'_>,
        task: &Task,
    ) -> Result<Vec<Row>, Stop> {
        let plan = self.plan;
        let method = &plan.methods[task.method];
        let wanted = |m: &&Measured<'_>| self.wanted(m.member, schedule, task);
        let members: Vec<&Measured<'_>> = group.members.iter().filter(wanted).collect();
        if members.is_empty() {
            return Ok(Vec::new());
        }
        let name = format!("{schedule}, {}", method.label());
        self.events.doing(&format_args!("reconstructing {name}"))?;
        let truths = members
            .iter()
            .map(|m| (m.member.material, m.truth, &m.readings));
        let (truths, events): (Vec<_>, _) = (truths.collect(), &mut self.events);
        let judge = &self.judge;
        let compared = judge.compared(schedule, &truths, &group.coverage, method, events);
        let names = members.iter().map(|m| &m.member.material.name);
        let names = names.map(|material| format!("{material}, {name}"));
        let Some(compared) = events.or_failed(compared, names, 1)? else {
            return Ok(Vec::new());
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
                let all =
                    m.readings.planned + m.spent + compared.reconstructed + compared.evaluated;
                let [low, high] = all.range().map_or([None; 2], |ends| ends.map(Some));
                rows.push(Row {
                    key,
                    material: m.member.material.name.clone(),
                    material_key: m.identity.key.clone(),
                    truth: m.member.material.truth(m.truth.alignment.as_ref()).into(),
                    alignment: m.truth.alignment.map(|a| a.q),
                    parametrization: schedule.coordinates.name().into(),
                    warp: schedule.coordinates.warp.clone(),
                    sample_set: schedule.sample_set.name.clone(),
                    reconstruction: method.name.clone(),
                    coordinates: method.coordinates.clone(),
                    instrument: name_of(schedule.instrument).into(),
                    allowed: schedule.allowance.to_string(),
                    seed: schedule.seed,
                    measure: measure.name().into(),
                    quantities,
                    pairs: errors.pairs,
                    converged: compared.converged[at],
                    pairs_missing: errors.pairs_missing,
                    pairs_unreconstructed: errors.pairs_unreconstructed,
                    measure_seconds: Some(m.spent.seconds),
                    reconstruct_seconds: Some(compared.reconstructed.seconds),
                    evaluate_seconds: Some(compared.evaluated.seconds),
                    low_seconds: low,
                    high_seconds: high,
                    moment_seconds: compared.moment_seconds,
                    ..m.readings.facts.clone()
                });
            }
        }
        Ok(rows)
    }
}
