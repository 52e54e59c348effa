//! Two coordinates instead of three: the average of a BRDF over the azimuth.
//!
//! Barla et al. 2015 (section 3) say that reducing a BRDF to two dimensions by projection gives
//! the same approximation in hybrid and in half/difference coordinates. The curves along which one
//! averages are indeed the same, (|h_bar|, |k|) and (theta_h, theta_d) being functions of each
//! other, but the azimuths run along them at different speeds:
//! tan phi_d = cos theta_h tan(phi_k − phi_h). So the claim holds for a projection that does not
//! know the coordinates, and not for the average over equal steps of an azimuth. In half/difference
//! coordinates the two agree, because J does not depend on phi_d.

use crate::brdf::Brdf;
use crate::geometry::DirectionPair;
use crate::metrics::{self, Values};
use crate::numeric::last_where;
use crate::parametrization::{Axis, Coords, Parametrization};
use crate::registry::named;
use crate::sampling::gauss_legendre;
use rayon::prelude::*;
use serde::Serialize;

/// Nodes of the quadrature along the azimuth.
const NODES: usize = 32;

/// Pairs that are reduced together: their nodes fill some megabytes.
const CHUNK: usize = 2048;

named! {
    /// Measure of the average of the values at one place of the first two axes.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Averaging {
        /// Over equal steps of the azimuth, as a grid of measurements would.
        Uniform = "uniform",
        /// Over d omega_i d omega_o: the same whatever the coordinates.
        SolidAngle = "solid-angle",
        /// Over cos θ_i cos θ_o d omega_i d omega_o: the same whatever the coordinates; the best
        /// approximation in the mean square over a diffuse room.
        Cosine = "cosine",
    }
}

/// The luminance (sr⁻¹) at `pairs` of the approximation of `brdf` that does not depend on the
/// third coordinate of `form`: the average over the physical part of that axis.
/// Missing where the table has no data on the whole of it.
///
/// Along the axis the physical part is looked for between the pair's own azimuth, which is
/// physical, and the ends; in every parametrization of [`all`](crate::parametrization::all) it is
/// in one piece if the axis is folded by reciprocity and mirror symmetry.
///
/// # Panics
/// If `form` has four axes, or is not folded by every symmetry.
pub fn reduced(
    brdf: &dyn Brdf,
    form: &dyn Parametrization,
    averaging: Averaging,
    pairs: &[DirectionPair],
) -> Values {
    let axes = form.axes();
    let s = form.symmetry();
    assert!(axes.len() == 3 && s.reciprocal && s.bilateral);
    let rule = gauss_legendre(NODES);
    let mut reduced = Values::default();
    for pairs in pairs.chunks(CHUNK) {
        let through = |pair| Fibre::through(form, &axes[2], averaging, pair, &rule);
        let fibres: Vec<Fibre> = pairs.par_iter().map(through).collect();
        let nodes: Vec<DirectionPair> = fibres.iter().flat_map(|f| &f.nodes).copied().collect();
        let values = metrics::evaluate(brdf, &nodes);
        let mut next = 0..nodes.len();
        let mut slab = Values::default();
        for fibre in &fibres {
            let (mut sum, mut total) = (0.0, 0.0);
            for (weight, i) in fibre.weights.iter().zip(&mut next) {
                if let Some(value) = values.get(i) {
                    sum += weight * value;
                    total += weight;
                }
            }
            let is_there = total > 0.0;
            slab.missing.push(!is_there);
            slab.luminance
                .push(if is_there { sum / total } else { 0.0 });
        }
        if !slab.missing.contains(&true) {
            slab.missing.clear();
        }
        reduced.append(slab);
    }
    reduced
}

/// The configurations that share the first two coordinates of a pair.
struct Fibre {
    nodes: Vec<DirectionPair>,
    weights: Vec<f64>,
}

impl Fibre {
    fn through(
        form: &dyn Parametrization,
        azimuth: &Axis,
        averaging: Averaging,
        pair: &DirectionPair,
        rule: &[(f64, f64)],
    ) -> Self {
        let [x, y, own, _] = form.forward(pair);
        let at = |phi: f64| -> Coords { [x, y, phi, 0.0] };
        let physical = |phi: f64| form.inverse(&at(phi)).is_some();
        let [lo, hi] = azimuth.range.map(|end| last(own, end, physical));
        let node = |(t, w): &(f64, f64)| {
            let coords = at(0.5 * (lo + hi) + 0.5 * (hi - lo) * t);
            // Rounding may put a node of a short piece below the horizon.
            let node = form.inverse(&coords)?;
            let measure = match averaging {
                Averaging::Uniform => 1.0,
                Averaging::SolidAngle => form.jacobian(&coords),
                Averaging::Cosine => {
                    form.jacobian(&coords) * node.omega_i.cos_theta() * node.omega_o.cos_theta()
                }
            };
            measure.is_finite().then_some((node, w * measure))
        };
        let (mut nodes, mut weights): (Vec<_>, Vec<f64>) = rule.iter().filter_map(node).unzip();
        // A pole, where the Jacobian vanishes and every azimuth is one configuration.
        if !(weights.iter().sum::<f64>() > 0.0) {
            (nodes, weights) = (vec![*pair], vec![1.0]);
        }
        Self { nodes, weights }
    }
}

/// The last physical azimuth on the way from `inside` to `end`.
fn last(inside: f64, end: f64, physical: impl Fn(f64) -> bool) -> f64 {
    if physical(end) {
        return end;
    }
    // 2^-50 of π/2 is rounding.
    last_where(inside, end, 50, physical)
}
