//! A MERL file as a config names it.

use super::super::{label_of, without_wavelengths};
use super::{Merl, Nodes, check};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::geometry::Symmetry;
use crate::registry;
use serde::{Deserialize, Serialize};

/// Interpolation of a table between its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// Between the eight nodes around the pair.
    #[default]
    Trilinear,
    /// The cell the pair falls in, as the reference reader does.
    Nearest,
}

file_table! {
    "merl": "measured isotropic table, the MERL file at `path`; also interpolation, nodes, bilateral, no_reading"
    /// A MERL file, as a config writes it.
    pub struct MerlSpec {
        /// Interpolation between its nodes.
        #[serde(default)]
        interpolation: Interpolation = Interpolation::default();
        /// Where in its cell a value is exact.
        #[serde(default)]
        nodes: Nodes = Nodes::default();
        /// True if phi_d and −phi_d count as one configuration. An assumption: the format does not
        /// guarantee it, but isotropic materials have it but for noise, and a schedule that folds
        /// it visits half as many poses. The bilateral law measures the deviation of a table from it.
        #[serde(default = "yes")]
        bilateral: bool = yes();
    }
}

fn yes() -> bool {
    true
}

impl BrdfSpec for MerlSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        label_of(&self.path, KIND)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        without_wavelengths("path", self.path.display(), channels)?;
        check(&self.path)
            .map(drop)
            .map_err(|e| e.of_file(&self.path))
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        let grid = check(&self.path).map_err(|e| e.of_file(&self.path))?;
        Ok(grid.symmetry(self.bilateral))
    }

    fn favours(&self) -> Favours {
        Favours::HalfDifferenceTable
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        without_wavelengths("path", self.path.display(), &channels)?;
        let table = Merl::load(&self.path, channels, self.no_reading);
        let table = table.map_err(|e| e.of_file(&self.path))?;
        Ok(Box::new(
            table
                .with_interpolation(self.interpolation)
                .with_nodes(self.nodes)
                .with_bilateral(self.bilateral),
        ))
    }

    fn tables(&self) -> Tables {
        // Header and size were checked; without a file there is nothing to hold.
        let bytes = std::fs::metadata(&self.path).map_or(0, |m| m.len());
        Tables {
            files: vec![self.path.clone()],
            channel_bytes: bytes as usize / Channels::Rgb.count(),
        }
    }
}
