//! Half/difference (Rusinkiewicz 1998): the half vector, and the light seen from it.
//!
//! theta_h, phi_h: spherical angles of h; theta_d, phi_d: those of omega_i in the frame of h,
//! d = rot(b, −theta_h) rot(n, −phi_h) omega_i (one transcription of Barla et al. prints the axes
//! swapped). J = 4 cos theta_d sin theta_h sin theta_d.
//!
//! theta_d = atan2(|k|, |h|), theta_h = atan2(|h_bar|, h_z) with h and k made orthogonal: acos of a
//! dot product would lose half the digits near retro-reflection and near the peak.
//! Degenerate: phi_h at theta_h = 0, phi_d at theta_d = 0; theta_d = 90° exactly has h = 0, where
//! the half vector is taken as the one closest to n.

use super::{Azimuth, Chart, Form, ParametrizationSpec, Quantity, Radial, entry};
use crate::geometry::half_and_back;
use crate::numeric::HORIZON_SLACK;
use crate::numeric::angles::{atan2, scale, sin_cos};
use crate::registry::Entry;
use glam::DVec3;

/// The half/difference chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct HalfDifference;

/// The registry entry.
pub(super) const ENTRY: Entry<ParametrizationSpec> = entry::<Form<HalfDifference>>(
    "angles of the half vector and of the light about it (Rusinkiewicz)",
    &[
        "",
        "warp = { theta_h = \"square-root\" }",
        "warp = { theta_h = \"merl\" }",
    ],
);

/// Half and back vector, the latter as seen from the former.
pub(crate) struct Frame {
    /// Azimuth of h: x and y of h, times any positive number.
    h_bar: [f64; 2],
    /// Angle (rad) of h to the normal.
    pub theta_h: f64,
    /// Angle (rad) of each direction to h.
    pub theta_d: f64,
    /// Components of k down the meridian of h and along its circle, times any positive number; where h is the normal,
    /// along t and b.
    pub k: [f64; 2],
}

impl Frame {
    /// Of ω_i and ω_o.
    #[inline(always)]
    pub fn new(directions: [DVec3; 2]) -> Self {
        let (h, k) = half_and_back(directions);
        // Opposite directions on the horizon: any h orthogonal to k is right.
        let opposed = h.x == 0.0 && h.y == 0.0 && h.z == 0.0;
        let instead = DVec3::Z - k * (k.z / k.length_squared());
        let [up, down] = if opposed {
            [1.0, 0.0]
        } else {
            scale(h.abs().max_element())
        };
        let h = if opposed { instead } else { h * up };
        let [k_up, k_down] = scale(k.abs().max_element());
        let k = k * k_up;
        let [bar_up, bar_down] = scale(h.x.abs().max(h.y.abs()));
        let (x, y) = (h.x * bar_up, h.y * bar_up);
        let bar_bar = x * x + y * y;
        let bar = bar_bar.sqrt();
        let h_bar = bar * bar_down;
        let h_len = (h_bar * h_bar + h.z * h.z).sqrt();
        let k_len = k.length();
        let at_normal = bar == 0.0;
        let (px, py) = if at_normal { (1.0, 0.0) } else { (x, y) };
        let along = k.x * px + k.y * py;
        Self {
            h_bar: [x, y],
            theta_h: atan2(h_bar, h.z),
            theta_d: atan2(k_len * k_down, h_len * down),
            k: [
                h.z * along - bar * h_bar * k.z,
                (px * k.y - py * k.x) * h_len,
            ],
        }
    }
}

impl Chart for HalfDifference {
    const NAME: &'static str = "half-difference";
    const RADIAL: [Radial; 2] = [
        Radial::angle("theta_h", "θ_h", Quantity::HalfAngle),
        Radial::angle("theta_d", "θ_d", Quantity::Angle),
    ];
    const AZIMUTH: [Azimuth; 2] = [Azimuth::new("phi_h", "φ_h"), Azimuth::new("phi_d", "φ_d")];
    const RELATIVE: Azimuth = Azimuth::new("phi_d", "φ_d");
    const EXCHANGE: bool = false;
    const NESTED: bool = true;
    const PEAK_AT_START: bool = true;
    const ROUND_TRIP: [f64; 2] = [2e-15; 2];
    const SINGULAR: bool = false;

    #[inline(always)]
    fn absolute(directions: [DVec3; 2]) -> [f64; 4] {
        let f = Frame::new(directions);
        let phi_h = atan2(f.h_bar[1], f.h_bar[0]);
        [f.theta_h, phi_h, f.theta_d, atan2(f.k[1], f.k[0])]
    }

    #[inline(always)]
    fn relative(directions: [DVec3; 2]) -> [f64; 3] {
        let f = Frame::new(directions);
        let phi_d = atan2(f.k[1], f.k[0]);
        // Where h is the normal the sample may be turned so that it is 0.
        let phi_d = if f.theta_h == 0.0 { 0.0 } else { phi_d };
        [f.theta_h, f.theta_d, phi_d]
    }

    #[inline(always)]
    fn inverse([theta_h, phi_h, theta_d, phi_d]: [f64; 4]) -> ([DVec3; 2], bool) {
        let (sh, ch) = sin_cos(theta_h);
        let (sd, cd) = sin_cos(theta_d);
        let (sf, cf) = sin_cos(phi_d);
        let (sp, cp) = sin_cos(phi_h);
        // h = cos theta_d · ĥ and k = sin theta_d · k̂ in the plane phi_h = 0, then turned about n.
        let turn = |x: f64, y: f64, z: f64| DVec3::new(cp * x - sp * y, sp * x + cp * y, z);
        let h = turn(cd * sh, 0.0, cd * ch);
        let k = turn(sd * cf * ch, sd * sf, -sd * cf * sh);
        above_horizon([h + k, h - k])
    }

    #[inline]
    fn jacobian([theta_h, _, theta_d, _]: [f64; 4]) -> f64 {
        4.0 * theta_d.cos() * theta_h.sin() * theta_d.sin()
    }
}

/// The directions, those within [`HORIZON_SLACK`] below the horizon put on it, and whether none was lower.
#[inline(always)]
fn above_horizon([mut i, mut o]: [DVec3; 2]) -> ([DVec3; 2], bool) {
    // Written so that NaN fails.
    let above = (i.z >= -HORIZON_SLACK) & (o.z >= -HORIZON_SLACK);
    i.z = i.z.max(0.0);
    o.z = o.z.max(0.0);
    ([i, o], above)
}
