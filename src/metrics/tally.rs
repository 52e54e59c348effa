//! Sums over test pairs, and the [`Errors`] that follow from them.

use super::histogram::Histogram;
use super::sum::Sum;
use super::terms::{AVERAGES, Add, Block, Pair, Sums, TERMS};
use super::{Errors, Values};
use crate::geometry::{BLOCK, DirectionPair};
use pulp::Arch;
use std::ops::Range;

/// Standard error that is small enough for any error.
const NEGLIGIBLE: f64 = 1e-6;

/// Share of the measure where the relative error is above `relative_p999`.
const ABOVE: f64 = 0.001;

/// The number of `energy` among the averages.
const ENERGY: usize = AVERAGES - 1;

/// Sums over pairs, from which errors are made: per measure and replicate of the pairs.
#[derive(Clone, Debug)]
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

    /// Adds the pairs in a range of a list; `weights` are lists, one per measure. A reconstruction begins at `offset` of
    /// the list.
    ///
    /// # Panics
    /// If a list is too short.
    pub fn add(
        &mut self,
        range: Range<usize>,
        (pairs, weights): (&[DirectionPair], &[Vec<f64>]),
        truth: &Values,
        (reconstruction, offset): (&Values, usize),
    ) {
        let pairs = range.map(|i| Pair {
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
            Arch::new().dispatch(Add {
                block: &mut block,
                weights: &mut weights,
                sums: &mut self.sums,
            });
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
        let replicates = 0..self.replicates.len();
        let quantiles: Option<Vec<f64>> = replicates
            .map(|r| self.quantile(measure, Some(r)))
            .collect();
        self.named(
            self.standard_errors_of_averages(measure),
            quantiles.and_then(|values| jackknife(&values)),
        )
    }

    /// True if the standard error of every average is a share below `tolerance` of it (of `energy`, of all energy), or
    /// below 1e-6.
    pub fn has_converged(&self, measure: usize, tolerance: f64) -> bool {
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
        let replicates = 0..self.replicates.len();
        let without: Vec<_> = replicates
            .map(|r| self.averages(measure, Some(r)))
            .collect();
        std::array::from_fn(|k| {
            let values: Option<Vec<f64>> = without.iter().map(|averages| averages[k]).collect();
            values.and_then(|values| jackknife(&values))
        })
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
        let [
            weight,
            difference2,
            truth2,
            cbrt2,
            log_relative,
            log1p,
            relative,
            gain,
            energy,
        ] = totals.map(Sum::value);
        let mean = |sum: f64| defined(sum / weight);
        [
            defined((difference2 / truth2).sqrt()),
            mean(log_relative),
            mean(log1p),
            mean(cbrt2).map(f64::sqrt),
            mean(relative),
            defined(gain / energy),
        ]
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

    fn named(&self, averages: [Option<f64>; AVERAGES], relative_p999: Option<f64>) -> Errors {
        let [nrmse, log_relative, log1p, cbrt, mean_relative, energy] = averages;
        let count = |k: usize| self.replicates.iter().map(|r| r.counts[k]).sum();
        Errors {
            nrmse,
            log_relative,
            log1p,
            cbrt,
            mean_relative,
            energy,
            relative_p999,
            pairs: count(0),
            pairs_missing: count(1),
            pairs_unreconstructed: count(2),
        }
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

/// [`compare`] with a weight ≥ 0 per pair: averages are weighted, and pairs of weight 0 are not
/// compared.
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

/// The number; `None` for 0/0, x/0 and overflow.
fn defined(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::{Measure, MetricsSpec, test_pairs};

    fn pairs(n: usize) -> Vec<DirectionPair> {
        let spec = MetricsSpec {
            pairs: n,
            ..Default::default()
        };
        test_pairs(Measure::Lobe, &spec).unwrap()
    }

    fn values(luminance: Vec<f64>) -> Values {
        Values {
            luminance,
            missing: Vec::new(),
        }
    }

    fn close(got: Option<f64>, want: f64) {
        let got = got.unwrap();
        assert!((got - want).abs() <= 1e-14 * want.max(1.0), "{got} {want}");
    }

    /// The quantile is known to a step.
    fn near(got: Option<f64>, want: f64) {
        let got = got.unwrap();
        assert!((got - want).abs() <= want / 32.0, "{got} {want}");
    }

    #[test]
    fn the_quantile_is_where_a_thousandth_is_above() {
        let pairs = pairs(20_000);
        for scale in [1e-6, 1.0, 1e9] {
            // Relative errors that are evenly spread up to the scale, in no order.
            let error = |i: usize| scale * ((i * 7919) % 20_000) as f64 / 20_000.0;
            let g = (0..20_000).map(|i| 1.0 + error(i)).collect();
            let errors = compare(&pairs, &values(vec![1.0; 20_000]), &values(g));
            near(errors.relative_p999, 0.999 * scale);
            let mut tally = Tally::new(1, 16);
            let g = values((0..20_000).map(|i| 1.0 + error(i)).collect());
            let lists = (pairs.as_slice(), &[vec![2.0; 20_000]][..]);
            let truth = values(vec![1.0; 20_000]);
            for (r, replicate) in tally.replicates_mut().iter_mut().enumerate() {
                let part = 1250 * r..1250 * (r + 1);
                replicate.add(part, lists, &truth, (&g, 0));
            }
            assert_eq!(tally.errors(0).relative_p999, errors.relative_p999);
            assert!(tally.standard_errors(0).relative_p999.unwrap() < 1e-2 * scale);
        }
        let same = compare(
            &pairs,
            &values(vec![1.0; 20_000]),
            &values(vec![1.0; 20_000]),
        );
        assert_eq!(same.relative_p999, Some(0.0));
    }

    /// The standard error of a mean of replicates with as many pairs each is that of a mean.
    #[test]
    fn the_standard_error_of_an_average_is_that_of_a_mean() {
        let mut tally = Tally::new(1, 16);
        let errors: Vec<f64> = (0..16).map(|r| 0.1 + 0.01 * f64::from(r * r % 7)).collect();
        let pairs = pairs(5);
        let lists = (pairs.as_slice(), &[vec![1.0; 5]][..]);
        for (replicate, error) in tally.replicates_mut().iter_mut().zip(&errors) {
            let [f, g] = [1.0, 1.0 + error].map(|v| values(vec![v; 5]));
            replicate.add(0..5, lists, &f, (&g, 0));
        }
        let mean = errors.iter().sum::<f64>() / 16.0;
        let spread: f64 = errors.iter().map(|e| (e - mean).powi(2)).sum();
        close(tally.errors(0).mean_relative, mean);
        close(
            tally.standard_errors(0).mean_relative,
            (spread / (16.0 * 15.0)).sqrt(),
        );
    }

    #[test]
    fn a_scaled_truth_has_the_errors_on_paper() {
        let pairs = pairs(1000);
        // Values over nine decades, above the floor.
        let f: Vec<f64> = (0..1000)
            .map(|i| 10f64.powf(i as f64 / 111.0 - 2.0))
            .collect();
        for c in [0.0, 0.5, 1.0, 1.5, 4.0] {
            let g = f.iter().map(|f| c * f).collect();
            let errors = compare(&pairs, &values(f.clone()), &values(g));
            close(errors.nrmse, f64::abs(c - 1.0));
            close(errors.mean_relative, f64::abs(c - 1.0));
            close(errors.energy, c - 1.0);
            near(errors.relative_p999, f64::abs(c - 1.0));
            assert_eq!(errors.pairs, 1000);
            assert_eq!((errors.pairs_missing, errors.pairs_unreconstructed), (0, 0));
        }
    }

    #[test]
    fn a_weight_is_a_number_of_equal_pairs() {
        let pairs = pairs(60);
        let [f, g] = [3.7, 5.1].map(|k| (0..60).map(|i| 1.0 + f64::sin(k * i as f64)).collect());
        let [f, g] = [f, g].map(|v: Vec<f64>| v);
        let weights: Vec<f64> = (0..60).map(|i| f64::from(i % 4)).collect();
        let often = || (0..60).flat_map(|i| std::iter::repeat_n(i, i % 4));
        let many: Vec<_> = often().map(|i| pairs[i]).collect();
        let of = |v: &[f64]| values(often().map(|i| v[i]).collect());
        let repeated = compare(&many, &of(&f), &of(&g));
        let weighted = compare_weighted(&pairs, &weights, &values(f), &values(g));
        for (_, of) in Errors::QUANTITIES {
            close(of(&weighted), of(&repeated).unwrap());
        }
        assert_eq!((weighted.pairs, repeated.pairs), (45, 90));
    }

    #[test]
    fn constants_have_the_errors_on_paper() {
        let pairs = pairs(1000);
        let n = pairs.len() as f64;
        let mean = |of: &dyn Fn(f64) -> f64| {
            let cosines = pairs.iter().map(|p| p.omega_i.cos_theta());
            cosines.map(of).sum::<f64>() / n
        };
        for (f, g) in [(0.3, 0.2), (1e-5, 2e-4), (0.0, 0.1), (5.0, 0.0), (2.0, 2.0)] {
            let errors = compare(&pairs, &values(vec![f; 1000]), &values(vec![g; 1000]));
            close(errors.log_relative, ((g + 1e-3) / (f + 1e-3)).ln().abs());
            close(
                errors.log1p,
                mean(&|cos| ((1.0 + g * cos).ln() - (1.0 + f * cos).ln()).abs()),
            );
            let cbrt = mean(&|cos| cos.powf(2.0 / 3.0)).sqrt() * (g.cbrt() - f.cbrt()).abs();
            close(errors.cbrt, cbrt);
            close(errors.mean_relative, f64::abs(g - f) / f.max(1e-3));
            near(errors.relative_p999, f64::abs(g - f) / f.max(1e-3));
            if f > 0.0 {
                close(errors.nrmse, f64::abs(g / f - 1.0));
            } else {
                assert_eq!((errors.nrmse, errors.energy), (None, None));
            }
        }
    }

    #[test]
    fn the_cosine_is_that_of_the_light() {
        let pair = DirectionPair::from_spherical(1.0, 0.0, 0.2, 0.5);
        let errors = compare(&[pair], &values(vec![1.0]), &values(vec![8.0]));
        close(errors.cbrt, 1.0_f64.cos().cbrt());
        let two = [pair, pair.swapped()];
        let errors = compare(&two, &values(vec![1.0, 1.0]), &values(vec![2.0, 1.0]));
        let (c2, d2) = (1.0_f64.cos().powi(2), 0.2_f64.cos().powi(2));
        close(errors.nrmse, (c2 / (c2 + d2)).sqrt());
        close(errors.mean_relative, 0.5);
        close(errors.energy, 0.5);
        near(errors.relative_p999, 1.0);
    }

    #[test]
    fn missing_pairs_are_left_out_and_counted() {
        let pairs = pairs(6);
        let mut truth = values(vec![1.0; 6]);
        truth.missing = vec![true, true, false, false, false, false];
        let mut reconstruction = values(vec![9.0, 9.0, 9.0, 1.5, 1.5, 1.5]);
        reconstruction.missing = vec![false, true, true, false, false, false];
        let errors = compare(&pairs, &truth, &reconstruction);
        assert_eq!(errors.pairs, 3);
        assert_eq!(errors.pairs_missing, 2);
        assert_eq!(errors.pairs_unreconstructed, 1);
        close(errors.nrmse, 0.5);
        near(errors.relative_p999, 0.5);
    }

    #[test]
    fn values_that_break_the_promise_count_as_missing() {
        let pairs = pairs(4);
        let broken = values(vec![f64::NAN, f64::INFINITY, -0.1, 2.0]);
        let errors = compare(&pairs, &values(vec![1.0; 4]), &broken);
        assert_eq!((errors.pairs, errors.pairs_unreconstructed), (1, 3));
        close(errors.nrmse, 1.0);
    }

    #[test]
    fn undefined_errors_are_empty() {
        let pairs = pairs(3);
        let black = compare(&pairs, &values(vec![0.0; 3]), &values(vec![0.0; 3]));
        assert_eq!(black.nrmse, None);
        assert_eq!(black.mean_relative, Some(0.0));
        let none = Values {
            luminance: vec![0.0; 3],
            missing: vec![true; 3],
        };
        for errors in [
            compare(&pairs, &none, &values(vec![1.0; 3])),
            compare(&[], &values(vec![]), &values(vec![])),
        ] {
            assert_eq!(errors.pairs, 0);
            let all = [
                errors.nrmse,
                errors.log_relative,
                errors.log1p,
                errors.cbrt,
                errors.mean_relative,
                errors.relative_p999,
            ];
            assert_eq!(all, [None; 6]);
        }
        // The squares overflow, the logarithms do not.
        let huge = compare(&pairs, &values(vec![1.0; 3]), &values(vec![1e200; 3]));
        assert_eq!(huge.nrmse, None);
        assert!(huge.log_relative.is_some());
    }

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
