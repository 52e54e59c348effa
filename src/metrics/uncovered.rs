//! Shares of the test pairs that readings do not surround.
//!
//! Errors are those of the whole reconstruction, or a method would win by leaving hard pairs out. These
//! shares stand beside them and say how much of the whole is extrapolated. They are facts of the
//! poses that have a reading, and the same for every method.
//!
//! They are counted at the first 2000 pairs, which are spread as all are (a prefix of Sobol points): a
//! search of neighbours for each of 20 000 would take twice the time of a run that interpolates on
//! grids. The standard error of a share is at most 0.011, of one of 1 % it is 0.002.

use super::{Judged, Quantity, Values};
use crate::geometry::DirectionPair;
use crate::reconstruct::Coverage;

/// Pairs at which shares are counted: a multiple of the 8 after which the lobes of a measure repeat.
const COUNTED: usize = 2000;

/// Shares of the test pairs by their [`Coverage`]; interpolated is the rest. `None` if the truth has data
/// at no pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncovered {
    /// Share of the pairs beside the readings.
    pub extrapolated: Option<f64>,
    /// Share of the pairs far from all readings.
    pub unknown: Option<f64>,
}

impl Uncovered {
    /// Both shares, in the order of columns.
    pub const QUANTITIES: [Judged<Uncovered>; 2] = [
        (
            Quantity::real(
                "extrapolated",
                "share of the pairs (of the first 2000) on one side of the readings; interpolated is what this and unknown leave",
            ),
            |u| u.extrapolated,
        ),
        (
            Quantity::real(
                "unknown",
                "share of these pairs farther than 30° from every reading",
            ),
            |u| u.unknown,
        ),
    ];

    /// The pairs whose coverage is counted: the first of all.
    pub fn counted(pairs: &[DirectionPair]) -> &[DirectionPair] {
        &pairs[..pairs.len().min(COUNTED)]
    }

    /// From the coverage of the [`counted`](Self::counted) pairs: shares of those where the truth has
    /// data, as the errors are averaged.
    ///
    /// # Panics
    /// If the truth has fewer values.
    pub fn among(coverage: &[Coverage], truth: &Values) -> Self {
        let compared = coverage.iter().enumerate();
        let compared = compared.filter(|(i, _)| truth.get(*i).is_some());
        let mut counts = [0_usize; Coverage::ALL.len()];
        for (_, coverage) in compared {
            counts[*coverage as usize] += 1;
        }
        let all: usize = counts.iter().sum();
        let share = |of: Coverage| (all > 0).then(|| counts[of as usize] as f64 / all as f64);
        Self {
            extrapolated: share(Coverage::Extrapolated),
            unknown: share(Coverage::Unknown),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Coverage::{Extrapolated, Interpolated, Unknown};

    #[test]
    fn shares_are_of_the_pairs_that_are_compared() {
        let coverage = [Interpolated, Extrapolated, Unknown, Extrapolated, Unknown];
        let mut truth = Values {
            luminance: vec![1.0; 5],
            missing: Vec::new(),
        };
        let shares = |truth: &Values| {
            let found = Uncovered::among(&coverage, truth);
            Uncovered::QUANTITIES.map(|(_, of)| of(&found))
        };
        assert_eq!(shares(&truth), [Some(0.4), Some(0.4)]);
        truth.missing = vec![false, false, false, false, true];
        assert_eq!(shares(&truth), [Some(0.5), Some(0.25)]);
        // What breaks the promise of a BRDF is not compared either.
        truth.luminance[1] = f64::NAN;
        assert_eq!(shares(&truth), [Some(1.0 / 3.0); 2]);
        truth.missing = vec![true; 5];
        assert_eq!(shares(&truth), [None; 2]);
    }
}
