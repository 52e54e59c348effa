//! Runs a study: schedule after schedule, all materials at once.
//!
//! Jobs run one after the other and the stages are parallel inside, so that no byte of the results
//! but the seconds depends on the number of threads. As many materials are in memory as a tile has.

use super::key::{self, Identity};
use super::plan::{Shard, StudyPlan, Unit};
use super::row::{RowKey, StudyRow};
use crate::analysis::alignment;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::observer::{Failure, Input, ScheduleKey};
use crate::experiment::plan::Material;
use crate::experiment::readings::{Facts, Readings as Taken};
use crate::experiment::route::{Place, Route, Router};
use crate::experiment::row::IDEAL;
use crate::experiment::run::{Stop, timed};
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::Outcome;
use crate::metrics::{self, Errors, Values};
use crate::reconstruct::{Interpolant, Readings};
use rayon::prelude::*;
use std::collections::HashSet;

/// Materials in memory at a time: as MERL tables in luminance 12 MB each.
const TILE: usize = 64;

/// Pairs at which a stack is evaluated in one task.
const CHUNK: usize = 256;

/// Is told what happens during a study, and may stop it.
pub trait StudyObserver {
    /// True if the study shall stop; asked before every stage.
    fn cancelled(&self) -> bool;

    /// What is done now, for people.
    fn stage(&mut self, what: &str);

    /// True if a material shall be [`loaded`](Self::loaded) though all its rows are there.
    fn wants(&self, _material: &Material, _key: &str) -> bool {
        false
    }

    /// A material is there; `key` is the hash of what it is. Asked before its rows are made.
    ///
    /// # Errors
    /// End the study.
    fn loaded(&mut self, material: &Material, brdf: &dyn Brdf, key: &str) -> Result<(), Error>;

    /// New rows.
    ///
    /// # Errors
    /// End the study.
    fn rows(&mut self, rows: Vec<StudyRow>) -> Result<(), Error>;

    /// Something could not be done; the study goes on.
    fn failed(&mut self, failure: &Failure);

    /// So many jobs are over, done, failed or known from before.
    fn advanced(&mut self, jobs: usize);
}

/// How a study ended.
#[derive(Debug, Default)]
pub struct StudySummary {
    /// Rows that were made.
    pub rows: usize,
    /// Keys of all rows of the plan (or of its shard), in the order of results.
    pub keys: Vec<RowKey>,
    /// What could not be done.
    pub failures: Vec<Failure>,
    /// The files of the materials.
    pub inputs: Vec<Input>,
    /// What each material is, as a hash; `None` of one that cannot be read.
    pub materials: Vec<Option<String>>,
    /// True if the observer asked to stop before the end.
    pub interrupted: bool,
}

/// Makes the rows of a study that are not in `known`.
///
/// # Errors
/// Those of the observer. A job that cannot be done is no error but a [`Failure`].
pub fn study(
    plan: &StudyPlan,
    shard: Option<Shard>,
    known: &HashSet<RowKey>,
    observer: &mut dyn StudyObserver,
) -> Result<StudySummary, Error> {
    let mut runner = Runner::new(plan, shard, known, observer)?;
    match runner.tiles() {
        Ok(()) => {}
        Err(Stop::Cancelled) => runner.summary.interrupted = true,
        Err(Stop::Error(e)) => return Err(e),
    }
    Ok(runner.summary)
}

/// A material and what reconstructions of it are compared with.
struct Truth<'a> {
    material: &'a Material,
    identity: &'a Identity,
    name: String,
    alignment: Option<f64>,
    brdf: Box<dyn Brdf>,
    /// One a measure.
    values: Vec<Values>,
}

/// Materials whose readings are at the same poses.
struct Stack<'t, 'a> {
    present: Vec<bool>,
    members: Vec<(&'t Truth<'a>, Taken, f64)>,
}

/// A method on a unit, with the hash of both.
struct Task {
    method: usize,
    hash: blake3::Hash,
}

struct Runner<'a> {
    plan: &'a StudyPlan,
    units: Vec<Unit>,
    known: &'a HashSet<RowKey>,
    observer: &'a mut dyn StudyObserver,
    pairs: Vec<Vec<DirectionPair>>,
    router: Router,
    /// One a material; `None`: its files cannot be read.
    identities: Vec<Option<Identity>>,
    /// One list a unit.
    tasks: Vec<Vec<Task>>,
    summary: StudySummary,
}

impl<'a> Runner<'a> {
    fn new(
        plan: &'a StudyPlan,
        shard: Option<Shard>,
        known: &'a HashSet<RowKey>,
        observer: &'a mut dyn StudyObserver,
    ) -> Result<Self, Error> {
        let common = &plan.plan;
        let pairs = common.measures.iter().map(|&measure| {
            metrics::test_pairs(measure, &common.metrics).map_err(|e| Error::config("metrics", e))
        });
        let pairs = pairs.collect::<Result<_, _>>()?;
        let units = plan.shard(shard);
        let tasks = units.iter().map(|u| {
            let methods = plan.methods_on(u).into_iter();
            let task = |method| Task {
                method,
                hash: key::of_job(plan, u, method),
            };
            methods.map(task).collect()
        });
        Ok(Self {
            tasks: tasks.collect(),
            units,
            plan,
            known,
            observer,
            pairs,
            router: Router::default(),
            identities: Vec::new(),
            summary: StudySummary::default(),
        })
    }

    fn tiles(&mut self) -> Result<(), Stop> {
        self.identify()?;
        let identities = std::mem::take(&mut self.identities);
        let materials = self.plan.plan.materials.iter().zip(&identities);
        let materials: Vec<_> = materials.collect();
        for tile in materials.chunks(TILE) {
            self.tile(tile)?;
        }
        Ok(())
    }

    /// Hashes the files of all materials, and lists the keys of all rows.
    fn identify(&mut self) -> Result<(), Stop> {
        for material in &self.plan.plan.materials {
            self.begin(&format!("reading {}", material.name))?;
            match Identity::of(material) {
                Ok(identity) => {
                    self.summary.inputs.extend_from_slice(&identity.inputs);
                    for task in self.tasks.iter().flatten() {
                        let measures = self.plan.plan.measures.iter();
                        let keys = measures.map(|&m| key::of_row(&identity.key, &task.hash, m));
                        self.summary.keys.extend(keys);
                    }
                    self.summary.materials.push(Some(identity.key.clone()));
                    self.identities.push(Some(identity));
                }
                Err(reason) => {
                    self.fail(&material.name, reason, self.jobs_of_material());
                    self.summary.materials.push(None);
                    self.identities.push(None);
                }
            }
        }
        Ok(())
    }

    fn jobs_of_material(&self) -> usize {
        self.tasks.iter().map(Vec::len).sum()
    }

    /// True if a row of this job is missing.
    fn wanted(&self, identity: &Identity, task: &Task) -> bool {
        let mut measures = self.plan.plan.measures.iter();
        measures.any(|&m| {
            !self
                .known
                .contains(&key::of_row(&identity.key, &task.hash, m))
        })
    }

    fn tile(&mut self, tile: &[(&Material, &Option<Identity>)]) -> Result<(), Stop> {
        let mut truths = Vec::new();
        for (material, identity) in tile {
            let Some(identity) = identity else {
                continue;
            };
            let mut tasks = self.tasks.iter().flatten();
            let key = identity.key.clone();
            let rows = tasks.any(|task| self.wanted(identity, task));
            if !rows && !self.observer.wants(material, &key) {
                self.observer.advanced(self.jobs_of_material());
                continue;
            }
            self.begin(&format!("loading {}", material.name))?;
            match material.spec.build(self.plan.plan.channels) {
                Ok(brdf) => {
                    self.observer.loaded(material, &*brdf, &key)?;
                    if !rows {
                        self.observer.advanced(self.jobs_of_material());
                        continue;
                    }
                    let at = |pairs: &Vec<DirectionPair>| metrics::evaluate(&*brdf, pairs);
                    truths.push(Truth {
                        material,
                        identity,
                        name: truth_name(material),
                        alignment: alignment(&*brdf).map(|a| a.q),
                        values: self.pairs.iter().map(at).collect(),
                        brdf,
                    });
                }
                Err(e) => self.fail(&material.name, e.to_string(), self.jobs_of_material()),
            }
        }
        let mut symmetries: Vec<Symmetry> = Vec::new();
        for truth in &truths {
            if !symmetries.contains(&truth.material.symmetry) {
                symmetries.push(truth.material.symmetry);
            }
        }
        for symmetry in symmetries {
            let alike = truths.iter().filter(|t| t.material.symmetry == symmetry);
            let alike: Vec<&Truth<'_>> = alike.collect();
            for u in 0..self.units.len() {
                self.unit(symmetry, &alike, u)?;
            }
        }
        Ok(())
    }

    /// One schedule: plan, measure every material, and every reconstruction.
    fn unit(&mut self, symmetry: Symmetry, truths: &[&Truth<'_>], u: usize) -> Result<(), Stop> {
        let unit = self.units[u];
        let tasks = std::mem::take(&mut self.tasks[u]);
        let result = self.tasks_of(symmetry, truths, &unit, &tasks);
        self.tasks[u] = tasks;
        result
    }

    fn tasks_of(
        &mut self,
        symmetry: Symmetry,
        truths: &[&Truth<'_>],
        unit: &Unit,
        tasks: &[Task],
    ) -> Result<(), Stop> {
        let wanted = |t: &&&Truth<'_>| tasks.iter().any(|task| self.wanted(t.identity, task));
        let wanting: Vec<&Truth<'_>> = truths.iter().filter(wanted).copied().collect();
        let known = truths.len() - wanting.len();
        self.observer.advanced(known * tasks.len());
        if wanting.is_empty() {
            return Ok(());
        }
        let common = &self.plan.plan;
        let mut schedule = schedule_key(self.plan, unit, symmetry);
        let text = describe(&schedule);
        self.begin(&text)?;
        let place = Place {
            symmetry,
            coordinates: unit.coordinates,
            sample_set: unit.sample_set,
            instrument: unit.instrument.unwrap_or(0),
        };
        let observer = &*self.observer;
        // Instruments share schedules; another tile asks again.
        let again = common.instruments.len() > 1 || common.materials.len() > TILE;
        let cancelled = || observer.cancelled();
        let found = self.router.route(&mut schedule, place, again, &cancelled)?;
        let route = match found {
            Ok(route) => route,
            Err(reason) => {
                for truth in &wanting {
                    let job = format!("{}, {text}", truth.material.name);
                    self.fail(&job, reason.clone(), tasks.len());
                }
                return Ok(());
            }
        };
        let stacks = self.measure(&wanting, &schedule, &route)?;
        for task in tasks {
            for stack in &stacks {
                let made = self.reconstruct(&schedule, &route, stack, task, &text)?;
                self.summary.rows += made.len();
                self.observer.rows(made)?;
                self.observer.advanced(stack.members.len());
            }
        }
        Ok(())
    }

    /// Measures materials, and puts together those whose readings are at the same poses.
    fn measure<'t, 'm>(
        &self,
        truths: &[&'t Truth<'m>],
        schedule: &ScheduleKey<'_>,
        route: &Route,
    ) -> Result<Vec<Stack<'t, 'm>>, Stop> {
        let cancelled = || self.observer.cancelled();
        let mut stacks: Vec<Stack<'t, 'm>> = Vec::new();
        for &truth in truths {
            if cancelled() {
                return Err(Stop::Cancelled);
            }
            let (taken, seconds) = timed(|| Taken::take(&*truth.brdf, schedule, route, &cancelled));
            let taken = taken?;
            let outcomes = taken.measured.outcomes.iter();
            let present: Vec<bool> = outcomes.map(|&o| o == Outcome::Reading).collect();
            let member = (truth, taken, seconds);
            match stacks.iter_mut().find(|s| s.present == present) {
                Some(stack) => stack.members.push(member),
                None => stacks.push(Stack {
                    present,
                    members: vec![member],
                }),
            }
        }
        Ok(stacks)
    }

    /// The rows of one method on a stack; none if it fails.
    fn reconstruct(
        &mut self,
        schedule: &ScheduleKey<'_>,
        route: &Route,
        stack: &Stack<'_, '_>,
        task: &Task,
        text: &str,
    ) -> Result<Vec<StudyRow>, Stop> {
        let method = &self.plan.methods[task.method];
        let members = stack.members.iter();
        let members: Vec<_> = members
            .filter(|m| self.wanted(m.0.identity, task))
            .collect();
        if members.is_empty() {
            return Ok(Vec::new());
        }
        let name = format!("{text}, {} in {}", method.name, method.coordinates);
        self.begin(&name)?;
        let width = members.len();
        let (made, reconstruct_seconds) = timed(|| {
            let values: Vec<&[f64]> = members.iter().map(|m| &*m.1.measured.values).collect();
            method.method.interpolate(&Readings {
                schedule: &route.schedule,
                width,
                values: &interleaved(&values),
                present: &stack.present,
            })
        });
        let interpolant = match made {
            Ok(interpolant) => interpolant,
            Err(e) => {
                for (truth, ..) in members {
                    let job = format!("{}, {name}", truth.material.name);
                    let failure = Failure {
                        job,
                        reason: e.to_string(),
                        jobs: 1,
                    };
                    self.observer.failed(&failure);
                    self.summary.failures.push(failure);
                }
                return Ok(Vec::new());
            }
        };
        // One list a measure of one a material.
        let mut errors = Vec::new();
        let mut evaluate_seconds = 0.0;
        for (m, pairs) in self.pairs.iter().enumerate() {
            if self.observer.cancelled() {
                return Err(Stop::Cancelled);
            }
            let truths: Vec<&Values> = members.iter().map(|t| &t.0.values[m]).collect();
            let (found, seconds) = timed(|| compare(&*interpolant, pairs, &truths));
            evaluate_seconds += seconds;
            errors.push(found);
        }
        let share = 1.0 / width as f64;
        let mut rows = Vec::with_capacity(width * errors.len());
        for (i, (truth, taken, measure_seconds)) in members.iter().enumerate() {
            for (measure, errors) in self.plan.plan.measures.iter().zip(&errors) {
                let facts = &taken.facts;
                let row = StudyRow {
                    key: key::of_row(&truth.identity.key, &task.hash, *measure),
                    material: truth.material.name.clone(),
                    material_key: truth.identity.key.clone(),
                    truth: truth.name.clone(),
                    alignment: truth.alignment,
                    reconstruction: method.name.clone(),
                    coordinates: method.coordinates.clone(),
                    measure: measure.name().into(),
                    plan_seconds: route.seconds,
                    measure_seconds: *measure_seconds,
                    reconstruct_seconds: reconstruct_seconds * share,
                    evaluate_seconds: evaluate_seconds * share,
                    ..row(schedule, facts, &errors[i])
                };
                rows.push(row);
            }
        }
        Ok(rows)
    }

    /// Announces a stage, or stops before it.
    fn begin(&mut self, what: &str) -> Result<(), Stop> {
        if self.observer.cancelled() {
            return Err(Stop::Cancelled);
        }
        self.observer.stage(what);
        Ok(())
    }

    fn fail(&mut self, job: &str, reason: String, jobs: usize) {
        let failure = Failure {
            job: job.to_owned(),
            reason,
            jobs,
        };
        self.observer.failed(&failure);
        self.observer.advanced(jobs);
        self.summary.failures.push(failure);
    }
}

/// What the rows of a schedule and a material share; the rest is empty.
fn row(schedule: &ScheduleKey<'_>, facts: &Facts, errors: &Errors) -> StudyRow {
    StudyRow {
        key: String::new(),
        material: String::new(),
        material_key: String::new(),
        truth: String::new(),
        alignment: None,
        parametrization: schedule.coordinates.name().into(),
        warp: schedule.coordinates.warp.clone(),
        sample_set: schedule.sample_set.name.clone(),
        instrument: schedule.instrument.map_or(IDEAL, |i| &i.name).into(),
        reconstruction: String::new(),
        coordinates: String::new(),
        allowed: schedule.allowance.to_string(),
        budget: schedule.budget,
        readings: facts.readings,
        seed: schedule.seed,
        measure: String::new(),
        nrmse: errors.nrmse,
        log_relative: errors.log_relative,
        log1p: errors.log1p,
        cbrt: errors.cbrt,
        mean_relative: errors.mean_relative,
        max_relative: errors.max_relative,
        reachable: facts.reachable,
        instrument_seconds: facts.instrument_seconds,
        unphysical_share: facts.unphysical_share,
        pairs: errors.pairs,
        pairs_missing: errors.pairs_missing,
        plan_seconds: 0.0,
        measure_seconds: 0.0,
        reconstruct_seconds: 0.0,
        evaluate_seconds: 0.0,
    }
}

/// What the rows of a material call its truth. In 4-D there are too few to tell them apart.
fn truth_name(material: &Material) -> String {
    let favours = material.spec.favours();
    if material.symmetry.isotropic || favours == crate::brdf::Favours::SphericalTable {
        favours.name().into()
    } else {
        "anisotropic".into()
    }
}

pub(super) fn describe(key: &ScheduleKey<'_>) -> String {
    let mut text = format!(
        "{}, {} of {}, seed {}",
        key.coordinates.label(),
        key.sample_set.name,
        key.allowance,
        key.seed
    );
    if let Some(instrument) = key.instrument {
        text += &format!(", {}", instrument.name);
    }
    text
}

/// Values pose by pose, of one material after the other.
fn interleaved(materials: &[&[f64]]) -> Vec<f64> {
    let width = materials.len();
    let poses = materials.first().map_or(0, |m| m.len());
    let mut all = vec![0.0; width * poses];
    for (i, values) in materials.iter().enumerate() {
        for (out, value) in all[i..].iter_mut().step_by(width).zip(*values) {
            *out = *value;
        }
    }
    all
}

/// Errors of a stack under one measure, one a material.
fn compare(
    interpolant: &dyn Interpolant,
    pairs: &[DirectionPair],
    truths: &[&Values],
) -> Vec<Errors> {
    let width = interpolant.width();
    let mut stacked = vec![0.0; pairs.len() * width];
    let chunks = stacked.par_chunks_mut(CHUNK * width);
    chunks
        .zip(pairs.par_chunks(CHUNK))
        .for_each(|(out, pairs)| interpolant.eval_batch(pairs, out));
    let of = |(i, truth): (usize, &&Values)| {
        let values = Values {
            luminance: stacked[i..].iter().step_by(width).copied().collect(),
            missing: Vec::new(),
        };
        metrics::compare(pairs, truth, &values)
    };
    truths.par_iter().enumerate().map(of).collect()
}

/// What determines the schedule of a unit; its budget is not known yet.
pub(super) fn schedule_key<'a>(
    plan: &'a StudyPlan,
    unit: &Unit,
    symmetry: Symmetry,
) -> ScheduleKey<'a> {
    let common = &plan.plan;
    ScheduleKey {
        coordinates: &common.parametrizations[unit.coordinates],
        symmetry,
        sample_set: &common.sample_sets[unit.sample_set],
        allowance: unit.allowance,
        budget: 0,
        instrument: unit.instrument.map(|i| &common.instruments[i]),
        seed: unit.seed,
    }
}
