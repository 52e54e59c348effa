//! Order of convergence: the slope of ln error against ln budget.

use super::bootstrap::Bootstrap;
use super::mean::{EXACT, mean};

/// A straight line through ln error against ln budget.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Order {
    /// d ln error / d ln budget: −1/2 is what chance alone does; an interpolant of order k in d
    /// dimensions comes to −k/d. Positive where more readings make it worse.
    pub slope: f64,
    /// The standard error of the slope, from the scatter about the line; `None` of two points.
    pub standard_error: Option<f64>,
    /// Points the line goes through.
    pub points: usize,
}

/// The order of convergence of an error from (budget, error), by least squares.
///
/// Points with an error below [`EXACT`] are left out: rounding does not converge. `None` with fewer
/// than two different budgets left, and where a budget is not positive and finite or an error
/// negative or not finite.
pub fn order(points: &[(f64, f64)]) -> Option<Order> {
    let allowed = |(budget, error): &(f64, f64)| {
        *budget > 0.0 && budget.is_finite() && *error >= 0.0 && error.is_finite()
    };
    if !points.iter().all(allowed) {
        return None;
    }
    let told = points.iter().filter(|(_, error)| *error >= EXACT);
    let (x, y): (Vec<f64>, Vec<f64>) = told.map(|(b, e)| (b.ln(), e.ln())).unzip();
    if x.iter().all(|b| *b == x[0]) {
        return None;
    }
    let (x_mean, y_mean) = (mean(&x)?, mean(&y)?);
    let xy = || {
        x.iter()
            .map(|x| x - x_mean)
            .zip(y.iter().map(|y| y - y_mean))
    };
    let spread: f64 = xy().map(|(x, _)| x * x).sum();
    let slope = xy().map(|(x, y)| x * y).sum::<f64>() / spread;
    let left: f64 = xy().map(|(x, y)| (y - slope * x).powi(2)).sum();
    let standard_error = (x.len() > 2).then(|| (left / (x.len() - 2) as f64 / spread).sqrt());
    Some(Order {
        slope,
        standard_error,
        points: x.len(),
    })
}

/// The error at a budget between those of (budget, error): a straight line in ln error against ln
/// budget between the two next to it, so exact where the error is a power of the budget.
///
/// Points are in any order; errors below [`EXACT`] count as that. `None` where no two budgets enclose
/// it, and where a budget is not positive and finite or an error negative or not finite.
pub fn error_at(points: &[(f64, f64)], budget: f64) -> Option<f64> {
    let logs = |(b, e): &(f64, f64)| {
        let allowed = *b > 0.0 && b.is_finite() && *e >= 0.0 && e.is_finite();
        allowed.then(|| (b.ln(), e.max(EXACT).ln()))
    };
    let mut points = points.iter().map(logs).collect::<Option<Vec<_>>>()?;
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let x = budget.ln();
    points.windows(2).find_map(|ends| {
        let [(a, at_a), (b, at_b)] = [ends[0], ends[1]];
        let t = (x - a) / (b - a);
        (a < b && (0.0..=1.0).contains(&t)).then(|| (at_a + t * (at_b - at_a)).exp())
    })
}

/// The slopes of several materials together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PooledOrder {
    /// The mean slope.
    pub slope: f64,
    /// Its 95 % interval over materials, see [`Bootstrap::mean_interval`].
    pub interval: Option<[f64; 2]>,
    /// Number of materials.
    pub n: usize,
}

/// The mean of slopes, one per material. `None` of no slopes and where one is not finite.
pub fn pooled_order(slopes: &[f64], bootstrap: &Bootstrap) -> Option<PooledOrder> {
    slopes.iter().all(|s| s.is_finite()).then_some(())?;
    Some(PooledOrder {
        slope: mean(slopes)?,
        interval: bootstrap.mean_interval(slopes),
        n: slopes.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
