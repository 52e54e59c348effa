//! A clear sky with a sun above a darker ground.
//!
//! Above the horizon the colour goes from `horizon` to `zenith` as 1 − (1 − cos θ)⁴, below it is
//! `ground`, with a smooth passage one degree to either side. Colours are chosen to look right,
//! not computed from an atmosphere.

use super::{BRIGHTEST, Lighting, LightingSpec};
use crate::brdf::{BuildError, Channels, Spectrum};
use crate::error::{in_closed, in_left_open};
use crate::geometry::{Direction, angle_between};
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

const KIND: &str = "sky";

/// The registry entry.
pub const ENTRY: Entry<dyn LightingSpec> = Entry {
    kind: KIND,
    summary: "a clear sky with a sun above a darker ground",
    examples: &["", "sun_theta_deg = 70\nsun_diameter_deg = 2"],
    read: |table| Ok(Box::new(registry::parse::<SkySpec>(table)?)),
};

/// A sky, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SkySpec {
    /// Radiance at the zenith, ≥ 0.
    pub zenith: Spectrum,
    /// Radiance of the sky at the horizon, ≥ 0.
    pub horizon: Spectrum,
    /// Radiance below the horizon, ≥ 0.
    pub ground: Spectrum,
    /// Radiance that the sun adds, ≥ 0; nothing where the ground hides it.
    pub sun: Spectrum,
    /// Angle of the sun from the zenith, degrees, in [0, 90].
    pub sun_theta_deg: f64,
    /// Azimuth of the sun from +x towards +y, degrees, in [-360, 360].
    pub sun_phi_deg: f64,
    /// Diameter of the sun at half its radiance, degrees, in (0, 180]. The true one, 0.53°, is
    /// smaller than a pixel of most pictures.
    pub sun_diameter_deg: f64,
    /// Width of the sun's edge, degrees, in (0, the diameter].
    pub sun_edge_deg: f64,
}

impl Default for SkySpec {
    fn default() -> Self {
        Self {
            zenith: Spectrum::Rgb([0.10, 0.22, 0.55]),
            horizon: Spectrum::Rgb([0.65, 0.78, 0.95]),
            ground: Spectrum::Rgb([0.13, 0.11, 0.08]),
            sun: Spectrum::Rgb([40.0, 36.0, 28.0]),
            sun_theta_deg: 40.0,
            sun_phi_deg: 45.0,
            sun_diameter_deg: 6.0,
            sun_edge_deg: 1.0,
        }
    }
}

impl LightingSpec for SkySpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        format!("{KIND}-{}", self.sun_theta_deg)
    }

    fn check(&self) -> Result<(), BuildError> {
        self.zenith
            .check("zenith", 0.0, BRIGHTEST, &Channels::Rgb)?;
        self.horizon
            .check("horizon", 0.0, BRIGHTEST, &Channels::Rgb)?;
        self.ground
            .check("ground", 0.0, BRIGHTEST, &Channels::Rgb)?;
        self.sun.check("sun", 0.0, BRIGHTEST, &Channels::Rgb)?;
        in_closed("sun_theta_deg", self.sun_theta_deg, 0.0, 90.0)?;
        in_closed("sun_phi_deg", self.sun_phi_deg, -360.0, 360.0)?;
        let diameter = in_left_open("sun_diameter_deg", self.sun_diameter_deg, 0.0, 180.0)?;
        in_left_open("sun_edge_deg", self.sun_edge_deg, 0.0, diameter)?;
        Ok(())
    }

    fn build(&self) -> Result<Box<dyn Lighting>, BuildError> {
        self.check()?;
        let (theta, phi) = (
            self.sun_theta_deg.to_radians(),
            self.sun_phi_deg.to_radians(),
        );
        Ok(Box::new(Sky {
            zenith: self.zenith.rgb(),
            horizon: self.horizon.rgb(),
            ground: self.ground.rgb(),
            sun: self.sun.rgb(),
            towards_sun: Direction::from_spherical(theta, phi),
            radius: 0.5 * self.sun_diameter_deg.to_radians(),
            edge: self.sun_edge_deg.to_radians(),
        }))
    }

    fn inputs(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

struct Sky {
    zenith: [f64; 3],
    horizon: [f64; 3],
    ground: [f64; 3],
    sun: [f64; 3],
    towards_sun: Direction,
    radius: f64,
    edge: f64,
}

/// 0 below −1/2, 1 above 1/2, smooth between.
fn smooth_step(x: f64) -> f64 {
    let x = (x + 0.5).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

impl Lighting for Sky {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let up = omega.cos_theta();
        let above = smooth_step(up / 2f64.to_radians());
        let low = (1.0 - up.clamp(0.0, 1.0)).powi(4);
        let away = angle_between(omega.vector(), self.towards_sun.vector());
        let sun = smooth_step((self.radius - away) / self.edge);
        std::array::from_fn(|c| {
            let sky = self.zenith[c] + low * (self.horizon[c] - self.zenith[c]);
            above * (sky + sun * self.sun[c]) + (1.0 - above) * self.ground[c]
        })
    }
}
