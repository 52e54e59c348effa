//! How good a reconstruction is when nobody knows the truth: readings that it was not given.
//!
//! [`CrossValidation`] leaves out some of the readings, has a method predict them from the others, and does
//! so in turn until every reading was left out once. Where readings lie in sheets of constant incidence,
//! whole sheets are left out ([`Left`]): the next reading in a sheet is so near that it would say nothing
//! of what lies between the sheets. Errors so found are those of a reconstruction from fewer readings, and so
//! rather too large. [`Jury`] is the readings that judge; those of another file do it as well.
//!
//! Readings are no sample of a measure, so each counts as much as the part of the measure that is nearer to
//! it than to any other. Standard errors are those of the jackknife over what is left out at a time (Efron
//! & Stein 1981).

mod choice;
mod cross_validation;
mod jury;
mod left_out;

pub use choice::{Ranked, chosen};
pub use cross_validation::CrossValidation;
pub use jury::{Estimate, Jury, Scores};
pub use left_out::Left;

use crate::error::count;
use crate::reconstruct::ReconstructError;

/// Reason why readings cannot judge.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ValidationError {
    /// Nothing is left if one is left out.
    #[error("{}: cross-validation needs 2 at different places", count(*places, "reading"))]
    TooFew {
        /// Readings at different places.
        places: usize,
    },
    /// The readings lie in no sheets.
    #[error(
        "the readings lie in fewer than 2 sheets of constant incidence; allowed: to leave out points"
    )]
    NoSheets,
    /// No method can do anything with the readings.
    #[error(transparent)]
    Reconstruct(#[from] ReconstructError),
}
