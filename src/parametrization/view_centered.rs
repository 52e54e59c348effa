//! The chart of a BRDF slice at fixed view (Zubiaga et al. 2015, Eq. 4): poles orthogonal to the
//! plane of incidence.
//!
//! m(θ, φ) = (sin θ cos φ, sin φ, cos θ cos φ), θ and φ in [−π/2, π/2]. φ is the angle out of the
//! plane of incidence, θ the angle from the normal in it. The view is omega_o = m(θ_o, 0), and
//! the mirror direction m(−θ_o, 0). dω = cos φ dθ dφ, ω·n = cos θ cos φ.
//!
//! Unlike the parametrizations of [`all`](super::all) this charts one direction, not a pair, so it
//! is no member of that list.

use crate::geometry::Direction;
use glam::DVec3;
use std::f64::consts::PI;

/// Area of the chart's square, π² rad².
pub const VIEW_CENTERED_AREA: f64 = PI * PI;

/// The direction at angles θ and φ (rad).
///
/// ```
/// use gonio::parametrization::{view_centered, view_centered_angles};
/// let [theta, phi] = view_centered_angles(view_centered(-0.4, 1.1));
/// assert!((theta + 0.4).abs() < 1e-15 && (phi - 1.1).abs() < 1e-15);
/// ```
#[inline]
pub fn view_centered(theta: f64, phi: f64) -> Direction {
    let (st, ct) = theta.sin_cos();
    let (sp, cp) = phi.sin_cos();
    Direction::from_unit(DVec3::new(st * cp, sp, ct * cp))
}

/// θ and φ (rad) of a direction: θ in [−π, π], beyond ±π/2 below the horizon; at the poles
/// φ = ±π/2, where every θ is right, θ is 0.
#[inline]
pub fn view_centered_angles(direction: Direction) -> [f64; 2] {
    let v = direction.vector();
    // `+ 0.0` turns −0 into +0: the angle of (±0, −0) would be ±π.
    let theta = (v.x + 0.0).atan2(v.z + 0.0);
    [theta, v.y.atan2(v.x.hypot(v.z))]
}
