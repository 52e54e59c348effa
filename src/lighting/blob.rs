//! A soft light before an even background.
//!
//! L = background + peak · exp(−γ²/(2 width²)), γ the angle from the light's middle.

use super::{BRIGHTEST, Lighting, LightingSpec};
use crate::brdf::{BuildError, Channels, Spectrum};
use crate::error::{in_closed, in_left_open};
use crate::geometry::{Direction, angle_between};
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "blob";

/// The registry entry.
pub const ENTRY: Entry<dyn LightingSpec> = Entry {
    kind: KIND,
    summary: "one soft light, Gaussian over the angle, before an even background",
    examples: &["", "theta_deg = 60\nphi_deg = -90\nwidth_deg = 5"],
    read: |table| Ok(Box::new(registry::parse::<BlobSpec>(table)?)),
};

/// A soft light, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BlobSpec {
    /// Angle of the middle from the zenith, degrees, in [0, 180].
    pub theta_deg: f64,
    /// Azimuth of the middle from +x towards +y, degrees, in [-360, 360].
    pub phi_deg: f64,
    /// Standard deviation, degrees, in (0, 180].
    pub width_deg: f64,
    /// Radiance of the middle above the background, ≥ 0.
    pub peak: Spectrum,
    /// Radiance everywhere, ≥ 0.
    pub background: Spectrum,
}

impl Default for BlobSpec {
    fn default() -> Self {
        Self {
            theta_deg: 30.0,
            phi_deg: 0.0,
            width_deg: 10.0,
            peak: Spectrum::Grey(1.0),
            background: Spectrum::Grey(0.1),
        }
    }
}

impl LightingSpec for BlobSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        format!("{KIND}-{}-{}", self.theta_deg, self.width_deg)
    }

    fn check(&self) -> Result<(), BuildError> {
        in_closed("theta_deg", self.theta_deg, 0.0, 180.0)?;
        in_closed("phi_deg", self.phi_deg, -360.0, 360.0)?;
        in_left_open("width_deg", self.width_deg, 0.0, 180.0)?;
        self.peak.check("peak", 0.0, BRIGHTEST, &Channels::Rgb)?;
        Ok(self
            .background
            .check("background", 0.0, BRIGHTEST, &Channels::Rgb)?)
    }

    fn build(&self) -> Result<Box<dyn Lighting>, BuildError> {
        self.check()?;
        let (theta, phi) = (self.theta_deg.to_radians(), self.phi_deg.to_radians());
        Ok(Box::new(Blob {
            middle: Direction::from_spherical(theta, phi),
            width: self.width_deg.to_radians(),
            peak: self.peak.rgb(),
            background: self.background.rgb(),
        }))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

struct Blob {
    middle: Direction,
    width: f64,
    peak: [f64; 3],
    background: [f64; 3],
}

impl Lighting for Blob {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let widths = angle_between(omega.vector(), self.middle.vector()) / self.width;
        let share = (-0.5 * widths * widths).exp();
        std::array::from_fn(|c| self.background[c] + share * self.peak[c])
    }
}
