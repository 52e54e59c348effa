//! Search for the largest budget whose cost is within a limit.

use crate::experiment::choices::MAX_BUDGET;

/// Relative distance of a budget that fits and one that does not, at which the search ends: steps of grids are larger.
const CLOSE: f64 = 0.005;

/// The first budget that is tried.
pub(super) const FIRST: usize = 64;

/// Factors between one budget that fits and the next that is tried, as long as none was too large.
const GROWTH: (f64, f64) = (1.1, 8.0);

/// The largest budget, to half a percent, whose cost is at most `most`, by bisection; `None` if not even the smallest fits.
/// Costs grow with the budget, but for the steps of grids: of several budgets at the limit one is found.
pub(super) fn largest_within<E>(
    most: f64,
    mut cost_of: impl FnMut(usize) -> Result<f64, E>,
) -> Result<Option<usize>, E> {
    let (mut fits, mut exceeds) = (0, None);
    let mut budget = FIRST;
    loop {
        let cost = cost_of(budget)?;
        if cost <= most {
            fits = budget;
        } else {
            exceeds = Some(budget);
        }
        budget = match exceeds {
            None if budget == MAX_BUDGET => break,
            None => {
                let (slow, fast) = GROWTH;
                let factor = (most / cost).clamp(slow, fast);
                ((budget as f64 * factor) as usize + 1).min(MAX_BUDGET)
            }
            Some(above) => {
                let gap = above - fits;
                if gap <= 1 || (gap as f64) < CLOSE * above as f64 {
                    break;
                }
                fits + gap / 2
            }
        };
    }
    Ok((fits > 0).then_some(fits))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(seconds: f64, time: impl Fn(usize) -> f64) -> (Option<usize>, usize) {
        let mut asked = 0;
        let count = |n| {
            asked += 1;
            Ok::<_, ()>(time(n))
        };
        let best = largest_within(seconds, count).unwrap();
        (best, asked)
    }

    #[test]
    fn the_largest_budget_in_time_is_found() {
        for exponent in [0.6, 1.0, 1.3] {
            for truth in [1, 5, 63, 64, 65, 1000, 123_456, 9_999_999] {
                let time = |n: usize| (n as f64).powf(exponent);
                let seconds = time(truth) * (1.0 + 1e-12);
                let (best, asked) = found(seconds, time);
                let best = best.unwrap();
                assert!(best <= truth, "{best} of {truth}");
                assert!(
                    best as f64 >= truth as f64 * (1.0 - CLOSE) - 1.0,
                    "{best} of {truth}"
                );
                assert!(asked < 25, "{truth}: {asked}");
            }
        }
    }

    #[test]
    fn nothing_fits_no_time_and_everything_endless_time() {
        assert_eq!(found(0.5, |n| n as f64).0, None);
        assert_eq!(found(1e9, |_| 1.0).0, Some(MAX_BUDGET));
    }

    #[test]
    fn steps_do_not_lead_astray() {
        // Grids: the time is that of the next smaller cube.
        let time = |n: usize| (n as f64).cbrt().floor().powi(3);
        let (best, _) = found(1000.0, time);
        assert!(time(best.unwrap()) <= 1000.0 && best.unwrap() >= 1000);
    }
}
