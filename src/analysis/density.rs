//! How densely a parametrization's own uniform points lie about a pair: poses that follow it lie where they are dense.

use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::parametrization::{self, Images, Layout, Parametrization, WarpSpec, Warps};
use crate::sampling::Random;
use glam::DVec2;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Points that the average Jacobian is of.
const POINTS: u64 = 1 << 16;

/// Of these that are within the elevation, at least.
const FEWEST: usize = 1000;

/// Of these, points whose own densities are averaged, at most.
const OWN: usize = 1 << 12;

/// Radius of the disc about a direction over which densities are averaged, rad: at a pole they have no value.
const RADIUS: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// Pairs that a density is averaged over.
const BESIDE: u64 = 64;

/// Density of uniform points of a parametrization in d ω_i d ω_o, up to an elevation, over that of uniform pairs of
/// directions. Symmetries fold both alike.
pub struct Density {
    form: Arc<dyn Parametrization>,
    /// Largest elevation, rad.
    elevation: f64,
    /// Average Jacobian of its own points.
    jacobian: f64,
    /// Points of the unit disc about each direction of a pair.
    beside: Vec<[DVec2; 2]>,
}

/// True if both directions are above the horizon and at most `elevation` (rad) from the normal.
pub fn is_within(pair: &DirectionPair, elevation: f64) -> bool {
    pair.is_above_horizon() && pair.least_cosine() >= elevation.cos()
}

impl Density {
    /// The density of a form's own points with both elevations up to `elevation`, rad, in (0, π/2]; `None` if so few points
    /// are within it that averages are not known to a few hundredths.
    pub(crate) fn new(form: Arc<dyn Parametrization>, elevation: f64) -> Option<Self> {
        let random = Random::new(2);
        let disc = |r: f64, phi: f64| r.sqrt() * DVec2::from_angle(TAU * phi);
        let beside = |i: u64| {
            let [r, phi, s, psi] = random.point(i);
            [disc(r, phi), disc(s, psi)]
        };
        let mut density = Self {
            form,
            elevation,
            jacobian: 0.0,
            beside: (0..BESIDE).map(beside).collect(),
        };
        let points = (0..POINTS).filter_map(|i| density.point(i));
        let all: Vec<f64> = points.map(|(_, jacobian)| jacobian).collect();
        density.jacobian = all.iter().sum::<f64>() / all.len() as f64;
        (all.len() >= FEWEST).then_some(density)
    }

    /// A uniform point, if it is one, and its Jacobian.
    fn point(&self, i: u64) -> Option<(DirectionPair, f64)> {
        let mut coords: [f64; 4] = Random::new(1).point(i);
        for (x, axis) in coords.iter_mut().zip(self.form.axes()) {
            *x = axis.range[0] + *x * axis.length();
        }
        let pair = self.form.inverse(&coords)?;
        if !is_within(&pair, self.elevation) {
            return None;
        }
        let jacobian = self.form.jacobian(&coords);
        jacobian.is_finite().then_some((pair, jacobian))
    }

    /// ln of the density at a pair, averaged over half a degree about both directions: 0 where it is that of uniform pairs
    /// of directions. `None` out of the elevation.
    pub(crate) fn log(&self, pair: &DirectionPair) -> Option<f64> {
        if !is_within(pair, self.elevation) {
            return None;
        }
        let inverse = |[i, o]: &[DVec2; 2]| {
            let beside = DirectionPair::new(turned(pair.omega_i, *i)?, turned(pair.omega_o, *o)?);
            let coords = self.form.forward(&beside);
            // Images of polar coordinates have the same Jacobian.
            let images = match self.form.facts().layout {
                Layout::Straight => self.form.images(&coords),
                _ => Images::from_slice(&[coords]),
            };
            let inverses = images.iter().map(|c| 1.0 / self.form.jacobian(c));
            let mean = inverses.sum::<f64>() / images.len() as f64;
            (is_within(&beside, self.elevation) && mean.is_finite()).then_some(mean)
        };
        let all: Vec<f64> = self.beside.iter().filter_map(inverse).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        Some((self.jacobian * mean).ln()).filter(|log| log.is_finite())
    }

    /// [`log`](Self::log) at its own uniform points: poses that follow it have as much in the mean.
    pub(crate) fn of_own(&self) -> Vec<f64> {
        let own = (0..POINTS).filter_map(|i| self.point(i)).take(OWN);
        let own: Vec<_> = own.collect();
        let logs = own.par_iter().filter_map(|(pair, _)| self.log(pair));
        logs.collect()
    }
}

/// Every parametrization with its kind, plain, and fine where lobes peak if one of its axes starts there.
pub fn fine_and_plain(symmetry: Symmetry) -> Vec<(&'static str, Arc<dyn Parametrization>)> {
    let mut all = Vec::new();
    for entry in parametrization::all() {
        let plain = entry.form(symmetry);
        let peak = plain.axes().iter().find(|axis| axis.peak_at_start);
        let warps = peak.map(|axis| Warps::from([(axis.symbol.to_owned(), WarpSpec::SquareRoot)]));
        let fine = warps.and_then(|warps| entry.warped(symmetry, &warps).ok());
        all.push((entry.kind, plain));
        all.extend(fine.map(|form| (entry.kind, form)));
    }
    all
}

/// A direction turned to a point of the disc about it, given in the unit disc.
fn turned(direction: Direction, point: DVec2) -> Option<Direction> {
    let centre = direction.vector();
    let (x, y) = centre.any_orthonormal_pair();
    Direction::try_new(centre + RADIUS * (point.x * x + point.y * y))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ELEVATION: f64 = 80.0 * std::f64::consts::PI / 180.0;

    fn densities() -> Vec<(String, Density)> {
        let all = fine_and_plain(Symmetry::FULL).into_iter();
        let named = |(kind, form): (&str, Arc<dyn Parametrization>)| {
            let name = format!("{kind} {}", form.warp_name());
            (name, Density::new(form, ELEVATION).unwrap())
        };
        all.map(named).collect()
    }

    #[test]
    fn densities_are_one_on_average_over_directions() {
        let random = Random::new(5);
        let least = ELEVATION.cos();
        let direction = |u: f64, v: f64| {
            let z = least + u * (1.0 - least);
            Direction::from_spherical(z.acos(), TAU * v)
        };
        for (name, density) in densities() {
            // Half of the pairs are its own points: what is averaged is 2 at most, at poles too.
            let share = |pair: &DirectionPair| {
                let p = density.log(pair)?.exp();
                Some(p / (0.5 * p + 0.5))
            };
            let of = |i: u64| {
                let [a, b, c, d] = random.point(i);
                share(&DirectionPair::new(direction(a, b), direction(c, d)))
            };
            let own = |i: u64| share(&density.point(i)?.0);
            let both: [Vec<f64>; 2] = [
                (0..10_000).into_par_iter().filter_map(of).collect(),
                (0..10_000).into_par_iter().filter_map(own).collect(),
            ];
            let [a, b] = both.map(|all| all.iter().sum::<f64>() / all.len() as f64);
            assert!((0.5 * (a + b) - 1.0).abs() < 0.02, "{name}: {a} {b}");
        }
    }

    /// Gibbs' inequality: no density suits points better than their own.
    #[test]
    fn points_follow_their_own_coordinates_most() {
        let all = densities();
        for (name, own) in &all {
            // Others than those whose mean `of_own` is.
            let points = (POINTS..POINTS + 3000).filter_map(|i| own.point(i));
            let points: Vec<DirectionPair> = points.map(|(pair, _)| pair).collect();
            let mean = |density: &Density| {
                let logs = points.par_iter().filter_map(|pair| density.log(pair));
                logs.sum::<f64>() / points.len() as f64
            };
            let follows = mean(own);
            let own = own.of_own();
            let own = own.iter().sum::<f64>() / own.len() as f64;
            assert!((follows - own).abs() < 0.1, "{name}");
            for (other, density) in &all {
                assert!(mean(density) <= follows + 0.02, "{name} by {other}");
            }
        }
    }
}
