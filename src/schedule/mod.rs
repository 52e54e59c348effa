//! Schedules: the configurations of an acquisition, in the order of measuring.

pub(crate) mod arms;
pub(crate) mod convention;
mod directions;
pub(crate) mod export;
mod file;
pub(crate) mod grid;
pub(crate) mod import;
mod itinerary;
mod lattice;
mod layout;
pub(crate) mod names;
mod pictures;
mod points;
pub(crate) mod record;
mod sample_set;
mod shapes;
pub(crate) mod table;
mod visited;

pub(crate) use convention::whole_pixels;
pub use convention::{
    AngleUnit, Azimuth, Choice, Conventions, Polarisation, Quantity, UncertaintyUnit, choice,
};
pub use directions::{Density, Directions};
pub use export::{Sequence, schedule_hash, write_schedule};
pub use file::FileSet;
pub use grid::{Grid, Ratio, Stratified};
pub use import::{Assume, ScheduleFile, read_schedule};
pub use itinerary::{Itinerary, MAX_AXES, Positions, Unreachable, Visit};
pub use lattice::{Centring, Lattice, LatticeAxis, for_each_node};
pub use layout::{Layout, LayoutSet};
pub(crate) use pictures::{Draws, azimuth};
pub use pictures::{Pictures, Spread, StopAngle};
pub use points::{PointSet, RandomSet, SobolSet};
pub use record::schedule_schema;
pub use sample_set::{PlanError, Planned, SampleSet};
pub use table::{FileError, ScheduleFormat};
pub use visited::{Unvisited, unvisited};

use self::export::FROM_FILE;
use crate::geometry::DirectionPair;
use crate::parametrization::{Coords, Parametrization, by_name};
use crate::registry::family;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A configuration to be measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Coordinates in the schedule's parametrization.
    pub coords: Coords,
    /// The directions of the two arms.
    pub pair: DirectionPair,
}

/// The configurations of one acquisition: distinct, above the horizon, in the order of measuring.
/// Pose `i` depends on (seed, i) and the schedule's own parameters only.
#[derive(Clone, Serialize, Deserialize)]
pub struct Schedule {
    /// The coordinates the set is uniform in, folded by the symmetries it assumes.
    #[serde(with = "by_name")]
    pub parametrization: Arc<dyn Parametrization>,
    /// Name of the sample set.
    pub sample_set: String,
    /// The poses.
    pub poses: Vec<Pose>,
    /// The lattice the poses lie on, for grids.
    pub lattice: Option<Lattice>,
    /// Share of the points of the box that are no physical configuration, in [0, 1].
    pub unphysical_share: f64,
    /// Kind of the reconstruction that the poses were chosen for, if they were for one.
    pub assumes: Option<String>,
}

impl Schedule {
    /// This schedule with each configuration once: the first of the poses that are equal under the symmetries.
    #[must_use]
    pub fn distinct(mut self) -> Self {
        let mut distinct = grid::Distinct::new(self.parametrization.axes());
        let mut number = 0;
        self.poses.retain(|pose| {
            let is_new = distinct.first(&pose.coords, number) == number;
            number += 1;
            is_new
        });
        self.lattice = None;
        self
    }

    /// Poses of a sample set, on no lattice.
    pub(crate) fn new(
        parametrization: Arc<dyn Parametrization>,
        sample_set: impl Into<String>,
        poses: Vec<Pose>,
        unphysical_share: f64,
    ) -> Self {
        Self {
            parametrization,
            sample_set: sample_set.into(),
            poses,
            lattice: None,
            unphysical_share,
            assumes: None,
        }
    }

    /// Given poses, as those of a table, in their order; both directions above the horizon.
    pub fn of_pairs(
        parametrization: Arc<dyn Parametrization>,
        pairs: impl IntoIterator<Item = DirectionPair>,
    ) -> Self {
        let pose = |pair| Pose {
            coords: parametrization.forward(&pair),
            pair,
        };
        let poses = pairs.into_iter().map(pose).collect();
        Self::new(Arc::clone(&parametrization), FROM_FILE, poses, 0.0)
    }
}

family! {
    "sample set": dyn SampleSet = [
        Grid::ENTRY,
        Stratified::ENTRY,
        SobolSet::ENTRY,
        RandomSet::ENTRY,
        Directions::ENTRY,
        LayoutSet::ENTRY,
        Pictures::ENTRY,
        FileSet::ENTRY,
    ]
}
