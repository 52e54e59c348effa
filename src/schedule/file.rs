//! Poses of a file: a schedule of this program, or a table of angles that others wrote.

use super::points::first_of;
use super::sample_set::{Planned, SampleSet};
use super::table::as_text;
use super::{AngleUnit, Assume, Azimuth, Conventions, read_schedule};
use crate::error::ParameterError;
use crate::geometry::DirectionPair;
use crate::parametrization::{Axis, Parametrization};
use crate::registry::{self, Entry, Resolved, keys};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

keys! {
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
        /// The hash of its rows and their poses, as they were when they were first asked for.
        #[serde(skip)]
        known: OnceLock<(String, Arc<[DirectionPair]>)> = OnceLock::new();
    }
}

impl FileSet {
    const KIND: &str = "file";

    pub(super) const ENTRY: Entry<dyn SampleSet> = Entry {
        kind: Self::KIND,
        summary: "the poses of a file, `file = \"poses.csv\"`, in its order, at most as many as the budget; also schedule_hash, columns, angles, elevation, azimuth",
        examples: &[],
        read: |table| Ok(Box::new(registry::parse::<Self>(table)?)),
    };

    /// The poses of the file, as they were when they were first asked for.
    fn load(&self) -> Result<&(String, Arc<[DirectionPair]>), ParameterError> {
        if let Some(known) = self.known.get() {
            return Ok(known);
        }
        let refuse = |why: String| {
            let file = format!("{:?}", self.file);
            ParameterError::new("file", file, format!("a file of poses ({why})"))
        };
        if self.file.as_os_str().is_empty() {
            return Err(refuse("it is not named".into()));
        }
        let assume = Assume {
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
        let text = as_text(&self.file).map_err(|e| refuse(e.to_string()))?;
        let found = read_schedule(&text, &name, &assume).map_err(|e| refuse(e.to_string()))?;
        if let Some(hash) = self.schedule_hash.as_ref().filter(|h| **h != found.hash) {
            let allowed = format!("{:?}, that of {name}, or no such key", found.hash);
            let hash = format!("{hash:?}");
            return Err(ParameterError::new("schedule_hash", hash, allowed));
        }
        // Poses that have a row, also of a lattice, in the order of the rows.
        let pair = |&number: &u32| found.schedule.poses[number as usize].pair;
        let pairs = found.order.iter().map(pair).collect();
        Ok(self.known.get_or_init(|| (found.hash, pairs)))
    }
}

impl Resolved for FileSet {
    fn resolved(&self) -> registry::Keys {
        // The hash is part of what a row depends on; the name of the file is not.
        let known = self.load().ok();
        let schedule_hash = known.map(|(hash, _)| hash.clone());
        let written = Self {
            schedule_hash: schedule_hash.or_else(|| self.schedule_hash.clone()),
            ..self.clone()
        };
        registry::resolved(Self::KIND, &written)
    }
}

impl SampleSet for FileSet {
    fn is_random(&self) -> bool {
        false
    }

    fn check(&self, _axes: &[Axis]) -> Result<(), ParameterError> {
        self.load().map(drop)
    }

    fn is_unguided(&self) -> bool {
        true
    }

    fn plan(&self, form: &Arc<dyn Parametrization>, budget: usize, _seed: u64) -> Planned {
        let (_, pairs) = self.load()?;
        let pairs = pairs.iter().copied();
        first_of(form, budget, Self::KIND, pairs)
    }
}
