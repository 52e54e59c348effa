//! Hybrid (Barla et al. 2015, after Stark et al. 2005): the projected half vector and the full
//! length of the back vector.
//!
//! |h_bar|, phi_h, |k|, phi_k (azimuth of k_bar); isotropic: |h_bar|, |k|, delta = phi_k − phi_h.
//! h_z = sqrt(1 − |k|² − |h_bar|²); theta_k = atan2(h_z, −|h_bar| cos delta); omega = h ± k.
//! The paper prints a tan⁻¹ that takes the other branch for half of all pairs (k changes sign and
//! the pair comes out swapped, harmless for a reciprocal BRDF only).
//! J = 4 |h_bar| |k| / (1 − |k|² − |h_bar|² sin² delta), in neither paper.
//! Ill-conditioned (floor about 3e-8 rad) where both directions are on the horizon.
//! Degenerate: phi_h at h_bar = 0, phi_k at k = 0.

use super::orthographic::{Orthographic, length, lengths_and_delta, polar};
use super::{Azimuth, Chart, Form, ParametrizationSpec, Quantity, Radial, entry};
use crate::geometry::half_and_back;
use crate::numeric::angles::{atan2, hypot, scale, sin_cos};
use crate::numeric::safe_sqrt;
use crate::registry::Entry;
use glam::{DVec3, Vec3Swizzles};

/// The hybrid chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hybrid;

/// The registry entry.
pub(super) const ENTRY: Entry<ParametrizationSpec> = entry::<Form<Hybrid>>(
    "projected half vector, full length of the back vector (Barla et al.)",
    &["", "warp = { h_bar = \"square-root\", k = \"arcsine\" }"],
);

/// What rounding may add to or take from h_z² = 1 − |k|² − |h_bar|²: a few ulp of 1, and a warp's
/// round trip. On the horizon, where h_z² itself is that small, it leaves h_z unknown to 4e-8.
const HEIGHT_SQUARED_SLACK: f64 = 2e-15;

impl Chart for Hybrid {
    const NAME: &'static str = "hybrid";
    const RADIAL: [Radial; 2] = [
        Orthographic::RADIAL[0],
        Radial::length("k", "|k|", Quantity::Length),
    ];
    const AZIMUTH: [Azimuth; 2] = Orthographic::AZIMUTH;
    const RELATIVE: Azimuth = Orthographic::RELATIVE;
    const EXCHANGE: bool = false;
    const NESTED: bool = false;
    const PEAK_AT_START: bool = true;

    #[inline(always)]
    fn absolute(directions: [DVec3; 2]) -> [f64; 4] {
        let (h, k) = half_and_back(directions);
        [
            length(hypot(h.x, h.y)),
            atan2(h.y, h.x),
            length(norm(k)),
            atan2(k.y, k.x),
        ]
    }

    #[inline(always)]
    fn relative(directions: [DVec3; 2]) -> [f64; 3] {
        let (h, k) = half_and_back(directions);
        lengths_and_delta(h.xy(), k.xy(), norm(k))
    }

    #[inline(always)]
    fn inverse([h_bar, phi_h, k_norm, phi_k]: [f64; 4]) -> ([DVec3; 2], bool) {
        // (1 − k)(1 + k) keeps the digits that 1 − k² loses near k = 1.
        let hz2 = (1.0 - k_norm) * (1.0 + k_norm) - h_bar * h_bar;
        // k ⟂ h: k̂ ∝ (h_z, −|h_bar| cos delta) in the plane of n and k_bar.
        let down = h_bar * sin_cos(phi_h - phi_k).1;
        // Both directions are above the horizon, so |k_z| = |k| |down| / sqrt(h_z² + down²) ≤ h_z: from this h_z on.
        let down_size = down.abs();
        let sum = down_size + hypot(down_size, 2.0 * k_norm);
        let lowest = k_norm * (2.0 * down_size / sum.max(f64::MIN_POSITIVE)).sqrt();
        // Refuse a point only if no h_z within rounding allows it. Written so that NaN fails.
        let highest = safe_sqrt(hz2 + HEIGHT_SQUARED_SLACK);
        let above = (hz2 >= -HEIGHT_SQUARED_SLACK) & (lowest <= highest + HEIGHT_SQUARED_SLACK);
        let h_z = safe_sqrt(hz2).max(lowest);
        let norm = hypot(h_z, down);
        // h_z = 0 and h_bar ⟂ k_bar, or h = 0: k lies in the tangent plane.
        let [sin_k, cos_k] = if norm == 0.0 {
            [1.0, 0.0]
        } else {
            [h_z / norm, -down / norm]
        };
        let k_z = (k_norm * cos_k).max(-h_z).min(h_z);
        let k_bar = k_norm * sin_k;
        let h = polar(h_bar, phi_h).extend(h_z);
        let k = polar(k_bar, phi_k).extend(k_z);
        ([h + k, h - k], above)
    }

    #[inline]
    fn jacobian([h_bar, phi_h, k_norm, phi_k]: [f64; 4]) -> f64 {
        let weight = 4.0 * h_bar * k_norm;
        // 0 · ∞ where a pole meets the horizon (k = 0 and h_bar = 1, or the reverse): 0.
        if weight == 0.0 {
            0.0
        } else {
            weight * inverse_height(h_bar, k_norm, phi_k - phi_h)
        }
    }
}

/// Length of a vector that may be tiny.
#[inline(always)]
fn norm(k: DVec3) -> f64 {
    let [up, down] = scale(k.abs().max_element());
    (k * up).length() * down
}

/// 1 / (1 − |k|² − |h_bar|² sin² delta), infinite on the edge of the domain and beyond.
#[inline]
pub(super) fn inverse_height(h_bar: f64, k_norm: f64, delta: f64) -> f64 {
    let s = h_bar * delta.sin();
    let d = (1.0 - k_norm) * (1.0 + k_norm) - s * s;
    if d > 0.0 { 1.0 / d } else { f64::INFINITY }
}
