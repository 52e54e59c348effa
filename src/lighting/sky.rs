//! A clear sky with a sun above a darker ground.
//!
//! Above the horizon the colour goes from `horizon` to `zenith` as 1 − (1 − cos θ)⁴, below it is
//! `ground`, with a smooth passage one degree to either side. Colours are chosen to look right,
//! not computed from an atmosphere.

use super::{Lighting, RADIANCE};
use crate::brdf::{Limited, Spectrum};
use crate::error::{in_left_open, left_open};
use crate::geometry::{Direction, angle_between};

light! {
    "sky": "a clear sky with a sun above a darker ground", [
        "",
        "sun_theta_deg = 70\nsun_diameter_deg = 2",
    ]
    /// A sky, as a config writes it.
    pub struct SkySpec {
        /// Radiance at the zenith.
        zenith: Spectrum = Spectrum::Rgb([0.10, 0.22, 0.55]), in RADIANCE;
        /// Radiance of the sky at the horizon.
        horizon: Spectrum = Spectrum::Rgb([0.65, 0.78, 0.95]), in RADIANCE;
        /// Radiance below the horizon.
        ground: Spectrum = Spectrum::Rgb([0.13, 0.11, 0.08]), in RADIANCE;
        /// Radiance that the sun adds; nothing where the ground hides it.
        sun: Spectrum = Spectrum::Rgb([40.0, 36.0, 28.0]), in RADIANCE;
        /// Angle of the sun from the zenith, degrees.
        sun_theta_deg: f64 = 40.0, in 0.0..=90.0;
        /// Azimuth of the sun from +x towards +y, degrees.
        sun_phi_deg: f64 = 45.0, in -360.0..=360.0;
        /// Diameter of the sun at half its radiance, degrees. The true one, 0.53°, is
        /// smaller than a pixel of most pictures.
        sun_diameter_deg: f64 = 6.0, in left_open(0.0, 180.0);
        /// Width of the sun's edge, degrees, in (0, the diameter].
        sun_edge_deg: f64 = 1.0, check |spec| {
            in_left_open("sun_edge_deg", spec.sun_edge_deg, 0.0, spec.sun_diameter_deg).map(drop)
        };
    }
    label: [sun_theta_deg],
    build: |spec| Sky {
        spec: spec.clone(),
        towards_sun: Direction::from_spherical(
            spec.sun_theta_deg.to_radians(),
            spec.sun_phi_deg.to_radians(),
        ),
    },
}

struct Sky {
    spec: SkySpec,
    towards_sun: Direction,
}

/// 0 below −1/2, 1 above 1/2, smooth between.
fn smooth_step(x: f64) -> f64 {
    let x = (x + 0.5).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

impl Lighting for Sky {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let spec = &self.spec;
        let colours = [&spec.zenith, &spec.horizon, &spec.ground, &spec.sun];
        let [zenith, horizon, ground, sun] = colours.map(Spectrum::rgb);
        let up = omega.cos_theta();
        let above = smooth_step(up / 2f64.to_radians());
        let low = (1.0 - up.clamp(0.0, 1.0)).powi(4);
        let away = angle_between(omega.vector(), self.towards_sun.vector());
        let radius = 0.5 * spec.sun_diameter_deg.to_radians();
        let seen = smooth_step((radius - away) / spec.sun_edge_deg.to_radians());
        std::array::from_fn(|c| {
            let sky = zenith[c] + low * (horizon[c] - zenith[c]);
            above * (sky + seen * sun[c]) + (1.0 - above) * ground[c]
        })
    }
}
