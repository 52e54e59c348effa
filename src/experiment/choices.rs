//! The choices of a plan: materials, coordinates, sample sets, reconstructions, each with a name.

use super::tuning::Tuning;
use crate::acquisition::Planner;
use crate::brdf::{BrdfSpec, Channels, Favours};
use crate::error::count;
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

/// A material to be measured.
#[derive(Debug)]
pub struct Material {
    /// Its name in results, unique in its plan.
    pub name: String,
    /// Specification it is built from.
    pub spec: Box<dyn BrdfSpec>,
    /// Symmetries that its schedules use to fold the coordinates.
    pub symmetry: Symmetry,
    /// What is peculiar about its files, a sentence each.
    pub remarks: Vec<String>,
}

impl Material {
    /// Its kind, which it shares with the materials it is compared with.
    pub fn group(&self) -> String {
        let resolved = self.spec.resolved();
        let kind = resolved.get("kind").and_then(toml::Value::as_str);
        kind.unwrap_or_default().to_owned()
    }

    /// True if it has values in R, G, B.
    pub fn is_coloured(&self) -> bool {
        self.spec.check(&Channels::Rgb).is_ok()
    }

    /// Truth class of its rows: the coordinates it favours. In 4-D there are too few to tell apart.
    pub fn truth(&self) -> &'static str {
        let favours = self.spec.favours();
        if self.symmetry.isotropic || favours == Favours::SphericalTable {
            favours.name()
        } else {
            "anisotropic"
        }
    }
}

/// A parametrization with its warps.
pub struct Coordinates {
    /// How to build it.
    pub spec: ParametrizationSpec,
    /// The warps as results name them, `none` if there are none.
    pub warp: String,
}

impl Coordinates {
    /// Name of the parametrization.
    pub fn name(&self) -> &'static str {
        self.spec.kind
    }

    /// Name with warps, for lists: `half-difference theta_h:square-root`.
    pub fn label(&self) -> String {
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
    pub fn learns(&self) -> bool {
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
    pub fn label(&self) -> String {
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

impl Allowance {
    /// The number of poses or readings; `None` for minutes.
    pub fn count(self) -> Option<usize> {
        match self {
            Allowance::Poses(n) | Allowance::Readings(n) => Some(n),
            Allowance::Minutes(_) => None,
        }
    }

    /// True if the text of one, in a row, is of a time.
    pub fn is_time(text: &str) -> bool {
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

/// Identity of a row without its material.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Label {
    /// Sampling and reconstruction.
    pub choice: Choice,
    /// The allowance, as rows name it.
    pub allowed: String,
    /// Seed.
    pub seed: u64,
    /// Distribution of the test pairs.
    pub measure: String,
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let c = &self.choice;
        // Names are free texts: in quotes no two labels are written alike.
        write!(
            f,
            "{:?} {:?} {:?} {:?} {:?} {:?} {:?} {} {:?}",
            c.parametrization,
            c.warp,
            c.sample_set,
            c.instrument,
            c.reconstruction,
            c.coordinates,
            self.allowed,
            self.seed,
            self.measure
        )
    }
}
