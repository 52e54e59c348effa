//! A tensor tree as a config names it.

use super::super::{label_of, without_wavelengths};
use super::TensorTree;
use super::read::{check, text};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::geometry::Symmetry;
use crate::registry;

/// Bytes of a tree for each byte of its text, at most: a number, its place and a box of eight.
const HELD: usize = 10;

file_table! {
    "tensor-tree": "isotropic reflection of a Radiance BSDF, the TensorTree3 XML at `path`; also no_reading"
    /// A tensor tree, as a config writes it.
    pub struct TensorTreeSpec {}
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
        checked.map_err(|e| e.of_file(&self.path))
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
        Ok(Box::new(table.map_err(|e| e.of_file(&self.path))?))
    }

    fn tables(&self) -> Tables {
        let length = std::fs::metadata(&self.path).map_or(0, |file| file.len() as usize);
        Tables {
            files: vec![self.path.clone()],
            channel_bytes: length.saturating_mul(HELD),
        }
    }
}
