//! Equal radiance from every direction.

use super::{BRIGHTEST, Lighting, LightingSpec};
use crate::brdf::{BuildError, Channels, Spectrum};
use crate::geometry::Direction;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "constant";

/// The registry entry.
pub const ENTRY: Entry<dyn LightingSpec> = Entry {
    kind: KIND,
    summary: "the same radiance from everywhere",
    examples: &["", "radiance = [1.0, 0.9, 0.8]"],
    read: |table| Ok(Box::new(registry::parse::<ConstantSpec>(table)?)),
};

/// Constant light, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConstantSpec {
    /// Radiance, ≥ 0.
    pub radiance: Spectrum,
}

impl Default for ConstantSpec {
    fn default() -> Self {
        Self {
            radiance: Spectrum::Grey(1.0),
        }
    }
}

impl LightingSpec for ConstantSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        KIND.into()
    }

    fn check(&self) -> Result<(), BuildError> {
        Ok(self
            .radiance
            .check("radiance", 0.0, BRIGHTEST, &Channels::Rgb)?)
    }

    fn build(&self) -> Result<Box<dyn Lighting>, BuildError> {
        self.check()?;
        Ok(Box::new(Constant(self.radiance.rgb())))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

struct Constant([f64; 3]);

impl Lighting for Constant {
    fn radiance(&self, _omega: Direction) -> [f64; 3] {
        self.0
    }
}
