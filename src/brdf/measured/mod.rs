//! Measured tables, and materials converted into tables.

pub mod merl;
pub mod rgl;
mod tabulated;
pub mod utia;

pub use tabulated::TabulatedSpec;

pub(super) use merl::ENTRY as MERL;
pub(super) use rgl::ENTRY as RGL;
pub(super) use tabulated::ENTRY as TABULATED;
pub(super) use utia::ENTRY as UTIA;

use super::Channels;
use crate::error::ParameterError;
use std::fmt;
use std::path::Path;

/// The values of a table, one list per channel; each kind of table says what they mean.
#[derive(Clone, Debug)]
enum Planes {
    /// One plane.
    Luminance(Vec<f64>),
    /// R, G, B.
    Rgb([Vec<f64>; 3]),
}

impl Planes {
    fn channels(&self) -> &'static Channels {
        match self {
            Planes::Luminance(_) => &Channels::Luminance,
            Planes::Rgb(_) => &Channels::Rgb,
        }
    }
}

/// Label of a table: the name of its file, or its kind if that has none.
pub(crate) fn label_of(path: &Path, kind: &str) -> String {
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
