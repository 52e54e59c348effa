//! Directional albedo by a quadrature made for narrow lobes.
//!
//! a(ω_o) = ∫ f cos θ_i dω_i = ∫ f cos θ_i 4 (ω_o·h) dω_h,   ω_i = 2 (ω_o·h) h − ω_o.
//!
//! Over half vectors in polar coordinates (θ, φ) about the normal, φ counted from the view's
//! azimuth, a mirror-like peak sits at θ = 0 for every view, however stretched it is over ω_i. ω_i is above
//! the horizon for every φ while θ < θ_1 = (π/2 − θ_o)/2, on the arc |φ| < φ_m up to θ_2 = (π/2 + θ_o)/2, and
//! nowhere beyond:
//!
//! tan φ_m = sqrt(sin 2(θ − θ_1) sin 2(θ_2 − θ)) / (−cos 2θ cos θ_o),
//!
//! so that the domain is integrated exactly, without a step at the horizon inside any panel.
//! θ: Gauss–Legendre on panels that double in width from 1e-9 rad, away from the peak and from
//! θ_1 and θ_2, where φ_m has a square root. φ: equal steps on circles (spectral for a periodic function),
//! Gauss–Legendre on arcs. The error is estimated from a second, coarser rule.

use crate::brdf::{Brdf, Presence};
use crate::geometry::{Direction, DirectionPair};
use crate::sampling::gauss_legendre;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Directional albedo of one view.
#[derive(Clone, Copy, Debug)]
pub struct DirectionalAlbedo {
    /// Albedo of each channel; entries beyond the BRDF's channels are 0.
    pub value: [f64; 3],
    /// Difference from a coarser rule, the largest over channels: an upper estimate of the error.
    pub error: f64,
    /// Share of the cosine-weighted hemisphere without data, which counts as 0 in `value`.
    pub missing: f64,
}

impl DirectionalAlbedo {
    /// The largest channel.
    pub fn max(&self) -> f64 {
        self.value.into_iter().fold(0.0, f64::max)
    }
}

/// The largest directional albedo over some views.
#[derive(Clone, Copy, Debug)]
pub struct MaxAlbedo {
    /// The view.
    pub omega_o: Direction,
    /// Its albedo.
    pub albedo: DirectionalAlbedo,
}

/// Elevations 0°, 15°, … 85° and 89°, where models that gain energy show it; an anisotropic
/// BRDF is seen along t, along b and between.
pub fn standard_views(isotropic: bool) -> Vec<Direction> {
    const THETA_DEG: [f64; 10] = [0.0, 15.0, 30.0, 45.0, 55.0, 65.0, 75.0, 80.0, 85.0, 89.0];
    let azimuths: &[f64] = if isotropic {
        &[0.0]
    } else {
        &[0.0, 35.0, 90.0]
    };
    let view = |&phi: &f64| {
        THETA_DEG.map(|theta| Direction::from_spherical(theta.to_radians(), phi.to_radians()))
    };
    azimuths.iter().flat_map(view).collect()
}

/// The view with the largest albedo in any channel; `None` if there is no view.
pub fn max_albedo(brdf: &dyn Brdf, views: &[Direction]) -> Option<MaxAlbedo> {
    let albedos = views.iter().map(|&omega_o| MaxAlbedo {
        omega_o,
        albedo: directional_albedo(brdf, omega_o),
    });
    albedos.max_by(|a, b| a.albedo.max().total_cmp(&b.albedo.max()))
}

/// Directional albedo seen from `omega_o`; 0 from below the horizon.
///
/// ```
/// use gonio::brdf::{laws, Channels, Lambert, Spectrum};
/// use gonio::geometry::Direction;
/// let white = Lambert::new(Spectrum::Grey(0.8), Channels::Luminance);
/// let albedo = laws::directional_albedo(&white, Direction::from_spherical(1.2, 0.0));
/// assert!((albedo.value[0] - 0.8).abs() < 1e-10);
/// ```
pub fn directional_albedo(brdf: &dyn Brdf, omega_o: Direction) -> DirectionalAlbedo {
    if omega_o.cos_theta() <= 0.0 {
        return DirectionalAlbedo {
            value: [0.0; 3],
            error: 0.0,
            missing: 0.0,
        };
    }
    let fine = integrate(brdf, omega_o, 10, 96);
    let coarse = integrate(brdf, omega_o, 7, 64);
    let error = fine.value.iter().zip(coarse.value);
    DirectionalAlbedo {
        error: error.fold(0.0, |e, (a, b)| e.max((a - b).abs())),
        ..fine
    }
}

/// One rule: `nodes` per panel of θ, `turns` per circle or arc.
fn integrate(brdf: &dyn Brdf, omega_o: Direction, nodes: usize, turns: usize) -> DirectionalAlbedo {
    let channels = brdf.channels().count();
    let (theta_o, phi_o) = (omega_o.theta(), omega_o.phi());
    let cos_o = omega_o.cos_theta();
    let [theta_1, theta_2] = [-theta_o, theta_o].map(|t| 0.5 * (FRAC_PI_2 + t));
    let (rule, arc) = (gauss_legendre(nodes), gauss_legendre(turns));
    let mut total = [0.0; 3];
    let (mut weight_total, mut weight_missing) = (0.0, 0.0);
    let mut pairs = Vec::with_capacity(turns);
    let mut weights = Vec::with_capacity(turns);
    let mut values = vec![0.0; turns * channels];
    let mut presence = vec![Presence::Present; turns];

    for (lo, hi) in panels(theta_1, theta_2) {
        for &(x, w) in &rule {
            let theta = 0.5 * ((hi - lo) * x + (hi + lo));
            let w_theta = 0.5 * (hi - lo) * w;
            let (sin, cos) = theta.sin_cos();
            pairs.clear();
            weights.clear();
            let mut add = |phi: f64, w_phi: f64| {
                let (s, c) = (phi_o + phi).sin_cos();
                let h = DVec3::new(sin * c, sin * s, cos);
                let cos_d = omega_o.vector().dot(h);
                // A node within rounding of the horizon may fall below it, with weight 0.
                if let Some(omega_i) = Direction::try_new(2.0 * cos_d * h - omega_o.vector()) {
                    pairs.push(DirectionPair::new(omega_i, omega_o));
                    let cos_i = omega_i.cos_theta().max(0.0);
                    weights.push(w_theta * w_phi * sin * 4.0 * cos_d * cos_i);
                }
            };
            if theta < theta_1 {
                let step = TAU / turns as f64;
                (0..turns).for_each(|k| add(step * (k as f64 + 0.5), step));
            } else {
                let root = (2.0 * (theta - theta_1)).sin() * (2.0 * (theta_2 - theta)).sin();
                let half = root.max(0.0).sqrt().atan2(-(2.0 * theta).cos() * cos_o);
                arc.iter().for_each(|&(x, w)| add(half * x, half * w));
            }
            let n = pairs.len();
            brdf.eval_batch(&pairs, &mut values[..n * channels], &mut presence[..n]);
            for ((w, values), presence) in weights
                .iter()
                .zip(values.chunks_exact(channels))
                .zip(&presence)
            {
                weight_total += w;
                match presence {
                    Presence::Present => {
                        for (total, value) in total.iter_mut().zip(values) {
                            *total += w * value;
                        }
                    }
                    Presence::Missing => weight_missing += w,
                }
            }
        }
    }
    DirectionalAlbedo {
        value: total,
        error: 0.0,
        missing: weight_missing / weight_total,
    }
}

/// Panels of θ that double in width away from 0, θ_1 and θ_2.
fn panels(theta_1: f64, theta_2: f64) -> Vec<(f64, f64)> {
    /// Narrower than the peak of any allowed roughness by a factor of a thousand.
    const FIRST: f64 = 1e-9;
    let mut edges = vec![0.0];
    let mut x = FIRST;
    while x < theta_1 {
        edges.push(x);
        x *= 2.0;
    }
    edges.push(theta_1);
    let half = 0.5 * (theta_2 - theta_1);
    let mut offsets = Vec::new();
    let mut x = FIRST;
    while x < half {
        offsets.push(x);
        x *= 2.0;
    }
    edges.extend(offsets.iter().map(|x| theta_1 + x));
    if half > 0.0 {
        edges.push(theta_1 + half);
    }
    edges.extend(offsets.iter().rev().map(|x| theta_2 - x));
    edges.push(theta_2);
    let panels = edges.windows(2).map(|w| (w[0], w[1]));
    panels.filter(|(lo, hi)| lo < hi).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_cover_the_range_once() {
        for theta_o in [0.0, 1e-12, 0.3, 1.4, FRAC_PI_2 - 1e-10] {
            let (a, b) = (0.5 * (FRAC_PI_2 - theta_o), 0.5 * (FRAC_PI_2 + theta_o));
            let panels = panels(a, b);
            assert_eq!(panels[0].0, 0.0);
            assert_eq!(panels[panels.len() - 1].1, b);
            assert!(panels.windows(2).all(|w| w[0].1 == w[1].0));
            // No panel straddles the end of the full circles.
            assert!(panels.iter().all(|&(lo, hi)| hi <= a || lo >= a));
        }
    }
}
