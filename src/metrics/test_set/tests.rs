//! Densities, replicates and convergence of test pairs.
use super::*;

fn spec(pairs: usize, mask_deg: f64, min_separation_deg: f64, seed: u64) -> MetricsSpec {
    MetricsSpec {
        pairs,
        mask_deg,
        min_separation_deg,
        seed,
        ..MetricsSpec::default()
    }
}

/// Mean over the replicates, and its standard error.
fn mean(of: impl Fn(usize) -> f64) -> (f64, f64) {
    let values: Vec<f64> = (0..REPLICATES).map(of).collect();
    let n = REPLICATES as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (spread / (n * (n - 1.0))).sqrt())
}

/// The integral of every density over the window is the share of its candidates that are inside.
#[test]
fn densities_are_those_of_the_candidates() {
    for (mask, separation) in [(90.0, 0.0), (80.0, 0.0), (40.0, 25.0)] {
        let set = TestSet::new(&Measure::USUAL, &spec(1 << 17, mask, separation, 3)).unwrap();
        let level = set.level(0);
        let each = set.first as f64;
        for (m, part) in MIXTURE.into_iter().enumerate() {
            let mut sobol = Sobol::new(99);
            let n = 1 << 15;
            let inside = (0..n).filter(|&i| {
                let pair = part.candidate(sobol.point(i), &set.window);
                pair.is_some_and(|pair| set.window.keeps(&pair))
            });
            let inside = inside.count() as f64 / n as f64;
            let (integral, error) = mean(|r| {
                let of = level.pairs[level.replicates[r].clone()].iter();
                let of = of.map(|pair| {
                    let densities = set.densities(pair);
                    let others: f64 = densities[1..].iter().sum();
                    densities[m] / (0.5 * (densities[0] + others / PARTS as f64))
                });
                of.sum::<f64>() / each
            });
            let off = (integral - inside).abs();
            assert!(
                off < 4.0 * error + 3e-3,
                "{mask} {m}: {integral} ± {error}, {inside}"
            );
            // Nearly empty is no test.
            assert!(inside > 0.05 || separation > 0.0, "{mask} {m}: {inside}");
        }
    }
}
