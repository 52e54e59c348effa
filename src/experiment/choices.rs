//! The choices of a plan: materials, coordinates, sample sets, reconstructions, each with a name.

pub use super::materials::Material;
use super::tuning::Tuning;
use crate::acquisition::Planner;
use crate::error::{Error, count};
use crate::geometry::Symmetry;
use crate::parametrization::{Parametrization, ParametrizationSpec, WarpError};
use crate::reconstruct::{self, Reconstruct};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::sync::Arc;

/// The largest budget, distinct configurations: a gigabyte of poses. More is a misprint.
pub const MAX_BUDGET: usize = 10_000_000;

/// Name of the instrument without flaws in the column `instrument`.
pub const IDEAL: &str = "ideal";

/// Value of the column `coordinates` where a reconstruction works in those of its schedule.
pub const OWN: &str = "own";

/// Value of the column `coordinates` where a reconstruction that never works in those of its schedule was given none.
pub const DEFAULT: &str = "default";

/// Value of the columns `parametrization` and `warp` of sample sets that depend on no parametrization.
pub const NONE: &str = "none";

/// True of the label of coordinates that a config names, and neither [`OWN`] nor [`DEFAULT`].
pub(crate) fn are_named(coordinates: &str) -> bool {
    coordinates != OWN && coordinates != DEFAULT
}

/// A parametrization with its warps.
#[derive(Clone)]
pub struct Coordinates {
    /// Name of the parametrization, or [`NONE`] of [unguided](crate::schedule::SampleSet::is_unguided) sample sets.
    pub(super) kind: &'static str,
    /// How to build it.
    pub spec: ParametrizationSpec,
    /// The warps as results name them, `none` if there are none.
    pub warp: String,
}

impl Coordinates {
    /// Name of the parametrization.
    pub(crate) fn name(&self) -> &'static str {
        self.kind
    }

    /// These as what folds and identifies the poses of a sample set that does not depend on them.
    pub(crate) fn unguided(&self) -> Self {
        Self {
            kind: NONE,
            spec: self.spec.clone(),
            warp: NONE.into(),
        }
    }

    /// Name with warps, for lists: `half-difference theta_h:square-root`.
    pub(crate) fn label(&self) -> String {
        match self.warp.as_str() {
            NONE => self.name().into(),
            warp => format!("{} {warp}", self.name()),
        }
    }

    /// These as the coordinates of a reconstruction.
    pub(super) fn of_reconstructions(&self) -> reconstruct::Coordinates {
        reconstruct::Coordinates {
            kind: self.spec.kind.to_owned(),
            warp: self.spec.warps.clone(),
        }
    }

    /// The form for a material of these symmetries.
    ///
    /// # Errors
    /// If a warp does not fit an axis; not for the symmetries of the plan's materials.
    pub fn form(&self, symmetry: Symmetry) -> Result<Arc<dyn Parametrization>, WarpError> {
        self.spec.form(symmetry)
    }

    /// The form for a material of a plan, whose warps are checked.
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
    /// The largest budget it is used at, also where that is found for a time; as a config writes it with the instruments.
    pub reach: Reach,
    /// The instruments it is used on, by position; empty: all.
    pub on: Vec<usize>,
}

impl PlannedSet {
    /// Poses of a schedule, at most.
    pub(crate) fn most(&self) -> usize {
        self.set.most().min(self.reach.largest())
    }

    /// True if its poses are chosen batch by batch, from the readings before: each material has its own.
    pub(crate) fn learns(&self) -> bool {
        self.set.batch(0, MAX_BUDGET, false).is_some()
    }
}

/// The keys of a `[[sample_set]]` or a `[[reconstruction]]` that limit where it is used.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Reach {
    /// The largest budget it is used at.
    pub up_to: Option<i64>,
    /// The instruments a sample set, or the sample sets a reconstruction is used on, by name: one, or a list of them.
    #[serde(
        skip_serializing_if = "Vec::is_empty",
        serialize_with = "one_or_list",
        deserialize_with = "names"
    )]
    pub on: Vec<String>,
}

impl Reach {
    /// The largest budget, without end if none is given.
    pub(crate) fn largest(&self) -> usize {
        self.up_to.map_or(usize::MAX, |n| n.unsigned_abs() as usize)
    }
}

/// One name as it is, or a list of several.
fn one_or_list<S: Serializer>(names: &[String], serializer: S) -> Result<S::Ok, S::Error> {
    match names {
        [name] => serializer.serialize_str(name),
        names => names.serialize(serializer),
    }
}

/// A list of names, or one of its own.
fn names<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    struct V;
    impl<'de> Visitor<'de> for V {
        type Value = Vec<String>;
        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("a string or a list of strings")
        }
        fn visit_str<E: de::Error>(self, name: &str) -> Result<Vec<String>, E> {
            Ok(vec![name.to_owned()])
        }
        fn visit_seq<A: de::SeqAccess<'de>>(self, list: A) -> Result<Vec<String>, A::Error> {
            Vec::deserialize(de::value::SeqAccessDeserializer::new(list))
        }
    }
    deserializer.deserialize_any(V)
}

/// A reconstruction in one kind of coordinates.
#[derive(Debug)]
pub struct Method {
    /// Name of the reconstruction.
    pub name: String,
    /// The coordinates it works in: [`OWN`], [`DEFAULT`], or e.g. `hybrid+h_bar:square-root`.
    pub coordinates: String,
    /// The method.
    pub method: Arc<dyn Reconstruct>,
    /// The largest budget it is used at.
    pub up_to: Option<usize>,
    /// The sample sets it is used on, by position; empty: all.
    pub on: Vec<usize>,
    /// The coordinates of the schedules it is used on.
    pub used_in: UsedIn,
}

/// Coordinates of schedules on which a method is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UsedIn {
    /// All, and those of no parametrization.
    All,
    /// All parametrizations.
    Guided,
    /// The parametrization at a position of the plan.
    Only(usize),
    /// Those of no parametrization.
    Unguided,
}

impl UsedIn {
    /// True if schedules in the coordinates at a position of the plan, or in none, are among them.
    pub(crate) fn has(self, coordinates: Option<usize>) -> bool {
        match self {
            UsedIn::All => true,
            UsedIn::Guided => coordinates.is_some(),
            UsedIn::Only(p) => coordinates == Some(p),
            UsedIn::Unguided => coordinates.is_none(),
        }
    }
}

impl Method {
    /// Name with coordinates, for lists: `thin-plate in hybrid`.
    pub(crate) fn label(&self) -> String {
        match are_named(&self.coordinates) {
            true => format!("{} in {}", self.name, self.coordinates),
            false => self.name.clone(),
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

/// Poses that an instrument visits in a minute, times the schedules that are tried to find out.
pub(super) const MINUTE_WORK: f64 = 300.0;

/// Poses that an instrument takes in a minute, about: the presets take 6 to 30.
pub(crate) const POSES_A_MINUTE: f64 = 20.0;

impl Allowance {
    /// The number of poses or readings; `None` for minutes.
    pub fn count(self) -> Option<usize> {
        match self {
            Allowance::Poses(n) | Allowance::Readings(n) => Some(n),
            Allowance::Minutes(_) => None,
        }
    }

    /// The number of readings, of a time by so many in a minute.
    pub(super) fn readings(self, in_a_minute: f64) -> usize {
        match self {
            Allowance::Poses(n) | Allowance::Readings(n) => n,
            Allowance::Minutes(minutes) => (minutes * in_a_minute).min(MAX_BUDGET as f64) as usize,
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
