//! Test pairs of every measure at once, in independent replicates.
//!
//! A lobe of 0.1° gets a handful of ten thousand pairs that are spread as a measure is, and every seed misses it
//! alike. So the pairs are of one mixture q, which looks everywhere where a BRDF may be narrow, and an average
//! under a measure p weighs each pair by p/q and divides by the sum of these weights:
//!
//! | share | density of omega_o | omega_i |
//! |---|---|---|
//! | 2/32 | cos θ_o / π | cos θ_i / π |
//! | 8/32 | uniform in solid angle | the same |
//! | 16/32 | uniform | half vectors with density D(θ_h) cos θ_h of GGX, alpha 0.1, 0.03, 0.01 (4 each), 0.003 (2), 0.3, 0.001 |
//! | 3/32 | uniform | \|h_bar\| with density s² / (π (s² + \|h_bar\|²)²), s = 0.1, 0.03, 0.01 |
//! | 3/32 | uniform | the same of half the distance between light and sensor, projected |
//!
//! Reconstructions err most about the mirror direction and towards the horizon. The density of the cosine measure is
//! nowhere above 8 q. Sixteen replicates are scrambled independently of each other, and the scatter of their averages is
//! the standard error of the average over all (Owen, *Monte Carlo theory, methods and examples*, §17.3 and §9.10). Pairs
//! come in levels, each as many as all before it: a beginning is a mixture of the same shares.
//!
//! Candidates outside the window (below the horizon, beyond the mask, too close) are left out and not replaced, so
//! that q is known. The parts of [`Measure::Lobe`] are weighed by their shares inside the window.

use super::pairs::{TRIAL, test_pairs};
use super::part::{Facts, MEASURED, MIXTURE, Part, Window};
use super::{Measure, MetricsSpec, Replicate, Tally, Values, evaluate};
use crate::brdf::Brdf;
use crate::error::ParameterError;
use crate::geometry::DirectionPair;
use crate::sampling::Sobol;
use rayon::prelude::*;
use std::ops::Range;

/// Sets of pairs that are scrambled independently.
pub const REPLICATES: usize = 16;

/// Candidates after which every part has had its share.
const CYCLE: usize = 32;

/// Pairs that stay together when the pairs of a level are dealt out to slices.
const HAND: usize = 256;

/// Slices of a level, at least, and pairs of a slice, at most.
const SLICES: usize = 6;
const SLICE: usize = 1 << 15;

/// Pairs of all replicates, and their weights.
#[derive(Clone, Debug, Default)]
pub struct Level {
    /// In [`slices`](Self::slices), the last with fewer pairs. Pairs that are near each other follow each other, and every
    /// slice has pairs of all places, so that the times of evaluating them may be compared.
    pub pairs: Vec<DirectionPair>,
    /// Weights of the pairs, one list per measure.
    pub weights: Vec<Vec<f64>>,
    /// Numbers of the pairs of each replicate, ascending.
    pub replicates: Vec<Vec<u32>>,
}

impl Level {
    /// The ranges of pairs that are evaluated at a time, and whose sums are added one after the other.
    pub fn slices(&self) -> impl Iterator<Item = Range<usize>> {
        let all = self.pairs.len();
        let slice = all.div_ceil(SLICES).clamp(1, SLICE);
        let starts = (0..all).step_by(slice);
        starts.map(move |start| start..all.min(start + slice))
    }

    /// Adds the pairs to a tally of the same set, with the values at all of them.
    ///
    /// # Panics
    /// If it has other replicates or measures.
    pub fn add_to(&self, tally: &mut Tally, truth: &Values, reconstruction: &Values) {
        for (r, replicate) in tally.replicates_mut().iter_mut().enumerate() {
            for range in self.slices() {
                self.add_replicate(r, replicate, range, truth, (reconstruction, 0));
            }
        }
    }

    /// Adds those pairs of one replicate to its sums that are in a range; the values of the reconstruction begin at the pair whose
    /// number is beside them.
    pub(crate) fn add_replicate(
        &self,
        r: usize,
        to: &mut Replicate,
        range: Range<usize>,
        truth: &Values,
        reconstruction: (&Values, usize),
    ) {
        let lists = (self.pairs.as_slice(), self.weights.as_slice());
        let all = &self.replicates[r];
        let [first, end] =
            [range.start, range.end].map(|n| all.partition_point(|&i| (i as usize) < n));
        to.add(&all[first..end], lists, truth, reconstruction);
    }
}

/// A truth and a reconstruction at as many test pairs as it takes.
pub struct Compared {
    /// The sums over all pairs.
    pub tally: Tally,
    /// The first pairs.
    pub first: Level,
    /// The values of both at the first pairs.
    pub values: [Values; 2],
}

/// The test pairs of some measures, without end.
pub struct TestSet {
    window: Window,
    spec: MetricsSpec,
    /// The measures, in the order of the weights.
    pub(crate) measures: Vec<Measure>,
    /// Candidates of a replicate in the first level.
    first: usize,
    /// The share inside the window of each distribution of [`MEASURED`]; 0 of those that no measure needs.
    inside: [f64; MEASURED.len()],
}

impl TestSet {
    /// The pairs of `spec`, for these measures.
    ///
    /// # Errors
    /// As [`MetricsSpec::check`]; also for a window that keeps less than one candidate in a thousand.
    pub fn new(measures: &[Measure], spec: &MetricsSpec) -> Result<Self, ParameterError> {
        spec.check()?;
        let window = Window::new(spec.mask_deg, spec.min_separation_deg);
        let mut inside = [0.0; MEASURED.len()];
        let lobes = measures.contains(&Measure::Lobe);
        let asked = if lobes { inside.len() } else { 1 };
        for (inside, part) in inside.iter_mut().zip(MEASURED).take(asked) {
            let mut sobol = Sobol::new(spec.seed);
            let kept = (0..TRIAL).filter(|&i| {
                let pair = part.candidate(sobol.point(i), &window);
                pair.is_some_and(|pair| window.keeps(&pair))
            });
            *inside = kept.count() as f64 / TRIAL as f64;
            if *inside < 1e-3 {
                return Err(spec.hopeless());
            }
        }
        for &measure in measures {
            // A part that the mask leaves nothing of.
            let few = MetricsSpec {
                pairs: 1,
                ..spec.clone()
            };
            test_pairs(measure, &few)?;
        }
        Ok(Self {
            window,
            spec: spec.clone(),
            measures: measures.to_vec(),
            first: spec.pairs.div_ceil(REPLICATES * CYCLE) * CYCLE,
            inside,
        })
    }

    /// Candidates of this and all levels before it.
    pub fn candidates(&self, level: usize) -> usize {
        (REPLICATES * self.first) << level
    }

    /// An empty sum over these pairs.
    pub fn tally(&self) -> Tally {
        Tally::new(self.measures.len(), REPLICATES)
    }

    /// True if the pairs of another level would be more than `max_pairs`.
    pub(crate) fn is_last(&self, level: usize) -> bool {
        self.candidates(level + 1) > self.spec.max_pairs
    }

    /// True if the standard error of every average under a measure, by number, is below the tolerance.
    pub fn has_converged(&self, tally: &Tally, measure: usize) -> bool {
        tally.has_converged(measure, self.spec.tolerance)
    }

    /// True if the averages under every measure have converged.
    pub(crate) fn is_enough(&self, tally: &Tally) -> bool {
        (0..self.measures.len()).all(|at| self.has_converged(tally, at))
    }

    /// Compares a reconstruction with a truth, level after level until their number is enough.
    pub fn compare(&self, truth: &dyn Brdf, reconstruction: &dyn Brdf) -> Compared {
        let values = |level: &Level| [truth, reconstruction].map(|b| evaluate(b, &level.pairs));
        let first = self.level(0);
        let mut compared = Compared {
            tally: self.tally(),
            values: values(&first),
            first,
        };
        let [f, g] = &compared.values;
        compared.first.add_to(&mut compared.tally, f, g);
        let mut n = 0;
        while !self.is_enough(&compared.tally) && !self.is_last(n) {
            n += 1;
            let level = self.level(n);
            let [f, g] = values(&level);
            level.add_to(&mut compared.tally, &f, &g);
        }
        compared
    }

    /// The pairs of a level: those of level 0 are the beginning, each further one has as many as all before it.
    pub fn level(&self, level: usize) -> Level {
        let of = match level {
            0 => 0..self.first,
            level => self.first << (level - 1)..self.first << level,
        };
        let replicates = (0..REPLICATES).into_par_iter();
        let replicates = replicates.map(|r| {
            self.replicate(r, of.clone())
                .into_iter()
                .map(move |pair| (r, pair))
        });
        let mut pairs: Vec<(usize, DirectionPair)> = replicates.flatten_iter().collect();
        pairs.par_sort_by_cached_key(|(_, pair)| place(pair));
        let hands: Vec<_> = pairs.chunks(HAND).collect();
        let slices = SLICES.max(pairs.len().div_ceil(SLICE));
        let dealt = (0..slices).flat_map(|first| hands.iter().skip(first).step_by(slices));
        let mut numbers = vec![Vec::new(); REPLICATES];
        let number = |((r, pair), number): (&(usize, DirectionPair), u32)| {
            numbers[*r].push(number);
            *pair
        };
        let pairs: Vec<DirectionPair> = dealt.copied().flatten().zip(0..).map(number).collect();
        let densities: Vec<_> = pairs.par_iter().map(|pair| self.densities(pair)).collect();
        let weights = |measure: &Measure| {
            let weight = |(pair, (mixture, measured)): (&DirectionPair, &(f64, _))| {
                if measure.has(pair) {
                    self.density(*measure, measured) / mixture
                } else {
                    0.0
                }
            };
            pairs.iter().zip(&densities).map(weight).collect()
        };
        Level {
            weights: self.measures.iter().map(weights).collect(),
            replicates: numbers,
            pairs,
        }
    }

    /// Pairs of some candidates of a replicate.
    fn replicate(&self, replicate: usize, of: Range<usize>) -> Vec<DirectionPair> {
        let mut pairs = Vec::new();
        // Levels begin and end with a cycle.
        let cycles = of.start / CYCLE..of.end / CYCLE;
        for (number, (part, share)) in MIXTURE.into_iter().enumerate() {
            // Any odd constant keeps the seeds apart; `Sobol` hashes what it is given.
            let stream = (replicate * MIXTURE.len() + number + 1) as u64;
            let stream = stream.wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mut sobol = Sobol::new(self.spec.seed.wrapping_add(stream));
            for point in cycles.start * share..cycles.end * share {
                let candidate = part.candidate(sobol.point(point as u64), &self.window);
                pairs.extend(candidate.filter(|pair| self.window.keeps(pair)));
            }
        }
        pairs
    }

    /// Density of the mixture at a pair, and of each of [`MEASURED`].
    fn densities(&self, pair: &DirectionPair) -> (f64, [f64; MEASURED.len()]) {
        let facts = Facts::of(pair);
        let density = |part: Part| part.density(&facts, &self.window);
        let shares = MIXTURE
            .iter()
            .map(|(part, share)| density(*part) * *share as f64);
        (shares.sum::<f64>() / CYCLE as f64, MEASURED.map(density))
    }

    /// The density of a measure inside the window, from those of [`MEASURED`].
    fn density(&self, measure: Measure, densities: &[f64; MEASURED.len()]) -> f64 {
        let cosine = densities[0] / self.inside[0];
        match measure {
            Measure::Cosine | Measure::Steep | Measure::Grazing => cosine,
            Measure::Lobe => {
                let lobes = densities[1..].iter().zip(&self.inside[1..]);
                let lobes: f64 = lobes.map(|(d, inside)| d / inside).sum();
                0.5 * (cosine + lobes / (MEASURED.len() - 1) as f64)
            }
        }
    }
}

/// Where a pair is on a curve through all pairs (Morton 1966, over sqrt |h_bar|, |k_bar| and the angle between):
/// what is looked up for pairs that follow each other is near in memory.
fn place(pair: &DirectionPair) -> u32 {
    const BITS: u32 = 7;
    let (h, k) = pair.half_and_back();
    let [h, k] = [h.truncate(), k.truncate()];
    let [r, s] = [h.length(), k.length()];
    let cos = match r * s > 0.0 {
        true => h.dot(k).abs() / (r * s),
        false => 0.0,
    };
    let numbers = [r.sqrt(), s, cos].map(|x| (x * f64::from(1 << BITS)) as u32);
    let bit = |bit: u32| numbers.iter().fold(0, |key, n| 2 * key + (n >> bit & 1));
    (0..=BITS).rev().fold(0, |key, b| 8 * key + bit(b))
}
