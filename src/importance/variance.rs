//! Relative variance of f_r cos θ_i over a density of light directions.

use super::TabulatedSampler;
use super::chart::{Axes, LightChart, RadialWarp, View};
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
const HALVINGS: i32 = 16;

/// Halvings of the cells at the horizon, where grazing lobes are steep.
const AT_HORIZON: i32 = 12;

/// Nodes of a cell along either axis.
const NODES: usize = 3;

/// The chart whose nodes are dense where lobes peak.
pub(super) const HALF_VECTOR: Axes = Axes {
    chart: LightChart::HalfVector,
    warp: RadialWarp::SquareRoot,
    to_horizon: true,
};

/// The view of an index of [`VIEWS_DEG`].
pub(super) fn view(index: usize) -> Direction {
    let phi = AZIMUTHS_DEG[index / 4].to_radians();
    Direction::from_spherical(VIEWS_DEG[index].to_radians(), phi)
}

/// Light directions of a view with f_r cos θ_i: a quadrature in a chart.
pub(super) struct Nodes {
    axes: Axes,
    omega_o: Direction,
    places: Vec<[f64; 2]>,
    pairs: Vec<DirectionPair>,
    jacobians: Vec<f64>,
    /// dω_i of each.
    measures: Vec<f64>,
    /// f_r cos θ_i, 0 where there is no data.
    values: Vec<f64>,
}

impl Nodes {
    /// Of the upper hemisphere, or of the half of it on one side of the plane of incidence, counted twice; for densities over a chart.
    /// Charts of ω_i itself are coarse where lobes are narrow: of them the nodes are those of half vectors.
    pub(crate) fn new(brdf: &dyn Brdf, of: &Axes, omega_o: Direction) -> Self {
        let axes = match of.chart {
            LightChart::SolidAngle | LightChart::Cosine => HALF_VECTOR,
            _ => *of,
        };
        let symmetry = brdf.symmetry();
        let is_folded = symmetry.isotropic && symmetry.bilateral;
        let rule = gauss_legendre(NODES);
        let cell = 1.0 / CELLS as f64;
        let inner = (0..HALVINGS).map(|k| [0.5_f64.powi(k + 1) * cell, 0.5_f64.powi(k) * cell]);
        let outer = (1..CELLS - 1).map(|k| [k as f64 * cell, (k + 1) as f64 * cell]);
        let last = (0..AT_HORIZON).map(|k| {
            let before = |k: i32| {
                1.0 - if k == AT_HORIZON {
                    0.0
                } else {
                    0.5_f64.powi(k) * cell
                }
            };
            [before(k), before(k + 1)]
        });
        let around = if is_folded { CELLS / 2 } else { CELLS };
        let around = (0..around).map(|k| [k as f64 * cell, (k + 1) as f64 * cell]);
        let in_part = |[low, high]: [f64; 2]| {
            let half = 0.5 * (high - low);
            rule.iter()
                .map(move |(x, w)| (low + half * (1.0 + x), half * w))
                .collect::<Vec<_>>()
        };
        let around: Vec<_> = around.flat_map(in_part).collect();
        let view = View::new(omega_o);
        let mut nodes = Self {
            axes,
            omega_o,
            places: Vec::new(),
            pairs: Vec::new(),
            jacobians: Vec::new(),
            measures: Vec::new(),
            values: Vec::new(),
        };
        let times = if is_folded { 2.0 } else { 1.0 };
        for (x, dx) in inner.chain(outer).chain(last).flat_map(in_part) {
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
        let value = |k: usize| {
            found
                .get(k)
                .map_or(0.0, |f| f.max(0.0) * nodes.pairs[k].omega_i.cos_theta())
        };
        nodes.values = (0..nodes.pairs.len()).map(value).collect();
        nodes
    }

    /// ∫ g²/p dω_i − 1 with g = f_r cos θ_i/∫ f_r cos θ_i dω_i of a density p; infinite where it is 0 and f_r is not, `None` where nothing
    /// is reflected. Computed as ∫ (g − p)²/p dω_i + 1 − ∫ p dω_i, whose error is a share of it; `is_whole`: all draws are above the horizon,
    /// so that ∫ p dω_i is 1.
    pub(crate) fn relative_variance(
        &self,
        is_whole: bool,
        density: impl Fn(usize) -> f64,
    ) -> Option<f64> {
        let albedo = self.albedo();
        let (mut squares, mut above) = (0.0, 0.0);
        for (k, (value, measure)) in self.values.iter().zip(&self.measures).enumerate() {
            let (g, p) = (value / albedo, density(k));
            if g > 0.0 || p > 0.0 {
                squares += (g - p) * ((g - p) / p) * measure;
            }
            above += p * measure;
        }
        let below = if is_whole {
            0.0
        } else {
            (1.0 - above).max(0.0)
        };
        (albedo > 0.0).then_some(squares + below)
    }

    /// ∫ f_r cos θ_i dω_i.
    pub(crate) fn albedo(&self) -> f64 {
        self.values
            .iter()
            .zip(&self.measures)
            .map(|(f, w)| f * w)
            .sum()
    }

    /// [`relative_variance`](Self::relative_variance) of a sampler.
    pub(crate) fn of(&self, sampler: &TabulatedSampler) -> Option<f64> {
        let density = sampler.given(self.omega_o);
        let axes = sampler.settings().axes;
        let is_whole = axes.to_horizon;
        if axes != self.axes {
            return self.relative_variance(is_whole, |k| density.pdf(self.pairs[k].omega_i));
        }
        self.relative_variance(is_whole, |k| {
            density.pdf_at(self.places[k], self.jacobians[k], self.pairs[k].omega_i)
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
