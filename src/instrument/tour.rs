//! Orders of visits: the arms need minutes where a careless order takes hours.
//!
//! The cost of a step is its [`Travel`] time, the path starts at rest and ends anywhere.
//! Positions that occur more than once are visited one after the other and count as one.

mod improve;
mod sorted;

use super::motion::Travel;
use crate::numeric::tree::{Metric, Tree};
use crate::registry::named;
use crate::schedule::{MAX_AXES, Positions};
use improve::improve;
use serde::{Deserialize, Serialize};
use sorted::sorted;
use std::cmp::Ordering;

named! {
    /// Rule that orders the visits.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Order {
        AsGenerated = "as-generated": "as the schedule numbers them",
        Sorted = "sorted": "back and forth along the quickest axis, in rows of the others",
        NearestNeighbour = "nearest-neighbour": "always to the nearest pose that is left",
        /// The nearest-neighbour path with its detours taken out by exchanges of two and three steps
        /// (2-opt, Or-opt; Bentley 1992), then shaken up and repaired again piece by piece.
        #[default]
        TwoOpt = "two-opt": "nearest neighbour, then 2-opt and Or-opt",
    }
}

impl Order {
    /// The numbers of `positions` in the order of visits, from `rest`. Needs memory for some
    /// hundred bytes a position.
    pub fn tour(self, travel: &Travel, rest: &Positions, positions: &[Positions]) -> Vec<u32> {
        match self {
            Order::AsGenerated => (0..positions.len() as u32).collect(),
            Order::Sorted => sorted(travel, rest, positions),
            Order::NearestNeighbour => {
                distinct(positions, |points| nearest_neighbour(travel, rest, points))
            }
            Order::TwoOpt => distinct(positions, |points| {
                let path = nearest_neighbour(travel, rest, points);
                improve(travel, rest, points, path)
            }),
        }
    }
}

/// Finds a path over the distinct positions, and visits equal ones in the order of their numbers.
fn distinct(positions: &[Positions], path: impl Fn(&[Positions]) -> Vec<u32>) -> Vec<u32> {
    let at = |i: &u32| &positions[*i as usize];
    let compare = |a: &u32, b: &u32| {
        let mut axes = at(a).iter().zip(at(b)).map(|(a, b)| a.total_cmp(b));
        axes.find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    };
    let mut numbers: Vec<u32> = (0..positions.len() as u32).collect();
    numbers.sort_unstable_by(|a, b| compare(a, b).then(a.cmp(b)));
    let equal = numbers.chunk_by(|a, b| compare(a, b).is_eq());
    let mut groups: Vec<&[u32]> = equal.collect();
    // In the order of their first numbers, so that ties are resolved by number.
    groups.sort_unstable_by_key(|g| g[0]);
    let points: Vec<Positions> = groups.iter().map(|g| *at(&g[0])).collect();
    let order = path(&points).into_iter();
    order.flat_map(|g| groups[g as usize]).copied().collect()
}

/// Always to the nearest that is left: by travel time, then by the sum of the squared times of all
/// axes (move no axis without need), then by number.
fn nearest_neighbour(travel: &Travel, rest: &Positions, points: &[Positions]) -> Vec<u32> {
    let mut tree = Tree::new(travel, points);
    let leaves = tree.leaves();
    let mut path = Vec::with_capacity(points.len());
    let mut here = *rest;
    while let Some(number) = tree.nearest_one(&here, FAR) {
        tree.remove(number, leaves[number as usize]);
        here = points[number as usize];
        path.push(number);
    }
    path
}

/// Travel times: less is nearer.
impl Metric<MAX_AXES> for &Travel {
    /// The square of the travel time, s², and the sum of the squares of all axes: among equal times the way that moves least.
    /// On a lattice most times are equal, and neighbours along its axes are better than any others.
    type Distance = [f64; 2];

    fn distance(&self, from: &Positions, to: &Positions) -> [f64; 2] {
        let squares = self.squares(from, to);
        let longest = squares.into_iter().fold(0.0, f64::max);
        [longest, squares.into_iter().sum()]
    }

    fn bounded([time, _]: [f64; 2]) -> f64 {
        time
    }

    fn to_box(&self, from: &Positions, low: &Positions, high: &Positions) -> f64 {
        let squares = self.squares_to_box(from, low, high);
        squares.into_iter().fold(0.0, f64::max)
    }

    fn length(&self, axis: usize, low: f64, high: f64) -> f64 {
        (high - low) / self.speed(axis)
    }
}

/// Farther than any point.
const FAR: [f64; 2] = [f64::INFINITY; 2];

#[cfg(test)]
mod tests;
