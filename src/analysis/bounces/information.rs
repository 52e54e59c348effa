//! Mutual information of coordinates and the class of light, bits.
//!
//! I(class; coordinates) = Σ p(cell, class) log2 [p(cell, class) / (p(cell) p(class))], p weighed by light, over cells that hold
//! equally many paths: halves of halves by rank, along one axis after the other. So a warp of an axis changes nothing, and which
//! paths share a cell does not depend on their class.
//!
//! Cells with few paths overestimate the information. This bias falls as one over the number of paths, and the
//! jackknife over batches takes it off; its standard error is stated, with the difference from cells that are twice as wide along
//! each axis, as the root of the sum of squares.

use super::sample::{PathSample, spread};
use crate::analysis::Estimate;
use crate::brdf::CLASSES;
use crate::parametrization::Coords;
use rayon::prelude::*;

/// Halvings of all paths, at most, and along one axis.
const HALVINGS: [u32; 2] = [12, 8];

/// Paths of a cell, at least.
const FEWEST: usize = 64;

/// Information of an axis, of two, and of all, bits.
#[derive(Clone, Debug, PartialEq)]
pub struct Information {
    /// Each axis alone.
    pub single: Vec<Estimate>,
    /// Each two axes.
    pub pairs: Vec<([usize; 2], Estimate)>,
    /// All axes.
    pub all: Estimate,
}

impl Information {
    /// The axis of most information.
    pub fn best_single(&self) -> (usize, Estimate) {
        let numbered = self.single.iter().copied().enumerate();
        best(numbered).unwrap_or((0, self.all))
    }

    /// The two axes of most information.
    pub(crate) fn best_pair(&self) -> ([usize; 2], Estimate) {
        best(self.pairs.iter().copied()).unwrap_or(([0, 1], self.all))
    }
}

/// The first of those with the largest value.
fn best<T>(all: impl Iterator<Item = (T, Estimate)>) -> Option<(T, Estimate)> {
    all.reduce(|a, b| if b.1.value > a.1.value { b } else { a })
}

/// Entropy of the class, bits: the upper bound of the information.
pub fn entropy(sample: &PathSample) -> Estimate {
    let mut cells = Cells::new(1, sample.batches());
    (0..sample.pairs.len()).for_each(|i| cells.add(0, sample, i));
    cells.estimate(|sums| {
        let [classes] = sums else { return 0.0 };
        let total: f64 = classes.iter().sum();
        let shares = classes.iter().map(|s| s / total).filter(|p| *p > 0.0);
        -shares.map(|p| p * p.log2()).sum::<f64>()
    })
}

/// Place of each path along each of `axes` axes; paths at one place are in the order of their numbers.
pub(super) fn ranks(coords: &[Coords], axes: usize) -> Vec<Vec<u32>> {
    let axis = |axis: usize| {
        let mut order: Vec<(f64, u32)> = (0..).zip(coords).map(|(i, c)| (c[axis], i)).collect();
        order.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut ranks = vec![0; coords.len()];
        for (rank, (_, i)) in (0..).zip(order) {
            ranks[i as usize] = rank;
        }
        ranks
    };
    (0..axes).map(axis).collect()
}

/// Information of each set of axes, from the ranks of all paths.
pub(super) fn information(sample: &PathSample, ranks: &[Vec<u32>]) -> Information {
    let axes = ranks.len();
    let pairs = (0..axes).flat_map(|i| (i + 1..axes).map(move |k| [i, k]));
    let pairs: Vec<[usize; 2]> = pairs.collect();
    let mut sets: Vec<Vec<usize>> = vec![(0..axes).collect()];
    sets.extend(pairs.iter().map(|pair| pair.to_vec()));
    sets.extend((0..axes).map(|i| vec![i]));
    let of_set = |set: &Vec<usize>| {
        let ranks: Vec<&[u32]> = set.iter().map(|&axis| &ranks[axis][..]).collect();
        of_axes(sample, &ranks)
    };
    let mut found: Vec<Estimate> = sets.par_iter().map(of_set).collect();
    let single = found.split_off(1 + pairs.len());
    Information {
        single,
        pairs: pairs.into_iter().zip(found.drain(1..)).collect(),
        all: found[0],
    }
}

fn of_axes(sample: &PathSample, ranks: &[&[u32]]) -> Estimate {
    let n = sample.pairs.len();
    let [most, along] = HALVINGS;
    let affordable = (n / FEWEST).max(1).ilog2().min(most);
    let each = (affordable / ranks.len() as u32).min(along);
    let levels = each * ranks.len() as u32;
    let mut fine = Cells::new(1 << levels, sample.batches());
    let point = |i: usize| Point {
        path: i as u32,
        ranks: std::array::from_fn(|k| ranks.get(k).map_or(0, |r| r[i])),
    };
    let mut points: Vec<Point> = (0..n).map(point).collect();
    let mut add = |cell, points: &[Point]| {
        for point in points {
            fine.add(cell, sample, point.path as usize);
        }
    };
    halve(&mut points, [0, ranks.len()], levels, 0, &mut add);
    let found = fine.estimate(mutual);
    if each == 0 {
        return found;
    }
    let coarse = fine.merged(1 << ranks.len()).estimate(mutual);
    Estimate::new(found.value, found.error.hypot(found.value - coarse.value))
}

/// A path and its places along up to four axes.
#[derive(Clone, Copy)]
struct Point {
    path: u32,
    ranks: [u32; 4],
}

/// Halves points `levels` times, from one axis to the next, and hands over the cells in their order; cells that were halved last
/// stand side by side.
fn halve(
    points: &mut [Point],
    [axis, axes]: [usize; 2],
    levels: u32,
    cell: usize,
    each: &mut impl FnMut(usize, &[Point]),
) {
    if levels == 0 || points.is_empty() {
        return each(cell << levels, points);
    }
    let middle = points.len() / 2;
    points.select_nth_unstable_by_key(middle, |p| p.ranks[axis]);
    let (low, high) = points.split_at_mut(middle);
    let next = [(axis + 1) % axes, axes];
    halve(low, next, levels - 1, 2 * cell, each);
    halve(high, next, levels - 1, 2 * cell + 1, each);
}

/// Light of each class in each cell, of each batch.
struct Cells(Vec<Vec<[f64; CLASSES]>>);

impl Cells {
    fn new(cells: usize, batches: usize) -> Self {
        Self(vec![vec![[0.0; CLASSES]; cells]; batches])
    }

    fn add(&mut self, cell: usize, sample: &PathSample, path: usize) {
        let class = usize::from(sample.class[path]);
        self.0[sample.batch_of(path)][cell][class] += sample.light[path];
    }

    /// Cells of so many neighbours each.
    fn merged(&self, neighbours: usize) -> Self {
        let sum = |group: &[[f64; CLASSES]]| {
            std::array::from_fn(|c| group.iter().map(|light| light[c]).sum())
        };
        let batches = self.0.iter();
        let merged = batches.map(|cells| cells.chunks(neighbours).map(sum).collect());
        Self(merged.collect())
    }

    /// A number of the sums over all batches, without its bias, and its standard error. It is not below 0.
    fn estimate(&self, of: impl Fn(&[[f64; CLASSES]]) -> f64) -> Estimate {
        let mut whole = vec![[0.0; CLASSES]; self.0.first().map_or(0, Vec::len)];
        for batch in &self.0 {
            for (sum, part) in whole.iter_mut().zip(batch) {
                (0..CLASSES).for_each(|c| sum[c] += part[c]);
            }
        }
        let all = of(&whole);
        let mut rest = whole.clone();
        let without = self.0.iter().map(|batch| {
            for ((rest, sum), part) in rest.iter_mut().zip(&whole).zip(batch) {
                // What rounding leaves of a cell of this batch alone is nothing.
                *rest = std::array::from_fn(|c| match sum[c] - part[c] {
                    left if left > 1e-9 * sum[c] => left,
                    _ => 0.0,
                });
            }
            of(&rest)
        });
        let without: Vec<f64> = without.collect();
        let n = without.len() as f64;
        // Each leaves out one share in n, and is off by as much more.
        let bias = (n - 1.0) * (without.iter().sum::<f64>() / n - all);
        Estimate::new((all - bias).max(0.0), spread(&without))
    }
}

/// Σ p(cell, class) log2 [p(cell, class) / (p(cell) p(class))] of light in cells.
fn mutual(cells: &[[f64; CLASSES]]) -> f64 {
    let mut classes = [0.0; CLASSES];
    for cell in cells {
        (0..CLASSES).for_each(|c| classes[c] += cell[c]);
    }
    let total: f64 = classes.iter().sum();
    let mut bits = 0.0;
    for cell in cells {
        let here: f64 = cell.iter().sum();
        for c in 0..CLASSES {
            if cell[c] > 0.0 {
                bits += cell[c] * (cell[c] * total / (here * classes[c])).log2();
            }
        }
    }
    bits / total
}
