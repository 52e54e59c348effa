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

use super::spherical::azimuth;
use super::{Azimuth, Chart, Form, ParametrizationSpec, Quantity, Radial, Unit, entry};
use crate::geometry::{Direction, DirectionPair};
use crate::numeric::HORIZON_SLACK;
use crate::registry::Entry;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

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

/// What both forms of the chart need of a pair.
struct Split {
    h: DVec3,
    h_bar: f64,
    theta_h: f64,
    theta_d: f64,
    phi_d: f64,
}

impl HalfDifference {
    /// `isotropic`: phi_d is 0 where the half vector is the normal, because the sample may be
    /// turned so; otherwise it is measured from t there.
    #[inline]
    fn split(pair: &DirectionPair, isotropic: bool) -> Split {
        let (mut h, k) = pair.half_and_back();
        if h == DVec3::ZERO {
            // Opposite directions on the horizon: any h orthogonal to k is right.
            let kk = k.length_squared();
            h = (DVec3::Z - k * (k.z / kk)) * 1e-200;
        }
        // hypot, not sqrt(x² + y²): h may be as small as the last bit of 1 or smaller.
        let h_bar = h.x.hypot(h.y);
        let h_len = h_bar.hypot(h.z);
        let k_len = k.length();
        let theta_h = h_bar.atan2(h.z);
        let theta_d = k_len.atan2(h_len);
        // Components of k along the frame of h: e1 points down the meridian, e2 along the circle.
        let (px, py) = if h_bar > 0.0 {
            (h.x / h_bar, h.y / h_bar)
        } else {
            (1.0, 0.0)
        };
        let along = k.x * px + k.y * py;
        let e1 = (h.z * along - h_bar * k.z) / h_len;
        let e2 = px * k.y - py * k.x;
        let phi_d = if k_len == 0.0 || (isotropic && h_bar == 0.0) {
            0.0
        } else {
            azimuth(e2, e1)
        };
        Split {
            h,
            h_bar,
            theta_h,
            theta_d,
            phi_d,
        }
    }
}

impl Chart for HalfDifference {
    const NAME: &'static str = "half-difference";
    const RADIAL: [Radial; 2] = [
        Radial {
            symbol: "theta_h",
            label: "θ_h",
            unit: Unit::Radian,
            max: FRAC_PI_2,
            quantity: Quantity::HalfAngle,
        },
        Radial {
            symbol: "theta_d",
            label: "θ_d",
            unit: Unit::Radian,
            max: FRAC_PI_2,
            quantity: Quantity::Angle,
        },
    ];
    const AZIMUTH: [Azimuth; 2] = [
        Azimuth {
            symbol: "phi_h",
            label: "φ_h",
        },
        Azimuth {
            symbol: "phi_d",
            label: "φ_d",
        },
    ];
    const RELATIVE: Azimuth = Azimuth {
        symbol: "phi_d",
        label: "φ_d",
    };
    const EXCHANGE: bool = false;
    const NESTED: bool = true;
    const PEAK_AT_START: bool = true;
    const ROUND_TRIP: [f64; 2] = [2e-15; 2];
    const SINGULAR: bool = false;

    #[inline]
    fn absolute(&self, pair: &DirectionPair) -> [f64; 4] {
        let s = Self::split(pair, false);
        let phi_h = if s.h_bar > 0.0 {
            azimuth(s.h.y, s.h.x)
        } else {
            0.0
        };
        [s.theta_h, phi_h, s.theta_d, s.phi_d]
    }

    #[inline]
    fn relative(&self, pair: &DirectionPair) -> [f64; 3] {
        let s = Self::split(pair, true);
        [s.theta_h, s.theta_d, s.phi_d]
    }

    #[inline]
    fn inverse(&self, [theta_h, phi_h, theta_d, phi_d]: [f64; 4]) -> Option<DirectionPair> {
        let (sh, ch) = theta_h.sin_cos();
        let (sd, cd) = theta_d.sin_cos();
        let (sf, cf) = phi_d.sin_cos();
        let (sp, cp) = phi_h.sin_cos();
        // h = cos theta_d · ĥ and k = sin theta_d · k̂ in the plane phi_h = 0, then turned about n.
        let turn = |x: f64, y: f64, z: f64| DVec3::new(cp * x - sp * y, sp * x + cp * y, z);
        let h = turn(cd * sh, 0.0, cd * ch);
        let k = turn(sd * cf * ch, sd * sf, -sd * cf * sh);
        above_horizon(h + k, h - k, HORIZON_SLACK)
    }

    #[inline]
    fn jacobian(&self, [theta_h, _, theta_d, _]: [f64; 4]) -> f64 {
        4.0 * theta_d.cos() * theta_h.sin() * theta_d.sin()
    }
}

/// The pair if both directions are above the horizon; within `slack` below it they are put on it.
#[inline]
pub(super) fn above_horizon(
    mut omega_i: DVec3,
    mut omega_o: DVec3,
    slack: f64,
) -> Option<DirectionPair> {
    // Written so that NaN fails.
    if !(omega_i.z >= -slack && omega_o.z >= -slack) {
        return None;
    }
    omega_i.z = omega_i.z.max(0.0);
    omega_o.z = omega_o.z.max(0.0);
    Some(DirectionPair::new(
        Direction::from_unit(omega_i),
        Direction::from_unit(omega_o),
    ))
}
