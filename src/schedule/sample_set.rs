//! Sample sets that are uniform in the coordinates of a parametrization.
//!
//! A budget N counts distinct configurations above the horizon: coordinates that coincide (all
//! azimuths at a pole) or that a declared symmetry folds together count once.

use super::grid::{Grid, Stratified};
use super::{Pose, Schedule};
use crate::error::ParameterError;
use crate::numeric::GRAZING_COS;
use crate::parametrization::{Axis, Coords, Parametrization};
use crate::registry::{self, Entry, ReadError, Table};
use crate::sampling::{Random, Sobol};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Chooses the configurations of an acquisition. A config names one by `kind`.
pub trait SampleSet: std::fmt::Debug + Send + Sync {
    /// The kind and every key with its value.
    fn resolved(&self) -> toml::Table;

    /// A short name for tables: the kind.
    fn label(&self) -> String;

    /// True if the poses lie on a lattice, which grid reconstructions need.
    fn is_grid(&self) -> bool {
        false
    }

    /// Checks the keys against the axes of a parametrization.
    ///
    /// # Errors
    /// Names the key, the value and what is allowed.
    fn check(&self, axes: &[Axis]) -> Result<(), ParameterError>;

    /// The schedule of at most `budget` distinct configurations.
    ///
    /// # Errors
    /// If the budget is too small for the set, or [`check`](Self::check) fails.
    fn plan(
        &self,
        parametrization: &Arc<dyn Parametrization>,
        budget: usize,
        seed: u64,
    ) -> Result<Schedule, PlanError>;
}

/// Why a sample set could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A key is outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No configuration within the budget is physical.
    #[error(
        "budget = {budget}: no {sample_set} of at most that many configurations in {parametrization} coordinates has one above the horizon; allowed: a larger budget"
    )]
    Empty {
        /// The budget.
        budget: usize,
        /// The sample set.
        sample_set: &'static str,
        /// The parametrization.
        parametrization: &'static str,
    },
}

/// Every sample set a config can name.
pub fn all() -> Vec<Entry<dyn SampleSet>> {
    vec![
        Entry {
            kind: Grid::KIND,
            summary: "regular grid, cell- or node-centred per axis",
            examples: &[
                "",
                "ratio = [4, 4, 1]\ncentring = [\"start\", \"cell\", \"cell\"]",
            ],
            read: |table| Ok(Box::new(registry::parse::<Grid>(table)?)),
        },
        Entry {
            kind: Stratified::KIND,
            summary: "one random point in each cell of a regular grid",
            examples: &["", "ratio = [2, 2, 1]"],
            read: |table| Ok(Box::new(registry::parse::<Stratified>(table)?)),
        },
        Entry {
            kind: SobolSet::KIND,
            summary: "Owen-scrambled Sobol points",
            examples: &[""],
            read: |table| Ok(Box::new(registry::parse::<SobolSet>(table)?)),
        },
        Entry {
            kind: RandomSet::KIND,
            summary: "independent uniform points",
            examples: &[""],
            read: |table| Ok(Box::new(registry::parse::<RandomSet>(table)?)),
        },
    ]
}

/// Reads a sample set from its config table.
pub fn read(table: Table<'_>) -> Result<Box<dyn SampleSet>, ReadError> {
    registry::read("sample set", &all(), table)
}

/// Scrambled Sobol points: the first N that are physical.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SobolSet {}

impl SobolSet {
    const KIND: &'static str = "sobol";
}

impl SampleSet for SobolSet {
    fn resolved(&self) -> toml::Table {
        registry::resolved(Self::KIND, self)
    }

    fn label(&self) -> String {
        Self::KIND.into()
    }

    fn check(&self, _axes: &[Axis]) -> Result<(), ParameterError> {
        Ok(())
    }

    fn plan(
        &self,
        parametrization: &Arc<dyn Parametrization>,
        budget: usize,
        seed: u64,
    ) -> Result<Schedule, PlanError> {
        let mut sobol = Sobol::new(seed);
        accept(parametrization, budget, Self::KIND, |i| sobol.point(i))
    }
}

/// Independent uniform points: the first N that are physical.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RandomSet {}

impl RandomSet {
    const KIND: &'static str = "random";
}

impl SampleSet for RandomSet {
    fn resolved(&self) -> toml::Table {
        registry::resolved(Self::KIND, self)
    }

    fn label(&self) -> String {
        Self::KIND.into()
    }

    fn check(&self, _axes: &[Axis]) -> Result<(), ParameterError> {
        Ok(())
    }

    fn plan(
        &self,
        parametrization: &Arc<dyn Parametrization>,
        budget: usize,
        seed: u64,
    ) -> Result<Schedule, PlanError> {
        let random = Random::new(seed);
        accept(parametrization, budget, Self::KIND, |i| random.point(i))
    }
}

/// The pose at `coords`, in its canonical coordinates; `None` if it is not physical.
pub(super) fn place(parametrization: &dyn Parametrization, coords: &Coords) -> Option<Pose> {
    let coords = parametrization.canonical(coords)?;
    let pair = parametrization.inverse(&coords)?;
    let visible = pair.omega_i.cos_theta() > GRAZING_COS && pair.omega_o.cos_theta() > GRAZING_COS;
    visible.then_some(Pose { coords, pair })
}

/// Coordinates of a point of the unit cube.
pub(super) fn from_unit(axes: &[Axis], u: &[f64; 4]) -> Coords {
    let mut c = [0.0; 4];
    for (d, axis) in axes.iter().enumerate() {
        c[d] = axis.range[0] + u[d] * axis.length();
    }
    c
}

/// The first `budget` physical points of a sequence.
fn accept(
    parametrization: &Arc<dyn Parametrization>,
    budget: usize,
    kind: &'static str,
    mut point: impl FnMut(u64) -> [f64; 4],
) -> Result<Schedule, PlanError> {
    let axes = parametrization.axes();
    // Every parametrization has more than half of its box above the horizon in 3-D and more than
    // a quarter in 4-D; a sequence that misses a thousand times in a row never hits.
    let patience = 1000 * (budget as u64 + 1);
    let mut poses = Vec::with_capacity(budget);
    let mut tried = 0;
    while poses.len() < budget && tried < patience {
        poses.extend(place(&**parametrization, &from_unit(axes, &point(tried))));
        tried += 1;
    }
    if poses.is_empty() {
        return Err(PlanError::Empty {
            budget,
            sample_set: kind,
            parametrization: parametrization.name(),
        });
    }
    let unphysical_share = 1.0 - poses.len() as f64 / tried as f64;
    Ok(Schedule {
        parametrization: Arc::clone(parametrization),
        sample_set: kind.into(),
        poses,
        lattice: None,
        unphysical_share,
    })
}
