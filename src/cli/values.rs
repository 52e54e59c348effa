//! Numbers of options.

use crate::error::{self, ParameterError, left_open};
use crate::experiment::{MAX_BUDGET, MAX_MINUTES};
use std::ops::RangeBounds;

/// Reads a number of configurations: 1000, or 1e6.
pub(super) fn budget(text: &str) -> Result<usize, ParameterError> {
    const MOST: u64 = MAX_BUDGET as u64;
    let number = whole::<1, MOST>(text);
    let number = number.map_err(|e| ParameterError::new("budget", text, e.0))?;
    Ok(number as usize)
}

/// What a number of an option must be.
#[derive(Debug, thiserror::Error)]
#[error("allowed: {0}")]
pub(super) struct NoNumber(String);

/// Reads a whole number: 1000, or 1e6.
pub(super) fn whole<const LEAST: u64, const MOST: u64>(text: &str) -> Result<u64, NoNumber> {
    let text = text.trim();
    let of_float = |n: f64| (n.fract() == 0.0 && (0.0..1e15).contains(&n)).then_some(n as u64);
    let number = text.parse().ok();
    let number = number.or_else(|| of_float(text.parse().ok()?));
    number
        .filter(|n| (LEAST..=MOST).contains(n))
        .ok_or_else(|| {
            let allowed = match MOST {
                u64::MAX => format!("a whole number from {LEAST} on"),
                _ => format!("a whole number from {LEAST} to {MOST}"),
            };
            NoNumber(allowed)
        })
}

/// Reads a number in a range.
pub(super) fn in_range(
    key: &'static str,
    range: impl RangeBounds<f64> + Clone + Send + Sync + 'static,
) -> impl Fn(&str) -> Result<f64, NoNumber> + Clone + Send + Sync + 'static {
    move |text: &str| {
        let number = text.trim().parse().unwrap_or(f64::NAN);
        error::in_range(key, number, &range).map_err(|e| NoNumber(e.allowed))
    }
}

/// Reads a time in minutes: 90, or 0.5.
pub(super) fn minutes(text: &str) -> Result<f64, NoNumber> {
    in_range("minutes", left_open(0.0, MAX_MINUTES))(text)
}
