//! Orthographic (Neumann et al. 1999; Barla et al. 2015): half and back vector projected on the
//! tangent plane, in polar coordinates.
//!
//! |h_bar|, phi_h, |k_bar|, phi_k; isotropic: |h_bar|, |k_bar|, delta = phi_k − phi_h.
//! omega_i = (h_bar + k_bar, sqrt(1 − |h_bar + k_bar|²)), omega_o likewise with h_bar − k_bar.
//! J = 4 |h_bar| |k_bar| / (cos theta_i cos theta_o): infinite on the horizon, where the square
//! root also makes the inverse ill-conditioned by definition (floor about 3e-8 rad).
//! Degenerate: phi_h at h_bar = 0, phi_k at k_bar = 0.

use super::{Azimuth, Chart, Form, ParametrizationSpec, Quantity, Radial, entry};
use crate::numeric::angles::{atan2, hypot, scale, sin_cos};
use crate::numeric::{HORIZON_SLACK, safe_sqrt};
use crate::registry::Entry;
use glam::{DVec2, DVec3, Vec3Swizzles};

/// The orthographic chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct Orthographic;

/// The registry entry.
pub(super) const ENTRY: Entry<ParametrizationSpec> = entry::<Form<Orthographic>>(
    "half and back vector projected on the tangent plane (Neumann)",
    &[
        "",
        "warp = { h_bar = \"square-root\", k_bar = \"arcsine\" }",
    ],
);

/// A length as a coordinate. No length here exceeds 1 on paper; of opposed directions on the horizon
/// |k| = 1 rounds to 1 + ulp, which would lie past the end of its axis. NaN stays NaN.
#[inline(always)]
pub(super) fn length(x: f64) -> f64 {
    x.clamp(0.0, 1.0)
}

/// `[|h_bar|, |other|, delta]`, delta the angle from h_bar to the projection of `k`.
#[inline(always)]
pub(super) fn lengths_and_delta(h: DVec2, k: DVec2, k_norm: f64) -> [f64; 3] {
    // The angle between vectors that were scaled is that between them.
    let [h_up, _] = scale(h.abs().max_element());
    let [k_up, _] = scale(k.abs().max_element());
    let (p, q) = (h * h_up, k * k_up);
    let delta = atan2(p.x * q.y - p.y * q.x, p.dot(q));
    [length(hypot(h.x, h.y)), length(k_norm), delta]
}

impl Chart for Orthographic {
    const NAME: &'static str = "orthographic";
    const RADIAL: [Radial; 2] = [
        Radial::length("h_bar", "|h\u{304}|", Quantity::Length),
        Radial::length("k_bar", "|k\u{304}|", Quantity::Length),
    ];
    const AZIMUTH: [Azimuth; 2] = [Azimuth::new("phi_h", "φ_h"), Azimuth::new("phi_k", "φ_k")];
    const RELATIVE: Azimuth = Azimuth::new("delta", "δ");
    const EXCHANGE: bool = false;
    const NESTED: bool = false;
    const PEAK_AT_START: bool = true;

    #[inline(always)]
    fn absolute([i, o]: [DVec3; 2]) -> [f64; 4] {
        let (h, k) = (0.5 * (i + o), 0.5 * (i - o));
        [
            length(hypot(h.x, h.y)),
            atan2(h.y, h.x),
            length(hypot(k.x, k.y)),
            atan2(k.y, k.x),
        ]
    }

    #[inline(always)]
    fn relative([i, o]: [DVec3; 2]) -> [f64; 3] {
        let (h, k) = (0.5 * (i.xy() + o.xy()), 0.5 * (i.xy() - o.xy()));
        lengths_and_delta(h, k, hypot(k.x, k.y))
    }

    #[inline(always)]
    fn inverse([h_bar, phi_h, k_bar, phi_k]: [f64; 4]) -> ([DVec3; 2], bool) {
        let (i, o) = projected(h_bar, phi_h, k_bar, phi_k);
        let (ii, oo) = (i.length_squared(), o.length_squared());
        let above = (ii <= 1.0 + HORIZON_SLACK) & (oo <= 1.0 + HORIZON_SLACK);
        let lifted = [i.extend(safe_sqrt(1.0 - ii)), o.extend(safe_sqrt(1.0 - oo))];
        (lifted, above)
    }

    #[inline]
    fn jacobian([h_bar, phi_h, k_bar, phi_k]: [f64; 4]) -> f64 {
        let (i, o) = projected(h_bar, phi_h, k_bar, phi_k);
        let cos_i = safe_sqrt(1.0 - i.length_squared());
        let cos_o = safe_sqrt(1.0 - o.length_squared());
        let weight = 4.0 * h_bar * k_bar;
        // 0/0 where an axis meets the horizon: the measure there is 0.
        if weight == 0.0 {
            0.0
        } else {
            weight / (cos_i * cos_o)
        }
    }
}

/// omega_i and omega_o projected on the tangent plane.
#[inline(always)]
fn projected(h_bar: f64, phi_h: f64, k_bar: f64, phi_k: f64) -> (DVec2, DVec2) {
    let h = polar(h_bar, phi_h);
    let k = polar(k_bar, phi_k);
    (h + k, h - k)
}

/// A tangent-plane vector from its polar coordinates.
#[inline(always)]
pub(super) fn polar(r: f64, phi: f64) -> DVec2 {
    let (s, c) = sin_cos(phi);
    DVec2::new(r * c, r * s)
}
