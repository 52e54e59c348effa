//! Directional albedo at eight elevations, and its error.
//!
//! a(θ_o) = ∫ f_r(omega_i, omega_o) cos θ_i dω_i over the hemisphere of omega_i, dimensionless, in
//! [0, 1] for a BRDF that conserves energy; θ_o = 0, 15, 30, 45, 55, 65, 75, 80°, φ_o = 0 (an
//! anisotropic BRDF is seen along its t axis only).
//!
//! # The quadrature
//! One deterministic product rule for truth and reconstruction. It integrates over the half
//! vector, because there a glossy lobe stays centred on the normal and keeps its shape whatever
//! the view: omega_i = 2 (omega_o·ĥ) ĥ − omega_o, dω_i = 4 (omega_o·ĥ) sin θ_h dθ_h dφ_h.
//!
//! - omega_i is above the horizon for cos φ_h > −cot θ_o cot 2θ_h: the full circle up to
//!   θ_h = (90° − θ_o)/2, from there to (90° + θ_o)/2 the arc |φ_h| < φ_max with
//!   tan²(φ_max/2) = cos(2θ_h − θ_o) / −cos(2θ_h + θ_o).
//! - θ_h = a sinh x: uniform near the normal, logarithmic beyond a; in x a GGX or Beckmann lobe of
//!   any roughness above a has the same width of order 1. Gauss–Legendre on either side of
//!   (90° − θ_o)/2; on the outer side x follows the sine of the node, because φ_max leaves 180°
//!   and reaches 0 like a square root.
//! - φ_h: equal steps on the circle (spectral), Gauss–Legendre on the arc. The circle starts a
//!   quarter step from the plane of incidence, so that the mirror images of the nodes fall
//!   between them: for a BRDF that is symmetric about that plane it counts as twice the nodes.
//!
//! # Accuracy
//! Relative, the worst of the eight views, against adaptive quadrature in omega_i
//! (`tests/albedo.rs`):
//!
//! | BRDF | error |
//! |---|---|
//! | Lambert | 1e-13 |
//! | GGX, alpha 0.01 to 0.5 | 3e-7 |
//! | Beckmann, alpha 0.1 and 0.01 | 3e-7, 1.4e-5 |
//! | Ward, alpha 0.5 and 0.01 | 2e-6, 1.4e-5 |
//! | Phong, exponent 1 to 100, 10 000 | 1e-8, 8e-6 |
//! | Oren–Nayar, σ = 30° and 90°, the model with a kink | 1.6e-4, 2.5e-4 |
//!
//! A narrow lobe elsewhere than around the mirror direction (retro-reflection) is only seen with
//! the resolution of the outer nodes, some 3°, and a lobe that is narrow along one tangent axis only
//! with that of the nodes in φ_h, 6°: [`crate::brdf::laws::directional_albedo`] finds both. So the error is taken
//! twice, the second time with half of the nodes along each axis: their difference is reported beside it.

use super::{Quantity, Values, evaluate, sum::Sum};
use crate::brdf::Brdf;
use crate::geometry::{Direction, DirectionPair};
use crate::sampling::gauss_legendre;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Scale of θ_h (rad) below which nodes are uniform, 0.29°: half the narrowest lobe aimed at.
const CORE: f64 = 0.005;
/// Nodes along the axes of a rule.
#[derive(Clone, Copy, Debug)]
struct Nodes {
    /// In θ_h on full circles.
    circles: usize,
    /// In θ_h on arcs, where lobes are wide but a BRDF may have kinks.
    arcs: usize,
    /// In φ_h for each θ_h.
    phi: usize,
}

/// The rule that albedos are integrated with, and a coarser one for their errors.
const RULES: [Nodes; 2] = [Nodes::over(1), Nodes::over(2)];
/// Numbers of the two.
const FINE: usize = 0;
const COARSE: usize = 1;

impl Nodes {
    const fn over(divisor: usize) -> Self {
        Self {
            circles: 24 / divisor,
            arcs: 48 / divisor,
            phi: 56 / divisor,
        }
    }

    /// Pairs of a view.
    const fn per_view(self) -> usize {
        (self.circles + self.arcs) * self.phi
    }
}

/// The fixed pairs at which directional albedos are taken.
///
/// ```
/// use gonio::brdf::{Channels, Lambert, Spectrum};
/// use gonio::metrics::AlbedoProbe;
/// let probe = AlbedoProbe::new();
/// let [truth, darker] = [0.8, 0.6].map(|albedo| {
///     probe.evaluate(&Lambert::new(Spectrum::Grey(albedo), Channels::Luminance))
/// });
/// assert!((probe.albedos(&truth, &truth)[3] - 0.8).abs() < 1e-8);
/// assert!((probe.error(&truth, &darker).unwrap() - 0.25).abs() < 1e-12);
/// ```
#[derive(Clone, Debug)]
pub struct AlbedoProbe {
    /// View after view of the fine rule, then of the coarse one.
    pairs: Vec<DirectionPair>,
    /// cos θ_i dω_i (sr) of each pair.
    weights: Vec<f64>,
}

impl AlbedoProbe {
    /// θ_o of the views, degrees.
    pub const VIEWS_DEG: [f64; 8] = [0.0, 15.0, 30.0, 45.0, 55.0, 65.0, 75.0, 80.0];

    /// The quantity that [`error`](Self::error) returns.
    pub(crate) const QUANTITY: Quantity = Quantity::real(
        "albedo",
        "mean relative error of the directional albedo at eight theta_o from 0 to 80°, if `quantities` asks for it; the same for every measure",
    );

    /// The quantity that [`error_and_quadrature`](Self::error_and_quadrature) returns beside it.
    pub(crate) const QUADRATURE: Quantity = Quantity::real(
        "albedo_se",
        "mean over the views of what albedo differs by with half of the nodes along each axis of its quadrature",
    );

    /// Lays out the pairs: some milliseconds and 2 MB, once per program.
    pub fn new() -> Self {
        let pairs = Self::before(RULES.len());
        let mut probe = Self {
            pairs: Vec::with_capacity(pairs),
            weights: Vec::with_capacity(pairs),
        };
        for nodes in RULES {
            for view in Self::VIEWS_DEG {
                probe.add_view(view.to_radians(), nodes);
            }
        }
        probe
    }

    /// The pairs, for those who evaluate them elsewhere.
    pub fn pairs(&self) -> &[DirectionPair] {
        &self.pairs
    }

    /// Values of a BRDF at the fixed pairs, in parallel.
    pub fn evaluate(&self, brdf: &dyn Brdf) -> Values {
        evaluate(brdf, &self.pairs)
    }

    /// Directional albedos of `values`, one per view.
    ///
    /// Pairs that are missing in either list are left out and count as black, so that both are compared over the same part of
    /// the hemisphere; pass the same values twice for the albedo by itself.
    ///
    /// # Panics
    /// If the values belong to other pairs (lengths differ).
    pub fn albedos(&self, values: &Values, other: &Values) -> [f64; 8] {
        self.by(FINE, values, other)
    }

    /// Pairs of the rules before one.
    fn before(rule: usize) -> usize {
        let of_a_view: usize = RULES[..rule].iter().map(|nodes| nodes.per_view()).sum();
        Self::VIEWS_DEG.len() * of_a_view
    }

    fn by(&self, rule: usize, values: &Values, other: &Values) -> [f64; 8] {
        assert_eq!(self.pairs.len(), values.luminance.len());
        assert_eq!(self.pairs.len(), other.luminance.len());
        let (first, of_a_view) = (Self::before(rule), RULES[rule].per_view());
        std::array::from_fn(|view| {
            let mut sum = Sum::default();
            let start = first + view * of_a_view;
            for i in start..start + of_a_view {
                if let (Some(value), Some(_)) = (values.get(i), other.get(i)) {
                    sum.add(self.weights[i] * value);
                }
            }
            sum.value()
        })
    }

    /// Mean over the views of |a_g − a_f| / a_f; views where the truth is black or has no data are
    /// left out, `None` if that leaves none.
    ///
    /// # Panics
    /// If the values belong to other pairs (lengths differ).
    pub fn error(&self, truth: &Values, reconstruction: &Values) -> Option<f64> {
        mean(self.errors(FINE, truth, reconstruction))
    }

    /// [`error`](Self::error), and the mean over the views of what its terms change by with half of the nodes along each axis.
    ///
    /// # Panics
    /// If the values belong to other pairs (lengths differ).
    pub fn error_and_quadrature(
        &self,
        truth: &Values,
        reconstruction: &Values,
    ) -> Option<[f64; 2]> {
        let [fine, coarse] = [FINE, COARSE].map(|rule| self.errors(rule, truth, reconstruction));
        let off = std::array::from_fn(|i| Some((fine[i]? - coarse[i]?).abs()));
        Some([mean(fine)?, mean(off)?])
    }

    /// |a_g − a_f| / a_f of each view by a rule, `None` where the truth is black or has no data.
    fn errors(&self, rule: usize, truth: &Values, reconstruction: &Values) -> [Option<f64>; 8] {
        let a_f = self.by(rule, truth, reconstruction);
        let a_g = self.by(rule, reconstruction, truth);
        std::array::from_fn(|i| (a_f[i] > 0.0).then(|| (a_g[i] - a_f[i]).abs() / a_f[i]))
    }

    fn add_view(&mut self, theta_o: f64, nodes: Nodes) {
        let core = |theta: f64| (theta / CORE).asinh();
        let (inner, outer) = (
            core(0.5 * (FRAC_PI_2 - theta_o)),
            core(0.5 * (FRAC_PI_2 + theta_o)),
        );
        // At normal incidence there are no arcs: all nodes go inside.
        let (circles, arcs) = match theta_o == 0.0 {
            true => (nodes.circles + nodes.arcs, 0),
            false => (nodes.circles, nodes.arcs),
        };
        let arc = gauss_legendre(nodes.phi);
        for (x, weight) in between(0.0, inner, circles) {
            for j in 0..nodes.phi {
                let phi = TAU * (j as f64 + 0.25) / nodes.phi as f64;
                self.add(theta_o, x, phi, weight * TAU / nodes.phi as f64);
            }
        }
        for (s, weight) in between(-FRAC_PI_2, FRAC_PI_2, arcs) {
            // x runs over the outer interval like sin s: quadratic at both ends.
            let half = 0.5 * (outer - inner);
            let x = inner + half * (1.0 + s.sin());
            let weight = weight * half * s.cos();
            let theta_h = CORE * x.sinh();
            // Both are positive strictly inside this interval.
            let phi_max = 2.0
                * (2.0 * theta_h - theta_o)
                    .cos()
                    .sqrt()
                    .atan2((-(2.0 * theta_h + theta_o).cos()).sqrt());
            for &(t, arc_weight) in &arc {
                self.add(theta_o, x, t * phi_max, weight * arc_weight * phi_max);
            }
        }
    }

    /// Adds a node; `weight` is dx dφ_h.
    fn add(&mut self, theta_o: f64, x: f64, phi_h: f64, weight: f64) {
        let theta_h = CORE * x.sinh();
        let omega_o = Direction::from_spherical(theta_o, 0.0);
        let h = Direction::from_spherical(theta_h, phi_h).vector();
        let o_h = omega_o.vector().dot(h);
        let omega_i: DVec3 = 2.0 * o_h * h - omega_o.vector();
        let d_theta_h = CORE * x.cosh();
        self.weights
            .push(omega_i.z * 4.0 * o_h * theta_h.sin() * d_theta_h * weight);
        self.pairs
            .push(DirectionPair::new(Direction::from_unit(omega_i), omega_o));
    }
}

impl Default for AlbedoProbe {
    fn default() -> Self {
        Self::new()
    }
}

/// The mean of those that are there, `None` without any.
fn mean(views: [Option<f64>; 8]) -> Option<f64> {
    let there = views.iter().flatten();
    let count = there.clone().count();
    (count > 0).then(|| there.sum::<f64>() / count as f64)
}

/// The `n` Gauss–Legendre nodes and weights on [lo, hi].
fn between(lo: f64, hi: f64, n: usize) -> impl Iterator<Item = (f64, f64)> {
    let half = 0.5 * (hi - lo);
    gauss_legendre(n)
        .into_iter()
        .map(move |(t, weight)| (lo + half * (1.0 + t), half * weight))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Channels, Lambert, Spectrum};

    #[test]
    fn every_pair_is_above_the_horizon_and_every_weight_positive() {
        let probe = AlbedoProbe::new();
        assert!(probe.pairs.len() <= 65_536);
        assert!(probe.pairs.iter().all(DirectionPair::is_above_horizon));
        assert!(probe.weights.iter().all(|weight| *weight > 0.0));
    }

    #[test]
    fn views_without_a_truth_are_left_out() {
        let probe = AlbedoProbe::new();
        let grey =
            |albedo| probe.evaluate(&Lambert::new(Spectrum::Grey(albedo), Channels::Luminance));
        let (mut truth, reconstruction) = (grey(0.5), grey(0.25));
        truth.missing = vec![true; probe.pairs.len()];
        assert_eq!(probe.error(&truth, &reconstruction), None);
        assert_eq!(probe.error(&grey(0.0), &reconstruction), None);
        truth.missing[3 * RULES[FINE].per_view()..].fill(false);
        let error = probe.error(&truth, &reconstruction).unwrap();
        assert!((error - 0.5).abs() < 1e-12, "{error}");
    }
}
