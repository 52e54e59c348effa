//! Clouds of points with values, of any layout, and the neighbours of a point in them.
//!
//! The nearest points of a reading on a sheet all lie in that sheet: they say nothing of what lies
//! across it. Where the nearest points are flat, the nearest points of ever thinner copies of the cloud
//! are added, until those of one copy fill space about the point, or no thinner copy is left. So
//! dense sheets, lines and clusters stand beside what lies between them, and a cloud that fills space
//! evenly never needs a copy.

use crate::numeric::tree::{Near, Squared, Tree};
use crate::numeric::{upper_median, vectorised};
use rustc_hash::FxHashSet;
use std::num::NonZeroUsize;
use std::sync::OnceLock;

/// Neighbours are flat if their variance along some direction, given the others, is below this share
/// of that along the widest. Of a ball it is 1, of half a ball 0.3, of a sheet of curvature 1 and
/// radius r about r² / 10.
const FLAT: f64 = 0.02;

/// Length of the mean direction to neighbours above which they lie on one side: it is 1/2 for a half
/// space.
const ONE_SIDE: f64 = 0.6;

/// Neighbours from each thinner copy: enough to surround a point in 4-D.
const PER_COPY: usize = 12;

/// Points of a copy that is not thinned further.
const FEWEST: usize = 2 * PER_COPY;

/// Smallest cubes of a copy: the range of a coordinate is about 1.
const SMALLEST: f64 = 1e-3;

/// Dimensions of an embedding, the most there are.
const MOST: usize = 4;

/// What rounding may add to a squared distance.
const WIDER: f64 = 1.0 + 1e-9;

/// Radius within which points are kept for the queries after, as a multiple of the reach of the neighbours of one.
const AROUND: f64 = 1.6;

/// Points that are kept, at most, as a multiple of the neighbours of a query.
const MANY: usize = 32;

/// Way from one query to the next, as a share of the reach of its neighbours, up to which it is worth to keep points for others.
const CLOSE: f64 = 0.3;

/// Points whose neighbours determine spacing and layout.
const PROBES: usize = 128;

/// The `k` points nearest to `x`, nearest first.
fn nearest_in<const K: usize>(tree: &Tree<K, Squared>, x: &[f64; K], k: usize) -> Vec<Near<f64>> {
    let mut found = Vec::with_capacity(2 * k);
    tree.nearest(x, k, f64::INFINITY, &mut found);
    found
}

/// A part of the cloud: one point per cube.
struct Copy<const K: usize> {
    tree: Tree<K, Squared>,
    /// Numbers of its points in the cloud.
    index: Vec<usize>,
}

/// Points with a value per channel.
pub(super) struct Cloud<const K: usize> {
    /// Places.
    pub points: Vec<[f64; K]>,
    /// Values, point-major (`points × channels`).
    values: Vec<f64>,
    /// Values per point.
    pub channels: usize,
    /// Relative uncertainty of each point; empty: all are exact.
    noise: Vec<f64>,
    tree: Tree<K, Squared>,
    /// Thinner copies, made when first asked for.
    copies: OnceLock<Vec<Copy<K>>>,
    in_sheets: OnceLock<bool>,
}

/// What was found about a point.
#[derive(Default)]
pub(super) struct Found {
    /// Numbers of the neighbours; the nearest is the first.
    pub index: Vec<usize>,
    /// Their squared distances.
    pub distance2: Vec<f64>,
    /// Where they are from.
    pub reach: Reach,
}

/// State of a search of one cloud about points that follow each other, with its buffers.
#[derive(Default)]
pub(super) struct Search {
    /// What was found about the last.
    pub found: Found,
    /// The point that was looked about before, and the distance of the farthest of its nearest.
    before: Option<([f64; MOST], f64)>,
    /// Points near an earlier one.
    around: Around,
    near: Vec<Near<f64>>,
    /// Those of one thinner copy.
    of_copy: Vec<usize>,
}

/// All points of a cloud that are nearer to a place than a radius.
#[derive(Default)]
struct Around {
    centre: [f64; MOST],
    radius: f64,
    /// Their coordinates, axis by axis, and their numbers.
    at: [Vec<f64>; MOST],
    number: Vec<u32>,
    /// A buffer: their squared distances from another place.
    distance2: Vec<f64>,
}

/// How far neighbours had to be looked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Reach {
    /// They are the nearest points, and fill space in every direction.
    #[default]
    Nearest,
    /// With some of thinner copies they fill space.
    Far,
    /// They are the nearest points; neither they nor those of thinner copies fill space.
    Flat,
}

impl Found {
    fn push(&mut self, i: usize, d2: f64) {
        self.index.push(i);
        self.distance2.push(d2);
    }

    /// Distance of the farthest.
    pub(crate) fn size(&self) -> f64 {
        self.distance2.iter().copied().fold(0.0, f64::max).sqrt()
    }
}

impl<const K: usize> Cloud<K> {
    /// Of at least one point, finite; `values` is point-major, and `noise` a relative uncertainty per point, or nothing.
    pub(crate) fn new(
        points: Vec<[f64; K]>,
        values: Vec<f64>,
        channels: usize,
        mut noise: Vec<f64>,
    ) -> Self {
        if noise.iter().all(|&u| u == 0.0) {
            noise = Vec::new();
        }
        Self {
            tree: Tree::new(Squared, &points),
            points,
            values,
            channels,
            noise,
            copies: OnceLock::new(),
            in_sheets: OnceLock::new(),
        }
    }

    /// The relative uncertainty of point `i`.
    #[inline]
    pub fn noise(&self, i: usize) -> f64 {
        self.noise.get(i).copied().unwrap_or(0.0)
    }

    /// The values of point `i`.
    #[inline]
    pub(crate) fn value(&self, i: usize) -> &[f64] {
        &self.values[i * self.channels..(i + 1) * self.channels]
    }

    /// Number of the point nearest to `x`.
    #[inline]
    pub(crate) fn nearest(&self, x: &[f64; K]) -> usize {
        match self.tree.nearest_one(x, f64::INFINITY) {
            Some(number) => number as usize,
            None => unreachable!("a cloud has a point"),
        }
    }

    /// The `k` points nearest to `x`, and more where they are flat.
    pub(crate) fn find(&self, x: &[f64; K], k: NonZeroUsize, search: &mut Search) {
        search.nearest(self, x, k.get());
        let found = &mut search.found;
        found.index.clear();
        found.distance2.clear();
        for near in &search.near {
            found.push(near.number as usize, near.distance);
        }
        found.reach = Reach::Nearest;
        if fills_space(&self.points, &found.index) {
            return;
        }
        let nearest = found.index.len();
        let of_copy = &mut search.of_copy;
        found.reach = Reach::Flat;
        for copy in self.copies.get_or_init(|| self.thinned()) {
            of_copy.clear();
            for near in nearest_in(&copy.tree, x, PER_COPY) {
                let i = copy.index[near.number as usize];
                of_copy.push(i);
                if !found.index.contains(&i) {
                    found.push(i, near.distance);
                }
            }
            if fills_space(&self.points, of_copy) && self.surrounds(of_copy, x) {
                found.reach = Reach::Far;
                break;
            }
        }
        if found.reach == Reach::Flat {
            found.index.truncate(nearest);
            found.distance2.truncate(nearest);
        }
    }

    /// True if the points do not all lie on one side of `x`: their directions from it differ.
    pub(crate) fn surrounds(&self, index: &[usize], x: &[f64; K]) -> bool {
        let mut mean = [0.0; K];
        for &i in index {
            let towards: [f64; K] = std::array::from_fn(|d| self.points[i][d] - x[d]);
            let length = towards.iter().map(|c| c * c).sum::<f64>().sqrt();
            for (mean, c) in mean.iter_mut().zip(towards) {
                *mean += c / length / index.len() as f64;
            }
        }
        mean.iter().map(|c| c * c).sum::<f64>() < ONE_SIDE * ONE_SIDE
    }

    /// Distance of point `i` to the next one that is elsewhere, 0 if there is none near.
    pub(crate) fn gap(&self, i: usize) -> f64 {
        let near = nearest_in(&self.tree, &self.points[i], PER_COPY).into_iter();
        let elsewhere = near
            .map(|near| near.distance)
            .find(|d2| *d2 > SMALLEST * SMALLEST);
        elsewhere.map_or(0.0, f64::sqrt)
    }

    /// True if many points lie in sheets, lines or clusters: of a quarter the neighbours do not fill space.
    pub(crate) fn is_in_sheets(&self) -> bool {
        *self.in_sheets.get_or_init(|| {
            let points = &self.points;
            let step = points.len().div_ceil(PROBES);
            let is_flat = |x: &&[f64; K]| {
                let near = nearest_in(&self.tree, x, PER_COPY).into_iter();
                let near: Vec<usize> = near.map(|near| near.number as usize).collect();
                !fills_space(points, &near)
            };
            let flat = points.iter().step_by(step).filter(is_flat).count();
            4 * flat > points.len().div_ceil(step)
        })
    }

    /// This cloud, marked as lying in sheets.
    pub(crate) fn in_sheets(self) -> Self {
        Self {
            in_sheets: OnceLock::from(true),
            ..self
        }
    }

    /// Copies of the cloud, each with cubes twice as large as the one before.
    fn thinned(&self) -> Vec<Copy<K>> {
        let points = &self.points;
        let step = points.len().div_ceil(PROBES);
        let mut gaps = Vec::with_capacity(PROBES);
        for x in points.iter().step_by(step) {
            let near = nearest_in(&self.tree, x, 2).into_iter();
            gaps.extend(
                near.filter(|near| near.distance > 0.0)
                    .map(|near| near.distance.sqrt()),
            );
        }
        let gap = upper_median(&mut gaps).unwrap_or(SMALLEST);
        let mut edge = gap.max(SMALLEST);
        let mut copies: Vec<Copy<K>> = Vec::new();
        let mut index: Vec<usize> = (0..points.len()).collect();
        while index.len() > FEWEST {
            edge *= 2.0;
            index = one_per_cube(points, &index, edge);
            let of: Vec<[f64; K]> = index.iter().map(|&i| points[i]).collect();
            copies.push(Copy {
                tree: Tree::new(Squared, &of),
                index: index.clone(),
            });
        }
        copies
    }
}

impl Search {
    /// Goes over to another cloud.
    pub(super) fn restart(&mut self) {
        self.before = None;
        self.around.radius = 0.0;
    }

    /// Finds the `k` points nearest to `x`, nearest first. Of points that follow each other closely the neighbours are among those
    /// of an earlier one, which are looked through without the tree.
    fn nearest<const K: usize>(&mut self, cloud: &Cloud<K>, x: &[f64; K], k: usize) {
        // The nearest of the point before are within reach of this one.
        let way = |from: &[f64; MOST]| {
            let way2: f64 = from.iter().zip(x).map(|(a, b)| (a - b) * (a - b)).sum();
            way2.sqrt()
        };
        let before = self.before.map(|(at, reach)| (way(&at), reach));
        let reach = before.map_or(f64::INFINITY, |(way, reach)| (reach + way) * WIDER);
        // Squares of tiny distances are 0.
        let most = (reach * reach).max(f64::MIN_POSITIVE);
        let near = &mut self.near;
        let is_close = before.is_some_and(|(way, reach)| way < CLOSE * reach);
        let is_among = |around: &Around| reach + way(&around.centre) < around.radius;
        if is_close && !is_among(&self.around) {
            let radius = AROUND * reach;
            vectorised!(cloud.tree.within(x, radius * radius, MANY * k, near));
            // Beside a dense cluster the tree is faster.
            if near.len() <= MANY * k {
                self.around.set(cloud, x, radius, near);
            }
        }
        if is_among(&self.around) {
            vectorised!(self.around.nearest(x, k, most, near));
        } else {
            vectorised!(cloud.tree.nearest(x, k, most, near));
        }
        self.before = near.get(k - 1).map(|last| {
            let mut at = [0.0; MOST];
            at[..K].copy_from_slice(x);
            (at, last.distance.sqrt())
        });
    }
}

impl Around {
    /// Takes the points that were found up to a distance from a place.
    fn set<const K: usize>(
        &mut self,
        cloud: &Cloud<K>,
        centre: &[f64; K],
        radius: f64,
        near: &[Near<f64>],
    ) {
        self.centre[..K].copy_from_slice(centre);
        self.radius = radius;
        self.number.clear();
        self.number.extend(near.iter().map(|near| near.number));
        for (d, at) in self.at[..K].iter_mut().enumerate() {
            at.clear();
            at.extend(
                near.iter()
                    .map(|near| cloud.points[near.number as usize][d]),
            );
        }
    }

    /// The `k` of them that are nearest to a place, up to a squared distance, nearest first.
    #[inline(always)]
    fn nearest<const K: usize>(
        &mut self,
        from: &[f64; K],
        k: usize,
        most: f64,
        found: &mut Vec<Near<f64>>,
    ) {
        let sums = &mut self.distance2;
        sums.clear();
        sums.resize(self.number.len(), 0.0);
        for (from, at) in from.iter().zip(&self.at) {
            for (sum, at) in sums.iter_mut().zip(at) {
                *sum += (from - at) * (from - at);
            }
        }
        found.clear();
        let mut most = most;
        for (distance, number) in sums.iter().zip(&self.number) {
            if *distance <= most {
                let near = Near {
                    distance: *distance,
                    number: *number,
                };
                if let Some(last) = near.among(k, found) {
                    most = last.distance;
                }
            }
        }
    }
}

/// The first of `index` in each cube of edge `edge`.
fn one_per_cube<const K: usize>(points: &[[f64; K]], index: &[usize], edge: f64) -> Vec<usize> {
    let mut taken = FxHashSet::default();
    let cube = |i: usize| points[i].map(|x| (x / edge).floor() as i64);
    let first = |&i: &usize| taken.insert(cube(i));
    index.iter().copied().filter(first).collect()
}

/// True if the variance of the points is alike in every direction, to a factor of [`FLAT`].
fn fills_space<const K: usize>(points: &[[f64; K]], index: &[usize]) -> bool {
    let mut c = covariance(points, index);
    let widest = (0..K).map(|d| c[d][d]).fold(0.0, f64::max);
    // Pivoted elimination: what is left of a variance, given those before it.
    let mut done = [false; K];
    for _ in 0..K {
        let Some(p) = (0..K)
            .filter(|&d| !done[d])
            .max_by(|&a, &b| c[a][a].total_cmp(&c[b][b]))
        else {
            break;
        };
        if !(c[p][p] > FLAT * widest) {
            return false;
        }
        done[p] = true;
        for a in 0..K {
            if done[a] {
                continue;
            }
            let share = c[a][p] / c[p][p];
            for b in 0..K {
                c[a][b] -= share * c[p][b];
            }
        }
    }
    true
}

pub(super) fn covariance<const K: usize>(points: &[[f64; K]], index: &[usize]) -> [[f64; K]; K] {
    let n = index.len() as f64;
    let mut mean = [0.0; K];
    for &i in index {
        for (mean, x) in mean.iter_mut().zip(&points[i]) {
            *mean += x;
        }
    }
    mean.iter_mut().for_each(|mean| *mean /= n);
    let mut c = [[0.0; K]; K];
    for &i in index {
        let x: [f64; K] = std::array::from_fn(|d| points[i][d] - mean[d]);
        for a in 0..K {
            for b in 0..=a {
                c[a][b] += x[a] * x[b];
            }
        }
    }
    for a in 0..K {
        for b in 0..=a {
            c[a][b] /= n;
            c[b][a] = c[a][b];
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sobol;

    /// Neighbours by way of earlier queries are those of a search of its own: numbers, order and distances.
    #[test]
    fn searches_that_follow_each_other_find_the_same() {
        let sobol = |seed| {
            let mut sobol = Sobol::new(seed);
            move |n: u64| {
                let [x, y, z, _] = sobol.point(n);
                [x, y, z]
            }
        };
        let mut spread = sobol(1);
        let spread: Vec<[f64; 3]> = (0..800).map(&mut spread).collect();
        let lattice = spread.iter().map(|p| p.map(|x| (8.0 * x).floor() / 8.0));
        let cluster = spread
            .iter()
            .map(|p| p.map(|x| 0.01 * x))
            .chain([[0.5; 3], [0.6; 3]]);
        let few = vec![[0.1; 3], [0.1; 3], [0.9; 3]];
        let clouds = [spread.clone(), lattice.collect(), cluster.collect(), few];
        let mut from = sobol(2);
        let mut search = Search::default();
        let mut by_others = 0;
        for points in clouds {
            let cloud = Cloud::new(points.clone(), vec![0.0; points.len()], 1, Vec::new());
            for n in 0..200 {
                let [start, to] = [from(n), from(n + 1)];
                for k in [1, 5, 16, 40] {
                    search.restart();
                    // Steps of nothing, small ones, and one across the cloud.
                    for step in [0.0, 0.0, 1e-4, 2e-3, 4e-3, 6e-3, 0.02, 0.02, 0.5, 0.5] {
                        let x: [f64; 3] =
                            std::array::from_fn(|d| start[d] + step * (to[d] - start[d]));
                        search.nearest(&cloud, &x, k);
                        by_others += usize::from(search.around.radius > 0.0);
                        let alone = nearest_in(&cloud.tree, &x, k);
                        let both = |near: &Near<f64>| (near.number, near.distance);
                        assert!(
                            search.near.iter().map(both).eq(alone.iter().map(both)),
                            "{x:?} {k}"
                        );
                    }
                }
            }
        }
        assert!(by_others > 1000);
    }
}
