//! Pearson's chi² test, for the tests of everything that samples.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Number of `values` in each of `bins` equal bins of [0, 1]. Values outside panic.
pub fn equal_bins(values: impl Iterator<Item = f64>, bins: usize) -> Vec<u64> {
    let mut counts = vec![0; bins];
    for value in values {
        // Rounding may push a value that is 1 on paper past it.
        assert!((0.0..=1.0 + 1e-9).contains(&value), "{value} not in [0, 1]");
        counts[((value * bins as f64) as usize).min(bins - 1)] += 1;
    }
    counts
}

/// Probability that counts of uniform samples deviate at least as much as `counts` do.
pub fn uniformity(counts: &[u64]) -> f64 {
    let expected = counts.iter().sum::<u64>() as f64 / counts.len() as f64;
    goodness(counts, &vec![expected; counts.len()])
}

/// Probability that counts with the given expectations deviate at least as much as `counts` do.
pub fn goodness(counts: &[u64], expected: &[f64]) -> f64 {
    assert_eq!(counts.len(), expected.len());
    // Below five the statistic is not chi²-distributed.
    assert!(expected.iter().all(|e| *e >= 5.0), "bins too fine");
    let chi2: f64 = counts
        .iter()
        .zip(expected)
        .map(|(count, expected)| (*count as f64 - expected).powi(2) / expected)
        .sum();
    ChiSquared::new((counts.len() - 1) as f64).unwrap().sf(chi2)
}
