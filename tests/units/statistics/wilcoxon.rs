use gonio::statistics::{holm, least_p, signed_rank};
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
