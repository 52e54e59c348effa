//! What may be wrong with a table.

use crate::error::excerpt;
use std::io;

/// Reason why a table could not be read or written. Messages do not name the file; callers do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RglError {
    /// The system reported an error.
    #[error("no access to this RGL table: {0}")]
    Io(#[from] io::Error),
    /// The first bytes are those of another kind of file.
    #[error("not a tensor file: its first bytes are not \"tensor_file\", 0, and version 1.0")]
    NotATensorFile,
    /// The file is shorter than its header.
    #[error("not a tensor file: it ends within its header")]
    Cut,
    /// A field is not as a table has it.
    #[error("the field \"{name}\" {what}")]
    Field {
        /// Its name.
        name: String,
        /// What is wrong, and what is allowed.
        what: String,
    },
    /// A BRDF without any value above 0 has no distribution of normals.
    #[error("an RGL table holds no BRDF that is 0, or not known, everywhere")]
    Black,
}

impl RglError {
    pub(super) fn field(name: &str, what: impl Into<String>) -> Self {
        Self::Field {
            // A damaged file may have any name.
            name: excerpt(name).into_owned(),
            what: what.into(),
        }
    }
}
