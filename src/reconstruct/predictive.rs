//! What a reconstruction knows of its own errors.

use crate::geometry::DirectionPair;

/// What is known of the luminance f at a pair: ln(f + ε) as a normal variable, ε = 10⁻³ sr⁻¹.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LogNormal {
    /// Mean of ln(f + ε).
    pub mean: f64,
    /// Variance of ln(f + ε).
    pub variance: f64,
}

/// A reconstruction that knows how far off it may be between readings.
pub trait Predictive: Send + Sync {
    /// What is known at pairs.
    fn predict(&self, pairs: &[DirectionPair]) -> Vec<LogNormal>;
}
