//! Warps of the unit square onto the hemisphere, each with its density.

use crate::geometry::Direction;
use glam::DVec3;
use std::f64::consts::{FRAC_1_PI, TAU};

/// A cosine-distributed direction from two numbers in `[0, 1)`.
#[inline]
pub fn cosine_hemisphere(u: [f64; 2]) -> Direction {
    let (s, c) = (TAU * u[1]).sin_cos();
    // sin²θ = u, cos²θ = 1 − u: no cancellation at either end.
    let (sin, cos) = (u[0].sqrt(), (1.0 - u[0]).sqrt());
    Direction::from_unit(DVec3::new(sin * c, sin * s, cos))
}

/// Density of [`cosine_hemisphere`], per steradian: cos θ/π, 0 below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(omega: Direction) -> f64 {
    omega.cos_theta().max(0.0) * FRAC_1_PI
}

/// A microfacet normal with density D(θ_h) cos θ_h of isotropic GGX (Walter et al. 2007, eq. 35),
/// from two numbers in `[0, 1)`.
#[inline]
pub fn ggx_half_vector(alpha: f64, u: [f64; 2]) -> Direction {
    let (s, c) = (TAU * u[1]).sin_cos();
    // tan²θ = α² u/(1 − u), written with sin² and cos² so that it stays exact near the peak.
    let denominator = (1.0 - u[0]) + alpha * alpha * u[0];
    let sin = alpha * (u[0] / denominator).sqrt();
    let cos = ((1.0 - u[0]) / denominator).sqrt();
    Direction::from_unit(DVec3::new(sin * c, sin * s, cos))
}

/// Density of [`ggx_half_vector`], per steradian of the normal.
#[inline]
pub fn ggx_half_vector_pdf(alpha: f64, normal: Direction) -> f64 {
    let v = normal.vector();
    let (sin2, cos) = (v.x * v.x + v.y * v.y, v.z.max(0.0));
    let a2 = alpha * alpha;
    let d = sin2 + a2 * cos * cos;
    a2 * cos * FRAC_1_PI / (d * d)
}
