//! Sample sets that are uniform in the coordinates of a parametrization.
//!
//! A budget N counts distinct configurations above the horizon: coordinates that coincide (all
//! azimuths at a pole) or that a declared symmetry folds together count once.

use super::{Pose, Schedule};
use crate::error::ParameterError;
use crate::geometry::DirectionPair;
use crate::numeric::GRAZING_COS;
use crate::parametrization::{Axis, Coords, Parametrization};
use crate::registry::Resolved;
use std::sync::Arc;

/// Chooses the configurations of an acquisition. A config names one by `kind`.
pub trait SampleSet: Resolved + std::fmt::Debug + Send + Sync {
    /// A short name for tables; the kind by default.
    fn label(&self) -> String {
        let keys = self.resolved();
        let kind = keys.get("kind").and_then(|kind| kind.as_str());
        kind.unwrap_or_default().to_owned()
    }

    /// True if the poses lie on a lattice, which grid reconstructions need.
    fn is_grid(&self) -> bool {
        false
    }

    /// True if the poses depend on the seed.
    fn is_random(&self) -> bool {
        true
    }

    /// True if the poses do not depend on the coordinates they are planned in.
    fn is_unguided(&self) -> bool {
        false
    }

    /// The set with this ratio of its axes; `None` unless its ratio is to be tuned.
    fn tuned(&self, _ratio: &[f64]) -> Option<Box<dyn SampleSet>> {
        None
    }

    /// Checks the keys against the axes of a parametrization.
    ///
    /// # Errors
    /// Names the key, the value and what is allowed.
    fn check(&self, _axes: &[Axis]) -> Result<(), ParameterError> {
        Ok(())
    }

    /// The schedule of at most `budget` distinct configurations.
    ///
    /// # Errors
    /// If the budget is too small for the set, or [`check`](Self::check) fails.
    fn plan(&self, form: &Arc<dyn Parametrization>, budget: usize, seed: u64) -> Planned;
}

/// A schedule, or the reason why there is none.
pub type Planned = Result<Schedule, PlanError>;

/// Reason why a schedule could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A key is outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// No pose to choose from.
    #[error(
        "{sample_set} finds no pose that the instrument can take and has not refused; allowed: another instrument"
    )]
    NoCandidate {
        /// The sample set.
        sample_set: &'static str,
    },
    /// Whatever else a sample set cannot do, one sentence.
    #[error("{0}")]
    Refused(String),
}

impl Schedule {
    /// Poses that a sample set of a `kind` chose, on no lattice.
    pub(super) fn chosen(
        parametrization: &Arc<dyn Parametrization>,
        kind: &'static str,
        budget: usize,
        poses: Vec<Pose>,
        unphysical_share: f64,
    ) -> Result<Self, PlanError> {
        if poses.is_empty() {
            return Err(PlanError::Refused(format!(
                "budget = {budget}: no {kind} of at most that many configurations in {} coordinates has one above the horizon; allowed: a larger budget",
                parametrization.name()
            )));
        }
        let form = Arc::clone(parametrization);
        Ok(Self::new(form, kind, poses, unphysical_share))
    }
}

/// The pose at `coords`, in its canonical coordinates; `None` if it is not physical.
pub(super) fn place(parametrization: &dyn Parametrization, coords: &Coords) -> Option<Pose> {
    let coords = parametrization.canonical(coords)?;
    let pair = parametrization.inverse(&coords)?;
    is_visible(&pair).then_some(Pose { coords, pair })
}

/// True if light and sensor are above the horizon.
pub(super) fn is_visible(pair: &DirectionPair) -> bool {
    [pair.omega_i, pair.omega_o]
        .iter()
        .all(|d| d.cos_theta() > GRAZING_COS)
}

/// Coordinates of a point of the unit cube.
pub(super) fn from_unit(axes: &[Axis], u: &[f64; 4]) -> Coords {
    let mut c = [0.0; 4];
    for (d, axis) in axes.iter().enumerate() {
        c[d] = axis.range[0] + u[d] * axis.length();
    }
    c
}
