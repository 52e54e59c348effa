//! Reasons to end work early.

use crate::error::Error;
use std::fmt;

/// Reason why some work ends early.
pub enum Stop {
    /// The observer asked for it.
    Cancelled,
    /// The run cannot go on.
    Error(Error),
    /// The job cannot be done, for this reason; others can.
    Failed(String),
}

/// Asks whether to go on; an error if the observer has cancelled.
pub(super) type GoOn<'a> = &'a dyn Fn() -> Result<(), Stop>;

impl Stop {
    pub(crate) fn failed(reason: impl fmt::Display) -> Self {
        Stop::Failed(reason.to_string())
    }
}

impl From<Error> for Stop {
    fn from(e: Error) -> Self {
        Stop::Error(e)
    }
}
