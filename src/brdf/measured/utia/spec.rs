//! A UTIA file as a config names it.

use super::super::{label_of, without_wavelengths};
use super::{Utia, check};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::error::in_left_open;
use crate::geometry::Symmetry;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "utia";

/// The registry entry. No examples: those must build on every machine, and this kind needs a file.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "measured anisotropic table to 75°, the UTIA .bin file at `path`; also scale, no_reading",
    examples: &[],
    read: |table| Ok(Box::new(registry::parse::<UtiaSpec>(table)?)),
};

/// A UTIA file, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UtiaSpec {
    /// The file.
    pub path: PathBuf,
    /// One more number that stands for no reading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_reading: Option<f64>,
    /// Factor from stored values to sr⁻¹, above 0 and at most 10⁶.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

impl UtiaSpec {
    /// A file with every other key at its default.
    pub fn of(path: PathBuf) -> Self {
        Self {
            path,
            no_reading: None,
            scale: one(),
        }
    }
}

impl BrdfSpec for UtiaSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        label_of(&self.path, KIND)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        without_wavelengths("path", self.path.display(), channels)?;
        in_left_open("scale", self.scale, 0.0, 1e6)?;
        check(&self.path).map_err(|e| BuildError::data(&self.path, e))
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        Ok(Symmetry::NONE)
    }

    fn favours(&self) -> Favours {
        Favours::SphericalTable
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        let table = Utia::load_without(&self.path, self.scale, channels, self.no_reading);
        Ok(Box::new(
            table.map_err(|e| BuildError::data(&self.path, e))?,
        ))
    }

    fn tables(&self) -> Tables {
        Tables {
            files: vec![self.path.clone()],
            channel_bytes: super::FILE_LEN as usize / Channels::Rgb.count(),
        }
    }
}
