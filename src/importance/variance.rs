//! Relative variance of f_r cos θ_i over a density of light directions.

use super::TabulatedSampler;
use super::chart::{Axes, View};
use crate::brdf::Brdf;
use crate::geometry::{Direction, DirectionPair};
use crate::metrics;
use crate::sampling::gauss_legendre;

/// Elevations of the views that variances are averaged over, degrees: four, and four midway between the views of samplers with 16, 32
/// or 64 of them.
pub const VIEWS_DEG: [f64; 8] = [10.0, 40.0, 70.0, 85.0, 11.25, 39.375, 67.5, 84.375];

/// Azimuths of the two fours of views, degrees; the second midway between 32 azimuths.
const AZIMUTHS_DEG: [f64; 2] = [20.0, 16.875];

/// Cells of the quadrature along either axis; cells of tables are unions of them.
const CELLS: usize = 64;

/// Halvings of the cells at the pole: the narrowest lobe has some nodes.
const HALVINGS: i32 = 24;

/// Nodes of a cell along either axis.
const NODES: usize = 2;

/// The view of an index of [`VIEWS_DEG`].
pub(super) fn view(index: usize) -> Direction {
    let phi = AZIMUTHS_DEG[index / 4].to_radians();
    Direction::from_spherical(VIEWS_DEG[index].to_radians(), phi)
}

/// Light directions of a view with f_r cos θ_i: a quadrature in a chart.
pub(super) struct Nodes {
    view: View,
    places: Vec<[f64; 2]>,
    pairs: Vec<DirectionPair>,
    jacobians: Vec<f64>,
    /// dω_i of each.
    measures: Vec<f64>,
    /// f_r cos θ_i, 0 where there is no data.
    values: Vec<f64>,
}

impl Nodes {
    /// Of the upper hemisphere, or of the half of it on one side of the plane of incidence, counted twice.
    pub(crate) fn new(brdf: &dyn Brdf, axes: &Axes, omega_o: Direction) -> Self {
        let symmetry = brdf.symmetry();
        let is_folded = symmetry.isotropic && symmetry.bilateral;
        let rule = gauss_legendre(NODES);
        let cell = 1.0 / CELLS as f64;
        let inner = (0..HALVINGS).map(|k| [0.5_f64.powi(k + 1) * cell, 0.5_f64.powi(k) * cell]);
        let outer = (1..CELLS).map(|k| [k as f64 * cell, (k + 1) as f64 * cell]);
        let around = if is_folded { CELLS / 2 } else { CELLS };
        let around = (0..around).map(|k| [k as f64 * cell, (k + 1) as f64 * cell]);
        let in_part = |[low, high]: [f64; 2]| {
            let half = 0.5 * (high - low);
            rule.iter().map(move |(x, w)| (low + half * (1.0 + x), half * w)).collect::<Vec<_>>()
        };
        let around: Vec<_> = around.flat_map(in_part).collect();
        let view = View::new(omega_o);
        let mut nodes = Self {
            view,
            places: Vec::new(),
            pairs: Vec::new(),
            jacobians: Vec::new(),
            measures: Vec::new(),
            values: Vec::new(),
        };
        let times = if is_folded { 2.0 } else { 1.0 };
        for (x, dx) in inner.chain(outer).flat_map(in_part) {
            for (v, dv) in &around {
                if let Some(place) = axes.place(&view, [x, *v]) {
                    nodes.places.push([x, *v]);
                    nodes.pairs.push(DirectionPair::new(place.omega_i, omega_o));
                    nodes.jacobians.push(place.jacobian);
                    nodes.measures.push(times * dx * dv * place.jacobian);
                }
            }
        }
        let found = metrics::evaluate(brdf, &nodes.pairs);
        let value = |k: usize| found.get(k).map_or(0.0, |f| f.max(0.0) * nodes.pairs[k].omega_i.cos_theta());
        nodes.values = (0..nodes.pairs.len()).map(value).collect();
        nodes
    }

    /// ∫ (f_r cos θ_i)²/p dω_i / a² − 1, a = ∫ f_r cos θ_i dω_i, of a density; infinite where it is 0 and f_r is not, `None` where
    /// nothing is reflected.
    pub(crate) fn relative_variance(&self, density: impl Fn(usize) -> f64) -> Option<f64> {
        let mut square = 0.0;
        for (k, (value, measure)) in self.values.iter().zip(&self.measures).enumerate() {
            if *value > 0.0 {
                square += value * (value / density(k)) * measure;
            }
        }
        let albedo = self.albedo();
        // Rounding may leave −1e-16.
        (albedo > 0.0).then(|| (square / (albedo * albedo) - 1.0).max(0.0))
    }

    /// ∫ f_r cos θ_i dω_i.
    pub(crate) fn albedo(&self) -> f64 {
        self.values.iter().zip(&self.measures).map(|(f, w)| f * w).sum()
    }

    /// [`relative_variance`](Self::relative_variance) of a sampler of the same chart.
    pub(crate) fn of(&self, sampler: &TabulatedSampler) -> Option<f64> {
        self.relative_variance(|k| {
            let omega_i = self.pairs[k].omega_i;
            sampler.pdf_at(&self.view, self.places[k], self.jacobians[k], omega_i)
        })
    }

    /// The pair of each node.
    pub(crate) fn pairs(&self) -> &[DirectionPair] {
        &self.pairs
    }
}

/// Relative variance of f_r cos θ_i over the density of a sampler at a view, and ∫ f_r cos θ_i dω_i there: by quadrature in the
/// sampler's chart. `None` where nothing is reflected.
pub fn relative_variance(
    brdf: &dyn Brdf,
    sampler: &TabulatedSampler,
    omega_o: Direction,
) -> Option<(f64, f64)> {
    let nodes = Nodes::new(brdf, &sampler.settings().axes, omega_o);
    Some((nodes.of(sampler)?, nodes.albedo()))
}
