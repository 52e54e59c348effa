//! The value that is interpolated: f itself or its logarithm.

use crate::error::{ParameterError, in_left_open};
use crate::geometry::DirectionPair;
use crate::numeric::powers::{exp, ln};
use serde::{Deserialize, Serialize};

/// Function of f_r that is interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Values {
    /// f itself.
    Linear,
    /// ln(f + epsilon): lobes span decades and bend less there.
    Log,
}

impl Values {
    /// Checks `epsilon`.
    ///
    /// # Errors
    /// If it is not a positive number; 0 would send black materials to −∞.
    pub fn check(self, epsilon: f64) -> Result<(), ParameterError> {
        in_left_open("epsilon", epsilon, 0.0, 1e6).map(drop)
    }

    /// The distance in the transformed value that a factor of f + epsilon is; f itself has none.
    pub(super) fn rise(self, factor: f64) -> f64 {
        match self {
            Values::Linear => f64::INFINITY,
            Values::Log => factor.ln(),
        }
    }

    /// The transform with its epsilon (sr⁻¹).
    pub(crate) fn with(self, epsilon: f64) -> Transform {
        match self {
            Values::Linear => Transform::Linear,
            Values::Log => Transform::Log { epsilon },
        }
    }
}

/// The default epsilon, sr⁻¹: that of the `log_relative` metric.
pub const EPSILON: f64 = 1e-3;

/// A value transform and its inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// y = f.
    Linear,
    /// y = ln(f + epsilon).
    Log {
        /// Offset, sr⁻¹.
        epsilon: f64,
    },
}

/// The logarithm with the default epsilon.
pub(super) const LOG: Transform = Transform::Log { epsilon: EPSILON };

impl Transform {
    /// What is added to f, sr⁻¹; of f itself the floor that a share of it is taken of.
    pub(super) fn epsilon(self) -> f64 {
        match self {
            Transform::Linear => EPSILON,
            Transform::Log { epsilon } => epsilon,
        }
    }

    /// f to y. A noisy reading may be negative; the logarithm takes it for 0.
    #[inline(always)]
    pub fn forward(self, f: f64) -> f64 {
        match self {
            Transform::Linear => f,
            Transform::Log { epsilon } => ln(f.max(0.0) + epsilon),
        }
    }

    /// y to f, at least 0: interpolants with negative weights may undershoot a black region.
    #[inline(always)]
    pub fn inverse(self, y: f64) -> f64 {
        match self {
            Transform::Linear => y.clamp(0.0, f64::MAX),
            // An overshoot in y is a factor in f: kept finite, as f_r is.
            Transform::Log { epsilon } => (exp(y) - epsilon).clamp(0.0, f64::MAX),
        }
    }

    /// [`inverse`](Self::inverse) of the values of pairs (`pairs × width`), 0 below the horizon.
    pub(super) fn inverse_above(self, pairs: &[DirectionPair], width: usize, values: &mut [f64]) {
        for (pair, values) in pairs.iter().zip(values.chunks_exact_mut(width)) {
            let above = pair.is_above_horizon();
            for y in values {
                *y = if above { self.inverse(*y) } else { 0.0 };
            }
        }
    }

    /// [`inverse`](Self::inverse) of many, one after the other in vector instructions.
    #[inline(always)]
    pub(crate) fn inverse_all(self, values: &mut [f64]) {
        match self {
            Transform::Linear => values.iter_mut().for_each(|y| *y = self.inverse(*y)),
            Transform::Log { .. } => values.iter_mut().for_each(|y| *y = self.inverse(*y)),
        }
    }
}
