//! Wilcoxon's signed-rank test of whether differences lean to one side.

use super::bootstrap::FEWEST;
use crate::numeric::ranks::doubled_ranks;
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

/// The least p that [`holm`] can leave to any of `tests` [`signed_rank`] tests of `n` differences each: `tests` · 2/2ⁿ, of
/// differences that all lean to one side, at most 1, and 1 below [`FEWEST`] differences, which are not tested.
pub fn least_p(n: usize, tests: usize) -> f64 {
    if n < FEWEST {
        return 1.0;
    }
    (tests.max(1) as f64 * 2.0 * (-(n as f64)).exp2()).min(1.0)
}
