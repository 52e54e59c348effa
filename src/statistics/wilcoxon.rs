//! Wilcoxon's signed-rank test of whether differences lean to one side.

use super::bootstrap::FEWEST;
use super::ranks::doubled_ranks;
use statrs::distribution::{ContinuousCDF, Normal};

/// Most differences for which p is exact. Numbers of sign patterns, up to 2⁵⁰, are whole in `f64`.
const EXACT_UP_TO: usize = 50;

/// The two-sided p-value of the hypothesis that differences are as often as large to either side.
///
/// Differences of exactly 0 are left out, as Wilcoxon did. Up to 50 others p is exact, under ties too:
/// of all 2ⁿ sign patterns of the ranks at hand, how many are as far out. Above, normal, with the
/// variance that ties leave and a continuity correction. `None` with fewer than
/// [`FEWEST`] non-zero differences or where one is NaN.
pub fn signed_rank(differences: &[f64]) -> Option<f64> {
    let differences: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
    if differences.len() < FEWEST || differences.iter().any(|d| d.is_nan()) {
        return None;
    }
    let sizes: Vec<f64> = differences.iter().map(|d| d.abs()).collect();
    let ranks = doubled_ranks(&sizes);
    let total: usize = ranks.iter().sum();
    let up = ranks.iter().zip(&differences).filter(|(_, d)| **d > 0.0);
    let up: usize = up.map(|(r, _)| r).sum();
    // The distribution is symmetric about half the total.
    let least = up.min(total - up);
    let p = if ranks.len() <= EXACT_UP_TO {
        2.0 * at_most(&ranks, least)
    } else {
        // A doubled rank with a random sign adds rank²/4 to the variance of the doubled sum; half a
        // rank of continuity is 1 of it.
        let variance = ranks.iter().map(|r| (r * r) as f64).sum::<f64>() / 4.0;
        let z = (least as f64 + 1.0 - total as f64 / 2.0) / variance.sqrt();
        2.0 * Normal::standard().cdf(z)
    };
    Some(p.min(1.0))
}

/// The share of all subsets of ranks whose sum is at most `bound`.
fn at_most(ranks: &[usize], bound: usize) -> f64 {
    let mut subsets = vec![0.0; bound + 1];
    subsets[0] = 1.0;
    for rank in ranks {
        for sum in (*rank..=bound).rev() {
            subsets[sum] += subsets[sum - rank];
        }
    }
    subsets.iter().sum::<f64>() / 2f64.powi(ranks.len() as i32)
}

/// Holm's adjustment of p-values of several tests, in their order: with every adjusted p below
/// 0.05 called a finding, the chance of a single false one among all is at most 5 %.
///
/// The k-th least of m is multiplied by m − k + 1, is no less than the one before it, and no more than
/// 1. S. Holm, Scand. J. Statist. 6 (1979). NaN stays NaN and does not count as a test.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).filter(|i| !p[*i].is_nan()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let mut adjusted = vec![f64::NAN; p.len()];
    let mut least = 0.0f64;
    for (before, i) in order.iter().enumerate() {
        least = least.max(p[*i] * (order.len() - before) as f64).min(1.0);
        adjusted[*i] = least;
    }
    adjusted
}

/// The least p that [`holm`] can leave to any of `tests` [`signed_rank`] tests of `n` differences each,
/// at most 1: `tests` · 2/2ⁿ, of differences that all lean to one side. 1 below [`FEWEST`] differences,
/// which are not tested. Where it is 0.05 and more, no difference, however large, can be a finding.
pub fn least_p(n: usize, tests: usize) -> f64 {
    if n < FEWEST {
        return 1.0;
    }
    (tests.max(1) as f64 * 2.0 * (-(n as f64)).exp2()).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn check(differences: &[f64], expected: f64, tolerance: f64) {
        let p = signed_rank(differences).unwrap();
        assert!((p / expected - 1.0).abs() < tolerance, "{p} {expected}");
        let turned: Vec<f64> = differences.iter().map(|d| -d).collect();
        assert_eq!(signed_rank(&turned), Some(p));
    }

    #[test]
    fn as_scipy_has_it() {
        // wilcoxon(d, method="exact")
        let d = [
            -0.31, 0.12, -0.45, -0.08, 0.05, -0.27, -0.52, 0.19, -0.66, -0.14,
        ];
        check(&d, 0.064_453_125, 1e-15);
        // k = arange(1, n + 1); wilcoxon(sin(k * k) - 0.2, method="exact"), n = 50
        let wave = |n: i32| -> Vec<f64> { (1..=n).map(|k| f64::from(k * k).sin() - 0.2).collect() };
        check(&wave(50), 0.002_996_250_182_501_825, 1e-13);
        // wilcoxon(…, method="asymptotic", correction=True), n = 60
        check(&wave(60), 0.011_690_582_940_796_323, 1e-9);
        // d = round(4 * (sin(k * k) - 0.2)); wilcoxon(d[d != 0], the same): 55 left, many ties
        let ties: Vec<f64> = wave(60).iter().map(|d| (4.0 * d).round()).collect();
        assert_eq!(ties.iter().filter(|d| **d != 0.0).count(), 55);
        check(&ties, 0.010_787_070_899_041_616, 1e-9);
    }

    #[test]
    fn no_adjusted_p_is_less() {
        for n in [6, 8, 12] {
            let alone = signed_rank(&(1..=n).map(f64::from).collect::<Vec<_>>()).unwrap();
            for tests in [1, 3, 39] {
                let least = holm(&vec![alone; tests])[0];
                // Powers of two: exact.
                assert_eq!(least_p(n as usize, tests), least, "{n} {tests}");
            }
        }
        assert_eq!(least_p(5, 1), 1.0);
        assert_eq!(signed_rank(&[1.0, 2.0, 3.0, 4.0, 5.0]), None);
    }

    #[test]
    fn exact_under_ties() {
        let d = [
            -3.0, 1.0, -2.0, -2.0, 1.0, -4.0, -1.0, -3.0, 5.0, -5.0, -2.0, -6.0,
        ];
        // wilcoxon(d, method=PermutationMethod(n_resamples=10**6))
        check(&d, 0.059_082_031_25, 1e-15);
        // Zeros say nothing.
        let mut zeros = vec![0.0, -0.0];
        zeros.extend(d);
        check(&zeros, 0.059_082_031_25, 1e-15);
    }

    #[test]
    fn signs_all_alike() {
        // 2 of 2ⁿ patterns.
        let all: Vec<f64> = (1..=50).map(f64::from).collect();
        for n in [6, 7, 20, 50] {
            check(&all[..n], 2f64.powi(1 - n as i32), 1e-15);
        }
        assert_eq!(signed_rank(&all[..5]), None);
        assert_eq!(signed_rank(&[f64::NAN; 7]), None);
        // As balanced as can be.
        assert_eq!(signed_rank(&[1.0, -1.0, 1.0, -1.0, 1.0, -1.0]), Some(1.0));
    }

    #[test]
    fn exact_and_normal_meet() {
        // At n = 50 the two differ by O(1/n) of p.
        for shift in [0.0, 0.1, 0.2, 0.3] {
            let d: Vec<f64> = (1..=50).map(|k| f64::from(k * k).sin() - shift).collect();
            let exact = signed_rank(&d).unwrap();
            // One more difference, of no weight in the sum.
            let mut more = d.clone();
            more.push(1e-9);
            let normal = signed_rank(&more).unwrap();
            assert!((normal - exact).abs() < 0.02, "{shift}: {exact} {normal}");
        }
    }

    /// Kolmogorov's distance of p-values from uniform.
    fn distance(mut p: Vec<f64>) -> f64 {
        p.sort_by(f64::total_cmp);
        let n = p.len() as f64;
        let gap = |(i, p): (usize, &f64)| ((i + 1) as f64 / n - p).max(p - i as f64 / n);
        p.iter().enumerate().map(gap).fold(0.0, f64::max)
    }

    #[test]
    fn uniform_where_nothing_leans() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for n in [30, 80] {
            let p = |shift: f64, rng: &mut ChaCha8Rng| -> Vec<f64> {
                let mut draw = || shift + Distribution::<f64>::sample(&StandardNormal, rng);
                (0..2000)
                    .map(|_| signed_rank(&(0..n).map(|_| draw()).collect::<Vec<_>>()).unwrap())
                    .collect()
            };
            // Kolmogorov's 99.9 % point for 2000 is 1.95/sqrt(2000) = 0.044; the steps of the exact
            // p at n = 30 are at most 2 · 0.004 high.
            let null = distance(p(0.0, &mut rng));
            assert!(null < 0.052, "{n}: {null}");
            // And not where something does.
            assert!(distance(p(0.2, &mut rng)) > 0.15);
        }
    }

    #[test]
    fn holm_by_hand() {
        // 4 · 0.005, 3 · 0.01, 2 · 0.03, 0.04 raised to the one before it.
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
        for (a, e) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((a - e).abs() < 1e-15, "{adjusted:?}");
        }
        assert_eq!(holm(&[0.5, 0.9]), [1.0, 1.0]);
        assert_eq!(holm(&[0.2]), [0.2]);
        let with_nan = holm(&[0.01, f64::NAN, 0.5]);
        assert_eq!((with_nan[0], with_nan[2]), (0.02, 0.5));
        assert!(with_nan[1].is_nan() && holm(&[]).is_empty());
    }
}
