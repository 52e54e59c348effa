//! What a run tells while it goes on, and at the end.

use super::instruments::PlannedInstrument;
use super::plan::{Allowance, Coordinates, Material, PlannedSet};
use super::row::Row;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::schedule::{Itinerary, Schedule};
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;

/// What a run is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Building a material and evaluating it at the test pairs.
    Load,
    /// Making a schedule.
    Plan,
    /// Measuring it.
    Measure,
    /// Reconstructing the measurement.
    Reconstruct,
    /// Comparing the reconstruction with the truth.
    Evaluate,
}

/// What a job is about, from the material on; `None` where it is about all of them.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The material.
    pub material: &'a Material,
    /// The schedule.
    pub schedule: Option<ScheduleKey<'a>>,
    /// Name of the reconstruction.
    pub reconstruction: Option<&'a str>,
}

/// What determines a schedule.
#[derive(Clone, Copy)]
pub struct ScheduleKey<'a> {
    /// The coordinates it is uniform in.
    pub coordinates: &'a Coordinates,
    /// The symmetries it folds.
    pub symmetry: Symmetry,
    /// How its points are spread.
    pub sample_set: &'a PlannedSet,
    /// How large it may be.
    pub allowance: Allowance,
    /// Configurations it may have, once they are known.
    pub budget: usize,
    /// Who visits it; `None`: the ideal instrument.
    pub instrument: Option<&'a PlannedInstrument>,
    /// Seed.
    pub seed: u64,
}

impl<'a> Job<'a> {
    /// Everything about a material.
    pub(super) fn of(material: &'a Material) -> Self {
        Self {
            material,
            schedule: None,
            reconstruction: None,
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
        match self.reconstruction {
            Some(name) => write!(f, ", {name}"),
            None => Ok(()),
        }
    }
}

/// A file that a material was read from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Input {
    /// As the config names it.
    pub path: PathBuf,
    /// BLAKE3 of its bytes, hexadecimal.
    pub blake3: String,
}

/// A job, or all jobs of a schedule or material, that could not be done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Failure {
    /// What was to be done.
    pub job: String,
    /// Why it could not.
    pub reason: String,
    /// Number of reconstructions lost.
    pub jobs: usize,
}

/// Where the time went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Building materials, hashing their files.
    pub load: f64,
    /// Evaluating materials at the test pairs.
    pub truth: f64,
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
}

/// How a run ended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Rows that were handed to the observer.
    pub rows: usize,
    /// What could not be done.
    pub failures: Vec<Failure>,
    /// Where the time went.
    pub seconds: Seconds,
    /// True if the observer asked to stop before the end.
    pub interrupted: bool,
}

/// Is told what happens during a run, and may stop it.
pub trait Observer {
    /// True if the run shall stop; asked before every stage, and several times during long ones.
    fn cancelled(&self) -> bool {
        false
    }

    /// A stage begins.
    fn stage(&mut self, _stage: Stage, _job: &Job<'_>) {}

    /// A material is there; `inputs` are the files it was read from.
    fn loaded(&mut self, _material: &Material, _inputs: &[Input]) {}

    /// A schedule was made, and the way of its instrument through it, if it has one.
    ///
    /// # Errors
    /// End the run.
    fn planned(
        &mut self,
        _key: &ScheduleKey<'_>,
        _schedule: &Schedule,
        _itinerary: Option<&Itinerary>,
    ) -> Result<(), Error> {
        Ok(())
    }

    /// A reconstruction is there, to be compared with the truth.
    ///
    /// # Errors
    /// End the run.
    fn reconstructed(
        &mut self,
        _job: &Job<'_>,
        _truth: &dyn Brdf,
        _reconstruction: &dyn Brdf,
    ) -> Result<(), Error> {
        Ok(())
    }

    /// The rows of one material, parametrization, sample set, instrument and allowance.
    ///
    /// # Errors
    /// End the run.
    fn rows(&mut self, rows: Vec<Row>) -> Result<(), Error>;

    /// Something could not be done; the run goes on.
    fn failed(&mut self, _failure: &Failure) {}

    /// So many jobs of this allowance are over, done or failed.
    fn advanced(&mut self, _jobs: usize, _allowance: Allowance) {}
}
