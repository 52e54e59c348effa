//! A schedule of a plan, by positions in the plan.

use super::choices::{Allowance, MAX_BUDGET};

/// A schedule: coordinates, sample set, instrument, size limit and seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Position of its coordinates in the plan.
    pub coordinates: usize,
    /// Position of its sample set.
    pub sample_set: usize,
    /// Position of its instrument; `None`: the ideal one.
    pub instrument: Option<usize>,
    /// Its size limit.
    pub allowance: Allowance,
    /// Seed.
    pub seed: u64,
}

/// Work of comparing one reconstruction, in poses; it does not depend on the budget.
const FIXED_WORK: f64 = 4000.0;

/// Poses that an instrument visits in a minute, times the schedules that are tried to find out.
const MINUTE_WORK: f64 = 300.0;

impl Unit {
    /// Upper estimate of its number of readings.
    pub fn readings(&self) -> usize {
        match self.allowance {
            Allowance::Poses(n) | Allowance::Readings(n) => n,
            Allowance::Minutes(minutes) => (minutes * MINUTE_WORK).min(MAX_BUDGET as f64) as usize,
        }
    }

    /// Estimated work of one reconstruction, in poses; for progress bars and shares.
    pub fn work(&self) -> f64 {
        FIXED_WORK
            + match self.allowance {
                Allowance::Poses(n) | Allowance::Readings(n) => n as f64,
                Allowance::Minutes(minutes) => minutes * MINUTE_WORK,
            }
    }
}
