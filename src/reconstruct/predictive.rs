//! What a reconstruction knows of its own errors.

use crate::geometry::DirectionPair;

/// What is known of the luminance f at a pair: ln(f + ε) as a normal variable, ε = 10⁻³ sr⁻¹.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LogNormal {
    /// Mean of ln(f + ε).
    pub mean: f64,
    /// Variance of ln(f + ε).
    pub variance: f64,
    /// The part of the variance that is of errors which all readings share: one draw of them is the error everywhere.
    pub shared: f64,
}

/// A reading that all others contradict, and that is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspect {
    /// The number of its pose.
    pub pose: usize,
    /// Its luminance f, sr⁻¹.
    pub value: f64,
    /// What the others predict of that.
    pub expected: f64,
    /// The standard uncertainty (k = 1) of the prediction, sr⁻¹.
    pub uncertainty: f64,
}

/// A reconstruction that knows how far off it may be between readings.
pub trait Predictive: Send + Sync {
    /// What is known at pairs.
    fn predict(&self, pairs: &[DirectionPair]) -> Vec<LogNormal>;

    /// The readings that it leaves out, in the order of the schedule.
    fn suspects(&self) -> &[Suspect] {
        &[]
    }
}
