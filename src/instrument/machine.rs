//! The moving parts: a chain of rotation axes, its class, and what it cannot reach.

use super::class::Class;
use super::spec::InstrumentSpec;
use crate::error::ParameterError;
use crate::geometry::DirectionPair;
use crate::schedule::{Positions, Unreachable};

/// One axis, angles in radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its name.
    pub name: String,
    /// Lowest and highest position, rad.
    pub range: [f64; 2],
    /// rad/s.
    pub speed: f64,
    /// rad/s².
    pub acceleration: f64,
    /// Smallest step, rad; 0: none.
    pub resolution: f64,
    /// Standard deviation from one approach to the next, rad.
    pub repeatability: f64,
    /// Standard deviation of the offset that all positions of one instrument share, rad.
    pub bias: f64,
    /// True if it turns round without end.
    pub wraps: bool,
}

/// A chain of axes with its limits.
#[derive(Debug)]
pub struct Machine {
    axes: Vec<Axis>,
    class: Box<dyn Class>,
}
