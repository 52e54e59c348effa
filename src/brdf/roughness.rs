//! The roughness parameter alpha: one number, or one for each tangent axis.

use crate::error::{ParameterError, in_closed};
use serde::{Deserialize, Serialize};
use std::fmt;

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
    /// Smallest roughness: a lobe of a micro-radian, five hundred times narrower than the
    /// resolution of a fine instrument, yet 10 digits above the rounding of a direction.
    pub const MIN: f64 = 1e-6;
    /// Largest roughness: slopes of 84°, where every lobe is flat.
    pub const MAX: f64 = 10.0;

    /// Roughness along t and along b.
    pub fn xy(self) -> [f64; 2] {
        match self {
            Roughness::Isotropic(a) => [a, a],
            Roughness::Anisotropic(a) => a,
        }
    }

    /// True if both axes are equally rough.
    pub fn is_isotropic(self) -> bool {
        let [x, y] = self.xy();
        x == y
    }

    /// Checks both values against [`MIN`](Self::MIN) and [`MAX`](Self::MAX).
    pub fn check(self, key: &str) -> Result<(), ParameterError> {
        self.xy()
            .iter()
            .try_for_each(|&a| in_closed(key, a, Self::MIN, Self::MAX).map(drop))
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
