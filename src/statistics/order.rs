//! Order of convergence: the slope of ln error against ln budget.

use super::bootstrap::Bootstrap;
use super::mean::{EXACT, log_error, mean};

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

/// ln of a budget, positive and finite, and of an error, which is [`EXACT`] at least; `None` of other numbers.
fn logs((budget, error): &(f64, f64)) -> Option<(f64, f64)> {
    let is_budget = *budget > 0.0 && budget.is_finite();
    Some((budget.ln(), log_error(*error)?)).filter(|_| is_budget)
}

/// The order of convergence of an error from (budget, error), by least squares.
///
/// Points with an error below [`EXACT`] are left out. `None` with fewer than two different budgets left, and where a budget is
/// not positive and finite or an error negative or not finite.
pub fn order(points: &[(f64, f64)]) -> Option<Order> {
    let logs = points.iter().map(logs).collect::<Option<Vec<_>>>()?;
    let kept = logs.into_iter().zip(points);
    let kept = kept.filter(|(_, (_, error))| *error >= EXACT);
    let (x, y): (Vec<f64>, Vec<f64>) = kept.map(|(logs, _)| logs).unzip();
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

/// The error at a budget between those of (budget, error), straight in ln error against ln budget between the two next to it.
///
/// Points are in any order; errors below [`EXACT`] count as that. `None` where no two budgets enclose
/// it, and where a budget is not positive and finite or an error negative or not finite.
pub fn error_at(points: &[(f64, f64)], budget: f64) -> Option<f64> {
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
