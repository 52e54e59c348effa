use gonio::statistics::{Bootstrap, error_at, order, pooled_order};

#[test]
fn between_budgets_a_power_law_is_exact() {
    for slope in [-0.5, -1.3, 0.2] {
        let law = |budget: f64| 7.0 * budget.powf(slope);
        let points = [990.0, 231.0, 3900.0].map(|b| (b, law(b)));
        for budget in [231.0, 544.0, 990.0, 2000.0, 3900.0] {
            let found = error_at(&points, budget).unwrap();
            assert!(
                (found / law(budget) - 1.0).abs() < 1e-13,
                "{slope} {budget}"
            );
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
    assert_eq!(order(&[(100.0, 0.5), (100.0, 0.4)]), None);
    assert_eq!(order(&[(100.0, 0.5), (200.0, 0.0)]), None);
    assert_eq!(order(&[(100.0, 0.5), (0.0, 0.5), (200.0, 0.4)]), None);
    assert_eq!(order(&[(100.0, 0.5), (200.0, f64::NAN)]), None);
    assert_eq!(order(&[(100.0, 0.5), (200.0, f64::INFINITY)]), None);
}

#[test]
fn pooled_over_materials() {
    let slopes = [-0.5, -0.6, -0.4, -0.7, -0.45, -0.55];
    let pooled = pooled_order(&slopes, &Bootstrap::new(1)).unwrap();
    assert!((pooled.slope + 3.2 / 6.0).abs() < 1e-15);
    assert_eq!(pooled.interval, Bootstrap::new(1).mean_interval(&slopes));
    let [low, high] = pooled.interval.unwrap();
    assert!(-0.7 < low && low < pooled.slope && pooled.slope < high && high < -0.4);
    assert_eq!(
        pooled_order(&slopes[..5], &Bootstrap::new(1))
            .unwrap()
            .interval,
        None
    );
    assert_eq!(pooled_order(&[], &Bootstrap::new(1)), None);
    assert_eq!(pooled_order(&[-0.5, f64::NAN], &Bootstrap::new(1)), None);
}
