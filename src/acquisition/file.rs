//! Poses of a file: a schedule of this program, or a table of angles that others wrote.

use super::{Planner, once};
use crate::error::ParameterError;
use crate::formats::READ_SCHEDULE;
use crate::geometry::DirectionPair;
use crate::instrument::axis_names;
use crate::parametrization::{Axis, Parametrization};
use crate::registry::{self, Entry, declare};
use crate::schedule::{
    AngleUnit, Assume, Azimuth, Conventions, PlanError, SampleSet, Schedule, first_of,
};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

declare! {
    impl dyn SampleSet, "file": "the poses of a file, in its order: of a budget that is smaller, the first so many", []
    /// Poses of a file.
    pub struct FileSet {
        /// A schedule, or a table with the columns `theta_i_deg`, `phi_i_deg`, `theta_o_deg`, `phi_o_deg`, relative to the
        /// working folder.
        file: PathBuf = PathBuf::new();
        /// Hash of the rows, where the file must not change.
        schedule_hash: Option<String> = None;
        /// Our names of columns and those in the file; unknown columns are passed over then.
        columns: BTreeMap<String, String> = BTreeMap::new();
        /// The unit of angles whose column does not say it: `deg` or `rad`.
        angles: Option<AngleUnit> = None;
        /// True if polar angles count from the surface.
        elevation: bool = false;
        /// Where azimuths count from: `sample`, `light`, `mirror` or `propagation`.
        azimuth: Option<Azimuth> = None;
        /// The poses, as they were when they were first asked for.
        #[serde(skip)]
        known: OnceLock<Poses> = OnceLock::new();
    }
}

/// What is known of a file: the hash of its rows and its pairs.
#[derive(Clone, Debug)]
pub(super) struct Poses {
    hash: String,
    pairs: Arc<[DirectionPair]>,
}

/// The registry entry.
pub(super) fn entry() -> Entry<dyn Planner> {
    let Entry {
        kind,
        summary,
        examples,
        ..
    } = FileSet::ENTRY;
    Entry {
        kind,
        summary,
        examples,
        read: |table| Ok(once((FileSet::ENTRY.read)(table)?)),
    }
}

impl FileSet {
    /// The poses of the file, as they were when they were first asked for.
    fn load(&self) -> Result<&Poses, ParameterError> {
        if let Some(known) = self.known.get() {
            return Ok(known);
        }
        let refuse = |why: String| {
            let file = format!("{:?}", self.file);
            ParameterError::new("file", file, format!("a file of poses ({why})"))
        };
        let assume = Assume {
            axes: axis_names(),
            conventions: Conventions {
                columns: self.columns.clone().into_iter().collect(),
                angles: self.angles,
                elevation: self.elevation,
                azimuth: self.azimuth,
                ..Conventions::default()
            },
            ..Assume::default()
        };
        let name = self.file.display().to_string();
        let found = READ_SCHEDULE.open(&self.file);
        let (text, read) = found.map_err(|e| refuse(e.to_string()))?;
        let found = read(&text, &name, &assume).map_err(|e| refuse(e.to_string()))?;
        if let Some(hash) = self.schedule_hash.as_ref().filter(|h| **h != found.hash) {
            let allowed = format!("{:?}, that of {name}, or no such key", found.hash);
            return Err(ParameterError::new(
                "schedule_hash",
                format!("{hash:?}"),
                allowed,
            ));
        }
        let poses = Poses {
            hash: found.hash,
            pairs: found.schedule.poses.iter().map(|pose| pose.pair).collect(),
        };
        Ok(self.known.get_or_init(|| poses))
    }
}

impl SampleSet for FileSet {
    fn resolved(&self) -> registry::Keys {
        // The hash is part of what a row depends on; the name of the file is not.
        let known = self.load().ok();
        let schedule_hash = known.map(|found| found.hash.clone());
        let written = Self {
            schedule_hash: schedule_hash.or_else(|| self.schedule_hash.clone()),
            ..self.clone()
        };
        registry::resolved(Self::KIND, &written)
    }

    fn is_random(&self) -> bool {
        false
    }

    fn check(&self, _axes: &[Axis]) -> Result<(), ParameterError> {
        self.load().map(drop)
    }

    fn plan(
        &self,
        parametrization: &Arc<dyn Parametrization>,
        budget: usize,
        _seed: u64,
    ) -> Result<Schedule, PlanError> {
        let found = self.load()?;
        let pairs = found.pairs.iter().copied();
        first_of(parametrization, budget, Self::KIND, pairs)
    }
}
