//! The observer of a run, and the events it is told.

use super::choices::{Allowance, Coordinates, Material, Method, PlannedSet};
use super::counts::{Built, Counts, Ledger, Stage};
use super::instruments::PlannedInstrument;
use super::key::{Identity, Input, RowKey};
use super::tuning::Tuned;
use crate::brdf::{Brdf, Channels};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::schedule::{Itinerary, Schedule};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::time::Instant;

/// A material, one of its schedules and one reconstruction; `None` stands for all of them.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The material.
    pub material: &'a Material,
    /// The schedule.
    pub schedule: Option<ScheduleKey<'a>>,
    /// The reconstruction.
    pub method: Option<&'a Method>,
}

/// A schedule as it is asked for; its budget is found by the [`Router`](super::Router).
#[derive(Clone, Copy)]
pub struct ScheduleKey<'a> {
    /// Coordinates in which the sample set is uniform.
    pub coordinates: &'a Coordinates,
    /// Symmetries that fold the coordinates.
    pub symmetry: Symmetry,
    /// The sample set.
    pub sample_set: &'a PlannedSet,
    /// Size limit: poses, readings or minutes.
    pub allowance: Allowance,
    /// The instrument that measures; `None`: the ideal one.
    pub instrument: Option<&'a PlannedInstrument>,
    /// Seed of the sample set and of the noise.
    pub seed: u64,
    /// The material whose readings the poses were chosen from, if they were.
    pub material: Option<&'a Material>,
}

impl<'a> Job<'a> {
    /// All schedules and reconstructions of a material.
    pub fn of(material: &'a Material) -> Self {
        Self {
            material,
            schedule: None,
            method: None,
        }
    }
}

impl fmt::Display for Job<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.material.name)?;
        if let Some(key) = &self.schedule {
            let coordinates = key.coordinates.label();
            let set = &key.sample_set.name;
            write!(
                f,
                ", {coordinates}, {set} of {}, seed {}",
                key.allowance, key.seed
            )?;
            if let Some(instrument) = key.instrument {
                write!(f, ", {}", instrument.name)?;
            }
        }
        match self.method {
            Some(method) => write!(f, ", {}", method.label()),
            None => Ok(()),
        }
    }
}

/// A job, or all jobs of a schedule or material, that could not be done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Name of the job.
    pub job: String,
    /// Reason for the failure.
    pub reason: String,
    /// Number of reconstructions lost.
    pub jobs: usize,
}

/// Wall times of a run, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Building materials and hashing their files.
    pub load: f64,
    /// Evaluating materials at the test pairs.
    pub truth: f64,
    /// Measuring the alignment of materials.
    pub alignment: f64,
    /// Making schedules.
    pub plan: f64,
    /// Measuring.
    pub measure: f64,
    /// Reconstructing.
    pub reconstruct: f64,
    /// Evaluating reconstructions and comparing.
    pub evaluate: f64,
    /// Integrating moments of materials and reconstructions, if they are asked for.
    pub moments: f64,
    /// Drawing materials.
    pub pictures: f64,
    /// Writing tables and reports when all records are there.
    pub report: f64,
}

impl Seconds {
    /// All, by the names of stages.
    pub fn by_stage(&self) -> BTreeMap<String, f64> {
        let of = |stage: Stage| (stage.name().to_owned(), self.of(stage));
        Stage::ALL.into_iter().map(of).collect()
    }

    /// Those of a stage.
    pub fn of(&self, stage: Stage) -> f64 {
        match stage {
            Stage::Load => self.load,
            Stage::Truth => self.truth,
            Stage::Alignment => self.alignment,
            Stage::Plan => self.plan,
            Stage::Measure => self.measure,
            Stage::Reconstruct => self.reconstruct,
            Stage::Evaluate => self.evaluate,
            Stage::Moments => self.moments,
            Stage::Pictures => self.pictures,
            Stage::Report => self.report,
        }
    }
}

/// Rows, failures and times of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Records that were made, without those that were known.
    pub rows: usize,
    /// Keys of all records of the plan, or of its shard, in the order of results; those of materials
    /// that cannot be read are left out.
    pub keys: Vec<RowKey>,
    /// Jobs that could not be done.
    pub failures: Vec<Failure>,
    /// The files of the materials.
    pub inputs: Vec<Input>,
    /// Hash of each material's keys and files; `None` of one that cannot be read, or is none of the shard.
    pub materials: Vec<Option<RowKey>>,
    /// Ratios of grids that were tuned.
    pub tuned: Vec<Tuned>,
    /// Wall times.
    pub seconds: Seconds,
    /// What was done.
    pub counts: Counts,
    /// True if the observer asked to stop before the end.
    pub interrupted: bool,
}

/// An event of a run; `R` is its record.
pub enum Event<'a, R> {
    /// A step begins; the text is for people.
    Doing(&'a dyn fmt::Display),
    /// A material was built; the key is the hash of what it is.
    Loaded(&'a Material, &'a str, &'a dyn Brdf),
    /// A schedule was made, and the way of its instrument through it, if it has one.
    Planned(&'a ScheduleKey<'a>, &'a Schedule, Option<&'a Itinerary>),
    /// A material was reconstructed: the job, the truth, the reconstruction. Told only where a plan
    /// [asks](super::Output) for pictures of slices.
    Reconstructed(&'a Job<'a>, &'a dyn Brdf, &'a dyn Brdf),
    /// Records were made.
    Made(&'a [R]),
    /// All records of one schedule or material, made now or known from before, in the order of
    /// results.
    Complete(&'a [&'a R]),
    /// A job failed; the run goes on.
    Failed(&'a Failure),
    /// This much of the [work](Observer::begins) is over: done, failed or known.
    Advanced(f64),
}

/// A by-product of a run that an observer may want even if all its records are known.
pub enum Wish<'a> {
    /// A material, by position and key.
    Material(usize, &'a Material, &'a str),
    /// A schedule.
    Schedule(&'a ScheduleKey<'a>),
    /// A reconstruction.
    Reconstruction(&'a Job<'a>),
}

/// Listens to the events of a run, and may stop it.
pub trait Observer<R> {
    /// True if the run shall stop; asked before every step, and several times during long ones.
    fn cancelled(&self) -> bool {
        false
    }

    /// Total work, in the unit of [`Event::Advanced`]; told once, at the beginning.
    fn begins(&mut self, _work: f64) {}

    /// True if this by-product shall be made and told even if all its records are known.
    fn wants(&self, _wish: &Wish<'_>) -> bool {
        false
    }

    /// Receives an event.
    ///
    /// # Errors
    /// Any error ends the run.
    fn tell(&mut self, event: &Event<'_, R>) -> Result<(), Error>;
}

/// Reason why a run ends early.
pub(super) enum Stop {
    Cancelled,
    Error(Error),
}

impl From<Error> for Stop {
    fn from(e: Error) -> Self {
        Stop::Error(e)
    }
}

/// An observer, and the summary of the events it was told.
pub(super) struct Teller<'o, R> {
    pub observer: &'o mut dyn Observer<R>,
    pub summary: Summary,
    pub ledger: Ledger,
}

impl<'o, R> Teller<'o, R> {
    pub fn new(observer: &'o mut dyn Observer<R>) -> Self {
        Self {
            observer,
            summary: Summary::default(),
            ledger: Ledger::default(),
        }
    }

    /// Tells a step that begins; an error if the observer wants to stop.
    pub fn doing(&mut self, what: &dyn fmt::Display) -> Result<(), Stop> {
        self.go_on()?;
        Ok(self.observer.tell(&Event::Doing(what))?)
    }

    /// Returns an error if the observer wants to stop.
    pub fn go_on(&self) -> Result<(), Stop> {
        if self.observer.cancelled() {
            return Err(Stop::Cancelled);
        }
        Ok(())
    }

    pub fn made(&mut self, records: &[R]) -> Result<(), Stop> {
        if records.is_empty() {
            return Ok(());
        }
        self.summary.rows += records.len();
        Ok(self.observer.tell(&Event::Made(records))?)
    }

    pub fn complete(&mut self, records: &[&R]) -> Result<(), Stop> {
        if records.is_empty() {
            return Ok(());
        }
        Ok(self.observer.tell(&Event::Complete(records))?)
    }

    pub fn failed(
        &mut self,
        job: String,
        reason: &dyn fmt::Display,
        jobs: usize,
    ) -> Result<(), Stop> {
        let reason = reason.to_string();
        let failure = Failure { job, reason, jobs };
        self.observer.tell(&Event::Failed(&failure))?;
        self.summary.failures.push(failure);
        Ok(())
    }

    /// The value of a result; for an error, tells a failure of so many jobs and returns `None`.
    pub fn or_failed<T, E: fmt::Display>(
        &mut self,
        job: &str,
        made: Result<T, E>,
        jobs: usize,
    ) -> Result<Option<T>, Stop> {
        match made {
            Ok(made) => Ok(Some(made)),
            Err(reason) => self.failed(job.to_owned(), &reason, jobs).map(|()| None),
        }
    }

    /// Hashes the files of a material; `None`, and the failure of so many jobs told, if one cannot
    /// be read.
    pub fn identified(
        &mut self,
        material: &Material,
        jobs: usize,
    ) -> Result<Option<Identity>, Stop> {
        let (identity, seconds) = timed(|| Identity::of(material));
        self.read(identity.iter().flat_map(|i| &i.inputs));
        let identity = self.or_failed(&material.name, identity, jobs)?;
        let summary = &mut self.summary;
        summary.seconds.load += seconds;
        let inputs = identity.iter().flat_map(|i| &i.inputs);
        summary.inputs.extend(inputs.cloned());
        let key = identity.as_ref().map(|i| i.key.clone());
        summary.materials.push(key);
        Ok(identity)
    }

    /// Builds a material from the files that were hashed; `None`, and the failure of so many jobs
    /// told, if that cannot be done.
    pub fn built(
        &mut self,
        material: &Material,
        identity: &Identity,
        channels: Channels,
        jobs: usize,
    ) -> Result<Option<Built>, Stop> {
        let (built, seconds) = timed(|| Built::new(&*material.spec, channels, &self.ledger));
        let (same, again) = timed(|| identity.holds());
        self.read(&identity.inputs);
        self.summary.seconds.load += seconds + again;
        match self.or_failed(&material.name, built, jobs)? {
            Some(built) => {
                let same = self.or_failed(&material.name, same, jobs)?;
                Ok(same.map(|()| built))
            }
            None => Ok(None),
        }
    }

    /// Counts files that were hashed.
    fn read<'i>(&self, inputs: impl IntoIterator<Item = &'i Input>) {
        let files = inputs.into_iter().map(|input| &*input.path);
        self.ledger.read(files);
    }

    /// Tells of a material that was built, whose pictures may be drawn then.
    pub fn loaded(&mut self, material: &Material, key: &str, brdf: &Built) -> Result<(), Stop> {
        let shown = brdf.at(&self.ledger, Stage::Pictures);
        let event = Event::Loaded(material, key, &shown);
        let (told, seconds) = timed(|| self.observer.tell(&event));
        self.summary.seconds.pictures += seconds;
        Ok(told?)
    }

    pub fn advanced(&mut self, work: f64) -> Result<(), Stop> {
        Ok(self.observer.tell(&Event::Advanced(work))?)
    }

    /// The summary of a run that ended, or the error that ended it.
    pub fn ended(mut self, result: Result<(), Stop>) -> Result<Summary, Error> {
        self.summary.counts = self.ledger.counts();
        match result {
            Ok(()) => {}
            Err(Stop::Cancelled) => self.summary.interrupted = true,
            Err(Stop::Error(e)) => return Err(e),
        }
        Ok(self.summary)
    }
}

/// The result of some work and its wall time, s.
pub(super) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}
