//! A pattern of bright and dark fields between circles of latitude and meridians.

use super::{BRIGHTEST, Lighting, LightingSpec};
use crate::brdf::{BuildError, Channels, Spectrum};
use crate::error::{ParameterError, in_left_open};
use crate::geometry::Direction;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "checker";

/// The registry entry.
pub const ENTRY: Entry<dyn LightingSpec> = Entry {
    kind: KIND,
    summary: "bright and dark fields of equal angles, which show blur and warp",
    examples: &["", "step_deg = 10\ndark = 0.1"],
    read: |table| Ok(Box::new(registry::parse::<CheckerSpec>(table)?)),
};

/// A checker pattern, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CheckerSpec {
    /// Height and width of a field, degrees; 180 divided by it is a whole number.
    pub step_deg: f64,
    /// Radiance of bright fields, ≥ 0; the one at the zenith and azimuth 0 is bright.
    pub bright: Spectrum,
    /// Radiance of dark fields, ≥ 0.
    pub dark: Spectrum,
}

impl Default for CheckerSpec {
    fn default() -> Self {
        Self {
            step_deg: 15.0,
            bright: Spectrum::Grey(1.0),
            dark: Spectrum::Grey(0.05),
        }
    }
}

impl LightingSpec for CheckerSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        format!("{KIND}-{}", self.step_deg)
    }

    fn check(&self) -> Result<(), BuildError> {
        in_left_open("step_deg", self.step_deg, 0.0, 180.0)?;
        let fields = 180.0 / self.step_deg;
        // Otherwise two fields of one colour would meet at azimuth 0.
        if (fields - fields.round()).abs() > 1e-9 * fields {
            let allowed = "180 divided by a whole number";
            return Err(ParameterError::new("step_deg", self.step_deg, allowed).into());
        }
        self.bright
            .check("bright", 0.0, BRIGHTEST, &Channels::Rgb)?;
        Ok(self.dark.check("dark", 0.0, BRIGHTEST, &Channels::Rgb)?)
    }

    fn build(&self) -> Result<Box<dyn Lighting>, BuildError> {
        self.check()?;
        Ok(Box::new(Checker {
            step: self.step_deg.to_radians(),
            bright: self.bright.rgb(),
            dark: self.dark.rgb(),
        }))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

struct Checker {
    step: f64,
    bright: [f64; 3],
    dark: [f64; 3],
}

impl Lighting for Checker {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let field = (omega.theta() / self.step).floor() + (omega.phi() / self.step).floor();
        if field.rem_euclid(2.0) == 0.0 {
            self.bright
        } else {
            self.dark
        }
    }
}
