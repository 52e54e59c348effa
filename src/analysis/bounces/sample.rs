//! Light paths of a material, in batches for standard errors.

use crate::analysis::Estimate;
use crate::brdf::{CLASSES, LightPath, Part, SplitBrdf};
use crate::geometry::DirectionPair;
use crate::metrics::jackknife;
use rayon::prelude::*;

/// Paths of a block, at most.
const BLOCK: usize = 4096;

/// Batches of a material whose surfaces are not batches of their own.
const BATCHES: usize = 16;

/// Surfaces, from which on each is a batch of its own.
const SURFACES: usize = 4;

/// Batches, at most: of more surfaces several share one.
const MOST: usize = 64;

/// What batches differ by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spread {
    /// Paths and surfaces: errors hold both.
    Surfaces,
    /// Paths alone, of an average over all surfaces, where that is all there is, or of one surface.
    Paths,
    /// Paths alone: each batch is of both or all three surfaces, too few for their scatter.
    FewSurfaces,
}

/// Light paths, drawn from the measure f cos θ_i cos θ_o and the hemisphere of light.
#[derive(Clone, Debug)]
pub struct PathSample {
    /// Pairs of the paths that left.
    pub(crate) pairs: Vec<DirectionPair>,
    /// Luminance of each path that left.
    pub(super) light: Vec<f64>,
    /// Class of each path that left.
    pub(super) class: Vec<u8>,
    /// First path of each batch, and the number of paths.
    starts: Vec<usize>,
    /// Paths that were followed, those that did not leave included.
    pub followed: usize,
    /// What errors hold.
    pub spread: Spread,
}

/// Light of each class, of each batch.
pub(super) type BatchSums = Vec<[f64; CLASSES]>;

/// Light of each class in a set of pairs, and in all.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// Share of each class in the light of the set; NaN of one without light.
    pub inside: [Estimate; CLASSES],
    /// Share of each class's light that the set holds; NaN of a class without light.
    pub captured: [Estimate; CLASSES],
}

/// The shares of light.
#[derive(Clone, Debug, PartialEq)]
pub struct LightShares {
    /// Light that leaves, as a share of what comes from the hemisphere.
    pub albedo: Estimate,
    /// Share of each class in the light that leaves.
    pub classes: [Estimate; CLASSES],
}

impl PathSample {
    /// Follows `paths` paths, or a few more so that batches are equal. The result does not depend on the number of threads.
    pub fn follow(brdf: &dyn SplitBrdf, paths: usize) -> Self {
        let surfaces = brdf.surfaces();
        let spread = match surfaces {
            0 => Spread::Paths,
            1..SURFACES => Spread::FewSurfaces,
            _ => Spread::Surfaces,
        };
        let are_batches = spread == Spread::Surfaces;
        // Blocks after which every batch has the same number from the same surfaces.
        let (few, many) = (surfaces.max(1), surfaces);
        let round = if are_batches { many } else { few * BATCHES };
        let batch_of = |block: usize| match are_batches {
            true => block % many % MOST,
            false => block / few % BATCHES,
        };
        let count = paths.div_ceil(round).clamp(1, BLOCK);
        let blocks = paths.div_ceil(count * round) * round;
        let mut order: Vec<usize> = (0..blocks).collect();
        order.sort_by_key(|&block| batch_of(block));
        let follow = |&block: &usize| {
            let mut found = Vec::new();
            brdf.paths(block as u64, count, &mut |path| {
                if path.light > 0.0 && path.pair.is_above_horizon() {
                    found.push(path);
                }
            });
            found
        };
        let followed: Vec<Vec<LightPath>> = order.par_iter().map(follow).collect();
        let left = followed.iter().map(Vec::len).sum();
        let mut sample = Self {
            pairs: Vec::with_capacity(left),
            light: Vec::with_capacity(left),
            class: Vec::with_capacity(left),
            starts: Vec::new(),
            followed: blocks * count,
            spread,
        };
        for (block, paths) in order.into_iter().zip(followed) {
            while sample.starts.len() <= batch_of(block) {
                sample.starts.push(sample.pairs.len());
            }
            for LightPath { pair, light, order } in paths {
                let class = Part::from_order(order).classes().start as u8;
                sample.pairs.push(pair);
                sample.light.push(light);
                sample.class.push(class);
            }
        }
        sample.starts.push(sample.pairs.len());
        sample
    }

    /// Independent parts that errors are of.
    pub fn batches(&self) -> usize {
        self.starts.len() - 1
    }

    /// Paths of a batch.
    pub(super) fn batch(&self, batch: usize) -> std::ops::Range<usize> {
        self.starts[batch]..self.starts[batch + 1]
    }

    pub(super) fn batch_of(&self, path: usize) -> usize {
        self.starts.partition_point(|&start| start <= path) - 1
    }

    /// Light of those paths whose number in the sample `counts`, of each batch.
    pub(super) fn sums(&self, counts: impl Fn(usize) -> bool + Sync) -> BatchSums {
        let batches = (0..self.batches()).into_par_iter().map(|batch| {
            let mut sums = [0.0; CLASSES];
            for i in self.batch(batch).filter(|&i| counts(i)) {
                sums[usize::from(self.class[i])] += self.light[i];
            }
            sums
        });
        batches.collect()
    }

    /// True if a path left with light.
    pub(crate) fn has_light(&self) -> bool {
        !self.light.is_empty()
    }

    /// How much leaves, and after how many facets.
    pub fn shares(&self) -> LightShares {
        let sums = self.sums(|_| true);
        let followed = self.followed as f64 / sums.len() as f64;
        let whole: BatchSums = vec![[followed; CLASSES]; sums.len()];
        LightShares {
            albedo: ratio(&sums, &whole, all, |s| s[0]),
            classes: std::array::from_fn(|c| ratio(&sums, &sums, |s| s[c], all)),
        }
    }

    /// What a set of pairs holds.
    pub fn capture(&self, holds: impl Fn(&DirectionPair) -> bool + Sync) -> Capture {
        let inside = self.sums(|i| holds(&self.pairs[i]));
        capture(&inside, &self.sums(|_| true))
    }
}

/// Shares of the light in a set and of each class, from sums of batches.
pub(super) fn capture(inside: &BatchSums, every: &BatchSums) -> Capture {
    Capture {
        inside: std::array::from_fn(|c| ratio(inside, inside, |s| s[c], all)),
        captured: std::array::from_fn(|c| ratio(inside, every, |s| s[c], |s| s[c])),
    }
}

/// Light of all classes.
pub(super) fn all(sums: &[f64; CLASSES]) -> f64 {
    sums.iter().sum()
}

/// A ratio of two sums over batches, NaN of nothing, and its standard error.
fn ratio(
    above: &BatchSums,
    below: &BatchSums,
    of_above: impl Fn(&[f64; CLASSES]) -> f64,
    of_below: impl Fn(&[f64; CLASSES]) -> f64,
) -> Estimate {
    let above: Vec<f64> = above.iter().map(of_above).collect();
    let below: Vec<f64> = below.iter().map(of_below).collect();
    let [a, b] = [&above, &below].map(|v| v.iter().sum::<f64>());
    if b <= 0.0 {
        return Estimate::new(f64::NAN, f64::NAN);
    }
    let share = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
    let without = (0..above.len()).map(|i| share(a - above[i], b - below[i]));
    Estimate::new(share(a, b), spread(&without.collect::<Vec<_>>()))
}

/// Standard error of an estimate from those that leave out a batch each; there are at least four.
pub(super) fn spread(without: &[f64]) -> f64 {
    jackknife(without).unwrap_or(f64::INFINITY)
}
