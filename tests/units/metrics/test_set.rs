//! Densities, replicates and convergence of test pairs.

use super::spec;
use crate::common::{near, values};
use gonio::geometry::DirectionPair;
use gonio::metrics::{Level, Measure, REPLICATES, TestSet, test_pairs};

/// Mean over the replicates, and its standard error.
fn mean(of: impl Fn(usize) -> f64) -> (f64, f64) {
    let values: Vec<f64> = (0..REPLICATES).map(of).collect();
    let n = REPLICATES as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (spread / (n * (n - 1.0))).sqrt())
}

/// Averages of the weighted pairs are those of the pairs of each measure.
#[test]
fn weights_lead_back_to_the_measures() {
    type Number = fn(&DirectionPair) -> f64;
    let numbers: [Number; 4] = [
        |p| p.omega_i.cos_theta() * p.omega_o.cos_theta(),
        |p| p.half().truncate().length(),
        |p| 1.0 / (1.0 + 1e4 * p.half().truncate().length_squared()),
        |p| f64::from(u8::from(p.separation() < 0.5)),
    ];
    for (mask, separation) in [(90.0, 0.0), (80.0, 0.0), (50.0, 20.0)] {
        // No pair of a narrower window grazes.
        let measures = &Measure::ALL[..if mask > 65.0 { 4 } else { 3 }];
        let set = TestSet::new(measures, &spec(1 << 16, mask, separation, 1)).unwrap();
        let level = set.level(0);
        assert!(mask < 90.0 || level.weights[0].iter().all(|w| *w <= 8.0 * (1.0 + 1e-12)));
        for (at, measure) in measures.iter().copied().enumerate() {
            let plain = test_pairs(measure, &spec(200_000, mask, separation, 2)).unwrap();
            for (k, number) in numbers.into_iter().enumerate() {
                let n = plain.len() as f64;
                let expected = plain.iter().map(number).sum::<f64>() / n;
                // That of independent pairs; Sobol points are better.
                let square: f64 = plain.iter().map(|p| (number(p) - expected).powi(2)).sum();
                let of_plain = square.sqrt() / n;
                let (found, error) = mean(|r| {
                    let (mut sum, mut all) = (0.0, 0.0);
                    for &i in &level.replicates[r] {
                        let i = i as usize;
                        sum += level.weights[at][i] * number(&level.pairs[i]);
                        all += level.weights[at][i];
                    }
                    sum / all
                });
                let what = || format!("{mask} {measure:?} {k}: {found} ± {error}, {expected}");
                assert!(error < 0.03 * expected, "{}", what());
                near(found, expected, 4.0 * error.hypot(of_plain), what());
            }
        }
    }
}

/// Levels go on where the one before ended.
#[test]
fn a_level_is_as_many_as_all_before_it() {
    let small = TestSet::new(&Measure::ALL, &spec(512, 80.0, 0.0, 0)).unwrap();
    let large = TestSet::new(&Measure::ALL, &spec(2048, 80.0, 0.0, 0)).unwrap();
    assert_eq!([small.candidates(0), small.candidates(2)], [512, 2048]);
    let of = |levels: &[Level], r: usize| -> Vec<DirectionPair> {
        let of = |l: &Level| -> Vec<DirectionPair> {
            l.replicates[r]
                .iter()
                .map(|&i| l.pairs[i as usize])
                .collect()
        };
        let mut all: Vec<DirectionPair> = levels.iter().flat_map(of).collect();
        // Each level is in an order of its own.
        all.sort_by_key(|pair| pair.omega_i.vector().x.to_bits());
        all
    };
    let levels: Vec<Level> = (0..3).map(|n| small.level(n)).collect();
    let whole = [large.level(0)];
    for r in 0..REPLICATES {
        assert_eq!(of(&levels, r), of(&whole, r));
    }
    let mut numbers = whole[0].replicates.concat();
    numbers.sort_unstable();
    assert!(numbers.into_iter().eq(0..whole[0].pairs.len() as u32));
}

/// Over many seeds an average differs from the truth as its standard error says, of a lobe that plain pairs
/// never see too.
#[test]
fn standard_errors_are_honest() {
    for width in [0.5, 0.03, 2e-3] {
        let value = |p: &DirectionPair, w: f64| {
            let sin2 = p.half().truncate().length_squared() / p.half().length_squared();
            0.1 + (-sin2 / (w * w)).exp() / (w * w)
        };
        let errors = |seed: u64, pairs: usize| {
            let set = TestSet::new(&[Measure::Cosine], &spec(pairs, 80.0, 0.0, seed)).unwrap();
            let level = set.level(0);
            let values = |w: f64| values(level.pairs.iter().map(|p| value(p, w)).collect());
            let mut tally = set.tally();
            level.add_to(&mut tally, &values(width), &values(1.1 * width));
            let of = |e: gonio::metrics::Errors| [e.nrmse, e.log_relative].map(Option::unwrap);
            (of(tally.errors(0)), of(tally.standard_errors(0)))
        };
        let (truth, _) = errors(1000, 1 << 17);
        let mut z2 = [0.0; 2];
        let seeds = 40;
        for seed in 0..seeds {
            let (found, standard) = errors(seed, 4096);
            for k in 0..2 {
                let [found, standard] = [found[k], standard[k]];
                assert!(standard < 0.1 * found, "{width} {k}: {standard} {found}");
                z2[k] += ((found - truth[k]) / standard).powi(2) / seeds as f64;
            }
        }
        // The mean of 40 squares of Student's t with 15 degrees of freedom is 1.15 ± 0.32.
        let is_honest = z2.iter().all(|z2| (0.4..2.4).contains(z2));
        assert!(is_honest, "{width}: {z2:?}");
    }
}
