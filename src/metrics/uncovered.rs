//! Shares of the test pairs that readings do not surround.
//!
//! Errors are those of the whole reconstruction, or a method would win by leaving hard pairs out. These shares, which depend
//! on the poses that have a reading and on no method, say how much of the whole is extrapolated. They are counted at 2000 pairs
//! at most, as neighbours are sought for each, spread over those that a comparison begins with: their standard error is at
//! most 0.03 (a half by √(8/2000), 8 being the largest weight).

use super::{Judged, Values, quantity::quantities};
use crate::reconstruct::Coverage;

/// Pairs at which shares are counted, at most.
const COUNTED: usize = 2000;

/// Shares of the test pairs by their [`Coverage`]; interpolated is the rest. `None` if the truth has no data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncovered {
    /// Share of the pairs beside the readings.
    pub extrapolated: Option<f64>,
    /// Share of the pairs far from all readings.
    pub unknown: Option<f64>,
}

impl Uncovered {
    /// Both shares, in the order of columns.
    pub const QUANTITIES: [Judged<Uncovered>; 2] = quantities! {
        "extrapolated": extrapolated,
            "share of the pairs (of 2000 of them) on one side of the readings; interpolated is what this and unknown leave";
        "unknown": unknown, "share of these pairs farther than 30° from every reading";
    };

    /// Numbers of the pairs whose coverage is counted, of so many: evenly spread over all.
    pub fn counted(pairs: usize) -> impl Iterator<Item = usize> {
        // Pairs are in the order of their places.
        (0..pairs).step_by(pairs.div_ceil(COUNTED) | 1)
    }

    /// From the coverage of the [`counted`](Self::counted) pairs: shares of those where the truth has
    /// data, by the weights of all pairs, as the errors are averaged.
    ///
    /// # Panics
    /// If truth or weights are fewer.
    pub fn among(coverage: &[Coverage], weights: &[f64], truth: &Values) -> Self {
        let mut weight = [0.0; Coverage::ALL.len()];
        for (i, coverage) in Self::counted(weights.len()).zip(coverage) {
            if truth.get(i).is_some() {
                weight[*coverage as usize] += weights[i];
            }
        }
        let all: f64 = weight.iter().sum();
        let share = |of: Coverage| (all > 0.0).then(|| weight[of as usize] / all);
        Self {
            extrapolated: share(Coverage::Extrapolated),
            unknown: share(Coverage::Unknown),
        }
    }
}
