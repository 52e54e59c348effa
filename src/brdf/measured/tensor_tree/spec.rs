//! A tensor tree as a config names it.

use super::super::{label_of, without_wavelengths};
use super::TensorTree;
use super::read::{check, text};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::geometry::Symmetry;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "tensor-tree";

/// Bytes of a tree for each byte of its text, at most: a number, its place and a box of eight.
const HELD: usize = 10;

/// The registry entry. No examples: those must build on every machine, and this kind needs a file.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "isotropic reflection of a Radiance BSDF, the TensorTree3 XML at `path`; also no_reading",
    examples: &[],
    read: |table| Ok(Box::new(registry::parse::<TensorTreeSpec>(table)?)),
};

/// A tensor tree, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TensorTreeSpec {
    /// The file.
    pub path: PathBuf,
    /// One more number that stands for no reading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_reading: Option<f64>,
}

impl TensorTreeSpec {
    /// A file.
    pub fn of(path: PathBuf) -> Self {
        Self {
            path,
            no_reading: None,
        }
    }
}

impl BrdfSpec for TensorTreeSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        label_of(&self.path, KIND)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        without_wavelengths("path", self.path.display(), channels)?;
        let checked = text(&self.path).and_then(|text| check(&text));
        checked.map_err(|e| BuildError::data(&self.path, e))
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        Ok(super::SYMMETRY)
    }

    fn favours(&self) -> Favours {
        Favours::SphericalTable
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        without_wavelengths("path", self.path.display(), &channels)?;
        let table = text(&self.path)
            .and_then(|text| TensorTree::read_without(&text, channels, self.no_reading));
        Ok(Box::new(
            table.map_err(|e| BuildError::data(&self.path, e))?,
        ))
    }

    fn tables(&self) -> Tables {
        let length = std::fs::metadata(&self.path).map_or(0, |file| file.len() as usize);
        Tables {
            files: vec![self.path.clone()],
            channel_bytes: length.saturating_mul(HELD),
        }
    }
}
