//! Sums over test pairs, and the [`Errors`] that follow from them.

use super::histogram::Histogram;
use super::sum::Sum;
use super::terms::{self, AVERAGES, Block, ENERGY, Pair, Sums, TERMS, defined};
use super::{Errors, Values};
use crate::geometry::{BLOCK, DirectionPair};
use crate::numeric::vectorised;

/// Standard error that is small enough for any error.
const NEGLIGIBLE: f64 = 1e-6;

/// Share of the measure where the relative error is above `relative_p999`.
const ABOVE: f64 = 0.001;

/// Sums over pairs, from which errors are made: per measure and replicate of the pairs.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    replicates: Vec<Replicate>,
}

/// Sums over the pairs of a replicate, measure by measure.
#[derive(Clone, Debug)]
pub struct Replicate {
    sums: Vec<Sums>,
    /// Weights by relative error, a column per measure.
    relative: Histogram,
    /// Pairs that were compared; those without a truth; those that have one, and no reconstruction.
    counts: [usize; 3],
}

impl Replicate {
    fn new(measures: usize) -> Self {
        Self {
            sums: vec![Sums::default(); measures],
            relative: Histogram::new(measures),
            counts: [0; 3],
        }
    }

    /// Adds pairs of a list, by number; `weights` has a list per measure, and the reconstruction begins at `offset`.
    ///
    /// # Panics
    /// If a list is too short.
    pub fn add(
        &mut self,
        numbers: &[u32],
        (pairs, weights): (&[DirectionPair], &[Vec<f64>]),
        truth: &Values,
        (reconstruction, offset): (&Values, usize),
    ) {
        let pairs = numbers.iter().map(|&i| i as usize).map(|i| Pair {
            truth: i,
            reconstruction: i - offset,
            cos: pairs[i].omega_i.cos_theta(),
        });
        self.see(pairs, |m, i| weights[m][i], truth, reconstruction);
    }

    /// Adds some pairs, with their weights by measure and number in the truth.
    fn see(
        &mut self,
        mut pairs: impl Iterator<Item = Pair>,
        weight: impl Fn(usize, usize) -> f64,
        truth: &Values,
        reconstruction: &Values,
    ) {
        let mut weights = vec![[0.0; BLOCK]; self.sums.len()];
        loop {
            let mut block = Block::new();
            for (j, pair) in pairs.by_ref().take(BLOCK).enumerate() {
                block.take(j, &pair, truth, reconstruction);
                for (m, weights) in weights.iter_mut().enumerate() {
                    weights[j] = weight(m, pair.truth);
                }
            }
            let n = block.counts.iter().sum();
            if n == 0 {
                break;
            }
            vectorised!(terms::add(&mut block, &mut weights, &mut self.sums));
            for j in 0..n {
                let weights = weights.iter().map(|weights| weights[j]);
                self.relative.add(block.steps[j], weights);
            }
            for (all, here) in self.counts.iter_mut().zip(block.counts) {
                *all += here;
            }
        }
    }
}

impl Tally {
    /// Of no pairs yet, of so many measures and independent replicates.
    pub fn new(measures: usize, replicates: usize) -> Self {
        Self {
            replicates: vec![Replicate::new(measures); replicates],
        }
    }

    /// Its replicates, to which pairs are added.
    pub fn replicates_mut(&mut self) -> &mut [Replicate] {
        &mut self.replicates
    }

    /// The errors under a measure, by number.
    pub fn errors(&self, measure: usize) -> Errors {
        self.named(self.averages(measure, None), self.quantile(measure, None))
    }

    /// The standard error of each error under a measure: of the jackknife over the replicates, which is that of
    /// their mean for an average (Efron & Stein 1981). `None` where one of them leaves nothing.
    pub fn standard_errors(&self, measure: usize) -> Errors {
        let of_quantile = self.jackknifed(|r| self.quantile(measure, Some(r)));
        self.named(self.standard_errors_of_averages(measure), of_quantile)
    }

    /// The standard error of a number, from those without one replicate each.
    fn jackknifed(&self, without: impl Fn(usize) -> Option<f64>) -> Option<f64> {
        let values = (0..self.replicates.len()).map(without);
        jackknife(&values.collect::<Option<Vec<f64>>>()?)
    }

    /// True if the standard error of every average is below 1e-6 or a share `tolerance` of it (of `energy`, of all energy).
    pub(crate) fn has_converged(&self, measure: usize, tolerance: f64) -> bool {
        let averages = self.averages(measure, None);
        let standard = self.standard_errors_of_averages(measure);
        let mut both = averages.iter().zip(standard).enumerate();
        both.all(|(k, both)| match both {
            (Some(_), Some(error)) if k == ENERGY => error <= tolerance,
            (Some(value), Some(error)) => error <= NEGLIGIBLE.max(tolerance * value),
            (value, _) => value.is_none(),
        })
    }

    fn standard_errors_of_averages(&self, measure: usize) -> [Option<f64>; AVERAGES] {
        let without = (0..self.replicates.len()).map(|r| self.averages(measure, Some(r)));
        let without: Vec<_> = without.collect();
        std::array::from_fn(|k| self.jackknifed(|r| without[r][k]))
    }

    /// All replicates but one.
    fn kept(&self, left_out: Option<usize>) -> impl Iterator<Item = &Replicate> + Clone {
        let all = self.replicates.iter().enumerate();
        all.filter(move |(r, _)| Some(*r) != left_out)
            .map(|(_, replicate)| replicate)
    }

    /// The averages of all replicates but one, in the order of [`Errors::QUANTITIES`].
    fn averages(&self, measure: usize, left_out: Option<usize>) -> [Option<f64>; AVERAGES] {
        let mut totals = [Sum::default(); 1 + TERMS];
        for replicate in self.kept(left_out) {
            for (total, sum) in totals.iter_mut().zip(replicate.sums[measure]) {
                total.add(sum.value());
            }
        }
        terms::averages(totals.map(Sum::value))
    }

    /// The quantile of the relative error of all replicates but one.
    fn quantile(&self, measure: usize, left_out: Option<usize>) -> Option<f64> {
        let kept = self.kept(left_out);
        let mut weight = Sum::default();
        kept.clone()
            .for_each(|replicate| weight.add(replicate.sums[measure][0].value()));
        let weight = weight.value();
        let all = kept.map(|replicate| &replicate.relative);
        let quantile = || Histogram::quantile(all, measure, ABOVE * weight);
        (weight > 0.0).then(quantile).and_then(defined)
    }

    fn named(&self, averages: [Option<f64>; AVERAGES], quantile: Option<f64>) -> Errors {
        let values = std::array::from_fn(|k| *averages.get(k).unwrap_or(&quantile));
        let count = |k: usize| self.replicates.iter().map(|r| r.counts[k]).sum();
        Errors::new(values, std::array::from_fn(count))
    }
}

/// Standard error of an estimate from those without one part each; `None` of fewer than two parts.
pub(crate) fn jackknife(without: &[f64]) -> Option<f64> {
    let n = without.len() as f64;
    let mean = without.iter().sum::<f64>() / n;
    let spread = without.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (n > 1.0).then(|| ((n - 1.0) / n * spread).sqrt())
}

/// The metrics over the pairs where both have a value; the others are counted.
///
/// # Panics
/// If the three lengths differ.
pub fn compare(pairs: &[DirectionPair], truth: &Values, reconstruction: &Values) -> Errors {
    averages(pairs, |_| 1.0, truth, reconstruction)
}

/// [`compare`] with a weight ≥ 0 per pair; pairs of weight 0 are not compared.
///
/// # Panics
/// If the four lengths differ.
pub fn compare_weighted(
    pairs: &[DirectionPair],
    weights: &[f64],
    truth: &Values,
    reconstruction: &Values,
) -> Errors {
    assert_eq!(pairs.len(), weights.len());
    averages(pairs, |i| weights[i], truth, reconstruction)
}

fn averages(
    pairs: &[DirectionPair],
    weight: impl Fn(usize) -> f64,
    truth: &Values,
    reconstruction: &Values,
) -> Errors {
    assert_eq!(pairs.len(), truth.luminance.len());
    assert_eq!(pairs.len(), reconstruction.luminance.len());
    let mut all = Replicate::new(1);
    let counted = (0..pairs.len()).filter(|&i| weight(i) > 0.0);
    let counted = counted.map(|i| Pair {
        truth: i,
        reconstruction: i,
        cos: pairs[i].omega_i.cos_theta(),
    });
    all.see(counted, |_, i| weight(i), truth, reconstruction);
    let replicates = vec![all];
    Tally { replicates }.errors(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_keep_what_plain_addition_loses() {
        let mut sum = Sum::default();
        sum.add(1.0);
        for _ in 0..1000 {
            sum.add(1e-17);
        }
        sum.add(1e16);
        sum.add(-1e16);
        assert_eq!(sum.value(), 1.0 + 1e-14);
    }
}
