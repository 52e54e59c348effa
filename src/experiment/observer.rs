//! The observer of a run, and the events it receives.

use super::choices::{Allowance, Coordinates, Material, Method, NONE, PlannedSet};
use super::counts::{Built, Counters, Counts, Seconds, Stage};
use super::instruments::PlannedInstrument;
use super::key::{Identity, Input, RowKey};
pub(super) use super::stop::GoOn;
pub use super::stop::Stop;
use super::tuning::Tuned;
use crate::brdf::{Brdf, Channels};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::schedule::{Itinerary, Schedule};
use serde::{Deserialize, Serialize};
use std::fmt;

/// One reconstruction of a material from one of its schedules.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The material.
    pub material: &'a Material,
    /// The schedule.
    pub schedule: ScheduleKey<'a>,
    /// The reconstruction.
    pub method: &'a Method,
}

/// A schedule as it is asked for; its budget is found for the readings or minutes of the plan.
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

impl ScheduleKey<'_> {
    /// Label of the coordinates that the poses are uniform in: `none` of sample sets that depend on no parametrization.
    pub(crate) fn uniform_in(&self) -> String {
        match self.sample_set.set.is_unguided() {
            true => NONE.into(),
            false => self.coordinates.label(),
        }
    }
}

/// As messages name it, without its symmetry and material.
impl fmt::Display for ScheduleKey<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (coordinates, set) = (self.uniform_in(), &self.sample_set.name);
        let Self {
            allowance, seed, ..
        } = self;
        write!(f, "{coordinates}, {set} of {allowance}, seed {seed}")?;
        match self.instrument {
            Some(instrument) => write!(f, ", {}", instrument.name),
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

/// Rows, failures and times of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Records that were made, without those that were known.
    pub rows: usize,
    /// Keys of all records of the plan, or of its shard, but those of materials that cannot be read; in the order of results.
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
    /// The job, the truth and the reconstruction of a material, if the plan asks for pictures of slices.
    Reconstructed(&'a Job<'a>, &'a dyn Brdf, &'a dyn Brdf),
    /// Records were made.
    Made(&'a [R]),
    /// All records of one schedule or material, made now or known from before, in the order of results.
    Complete(&'a [&'a R]),
    /// A job failed; the run goes on.
    Failed(&'a Failure),
    /// This much of the [work](Observer::begins) is over: done, failed or known.
    Advanced(f64),
}

/// A by-product of a run that an observer may request even if all its records are known.
pub enum ByProduct<'a> {
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

    /// Total work, in the unit of [`Event::Advanced`], once, at the beginning.
    fn begins(&mut self, _work: f64) {}

    /// True if this by-product shall be made and observed even if all its records are known.
    fn requests(&self, _wish: &ByProduct<'_>) -> bool {
        false
    }

    /// Receives an event.
    ///
    /// # Errors
    /// Any error ends the run.
    fn observe(&mut self, event: &Event<'_, R>) -> Result<(), Error>;
}

/// An observer, and the summary of its events.
pub struct EventSink<'o, R> {
    pub observer: &'o mut dyn Observer<R>,
    pub summary: Summary,
    pub counters: Counters,
}

impl<'o, R> EventSink<'o, R> {
    pub(crate) fn new(observer: &'o mut dyn Observer<R>) -> Self {
        Self {
            observer,
            summary: Summary::default(),
            counters: Counters::default(),
        }
    }

    /// Emits the beginning of a step; an error if the observer has cancelled.
    pub(crate) fn doing(&mut self, what: &dyn fmt::Display) -> Result<(), Stop> {
        self.go_on()?;
        Ok(self.observer.observe(&Event::Doing(what))?)
    }

    /// Returns an error if the observer has cancelled.
    pub(crate) fn go_on(&self) -> Result<(), Stop> {
        match self.observer.cancelled() {
            true => Err(Stop::Cancelled),
            false => Ok(()),
        }
    }

    pub(crate) fn made(&mut self, records: &[R]) -> Result<(), Stop> {
        if records.is_empty() {
            return Ok(());
        }
        self.summary.rows += records.len();
        Ok(self.observer.observe(&Event::Made(records))?)
    }

    pub(crate) fn complete(&mut self, records: &[&R]) -> Result<(), Stop> {
        if records.is_empty() {
            return Ok(());
        }
        Ok(self.observer.observe(&Event::Complete(records))?)
    }

    /// The value of a result. A failure is emitted under each name, of so many jobs each, and is `None`.
    pub(crate) fn or_failed<T>(
        &mut self,
        made: Result<T, Stop>,
        names: impl IntoIterator<Item = String>,
        jobs: usize,
    ) -> Result<Option<T>, Stop> {
        match made {
            Err(Stop::Failed(reason)) => {
                for job in names {
                    let reason = reason.clone();
                    let failure = Failure { job, reason, jobs };
                    self.observer.observe(&Event::Failed(&failure))?;
                    self.summary.failures.push(failure);
                }
                Ok(None)
            }
            made => made.map(Some),
        }
    }

    /// Hashes the files of a material; `None`, after the failure of so many jobs, if one cannot be read.
    pub(super) fn identified(
        &mut self,
        material: &Material,
        jobs: usize,
    ) -> Result<Option<Identity>, Stop> {
        let read = || Identity::read(material).map_err(Stop::failed);
        let (identity, _) = self.counters.timed(Stage::Load, read);
        let identity = self.or_failed(identity, [material.name.clone()], jobs)?;
        let inputs = identity.iter().flat_map(|i| &i.inputs);
        self.read(inputs.clone());
        self.summary.inputs.extend(inputs.cloned());
        let key = identity.as_ref().map(|i| i.key.clone());
        self.summary.materials.push(key);
        Ok(identity)
    }

    /// Builds a material from the files that were hashed; `None`, after the failure of so many jobs, if that cannot be done.
    pub(super) fn built(
        &mut self,
        material: &Material,
        identity: &Identity,
        channels: Channels,
        jobs: usize,
    ) -> Result<Option<Built>, Stop> {
        let (made, _) = self.counters.timed(Stage::Load, || {
            let built = Built::new(&*material.spec, channels, &self.counters);
            let same = identity.check_unchanged().map_err(Stop::failed);
            built
                .map_err(Stop::failed)
                .and_then(|built| same.map(|()| built))
        });
        self.read(&identity.inputs);
        self.or_failed(made, [material.name.clone()], jobs)
    }

    fn read<'i>(&self, inputs: impl IntoIterator<Item = &'i Input>) {
        let files = inputs.into_iter().map(|input| &*input.path);
        self.counters.read(files);
    }

    /// Emits that a material was built, whose pictures may be drawn then.
    pub(crate) fn loaded(
        &mut self,
        material: &Material,
        key: &str,
        brdf: &Built,
    ) -> Result<(), Stop> {
        let shown = brdf.counted_at(&self.counters, Stage::Pictures);
        let event = Event::Loaded(material, key, &shown);
        let observe = || self.observer.observe(&event);
        Ok(self.counters.timed(Stage::Pictures, observe).0?)
    }

    pub(crate) fn advanced(&mut self, work: f64) -> Result<(), Stop> {
        Ok(self.observer.observe(&Event::Advanced(work))?)
    }

    /// The summary of a run that ended, or the error that ended it.
    pub(crate) fn ended(mut self, result: Result<(), Stop>) -> Result<Summary, Error> {
        self.summary.counts = self.counters.counts();
        self.summary.seconds = self.counters.seconds();
        match result {
            Ok(()) => {}
            Err(Stop::Cancelled) => self.summary.interrupted = true,
            Err(Stop::Error(e)) => return Err(e),
            Err(Stop::Failed(reason)) => return Err(Error::Internal(reason)),
        }
        Ok(self.summary)
    }
}
