//! Test pairs of every measure at once, in independent replicates.
//!
//! A lobe of 0.1° gets a handful of ten thousand pairs that are spread as a measure is, and every seed misses it
//! alike. So the pairs are of one mixture q, which looks everywhere where a BRDF may be narrow, and an average
//! under a measure p weighs each pair by p/q and divides by the sum of these weights:
//!
//! | share | density of (omega_i, omega_o), omega_o with density cos θ_o / π but in the first and the last |
//! |---|---|
//! | 1/2 | cos θ_i cos θ_o / π² |
//! | 6/32 | half vectors with density D(θ_h) cos θ_h of GGX, alpha 0.3, 0.1, 0.03, 0.01, 0.003, 0.001 |
//! | 5/32 | \|h_bar\| with density s² / (π (s² + \|h_bar\|²)²), s = 0.1, 0.03, 0.01, 0.003, 0.001 |
//! | 4/32 | the same of half the distance between light and sensor, projected: s = 0.1, 0.03, 0.01, 0.003 |
//! | 1/32 | both directions uniform in solid angle: as many at grazing elevations as elsewhere |
//!
//! No weight of a cosine pair is above 2. Sixteen replicates are scrambled independently of each other, and the
//! scatter of what they say is the standard error of what all of them say (Owen, *Monte Carlo theory, methods and
//! examples*, §17.3 and §9.10). Pairs come in levels, each as many as all before it: a beginning is a mixture of the
//! same shares.
//!
//! Candidates outside the window (below the horizon, beyond the mask, too close) are left out and not replaced, so
//! that q is known. The parts of [`Measure::Lobe`] are weighed by their shares inside the window.

use super::pairs::{TRIAL, test_pairs};
use super::part::{Facts, LOBE_ALPHAS, MIXTURE, Window};
use super::{Measure, MetricsSpec, Replicate, Tally, Values, evaluate};
use crate::brdf::Brdf;
use crate::error::ParameterError;
use crate::geometry::DirectionPair;
use crate::sampling::Sobol;
use rayon::prelude::*;
use std::ops::Range;

/// Sets of pairs that are scrambled independently.
pub const REPLICATES: usize = 16;

/// Parts beside the cosine distribution, equally often.
const PARTS: usize = MIXTURE.len() - 1;

/// Candidates after which every part has had its share.
const CYCLE: usize = 2 * PARTS;

/// Pairs of all replicates, and their weights.
#[derive(Clone, Debug, Default)]
pub struct Level {
    /// Replicate after replicate.
    pub pairs: Vec<DirectionPair>,
    /// Weights of the pairs, one list per measure.
    pub weights: Vec<Vec<f64>>,
    /// Where the pairs of each replicate are.
    pub replicates: Vec<Range<usize>>,
}

impl Level {
    /// Adds the pairs to a tally of the same set, with the values at all of them.
    ///
    /// # Panics
    /// If it has other replicates or measures.
    pub fn add_to(&self, tally: &mut Tally, truth: &Values, reconstruction: &Values) {
        for (r, replicate) in tally.replicates_mut().iter_mut().enumerate() {
            self.add_replicate(r, replicate, truth, (reconstruction, 0));
        }
    }

    /// Adds the pairs of one replicate to its sums; the values of a reconstruction begin at `offset`.
    pub(crate) fn add_replicate(
        &self,
        r: usize,
        to: &mut Replicate,
        truth: &Values,
        (reconstruction, offset): (&Values, usize),
    ) {
        let lists = (self.pairs.as_slice(), self.weights.as_slice());
        let range = self.replicates[r].clone();
        to.add(range, lists, truth, (reconstruction, offset));
    }

    /// Replicates that follow each other, with at most so many pairs together, or one.
    pub fn chunks(&self, most: usize) -> Vec<Range<usize>> {
        let mut chunks: Vec<Range<usize>> = Vec::new();
        for (r, range) in self.replicates.iter().enumerate() {
            match chunks.last_mut() {
                Some(last) if range.end - self.replicates[last.start].start <= most => {
                    last.end = r + 1
                }
                _ => chunks.push(r..r + 1),
            }
        }
        chunks
    }

    /// The pairs of some replicates: where they begin and end.
    pub fn span(&self, replicates: &Range<usize>) -> Range<usize> {
        self.replicates[replicates.start].start..self.replicates[replicates.end - 1].end
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
    /// Shares of [`Part::Cosine`] and of each lobe of [`LOBE_ALPHAS`] inside the window.
    inside: [f64; 1 + LOBE_ALPHAS.len()],
}

impl TestSet {
    /// The pairs of `spec`, for these measures.
    ///
    /// # Errors
    /// As [`MetricsSpec::check`]; also for a window that keeps less than one candidate in a thousand.
    pub fn new(measures: &[Measure], spec: &MetricsSpec) -> Result<Self, ParameterError> {
        spec.check()?;
        let window = Window::new(spec.mask_deg, spec.min_separation_deg);
        let mut inside = [0.0; 1 + LOBE_ALPHAS.len()];
        let lobes = measures.contains(&Measure::Lobe);
        let asked = if lobes { inside.len() } else { 1 };
        for (inside, part) in inside.iter_mut().zip(MIXTURE).take(asked) {
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

    /// True if all that is waited for has converged: every measure but parts of others that are asked for too.
    pub(crate) fn is_enough(&self, tally: &Tally) -> bool {
        let is_part = |m: &Measure| self.measures.iter().any(|other| m.is_part_of(*other));
        let mut all = self.measures.iter().enumerate();
        all.all(|(at, m)| is_part(m) || self.has_converged(tally, at))
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
        let replicates: Vec<_> = replicates.map(|r| self.replicate(r, of.clone())).collect();
        let mut all = Level {
            weights: vec![Vec::new(); self.measures.len()],
            ..Level::default()
        };
        for (pairs, weights) in replicates {
            let start = all.pairs.len();
            all.pairs.extend(pairs);
            all.replicates.push(start..all.pairs.len());
            for (all, weights) in all.weights.iter_mut().zip(weights) {
                all.extend(weights);
            }
        }
        all
    }

    /// Pairs and weights of some candidates of a replicate.
    fn replicate(&self, replicate: usize, of: Range<usize>) -> (Vec<DirectionPair>, Vec<Vec<f64>>) {
        let mut sobol: Vec<Sobol> = (0..MIXTURE.len())
            .map(|part| {
                // Any odd constant keeps the seeds apart; `Sobol` hashes what it is given.
                let stream = (replicate * MIXTURE.len() + part + 1) as u64;
                let stream = stream.wrapping_mul(0x9e37_79b9_7f4a_7c15);
                Sobol::new(self.spec.seed.wrapping_add(stream))
            })
            .collect();
        let mut pairs = Vec::new();
        for i in of {
            let (part, number) = match i % 2 {
                0 => (0, i / 2),
                _ => (1 + i / 2 % PARTS, i / CYCLE),
            };
            let point = sobol[part].point(number as u64);
            let candidate = MIXTURE[part].candidate(point, &self.window);
            pairs.extend(candidate.filter(|pair| self.window.keeps(pair)));
        }
        pairs.sort_by_cached_key(place);
        let mut weights = vec![Vec::with_capacity(pairs.len()); self.measures.len()];
        for pair in &pairs {
            let densities = self.densities(pair);
            let others: f64 = densities[1..].iter().sum();
            let mixture = 0.5 * (densities[0] + others / PARTS as f64);
            for (weights, measure) in weights.iter_mut().zip(&self.measures) {
                let density = match measure.has(pair) {
                    true => self.density(*measure, &densities),
                    false => 0.0,
                };
                weights.push(density / mixture);
            }
        }
        (pairs, weights)
    }

    /// The densities of all parts at a pair.
    fn densities(&self, pair: &DirectionPair) -> [f64; MIXTURE.len()] {
        let facts = Facts::of(pair);
        MIXTURE.map(|part| part.density(&facts, &self.window))
    }

    /// The density of a measure inside the window, from those of the parts.
    fn density(&self, measure: Measure, densities: &[f64]) -> f64 {
        let cosine = densities[0] / self.inside[0];
        match measure {
            Measure::Cosine | Measure::Steep | Measure::Grazing => cosine,
            Measure::Lobe => {
                // The first parts after the cosine distribution are those of the measure.
                let lobes = densities[1..].iter().zip(&self.inside[1..]);
                let lobes: f64 = lobes.map(|(d, inside)| d / inside).sum();
                0.5 * (cosine + lobes / LOBE_ALPHAS.len() as f64)
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
