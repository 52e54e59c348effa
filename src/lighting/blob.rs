//! A soft light before an even background.
//!
//! L = background + peak · exp(−γ²/(2 width²)), γ the angle from the light's middle.

use super::{Lighting, RADIANCE};
use crate::brdf::{Limited, Spectrum};
use crate::error::left_open;
use crate::geometry::{Direction, angle_between};

light! {
    "blob": "one soft light, Gaussian over the angle, before an even background", [
        "",
        "theta_deg = 60\nphi_deg = -90\nwidth_deg = 5",
    ]
    /// A soft light, as a config writes it.
    pub struct BlobSpec {
        /// Angle of the middle from the zenith, degrees.
        theta_deg: f64 = 30.0, in 0.0..=180.0;
        /// Azimuth of the middle from +x towards +y, degrees.
        phi_deg: f64 = 0.0, in -360.0..=360.0;
        /// Standard deviation, degrees.
        width_deg: f64 = 10.0, in left_open(0.0, 180.0);
        /// Radiance of the middle above the background.
        peak: Spectrum = Spectrum::Grey(1.0), in RADIANCE;
        /// Radiance everywhere.
        background: Spectrum = Spectrum::Grey(0.1), in RADIANCE;
    }
    label: [theta_deg, width_deg],
    build: |spec| Blob {
        middle: Direction::from_spherical(spec.theta_deg.to_radians(), spec.phi_deg.to_radians()),
        spec: spec.clone(),
    },
}

struct Blob {
    middle: Direction,
    spec: BlobSpec,
}

impl Lighting for Blob {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let [peak, background] = [&self.spec.peak, &self.spec.background].map(Spectrum::rgb);
        let angle = angle_between(omega.vector(), self.middle.vector());
        let widths = angle / self.spec.width_deg.to_radians();
        let share = (-0.5 * widths * widths).exp();
        std::array::from_fn(|c| background[c] + share * peak[c])
    }
}
