//! Means of errors.

/// Errors below this count as this. An exact reconstruction has an error of rounding (1e-15), whose
/// size would decide a geometric mean or a ratio.
pub const EXACT: f64 = 1e-12;

/// The geometric mean of non-negative errors; those below [`EXACT`], 0 among them, count as that.
///
/// `None` of no errors at all, and where one is negative or not finite: a mean that leaves out the
/// worst says nothing.
pub fn geometric_mean(errors: &[f64]) -> Option<f64> {
    let logs: Option<Vec<f64>> = errors.iter().map(|e| log_error(*e)).collect();
    Some(mean(&logs?)?.exp())
}

/// The value in the middle, or between the two there; `None` of nothing.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

/// What a further value is below with at least this probability, if all are alike: the least value with enough at or
/// below it (Vovk et al. 2005); `None` if there are too few.
pub fn upper_quantile(values: &[f64], probability: f64) -> Option<f64> {
    let rank = (probability * (values.len() + 1) as f64).ceil() as usize;
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.get(rank.checked_sub(1)?).copied()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_of_logs() {
        // scipy.stats.gmean([0.02, 0.3, 1.7, 5e-4])
        let mean = geometric_mean(&[0.02, 0.3, 1.7, 5e-4]).unwrap();
        assert!((mean / 0.047_521_762_994_729_51 - 1.0).abs() < 1e-14);
        // sqrt(1e-12 · 1)
        let floored = geometric_mean(&[0.0, 1.0]).unwrap();
        assert!((floored / 1e-6 - 1.0).abs() < 1e-14);
        assert_eq!(geometric_mean(&[1e-300]), geometric_mean(&[0.0]));
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
            assert!(
                (0.9..0.9 + 1.0 / f64::from(n)).contains(&share),
                "{n}: {share}"
            );
        }
        assert_eq!(upper_quantile(&[1.0; 8], 0.9), None);
        assert_eq!(upper_quantile(&[], 0.0), None);
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
    fn no_mean_where_an_error_is_none() {
        for bad in [f64::NAN, f64::INFINITY, -1.0] {
            assert_eq!(geometric_mean(&[1.0, bad]), None, "{bad}");
        }
        assert_eq!(geometric_mean(&[]), None);
    }
}
