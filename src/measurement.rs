//! What an instrument reported: plain data.

use crate::brdf::Channels;
use crate::schedule::Schedule;
use std::sync::Arc;

/// What became of one pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Outcome {
    /// There is a reading.
    Reading,
    /// The material has no data there (an invalid cell of a table).
    NoData,
}

/// The outcomes of a schedule, in its order.
#[derive(Clone)]
pub struct Measurement {
    /// What was visited.
    pub schedule: Arc<Schedule>,
    /// Values per reading.
    pub channels: Channels,
    /// f_r in sr⁻¹, pose-major (`poses × channels`); meaningless where there is no reading.
    pub values: Vec<f64>,
    /// One a pose.
    pub outcomes: Vec<Outcome>,
}

impl Measurement {
    /// Number of poses with a reading.
    pub fn readings(&self) -> usize {
        let reading = |o: &&Outcome| **o == Outcome::Reading;
        self.outcomes.iter().filter(reading).count()
    }

    /// Number of poses where the material has no data.
    pub fn no_data(&self) -> usize {
        self.outcomes.len() - self.readings()
    }

    /// The values of pose `i`, `None` if there is no reading.
    pub fn value(&self, i: usize) -> Option<&[f64]> {
        let n = self.channels.count();
        match self.outcomes[i] {
            Outcome::Reading => Some(&self.values[i * n..(i + 1) * n]),
            Outcome::NoData => None,
        }
    }
}
