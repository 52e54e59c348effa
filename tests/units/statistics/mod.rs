mod paired;
mod variance;
mod wilcoxon;

use crate::common::near;
use gonio::statistics::{
    Bootstrap, error_at, geometric_mean, mean_and_error, median_ranks, order, pooled_order,
    upper_quantile,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

#[test]
fn means_of_logs() {
    // scipy.stats.gmean([0.02, 0.3, 1.7, 5e-4])
    let mean = geometric_mean(&[0.02, 0.3, 1.7, 5e-4]).unwrap();
    assert!((mean / 0.047_521_762_994_729_51 - 1.0).abs() < 1e-14);
    // sqrt(1e-12 · 1)
    let floored = geometric_mean(&[0.0, 1.0]).unwrap();
    assert!((floored / 1e-6 - 1.0).abs() < 1e-14);
    assert_eq!(geometric_mean(&[1e-300]), geometric_mean(&[0.0]));
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        assert_eq!(geometric_mean(&[1.0, bad]), None, "{bad}");
    }
    assert_eq!(geometric_mean(&[]), None);
}

#[test]
fn one_more_value_is_below_as_often_as_is_said() {
    // Of n + 1 values in any order the last is below the quantile of the others in at least that share.
    for n in [9, 10, 19, 40] {
        let all: Vec<f64> = (0..=n).map(|i| f64::from(i * 7919 % (n + 1))).collect();
        let below = (0..all.len()).filter(|&last| {
            let mut others = all.clone();
            let value = others.remove(last);
            value <= upper_quantile(&others, 0.9).unwrap()
        });
        let share = below.count() as f64 / all.len() as f64;
        let range = 0.9..0.9 + 1.0 / f64::from(n);
        assert!(range.contains(&share), "{n}: {share}");
    }
    assert_eq!(upper_quantile(&[1.0; 8], 0.9), None);
    assert_eq!(upper_quantile(&[], 0.0), None);
}

/// Of all equally likely ways in which values lie to the two sides of a median, those count in which it is between the ranks.
#[test]
fn the_interval_of_a_median_holds_it_as_often_as_is_said() {
    assert_eq!(median_ranks(5), None);
    // Hollander, Wolfe & Chicken 2014, table of the binomial: 12 values, the third and the tenth, 96.1 %.
    assert_eq!(median_ranks(12), Some([2, 9]));
    for n in 6..=16 {
        let [low, high] = median_ranks(n).unwrap();
        let holds = |low: usize, high: usize| {
            // The median lies above as many values as there are ones.
            let inside = (0..1_u32 << n).filter(|sides| {
                let below = sides.count_ones() as usize;
                (low + 1..=high).contains(&below)
            });
            inside.count() as f64 / f64::from(1_u32 << n)
        };
        assert!(holds(low, high) >= 0.95, "{n}");
        assert!(holds(low + 1, high - 1) < 0.95, "{n}");
    }
}

#[test]
fn means_are_known_to_their_errors() {
    // scipy.stats.sem([1, 2, 4, 9])
    let (mean, error) = mean_and_error(&[1.0, 2.0, 4.0, 9.0]).unwrap();
    assert_eq!(mean, 4.0);
    assert!((error.unwrap() - 1.779_513_042_005_219).abs() < 1e-12);
    assert_eq!(mean_and_error(&[3.0]), Some((3.0, None)));
    assert_eq!(mean_and_error(&[]), None);
}

#[test]
fn between_budgets_a_power_law_is_exact() {
    for slope in [-0.5, -1.3, 0.2] {
        let law = |budget: f64| 7.0 * budget.powf(slope);
        let points = [990.0, 231.0, 3900.0].map(|b| (b, law(b)));
        for budget in [231.0, 544.0, 990.0, 2000.0, 3900.0] {
            let found = error_at(&points, budget).unwrap();
            near(found / law(budget), 1.0, 1e-13, (slope, budget));
        }
        assert_eq!(error_at(&points, 230.0), None);
        assert_eq!(error_at(&points, 4000.0), None);
    }
    // Through the points, whatever is between.
    let bent = [(100.0, 0.1), (400.0, 0.4), (1600.0, 0.05)];
    assert!((error_at(&bent, 200.0).unwrap() / 0.2 - 1.0).abs() < 1e-14);
    assert!((error_at(&bent, 400.0).unwrap() / 0.4 - 1.0).abs() < 1e-14);
    // The same budget twice is no line, and a budget alone encloses nothing.
    assert_eq!(error_at(&[(100.0, 0.1), (100.0, 0.2)], 100.0), None);
    assert_eq!(error_at(&bent[..1], 100.0), None);
    assert_eq!(error_at(&[(100.0, f64::NAN), (400.0, 0.1)], 200.0), None);
}

const BUDGETS: [f64; 5] = [250.0, 1000.0, 4000.0, 16_000.0, 64_000.0];

#[test]
fn power_laws_come_back() {
    for slope in [-2.0, -0.5, 0.0, 0.25] {
        let points = BUDGETS.map(|b| (b, 3.0 * b.powf(slope)));
        let found = order(&points).unwrap();
        assert!((found.slope - slope).abs() < 1e-13, "{found:?}");
        assert!(found.standard_error.unwrap() < 1e-13);
        let two = order(&points[1..3]).unwrap();
        assert!((two.slope - slope).abs() < 1e-13);
        assert_eq!((two.standard_error, two.points), (None, 2));
    }
}

#[test]
fn as_scipy_has_it() {
    // linregress(log([250, 1000, 4000, 16000, 64000]), log([0.5, 0.21, 0.13, 0.05, 0.031]))
    let errors = [0.5, 0.21, 0.13, 0.05, 0.031];
    let points: Vec<_> = BUDGETS.into_iter().zip(errors).collect();
    let found = order(&points).unwrap();
    assert!((found.slope + 0.504_678_263_822_091).abs() < 1e-14);
    let error = found.standard_error.unwrap();
    assert!((error / 0.030_756_245_393_194_95 - 1.0).abs() < 1e-12);
}

#[test]
fn exact_points_do_not_flatten_the_line() {
    let mut points: Vec<_> = BUDGETS.map(|b| (b, 1.0 / b)).to_vec();
    let whole = order(&points).unwrap();
    points.extend([(1e6, 1e-15), (4e6, 0.0)]);
    assert_eq!(order(&points), Some(whole));
}

#[test]
fn no_line_no_order() {
    assert_eq!(order(&[]), None);
    assert_eq!(order(&[(100.0, 0.5), (0.0, 0.5), (200.0, 0.4)]), None);
    for other in [
        (100.0, 0.4),
        (200.0, 0.0),
        (200.0, f64::NAN),
        (200.0, f64::INFINITY),
    ] {
        assert_eq!(order(&[(100.0, 0.5), other]), None);
    }
}

#[test]
fn pooled_over_materials() {
    let slopes = [-0.5, -0.6, -0.4, -0.7, -0.45, -0.55];
    let pooled = pooled_order(&slopes, &Bootstrap::new(1)).unwrap();
    assert!((pooled.slope + 3.2 / 6.0).abs() < 1e-15);
    assert_eq!(pooled.interval, Bootstrap::new(1).mean_interval(&slopes));
    let [low, high] = pooled.interval.unwrap();
    assert!(-0.7 < low && low < pooled.slope && pooled.slope < high && high < -0.4);
    let pooled = |slopes: &[f64]| pooled_order(slopes, &Bootstrap::new(1));
    assert_eq!(pooled(&slopes[..5]).unwrap().interval, None);
    assert_eq!(pooled(&[]), None);
    assert_eq!(pooled(&[-0.5, f64::NAN]), None);
}

#[test]
fn intervals_cover_what_they_promise() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for n in [8, 24] {
        let mut covered = 0;
        for seed in 0..1000 {
            let mut draw = || 0.3 + 0.7 * Distribution::<f64>::sample(&StandardNormal, &mut rng);
            let values: Vec<f64> = (0..n).map(|_| draw()).collect();
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
    let interval = |values: &[f64]| Bootstrap::new(1).mean_interval(values);
    let [[a, b], [c, d]] = [&v, &w].map(|values| interval(values).unwrap());
    assert!((10.0 - 3.0 * b - c).abs() < 1e-12 && (10.0 - 3.0 * a - d).abs() < 1e-12);
    assert_eq!(interval(&v), interval(&v));
    assert_ne!(interval(&v), Bootstrap::new(2).mean_interval(&v));
    assert_eq!(interval(&[2.0; 6]), Some([2.0; 2]));
    assert_eq!(interval(&v[..5]), None);
    assert_eq!(interval(&[f64::NAN; 6]), None);
}
