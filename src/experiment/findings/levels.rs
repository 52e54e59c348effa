//! How many readings an error needs until it stays below the level of its metric.

use super::Scope;
use crate::experiment::choices::Choice;
use crate::statistics::median_ranks;

/// Readings until an error stays below a level.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub enum Needed {
    /// At most these, the fewest that were tried.
    AtMost(f64),
    /// About these: between two budgets errors go straight in log-log.
    About(f64),
    /// More than these, the most that were tried.
    MoreThan(f64),
}

impl Needed {
    /// From (readings, error) of one material at each budget: at all budgets from the number on the error is at most the
    /// level. `None` of no budget.
    pub(super) fn until(level: f64, mut points: Vec<(f64, f64)>) -> Option<Self> {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (fewest, most) = (points.first()?.0, points.last()?.0);
        // A mean of logarithms may be off by rounding.
        let above = |(_, error): &(f64, f64)| *error > level * (1.0 + 1e-12);
        let Some(last) = points.iter().rposition(above) else {
            return Some(Self::AtMost(fewest));
        };
        let Some((n, error)) = points.get(last + 1) else {
            return Some(Self::MoreThan(most));
        };
        let (before, above) = points[last];
        if above.is_infinite() {
            return Some(Self::About(*n));
        }
        // Of an exact error a floor far below every level: its logarithm is finite.
        let [from, at, to] = [above, level, error.max(1e-12)].map(f64::ln);
        let share = (from - at) / (from - to);
        Some(Self::About(before * (n / before).powf(share)))
    }

    fn rank(self) -> (f64, u8) {
        match self {
            Self::AtMost(n) => (n, 0),
            Self::About(n) => (n, 1),
            Self::MoreThan(_) => (f64::INFINITY, 2),
        }
    }
}

/// A choice: the readings it needs.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelLine {
    /// The choice.
    pub choice: Choice,
    /// Readings at which half of the materials are below the level, or more.
    pub half: Needed,
    /// Interval of the median over further materials that holds it with 95 % at least; `None` of fewer than six materials.
    pub interval: Option<[Needed; 2]>,
    /// Materials that are below the level at the most readings.
    pub reached: usize,
}

impl LevelLine {
    /// From what each material needs; `None` of none.
    pub(super) fn new(choice: Choice, mut needed: Vec<Needed>) -> Option<Self> {
        needed.sort_by(|a, b| {
            let ((n, as_known), (m, as_well)) = (a.rank(), b.rank());
            n.total_cmp(&m).then(as_known.cmp(&as_well))
        });
        let half = *needed.get(needed.len().checked_sub(1)? / 2)?;
        let reached = needed.iter().filter(|n| !matches!(n, Needed::MoreThan(_)));
        Some(Self {
            choice,
            half,
            interval: median_ranks(needed.len()).map(|ranks| ranks.map(|rank| needed[rank])),
            reached: reached.count(),
        })
    }

    /// True if it needs fewer readings than another, or as many and is below the level of more materials.
    pub fn is_before(&self, other: &Self) -> bool {
        let key = |line: &Self| (line.half.rank(), std::cmp::Reverse(line.reached));
        key(self) < key(other)
    }
}

/// Every choice that was tried on all materials, in the order of the rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// The rows it is about.
    pub scope: Scope,
    /// The level, in the unit of the metric.
    pub level: f64,
    /// One line per choice.
    pub lines: Vec<LevelLine>,
}
