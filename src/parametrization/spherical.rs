//! Spherical: elevation and azimuth of each direction.
//!
//! theta_i, phi_i, theta_o, phi_o (rad); isotropic: theta_i, theta_o and the signed
//! delta_phi = phi_i − phi_o. Elevations in [0, π/2]. J = sin theta_i sin theta_o.
//! Degenerate: phi at theta = 0. Every point of the box is above the horizon.

use super::{Azimuth, Chart, Form, ParametrizationSpec, Quantity, Radial, entry};
use crate::numeric::angles::{atan2, hypot, scale, sin_cos};
use crate::registry::Entry;
use glam::{DVec3, Vec3Swizzles};

/// The spherical chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spherical;

/// The registry entry.
pub(super) const ENTRY: Entry<ParametrizationSpec> = entry::<Form<Spherical>>(
    "elevation and azimuth of each direction",
    &[
        "",
        "warp = { theta_i = { kind = \"power\", exponent = 0.7 } }",
    ],
);

impl Chart for Spherical {
    const NAME: &'static str = "spherical";
    const RADIAL: [Radial; 2] = [
        Radial::angle("theta_i", "θ_i", Quantity::Angle),
        Radial::angle("theta_o", "θ_o", Quantity::Angle),
    ];
    const AZIMUTH: [Azimuth; 2] = [Azimuth::new("phi_i", "φ_i"), Azimuth::new("phi_o", "φ_o")];
    const RELATIVE: Azimuth = Azimuth::new("delta_phi", "Δφ");
    const LIFTED: [&'static str; 2] = ["Δφ", "φ_o"];
    const EXCHANGE: bool = true;
    const NESTED: bool = false;
    const PEAK_AT_START: bool = false;
    const ROUND_TRIP: [f64; 2] = [2e-15; 2];
    const SINGULAR: bool = false;
    const RADIAL_DENSITY: f64 = 1.0;

    #[inline(always)]
    fn absolute([i, o]: [DVec3; 2]) -> [f64; 4] {
        [elevation(i), atan2(i.y, i.x), elevation(o), atan2(o.y, o.x)]
    }

    #[inline(always)]
    fn relative([i, o]: [DVec3; 2]) -> [f64; 3] {
        // One angle of cross and dot: subtracting two azimuths would lose digits near ±π. Vectors that were scaled
        // have the angle between them, and products that do not vanish.
        let [p, q] = [i, o].map(|v| v.xy() * scale(v.x.abs().max(v.y.abs()))[0]);
        [elevation(i), elevation(o), atan2(q.perp_dot(p), p.dot(q))]
    }

    #[inline(always)]
    fn inverse([theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> ([DVec3; 2], bool) {
        let at = |theta, phi| {
            let (st, ct) = sin_cos(theta);
            let (sp, cp) = sin_cos(phi);
            DVec3::new(st * cp, st * sp, ct)
        };
        ([at(theta_i, phi_i), at(theta_o, phi_o)], true)
    }

    #[inline]
    fn lift([theta_i, theta_o, delta]: [f64; 3]) -> [f64; 4] {
        [theta_i, delta, theta_o, 0.0]
    }

    #[inline]
    fn jacobian([theta_i, _, theta_o, _]: [f64; 4]) -> f64 {
        theta_i.sin() * theta_o.sin()
    }
}

/// Angle (rad) of a unit vector to the normal, accurate near it and near the horizon.
#[inline(always)]
fn elevation(v: DVec3) -> f64 {
    atan2(hypot(v.x, v.y), v.z)
}
