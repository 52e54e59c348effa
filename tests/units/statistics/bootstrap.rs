use gonio::statistics::Bootstrap;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

#[test]
fn interval_as_scipy_has_it() {
    // v = exp(sin(arange(1, 25)**2)) - 1.1
    // bootstrap((v,), mean, method="percentile", n_resamples=1_000_000,
    //           confidence_level=1 - 2 * norm.cdf(-sqrt(24 / 23) * t.ppf(0.975, 23)))
    let v: Vec<f64> = (1..25)
        .map(|k| f64::from(k * k).sin().exp() - 1.1)
        .collect();
    let expected = [-0.297_909_250_340_226_6, 0.432_704_465_832_452_53];
    // The standard error of the 1.7 % point of 10 000 normal means is 3 % of their spread, 0.7 % of
    // the width: more than three of them.
    for seed in 0..20 {
        let got = Bootstrap::new(seed).mean_interval(&v).unwrap();
        let slack = 0.024 * (expected[1] - expected[0]);
        for (g, e) in got.iter().zip(expected) {
            assert!((g - e).abs() < slack, "{seed}: {got:?}");
        }
    }
}

#[test]
fn intervals_cover_what_they_promise() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for n in [8, 24] {
        let mut covered = 0;
        for seed in 0..1000 {
            let values: Vec<f64> = (0..n)
                .map(|_| 0.3 + 0.7 * Distribution::<f64>::sample(&StandardNormal, &mut rng))
                .collect();
            let [low, high] = Bootstrap::new(seed).mean_interval(&values).unwrap();
            covered += usize::from(low <= 0.3 && 0.3 <= high);
        }
        // 95 % of 1000 has a standard deviation of 0.7 %.
        assert!((930..=970).contains(&covered), "{n}: {covered}");
    }
}

#[test]
fn intervals_move_and_grow_with_their_values() {
    let v: Vec<f64> = (0..12).map(|k| f64::from(k * k % 7)).collect();
    let w: Vec<f64> = v.iter().map(|v| 10.0 - 3.0 * v).collect();
    let ([a, b], [c, d]) = (
        Bootstrap::new(1).mean_interval(&v).unwrap(),
        Bootstrap::new(1).mean_interval(&w).unwrap(),
    );
    assert!((10.0 - 3.0 * b - c).abs() < 1e-12 && (10.0 - 3.0 * a - d).abs() < 1e-12);
    assert_eq!(
        Bootstrap::new(1).mean_interval(&v),
        Bootstrap::new(1).mean_interval(&v)
    );
    assert_ne!(
        Bootstrap::new(1).mean_interval(&v),
        Bootstrap::new(2).mean_interval(&v)
    );
    assert_eq!(Bootstrap::new(1).mean_interval(&[2.0; 6]), Some([2.0; 2]));
    assert_eq!(Bootstrap::new(1).mean_interval(&v[..5]), None);
    assert_eq!(Bootstrap::new(1).mean_interval(&[f64::NAN; 6]), None);
}
