use gonio::metrics::Expected;
use gonio::reconstruct::{EPSILON, LogNormal};
use gonio::sampling::Random;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;

/// Pairs whose ln f has variances about one.
fn pairs(variance: f64) -> Vec<(f64, f64, LogNormal)> {
    let pair = |i: i32| {
        let i = f64::from(i);
        let known = LogNormal {
            mean: (0.7 * i).sin(),
            variance: variance * (1.0 + 0.5 * (1.3 * i).cos()),
            shared: 0.0,
        };
        (1.0 + (0.4 * i).cos().powi(2), 0.3 + 0.015 * i, known)
    };
    (0..40).map(pair).collect()
}

/// The mean square of errors of the median of f, over that of the median and over the mean square of f; the mean
/// absolute error of ln f. All by draws.
fn drawn(pairs: &[(f64, f64, LogNormal)]) -> [f64; 3] {
    const DRAWS: i32 = 40_000;
    let [mut square, mut log, mut all, mut median, mut mean] = [0.0; 5];
    for (i, (weight, cosine, known)) in pairs.iter().enumerate() {
        let mut random = Random::new(i as u64).stream(0);
        let shifted = known.mean.exp();
        let bright = |f: f64| weight * ((f - EPSILON) * cosine).powi(2);
        all += weight;
        median += bright(shifted);
        for _ in 0..DRAWS {
            let z: f64 = StandardNormal.sample(&mut random);
            let off = z * known.variance.sqrt();
            let draws = f64::from(DRAWS);
            square += weight * (shifted * cosine * off.exp_m1()).powi(2) / draws;
            mean += bright(shifted * off.exp()) / draws;
            log += weight * off.abs() / draws;
        }
    }
    [(square / median).sqrt(), (square / mean).sqrt(), log / all]
}

#[test]
fn errors_are_as_large_on_average_as_is_expected() {
    for variance in [1e-3, 0.5] {
        let pairs = pairs(variance);
        let expected = Expected::from_pairs(pairs.iter().copied());
        let (nrmse, log_relative) = (expected.nrmse.unwrap(), expected.log_relative.unwrap());
        let [most, least, log] = drawn(&pairs);
        let rounding = 0.005;
        assert!(nrmse < most * (1.0 + rounding) && nrmse > least * (1.0 - rounding));
        if variance < 0.01 {
            assert!((most / least - 1.0).abs() < 0.01, "{most} {least}");
        }
        assert!((log_relative / log - 1.0).abs() < 0.01);
    }
}

#[test]
fn of_the_black_only_the_logarithm_is_known() {
    let black = LogNormal {
        mean: EPSILON.ln() - 0.1,
        variance: 0.04,
        shared: 0.01,
    };
    let expected = Expected::from_pairs(std::iter::once((1.0, 0.5, black)));
    let log = (2.0 * 0.04 / PI).sqrt();
    assert_eq!(expected.nrmse, None);
    assert!((expected.log_relative.unwrap() - log).abs() < 1e-15);
    assert!((expected.shared[1].unwrap() - 0.5 * log).abs() < 1e-15);
    let nothing = Expected::from_pairs(std::iter::empty());
    assert_eq!(nothing, Expected::default());
}
