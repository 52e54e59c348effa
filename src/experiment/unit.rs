//! One schedule of a plan.

use super::choices::{Allowance, MAX_BUDGET};

/// A schedule: what it is uniform in, how large, by whom it is visited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Position of its coordinates in the plan.
    pub coordinates: usize,
    /// Position of its sample set.
    pub sample_set: usize,
    /// Position of its instrument; `None`: the ideal one.
    pub instrument: Option<usize>,
    /// How large it may be.
    pub allowance: Allowance,
    /// Seed.
    pub seed: u64,
}

/// Work of a job that does not depend on its budget, in poses: the comparison.
const FIXED_WORK: f64 = 4000.0;

/// Poses that an instrument visits in a minute, times the schedules that are tried to find out.
const MINUTE_WORK: f64 = 300.0;

impl Unit {
    /// About how many readings it has at most.
    pub fn readings(&self) -> usize {
        match self.allowance {
            Allowance::Poses(n) | Allowance::Readings(n) => n,
            Allowance::Minutes(minutes) => (minutes * MINUTE_WORK).min(MAX_BUDGET as f64) as usize,
        }
    }

    /// About how long a reconstruction takes, in the time of a pose; for bars and shares of work.
    pub fn work(&self) -> f64 {
        FIXED_WORK
            + match self.allowance {
                Allowance::Poses(n) | Allowance::Readings(n) => n as f64,
                Allowance::Minutes(minutes) => minutes * MINUTE_WORK,
            }
    }
}
