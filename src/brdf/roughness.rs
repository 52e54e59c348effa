//! The roughness parameter alpha: one number, or one for each tangent axis.

use super::Channels;
use super::spectrum::Limited;
use crate::error::ParameterError;
use crate::geometry::Symmetry;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::RangeInclusive;

/// Roughness along t and b; a config writes `0.3` or `[0.1, 0.4]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "alpha: allowed is a number or two numbers [alpha_x, alpha_y]"
)]
pub enum Roughness {
    /// Equal in every tangent direction.
    Isotropic(f64),
    /// One value along t and one along b.
    Anisotropic([f64; 2]),
}

impl Roughness {
    /// From a lobe of a micro-radian, 10 digits above the rounding of a direction, to slopes of 84°, where every lobe is flat.
    pub const RANGE: RangeInclusive<f64> = 1e-6..=10.0;

    /// Roughness along t and along b.
    pub fn xy(self) -> [f64; 2] {
        match self {
            Roughness::Isotropic(a) => [a, a],
            Roughness::Anisotropic(a) => a,
        }
    }

    /// The symmetries of a surface of it: isotropic if both axes are equally rough.
    pub fn symmetry(self) -> Symmetry {
        let [x, y] = self.xy();
        Symmetry::ORTHOTROPIC.with_isotropy(x == y)
    }

    /// Checks both values against a range, [`RANGE`](Self::RANGE) of a roughness, in any channels.
    pub fn within(
        self,
        key: &str,
        range: RangeInclusive<f64>,
        channels: &Channels,
    ) -> Result<(), ParameterError> {
        let mut both = self.xy().into_iter();
        both.try_for_each(|a| a.within(key, range.clone(), channels))
    }
}

/// `0.3`, or `0.1-0.4`: a piece of a label.
impl fmt::Display for Roughness {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Roughness::Isotropic(a) => write!(f, "{a}"),
            Roughness::Anisotropic([x, y]) => write!(f, "{x}-{y}"),
        }
    }
}
