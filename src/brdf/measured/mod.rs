//! Measured tables, and materials converted into tables.

pub mod merl;
mod tabulated;
pub mod utia;

pub use tabulated::TabulatedSpec;

pub(super) use merl::ENTRY as MERL;
pub(super) use tabulated::ENTRY as TABULATED;
pub(super) use utia::ENTRY as UTIA;

use super::Channels;
use crate::error::ParameterError;
use std::fmt;
use std::path::Path;

/// Label of a table: the name of its file, or its kind if that has none.
fn label_of(path: &Path, kind: &str) -> String {
    let stem = path.file_stem();
    stem.map_or(kind.into(), |stem| stem.to_string_lossy().into_owned())
}

/// Refuses a table of R, G, B, which `key` names, in a scene of wavelengths.
fn without_wavelengths(
    key: &str,
    table: impl fmt::Display,
    channels: &Channels,
) -> Result<(), ParameterError> {
    if channels.wavelengths().is_none() {
        return Ok(());
    }
    let allowed =
        "a material known by wavelength in a scene of wavelengths: this table holds R, G, B";
    Err(ParameterError::new(key, table, allowed))
}
