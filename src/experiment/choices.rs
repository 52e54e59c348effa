//! The choices of a plan: materials, coordinates, sample sets, reconstructions, each with a name.

pub use super::material::Material;
use super::tuning::Tuning;
use crate::acquisition::Planner;
use crate::error::{Error, count};
use crate::geometry::Symmetry;
use crate::parametrization::{Parametrization, ParametrizationSpec, WarpError};
use crate::reconstruct::Reconstruct;
use std::fmt;
use std::sync::Arc;

/// The largest budget, distinct configurations: a gigabyte of poses. More is a misprint.
pub const MAX_BUDGET: usize = 10_000_000;

/// Name of the instrument without flaws in the column `instrument`.
pub const IDEAL: &str = "ideal";

/// Value of the column `coordinates` where a reconstruction works in those of its schedule.
pub const OWN: &str = "own";

/// A parametrization with its warps.
pub struct Coordinates {
    /// How to build it.
    pub spec: ParametrizationSpec,
    /// The warps as results name them, `none` if there are none.
    pub warp: String,
}

impl Coordinates {
    /// Name of the parametrization.
    pub(crate) fn name(&self) -> &'static str {
        self.spec.kind
    }

    /// Name with warps, for lists: `half-difference theta_h:square-root`.
    pub(crate) fn label(&self) -> String {
        if self.spec.warps.is_empty() {
            self.name().into()
        } else {
            format!("{} {}", self.name(), self.warp)
        }
    }

    /// The form for a material of these symmetries.
    ///
    /// # Errors
    /// If a warp does not fit an axis; not for the symmetries of the plan's materials.
    pub fn form(&self, symmetry: Symmetry) -> Result<Arc<dyn Parametrization>, WarpError> {
        self.spec.form(symmetry)
    }

    /// The form for a material of a plan.
    ///
    /// # Errors
    /// [`Error::Internal`]: the plan has checked the warps.
    pub(crate) fn checked_form(
        &self,
        symmetry: Symmetry,
    ) -> Result<Arc<dyn Parametrization>, Error> {
        let form = self.form(symmetry);
        form.map_err(|e| Error::Internal(format!("a warp that was checked: {e}")))
    }
}

/// A sample set or planner with its name in results, unique in its plan.
#[derive(Debug)]
pub struct PlannedSet {
    /// The name.
    pub name: String,
    /// The set.
    pub set: Box<dyn Planner>,
    /// What its ratio is tuned on, if it is.
    pub tuning: Option<Arc<Tuning>>,
}

impl PlannedSet {
    /// True if its poses are chosen batch by batch, from the readings before: each material has its own.
    pub(crate) fn learns(&self) -> bool {
        self.set.batch(0, MAX_BUDGET).is_some()
    }
}

/// A reconstruction in one kind of coordinates.
#[derive(Debug)]
pub struct Method {
    /// Name of the reconstruction.
    pub name: String,
    /// The coordinates it works in: [`OWN`], or e.g. `hybrid+h_bar:square-root`.
    pub coordinates: String,
    /// The method.
    pub method: Arc<dyn Reconstruct>,
    /// The largest budget it is used at.
    pub up_to: Option<usize>,
    /// The one sample set it is used on, by position.
    pub on: Option<usize>,
}

impl Method {
    /// Name with coordinates, for lists: `thin-plate in hybrid`.
    pub(crate) fn label(&self) -> String {
        if self.coordinates == OWN {
            self.name.clone()
        } else {
            format!("{} in {}", self.name, self.coordinates)
        }
    }
}

/// The size limit of a schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allowance {
    /// Largest number of distinct configurations, reachable or not.
    Poses(usize),
    /// Largest number of poses its instrument can take; the budget is found.
    Readings(usize),
    /// Longest time on its instrument, minutes; the budget is found.
    Minutes(f64),
}

/// Work of comparing one reconstruction, in poses; it does not depend on the budget.
const FIXED_WORK: f64 = 4000.0;

/// Poses that an instrument visits in a minute, times the schedules that are tried to find out.
const MINUTE_WORK: f64 = 300.0;

impl Allowance {
    /// The number of poses or readings; `None` for minutes.
    pub fn count(self) -> Option<usize> {
        match self {
            Allowance::Poses(n) | Allowance::Readings(n) => Some(n),
            Allowance::Minutes(_) => None,
        }
    }

    /// Upper estimate of the number of readings.
    pub(super) fn readings(self) -> usize {
        match self {
            Allowance::Poses(n) | Allowance::Readings(n) => n,
            Allowance::Minutes(minutes) => (minutes * MINUTE_WORK).min(MAX_BUDGET as f64) as usize,
        }
    }

    /// Estimated work of one reconstruction, in poses; for progress bars and shares.
    pub(super) fn work(self) -> f64 {
        FIXED_WORK
            + match self {
                Allowance::Poses(n) | Allowance::Readings(n) => n as f64,
                Allowance::Minutes(minutes) => minutes * MINUTE_WORK,
            }
    }

    /// True if the text of one, in a row, is of a time.
    pub(crate) fn is_time(text: &str) -> bool {
        text.ends_with(" minute") || text.ends_with(" minutes")
    }
}

impl fmt::Display for Allowance {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Allowance::Poses(n) => f.write_str(&count(*n, "pose")),
            Allowance::Readings(n) => f.write_str(&count(*n, "reading")),
            Allowance::Minutes(1.0) => f.write_str("1 minute"),
            Allowance::Minutes(m) => write!(f, "{m} minutes"),
        }
    }
}

/// A sampling and a reconstruction: a row's identity without material, allowance, measure and seed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Choice {
    /// Parametrization the schedule is uniform in.
    pub parametrization: String,
    /// Its warps, or `none`.
    pub warp: String,
    /// Sample set.
    pub sample_set: String,
    /// Instrument.
    pub instrument: String,
    /// Reconstruction.
    pub reconstruction: String,
    /// The coordinates it works in.
    pub coordinates: String,
}
