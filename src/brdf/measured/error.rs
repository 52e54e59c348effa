//! What may be wrong with a table.

use crate::brdf::BuildError;
use crate::error::{ParameterError, excerpt};
use std::io;
use std::path::Path;

/// Reason why a table could not be read, made or written. Messages do not name the file; callers do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The system reported an error; what it refuses, e.g. `no access to this MERL table`.
    #[error("{0}: {1}")]
    Io(&'static str, #[source] io::Error),
    /// The file is none of such a table.
    #[error("{0}")]
    Malformed(String),
    /// A key of the material is outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A scene has channels that the table does not hold.
    #[error("{0}")]
    Channels(&'static str),
    /// The format has no room for this BRDF.
    #[error("{0}")]
    Unsuited(String),
    /// There is no data.
    #[error("{0}")]
    NoData(String),
}

impl TableError {
    /// A line, counted from 1, that is not as a table has it: what is wrong, and what is allowed.
    pub(super) fn line(line: usize, message: impl std::fmt::Display) -> Self {
        Self::Malformed(format!("line {line}: {message}"))
    }

    /// A named field that is not as a table has it.
    pub(super) fn field(name: &str, what: impl std::fmt::Display) -> Self {
        // A damaged file may have any name.
        Self::Malformed(format!("the field \"{}\" {what}", excerpt(name)))
    }

    /// The error about the file that the key `path` names.
    pub(super) fn of_file(self, path: &Path) -> BuildError {
        match self {
            Self::Parameter(e) => e.into(),
            Self::Channels(why) => ParameterError::new("path", path.display(), why).into(),
            e => BuildError::data(path, e),
        }
    }
}
