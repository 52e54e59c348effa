//! Errors of a reconstruction without a truth: by readings that it was not given.
//!
//! [`CrossValidation`] leaves out some of the readings, has a method predict them from the others, and does
//! so in turn, up to ten times. Where readings lie in sheets of constant incidence, whole sheets are left out
//! ([`Left`]): the next reading in a sheet is so near that it would say nothing of what lies between the
//! sheets. Readings of one incidence, of two, or of the plane of incidence alone cannot say how good they
//! are elsewhere, and do not. [`ReferenceReadings`] is the readings that judge; those of another file do it as well.
//!
//! Errors so found are those of a reconstruction from fewer readings, and the noise of the readings counts as
//! error: both make them too large. `nrmse` is ruled by the few readings that see a peak: if these are few it
//! and its standard error are too small.
//!
//! Readings are no sample of a measure, so each counts as much as the part of the measure that is nearer to
//! it than to any other. Standard errors are those of the jackknife over what is left out at a time (Efron
//! & Stein 1981).

mod choice;
mod cross_validation;
mod left_out;
mod made;
mod reference;

#[cfg(feature = "pictures")]
pub(crate) use choice::coordinates;
pub use choice::{Ranked, chosen};
pub use cross_validation::CrossValidation;
pub use left_out::Left;
pub use made::{Against, Reconstruction, expected};
pub use reference::{Estimate, ReferenceReadings, Scores};

use crate::error::count;
use crate::reconstruct::ReconstructError;
use std::fmt;

/// Layout of readings that has nothing beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beside {
    /// One or two sheets of constant incidence; true if it is the sensor that stood still.
    Sheets(usize, bool),
    /// The plane of incidence.
    Plane,
}

impl fmt::Display for Beside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sheets(sheets, of_sensor) => {
                let angle = if *of_sensor { "theta_o" } else { "theta_i" };
                write!(f, "of {} of {angle}", count(*sheets, "value"))
            }
            Self::Plane => write!(f, "in the plane of incidence"),
        }
    }
}

/// Reason why readings cannot judge.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ValidationError {
    /// Nothing is left if one is left out.
    #[error("{}; allowed: 2 or more at different places", count(*places, "reading"))]
    TooFew {
        /// Readings at different places.
        places: usize,
    },
    /// The readings lie in no sheets.
    #[error(
        "the readings lie in fewer than 3 sheets of constant incidence; allowed: to leave out points"
    )]
    NoSheets,
    /// No reading is as far from the others as the directions that errors are asked for.
    #[error(
        "the readings are {0}, and say nothing of what lies beside; allowed: to leave out points"
    )]
    NothingBeside(Beside),
    /// No method can do anything with the readings.
    #[error(transparent)]
    Reconstruct(#[from] ReconstructError),
}
