//! The metrics between a truth f and a reconstruction g at the same pairs.
//!
//! | name | definition | unit |
//! |---|---|---|
//! | `nrmse` | RMS of (g − f) cos over RMS of f cos | 1 |
//! | `log_relative` | mean \|ln((g + ε)/(f + ε))\| | 1 |
//! | `log1p` | mean \|ln(1 + g cos) − ln(1 + f cos)\| | 1 |
//! | `cbrt` | RMS of (g cos)^(1/3) − (f cos)^(1/3) | sr^(-1/3) |
//! | `mean_relative`, `max_relative` | mean and maximum of \|g − f\| / max(f, ε) | 1 |
//!
//! cos = cos θ_i, ε = 10⁻³ sr⁻¹. All are ≥ 0, and 0 if g = f at every pair.
//!
//! Undefined ones are `None`, an empty cell in a table: all of them if no pair is left to
//! compare, `nrmse` also if the truth is black. A NaN would be written as text, survive into a
//! median and compare false with every threshold; 0 would read as a perfect reconstruction.

use super::{Judged, Quantity, Values};
use crate::geometry::DirectionPair;
use serde::Serialize;

/// ε (sr⁻¹): the floor of the relative metrics, a third of a percent of a white diffuse surface.
const FLOOR: f64 = 1e-3;

/// Errors of one reconstruction under one measure; `None` where undefined, never NaN or infinite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// RMS of (g − f) cos over RMS of f cos; `None` also for a black truth.
    pub nrmse: Option<f64>,
    /// Mean |ln((g + 1e-3)/(f + 1e-3))|.
    pub log_relative: Option<f64>,
    /// Mean |ln(1 + g cos) − ln(1 + f cos)|.
    pub log1p: Option<f64>,
    /// RMS of (g cos)^(1/3) − (f cos)^(1/3).
    pub cbrt: Option<f64>,
    /// Mean of |g − f| / max(f, 1e-3).
    pub mean_relative: Option<f64>,
    /// Maximum of |g − f| / max(f, 1e-3).
    pub max_relative: Option<f64>,
    /// Pairs that were compared.
    pub pairs: usize,
    /// Pairs left out because the truth has no data there.
    pub pairs_missing: usize,
    /// Pairs left out because the reconstruction has no value where the truth has one.
    pub pairs_unreconstructed: usize,
}

impl Errors {
    /// Every error, in the order of columns, with its field.
    pub const QUANTITIES: [Judged<Errors>; 6] = [
        (
            Quantity::real(
                "nrmse",
                "RMS of (g − f) cos over RMS of f cos; f truth, g reconstruction, cos = cos theta_i",
            ),
            |e| e.nrmse,
        ),
        (
            Quantity::real("log_relative", "mean |ln((g + 1e-3)/(f + 1e-3))|"),
            |e| e.log_relative,
        ),
        (
            Quantity::real("log1p", "mean |ln(1 + g cos) − ln(1 + f cos)|"),
            |e| e.log1p,
        ),
        (
            Quantity::real("cbrt", "RMS of (g cos)^(1/3) − (f cos)^(1/3)"),
            |e| e.cbrt,
        ),
        (
            Quantity::real("mean_relative", "mean of |g − f| / max(f, 1e-3)"),
            |e| e.mean_relative,
        ),
        (
            Quantity::real("max_relative", "maximum of |g − f| / max(f, 1e-3)"),
            |e| e.max_relative,
        ),
    ];
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
    let [mut difference2, mut truth2, mut cbrt2] = [Sum::default(); 3];
    let [mut log_relative, mut log1p, mut relative, mut all] = [Sum::default(); 4];
    let mut max_relative = 0.0_f64;
    let (mut compared, mut missing, mut unreconstructed) = (0_usize, 0_usize, 0_usize);
    for (i, pair) in pairs.iter().enumerate() {
        let w = weight(i);
        if w == 0.0 {
            continue;
        }
        let Some(f) = truth.get(i) else {
            missing += 1;
            continue;
        };
        let Some(g) = reconstruction.get(i) else {
            unreconstructed += 1;
            continue;
        };
        compared += 1;
        all.add(w);
        let cos = pair.omega_i.cos_theta();
        let (f_cos, g_cos, difference) = (f * cos, g * cos, g - f);
        difference2.add(w * (difference * cos) * (difference * cos));
        truth2.add(w * f_cos * f_cos);
        let cbrt = g_cos.cbrt() - f_cos.cbrt();
        cbrt2.add(w * cbrt * cbrt);
        log_relative.add(w * ((g + FLOOR) / (f + FLOOR)).ln().abs());
        // One logarithm instead of two, and no cancellation where g is close to f.
        log1p.add(w * (difference * cos / (1.0 + f_cos)).ln_1p().abs());
        let r = difference.abs() / f.max(FLOOR);
        relative.add(w * r);
        max_relative = max_relative.max(r);
    }
    let mean = |sum: Sum| defined(sum.value() / all.value());
    Errors {
        nrmse: defined((difference2.value() / truth2.value()).sqrt()),
        log_relative: mean(log_relative),
        log1p: mean(log1p),
        cbrt: mean(cbrt2).map(f64::sqrt),
        mean_relative: mean(relative),
        max_relative: defined(max_relative).filter(|_| compared > 0),
        pairs: compared,
        pairs_missing: missing,
        pairs_unreconstructed: unreconstructed,
    }
}

/// The number; `None` for 0/0, x/0 and overflow.
fn defined(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// A running sum with Neumaier's compensation: correct to rounding whatever the number of terms,
/// always in the order of the pairs, hence the same on any number of threads.
#[derive(Clone, Copy, Default)]
pub(super) struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    #[inline]
    pub(super) fn add(&mut self, x: f64) {
        let total = self.sum + x;
        self.lost += if self.sum.abs() >= x.abs() {
            (self.sum - total) + x
        } else {
            (x - total) + self.sum
        };
        self.sum = total;
    }

    pub(super) fn value(self) -> f64 {
        self.sum + self.lost
    }
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
            close(errors.max_relative, f64::abs(c - 1.0));
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
            close(errors.max_relative, f64::abs(g - f) / f.max(1e-3));
            if f > 0.0 {
                close(errors.nrmse, f64::abs(g / f - 1.0));
            } else {
                assert_eq!(errors.nrmse, None);
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
        close(errors.max_relative, 1.0);
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
        close(errors.max_relative, 0.5);
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
                errors.max_relative,
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
