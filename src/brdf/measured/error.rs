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
    /// A line is not as a table has it.
    #[error("line {line}: {message}")]
    Line {
        /// From 1.
        line: usize,
        /// What is wrong, and what is allowed.
        message: String,
    },
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
    /// A file that is none of such a table.
    pub(super) fn malformed(message: impl Into<String>) -> Self {
        Self::Malformed(message.into())
    }

    /// A named field that is not as a table has it.
    pub(super) fn field(name: &str, what: impl std::fmt::Display) -> Self {
        // A damaged file may have any name.
        Self::Malformed(format!("the field \"{}\" {what}", excerpt(name)))
    }

    /// A BRDF that the format has no room for.
    pub(super) fn unsuited(message: impl Into<String>) -> Self {
        Self::Unsuited(message.into())
    }

    /// A table without data.
    pub(super) fn no_data(message: impl Into<String>) -> Self {
        Self::NoData(message.into())
    }

    /// The error about the file that the key `path` names.
    pub(super) fn of_file(self, path: &Path) -> BuildError {
        match self {
            Self::Channels(why) => ParameterError::new("path", path.display(), why).into(),
            e => BuildError::data(path, e),
        }
    }
}
