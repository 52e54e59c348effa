//! Directional albedo by adaptive quadrature that finds narrow lobes and ridges first.
//!
//! a(ω_o) = ∫ f cos θ_i dω_i, in the half vectors h of ω_i and ω_o, see [`Lobe`]. The plane is cut into
//! cells that shrink towards the peak of the lobe, towards the planes an anisotropic lobe is stretched
//! along, and towards a second peak; how far follows from single values along and across them. Every cell has
//! the product of the Gauss–Kronrod pair of 7 and 15 nodes; those whose sums differ most are halved,
//! along the axis they differ along, until all differences together are within the tolerance.
//!
//! A feature narrower than some degrees anywhere else may be missed.

use super::lobe::Lobe;
use crate::brdf::{Brdf, ChannelValues, Presence, SplitBrdf, SumErrors};
use crate::geometry::{Direction, DirectionPair};
use crate::sampling::{GAUSS_KRONROD, cut, halve_worst};

/// Directional albedo of one view.
#[derive(Clone, Debug)]
pub struct DirectionalAlbedo {
    /// Albedo of each channel.
    pub value: ChannelValues,
    /// Bound of the error of every channel, from how much rules of lower degree differ. It is large
    /// where the values that one albedo may cost did not suffice.
    pub error: f64,
    /// Share of the cosine-weighted hemisphere without data, which counts as 0 in `value`.
    pub missing: f64,
}

impl DirectionalAlbedo {
    /// The largest channel.
    pub fn max(&self) -> f64 {
        self.value.iter().copied().fold(0.0, f64::max)
    }
}

/// The largest directional albedo over some views.
#[derive(Clone, Debug)]
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
    found(brdf, omega_o, TOLERANCE).map_or_else(|| dark(brdf), |(albedo, ..)| albedo)
}

/// [`directional_albedo`] to a relative error of 10⁻⁵, and the standard error of its largest channel by random paths, 0 of values that
/// follow none.
pub fn noisy_albedo(brdf: &dyn Brdf, omega_o: Direction) -> (DirectionalAlbedo, f64) {
    let Some((albedo, lobe, cells)) = found(brdf, omega_o, ROUGH) else {
        return (dark(brdf), 0.0);
    };
    let luminance = brdf.channels().luminance(&albedo.value);
    let noise = match brdf.as_split() {
        Some(split) if luminance > 0.0 => noise(&lobe, split, &cells) * albedo.max() / luminance,
        _ => 0.0,
    };
    (albedo, noise)
}

fn dark(brdf: &dyn Brdf) -> DirectionalAlbedo {
    DirectionalAlbedo {
        value: ChannelValues::from_elem(0.0, brdf.channels().count()),
        error: 0.0,
        missing: 0.0,
    }
}

/// An albedo, and the cells that it is the sum of; `None` from below the horizon.
fn found(
    brdf: &dyn Brdf,
    omega_o: Direction,
    tolerance: f64,
) -> Option<(DirectionalAlbedo, Lobe<'_>, Vec<Cell>)> {
    if omega_o.cos_theta() <= 0.0 {
        return None;
    }
    let [mut first, mut second] = [false, true].map(|retro| Lobe::new(brdf, omega_o, retro));
    if second.top() > first.top() {
        std::mem::swap(&mut first, &mut second);
    }
    let (mut albedo, cells) = integrate(&first, tolerance);
    // A ridge through the second peak is bent in the half vectors of the first: cells may miss it,
    // and those of the second may not. Either way the difference is what is not known.
    if brdf.symmetry().isotropic || first.second_peak().is_none() {
        return Some((albedo, first, cells));
    }
    let (mut other, other_cells) = integrate(&second, tolerance);
    let error = albedo.error.max(other.error) + (albedo.max() - other.max()).abs();
    let is_other = other.max() - other.error > albedo.max() + albedo.error;
    [albedo.error, other.error] = [error; 2];
    Some(match is_other {
        true => (other, second, other_cells),
        false => (albedo, first, cells),
    })
}

/// Largest error, relative to the albedo; and where it is printed.
const TOLERANCE: f64 = 1e-10;
const ROUGH: f64 = 1e-5;

/// Values of the BRDF after which no cell is halved, and those of one that follows random paths for each: they take longer, and
/// their noise does not end with smaller cells.
const REFINEMENT: usize = 150_000;
const OF_PATHS: usize = 10_000;

/// Nodes along each axis of a cell.
const NODES: usize = GAUSS_KRONROD.len();

/// A part of the lobe's plane.
struct Cell {
    /// Ranges of s and φ.
    range: [[f64; 2]; 2],
    /// Sums over f cos θ_i of the channels.
    sums: ChannelValues,
    /// Sums over cos θ_i without data, and over cos θ_i.
    hemisphere: [f64; 2],
    /// Difference of the two rules along s and along φ, the largest of any channel.
    errors: [f64; 2],
}

/// Buffers for the nodes of a cell.
#[derive(Default)]
struct Nodes {
    weights: Vec<f64>,
    values: Vec<f64>,
    presence: Vec<Presence>,
}

impl Nodes {
    /// The pairs of a cell, along s fastest, and what they weigh.
    fn place(&mut self, lobe: &Lobe<'_>, range: [[f64; 2]; 2]) -> Vec<DirectionPair> {
        let centre = range.map(|[lo, hi]| 0.5 * (lo + hi));
        let half = range.map(|[lo, hi]| 0.5 * (hi - lo));
        let at = |axis: usize, x: f64| centre[axis] + half[axis] * x;
        let mut pairs = Vec::with_capacity(NODES * NODES);
        self.weights.clear();
        for [y, ..] in GAUSS_KRONROD {
            let meridian = lobe.meridian(at(1, y));
            for [x, ..] in GAUSS_KRONROD {
                let (pair, weight) = meridian.pair_and_weight(at(0, x));
                pairs.push(pair);
                self.weights.push(weight * half[0] * half[1]);
            }
        }
        pairs
    }
}

/// Standard error of the luminance of all cells by random paths.
fn noise(lobe: &Lobe<'_>, brdf: &dyn SplitBrdf, cells: &[Cell]) -> f64 {
    let mut nodes = Nodes::default();
    let mut errors = SumErrors::new();
    for cell in cells {
        let pairs = nodes.place(lobe, cell.range);
        for (i, (pair, weight)) in pairs.iter().zip(&nodes.weights).enumerate() {
            let [[_, k0, _], [_, k1, _]] = [GAUSS_KRONROD[i % NODES], GAUSS_KRONROD[i / NODES]];
            errors.add(brdf, pair, [k0 * k1 * weight]);
        }
    }
    let [[shared], [own]] = errors.errors();
    shared.hypot(own)
}

impl Cell {
    fn new(lobe: &Lobe<'_>, range: [[f64; 2]; 2], nodes: &mut Nodes) -> Self {
        let channels = lobe.brdf.channels().count();
        let pairs = nodes.place(lobe, range);
        nodes.values.resize(pairs.len() * channels, 0.0);
        nodes.presence.resize(pairs.len(), Presence::Present);
        lobe.brdf
            .eval_batch(&pairs, &mut nodes.values, &mut nodes.presence);
        let zero = ChannelValues::from_elem(0.0, channels);
        let mut sums = zero.clone();
        let mut hemisphere = [0.0; 2];
        let mut differences = [zero.clone(), zero];
        for (i, weight) in nodes.weights.iter().enumerate() {
            let [[_, k0, g0], [_, k1, g1]] = [GAUSS_KRONROD[i % NODES], GAUSS_KRONROD[i / NODES]];
            hemisphere[1] += k0 * k1 * weight;
            if nodes.presence[i] == Presence::Missing {
                hemisphere[0] += k0 * k1 * weight;
                continue;
            }
            for c in 0..channels {
                let value = weight * nodes.values[i * channels + c];
                sums[c] += k0 * k1 * value;
                differences[0][c] += (k0 - g0) * k1 * value;
                differences[1][c] += k0 * (k1 - g1) * value;
            }
        }
        let largest = |d: ChannelValues| d.into_iter().fold(0.0, |e: f64, d| e.max(d.abs()));
        Self {
            range,
            sums,
            hemisphere,
            errors: differences.map(largest),
        }
    }

    fn error(&self) -> f64 {
        self.errors[0] + self.errors[1]
    }
}

fn integrate(lobe: &Lobe<'_>, tolerance: f64) -> (DirectionalAlbedo, Vec<Cell>) {
    let mut nodes = Nodes::default();
    let channels = lobe.brdf.channels().count();
    let most = match lobe.brdf.as_split() {
        Some(split) if split.follows_pairs() => OF_PATHS,
        _ => REFINEMENT,
    };
    let mesh = lobe.mesh();
    let narrowest = mesh
        .iter()
        .flatten()
        .map(|[lo, hi]| hi - lo)
        .fold(1.0, f64::min);
    let new = |range| Cell::new(lobe, range, &mut nodes);
    let mut cells: Vec<Cell> = mesh.into_iter().map(new).collect();
    let mut evaluations = cells.len() * NODES * NODES;
    loop {
        let mut value = ChannelValues::from_elem(0.0, channels);
        let [mut missing, mut whole] = [0.0; 2];
        for cell in &cells {
            for (sum, x) in value.iter_mut().zip(&cell.sums) {
                *sum += x;
            }
            missing += cell.hemisphere[0];
            whole += cell.hemisphere[1];
        }
        let largest = value.iter().copied().fold(0.0, f64::max);
        let error: f64 = cells.iter().map(Cell::error).sum();
        let is_done = error <= tolerance * largest || evaluations >= most;
        let errors: Vec<[f64; 2]> = cells.iter().map(|cell| cell.errors).collect();
        let halves = |cell: &Cell, axis: usize| {
            let [lo, hi] = cell.range[axis];
            let parts = cut(cell.range, axis, 0.5 * (lo + hi));
            parts.map(|range| Cell::new(lobe, range, &mut nodes))
        };
        let halved = match is_done {
            true => 0,
            false => halve_worst(&mut cells, &errors, halves),
        };
        evaluations += 2 * halved * NODES * NODES;
        if halved == 0 {
            // Rounding of the sums, and of half vectors against the narrowest cell.
            let rounding = 1e-13 + f64::EPSILON / narrowest;
            let albedo = DirectionalAlbedo {
                value,
                error: error + rounding * largest,
                missing: missing / whole,
            };
            return (albedo, cells);
        }
    }
}
