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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::testing::goodness;
    use crate::sampling::{Random, gauss_legendre};

    /// ∫ pdf sin θ dθ dφ over an annulus, in the logarithm of θ.
    fn integral(pdf: &dyn Fn(Direction) -> f64, lo: f64, hi: f64) -> f64 {
        let half = 0.5 * (hi / lo).ln();
        gauss_legendre(40)
            .into_iter()
            .map(|(x, weight)| {
                let theta = lo * (half * (1.0 + x)).exp();
                let density = pdf(Direction::from_spherical(theta, 0.7));
                weight * half * theta * density * theta.sin() * TAU
            })
            .sum()
    }

    /// Compares a warp, whose peak is `width` rad wide, with its density.
    fn check(warp: impl Fn([f64; 2]) -> Direction, pdf: &dyn Fn(Direction) -> f64, width: f64) {
        // Annuli whose edges double, from well inside the peak to the horizon.
        let mut edges = vec![1e-6 * width];
        edges.extend(
            (0..)
                .map(|i| 0.1 * width * 1.3_f64.powi(i))
                .take_while(|e| *e < 1.5),
        );
        edges.push(std::f64::consts::FRAC_PI_2);
        let shares: Vec<f64> = edges
            .windows(2)
            .map(|w| integral(pdf, w[0], w[1]))
            .collect();
        let total: f64 = shares.iter().sum();
        assert!((total - 1.0).abs() < 1e-9, "{width}: {total}");

        // 16 sectors of every annulus that expects enough draws; the rest of it all is one bin.
        const SECTORS: usize = 16;
        let n = 200_000;
        let random = Random::new(4);
        let mut observed = vec![0_u64; shares.len() * SECTORS];
        for i in 0..n {
            let omega = warp(random.point(i));
            assert!((omega.vector().length() - 1.0).abs() < 4e-16);
            let ring = edges[1..edges.len() - 1].partition_point(|e| *e <= omega.theta());
            let turn = (omega.phi() / TAU).rem_euclid(1.0);
            observed[ring * SECTORS + (turn * SECTORS as f64) as usize % SECTORS] += 1;
        }
        let expected = |bin: usize| shares[bin / SECTORS] * n as f64 / SECTORS as f64;
        let (mut counts, mut wanted) = (vec![0], vec![0.0]);
        for (bin, count) in observed.into_iter().enumerate() {
            if expected(bin) >= 5.0 {
                counts.push(count);
                wanted.push(expected(bin));
            } else {
                counts[0] += count;
                wanted[0] += expected(bin);
            }
        }
        if wanted[0] < 5.0 {
            counts.remove(0);
            wanted.remove(0);
        }
        let p = goodness(&counts, &wanted);
        assert!(p > 1e-3, "{width}: p = {p}, {} bins", counts.len());
    }

    #[test]
    fn samples_follow_their_densities() {
        check(cosine_hemisphere, &cosine_hemisphere_pdf, 1.0);
        for alpha in [1.0, 0.3, 0.01, 1e-4] {
            let pdf = |h| ggx_half_vector_pdf(alpha, h);
            check(|u| ggx_half_vector(alpha, u), &pdf, alpha);
        }
    }

    #[test]
    fn the_ends_of_the_square_are_the_pole_and_the_horizon() {
        let last = 1.0 - f64::EPSILON / 2.0;
        for u1 in [0.0, 0.5, last] {
            assert_eq!(cosine_hemisphere([0.0, u1]).cos_theta(), 1.0);
            assert_eq!(cosine_hemisphere([0.0, u1]).sin_theta(), 0.0);
            // Still above the horizon, by the square root of the last step.
            let grazing = cosine_hemisphere([last, u1]).cos_theta();
            assert!((grazing / 1.053_671_212_772_351e-8 - 1.0).abs() < 1e-12);
            for alpha in [1.0, 0.01, 1e-6] {
                assert_eq!(ggx_half_vector(alpha, [0.0, u1]).cos_theta(), 1.0);
                let h = ggx_half_vector(alpha, [last, u1]);
                assert!(h.cos_theta() > 0.0 && (h.vector().length() - 1.0).abs() < 4e-16);
            }
        }
    }

    #[test]
    fn densities_are_zero_below_the_horizon() {
        let below = Direction::from_spherical(2.0, 0.3);
        assert_eq!(cosine_hemisphere_pdf(below), 0.0);
        assert_eq!(ggx_half_vector_pdf(0.1, below), 0.0);
    }
}
