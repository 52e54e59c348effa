//! Means of errors.

use statrs::distribution::{Binomial, DiscreteCDF};

/// Errors below this, which are of rounding, count as this: their size would decide a geometric mean or a ratio.
pub const EXACT: f64 = 1e-12;

/// True of an error of rounding: [`EXACT`] at most, as which a geometric mean returns it but for rounding.
pub fn is_exact(error: f64) -> bool {
    error <= EXACT * (1.0 + 1e-9)
}

/// The geometric mean of non-negative errors; those below [`EXACT`], 0 among them, count as that.
///
/// `None` of no errors at all, and where one is negative or not finite.
pub fn geometric_mean(errors: &[f64]) -> Option<f64> {
    let logs: Option<Vec<f64>> = errors.iter().map(|e| log_error(*e)).collect();
    Some(mean(&logs?)?.exp())
}

/// True if the errors of all choices on a material say something of which is better: there are some, and none is exact.
pub fn compares(errors: impl IntoIterator<Item = f64>) -> bool {
    let least = errors.into_iter().reduce(f64::min);
    least.is_some_and(|least| !is_exact(least))
}

/// The value in the middle, or between the two there; `None` of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

/// What a further value like these is below with at least this probability (Vovk et al. 2005); `None` if there are too few.
pub fn upper_quantile(values: &[f64], probability: f64) -> Option<f64> {
    let rank = (probability * (values.len() + 1) as f64).ceil() as usize;
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.get(rank.checked_sub(1)?).copied()
}

/// Positions in `n` sorted values that the median of their distribution lies between with 95 % at least; `None` below six.
pub fn median_ranks(n: usize) -> Option<[usize; 2]> {
    // As many values fall to one side of it as tosses of a coin.
    let below = Binomial::new(0.5, n as u64).ok()?;
    let rare = (0..n).take_while(|k| below.cdf(*k as u64) <= 0.025);
    let low = rare.last()?;
    Some([low, n - 1 - low])
}

/// The logarithm of an error, under the floor of [`geometric_mean`].
pub(super) fn log_error(error: f64) -> Option<f64> {
    (error >= 0.0 && error.is_finite()).then(|| error.max(EXACT).ln())
}

/// The arithmetic mean; `None` of nothing.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The arithmetic mean and its standard error, which one value has not; `None` of nothing.
pub fn mean_and_error(values: &[f64]) -> Option<(f64, Option<f64>)> {
    let (n, mean) = (values.len() as f64, mean(values)?);
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    Some((mean, (n > 1.0).then(|| (squares / (n * (n - 1.0))).sqrt())))
}
