//! A MERL file as a config names it.

use super::super::{label_of, without_wavelengths};
use super::{Merl, Nodes, check};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::geometry::Symmetry;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "merl";

/// The registry entry. No examples: those must build on every machine, and this kind needs a file.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "measured isotropic table, the MERL file at `path`; also interpolation, nodes, bilateral, no_reading",
    examples: &[],
    read: |table| Ok(Box::new(registry::parse::<MerlSpec>(table)?)),
};

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

/// A MERL file, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MerlSpec {
    /// The file.
    pub path: PathBuf,
    /// One more number that stands for no reading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub no_reading: Option<f64>,
    /// Interpolation between its nodes.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// Where in its cell a value is exact.
    #[serde(default)]
    pub nodes: Nodes,
    /// True if phi_d and −phi_d count as one configuration. An assumption: the format does not
    /// guarantee it, but isotropic materials have it but for noise, and a schedule that folds
    /// it visits half as many poses. The bilateral law measures the deviation of a table from it.
    #[serde(default = "yes")]
    pub bilateral: bool,
}

fn yes() -> bool {
    true
}

impl MerlSpec {
    /// A file with every other key at its default.
    pub fn of(path: PathBuf) -> Self {
        Self {
            path,
            no_reading: None,
            interpolation: Interpolation::default(),
            nodes: Nodes::default(),
            bilateral: yes(),
        }
    }
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
            .map_err(|e| BuildError::data(&self.path, e))
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        let grid = check(&self.path).map_err(|e| BuildError::data(&self.path, e))?;
        Ok(grid.symmetry(self.bilateral))
    }

    fn favours(&self) -> Favours {
        Favours::HalfDifferenceTable
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        without_wavelengths("path", self.path.display(), &channels)?;
        let table = Merl::load_without(&self.path, channels, self.no_reading);
        let table = table.map_err(|e| BuildError::data(&self.path, e))?;
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
