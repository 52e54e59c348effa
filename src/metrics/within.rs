//! Share of the pairs where a reconstruction differs from the truth by no more than its uncertainty.

use super::sum::Sum;
use super::{Quantity, Values};

/// [`share_within`] in tables: more is better, about 0.95 is right.
pub const WITHIN: Quantity = Quantity::real(
    "within_2u",
    "share of the pairs where the truth is within k = 2 of the uncertainty that the readings give, about 0.95 if nothing else errs",
);

/// Share of the pairs where |g − f| ≤ 2 u (k = 2), u the standard uncertainty of g − f; pairs count by
/// `weight`, those where f or g has no value do not. `None` if no pair is left.
///
/// Of normal errors that u includes it is 0.95; less means errors that u does not include, as between readings. An error that all
/// readings share (type B) is within k = 2 nearly everywhere or nearly nowhere.
///
/// # Panics
/// If the three lengths differ.
pub fn share_within(
    weight: impl Fn(usize) -> f64,
    truth: &Values,
    reconstruction: &Values,
    uncertainty: &[f64],
) -> Option<f64> {
    assert_eq!(truth.luminance.len(), uncertainty.len());
    assert_eq!(reconstruction.luminance.len(), uncertainty.len());
    let [mut within, mut all] = [Sum::default(); 2];
    for (i, u) in uncertainty.iter().enumerate() {
        let (Some(f), Some(g)) = (truth.get(i), reconstruction.get(i)) else {
            continue;
        };
        all.add(weight(i));
        if (g - f).abs() <= 2.0 * u {
            within.add(weight(i));
        }
    }
    (all.value() > 0.0).then(|| within.value() / all.value())
}
