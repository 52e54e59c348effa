//! The bare formulas of one parametrization.

use super::{Quantity, Unit};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// A radial coordinate of a [`Chart`], from 0 on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Radial {
    /// The field's symbol, e.g. `theta_h`.
    pub symbol: &'static str,
    /// The symbol as it is printed, e.g. `θ_h`.
    pub label: &'static str,
    /// Unit of the values.
    pub unit: Unit,
    /// Largest value.
    pub max: f64,
    /// What it measures.
    pub quantity: Quantity,
}

impl Radial {
    /// An elevation, or an angle between directions, up to a right angle.
    pub const fn angle(symbol: &'static str, label: &'static str, quantity: Quantity) -> Self {
        Self {
            symbol,
            label,
            unit: Unit::Radian,
            max: FRAC_PI_2,
            quantity,
        }
    }

    /// A length without unit, or the square of one, up to 1.
    pub const fn length(symbol: &'static str, label: &'static str, quantity: Quantity) -> Self {
        Self {
            symbol,
            label,
            unit: Unit::One,
            max: 1.0,
            quantity,
        }
    }
}

/// An azimuth of a [`Chart`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Azimuth {
    /// The field's symbol, e.g. `phi_h`.
    pub symbol: &'static str,
    /// The symbol as it is printed, e.g. `φ_h`.
    pub label: &'static str,
}

impl Azimuth {
    /// An azimuth of that symbol, and as it is printed.
    pub const fn new(symbol: &'static str, label: &'static str) -> Self {
        Self { symbol, label }
    }
}

/// One parametrization in its four coordinates `[r1, a1, r2, a2]`: two radial coordinates and two
/// azimuths, without any folding. [`Form`](super::Form) adds symmetry.
///
/// `absolute`, `relative` and `inverse` are made for many pairs at once: without branches or calls, and always
/// inlined.
pub trait Chart: Copy + Send + Sync + 'static {
    /// Name in configs and result files.
    const NAME: &'static str;
    /// The radial coordinates.
    const RADIAL: [Radial; 2];
    /// The azimuths.
    const AZIMUTH: [Azimuth; 2];
    /// The one azimuth that is left for isotropic materials.
    const RELATIVE: Azimuth;
    /// Labels of the azimuth that [`lift`](Self::lift) makes of the relative one, and of the one
    /// that it leaves 0.
    const LIFTED: [&'static str; 2] = [Self::AZIMUTH[1].label, Self::AZIMUTH[0].label];
    /// True if exchanging light and sensor exchanges `(r1, a1)` and `(r2, a2)` (spherical);
    /// otherwise it turns the second azimuth by π.
    const EXCHANGE: bool;
    /// True if the second azimuth is measured in a frame that turns with the first direction
    /// (half/difference); otherwise both are measured from t.
    const NESTED: bool;
    /// True if the mirror direction is at r1 = 0.
    const PEAK_AT_START: bool;

    /// Largest errors (rad) of pair → coordinates → pair: where both cosines exceed 1e-3, and
    /// anywhere. By default those of square roots that vanish on the horizon.
    const ROUND_TRIP: [f64; 2] = [1e-12, 4e-8];
    /// True if the Jacobian is infinite where a direction is on the horizon.
    const SINGULAR: bool = true;
    /// True if the radial coordinates are squares of lengths: the Jacobian does not vanish at the
    /// poles, and a step of s from a pole moves a direction by sqrt(s).
    const SQUARED: bool = false;

    /// How many nodes a grid puts along a radial axis for each one along a quarter turn, by
    /// default: lobes are narrow along the radial axes of the half-vector charts and change
    /// slowly with azimuth, but spread over all axes of the spherical one.
    const RADIAL_DENSITY: f64 = 4.0;

    /// `[r1, a1, r2, a2]` of ω_i and ω_o.
    fn absolute(directions: [DVec3; 2]) -> [f64; 4];

    /// `[r1, r2, a]` of ω_i and ω_o, a the azimuth that does not change when the sample turns;
    /// a = 0 where r1 or r2 vanishes.
    fn relative(directions: [DVec3; 2]) -> [f64; 3];

    /// ω_i and ω_o at `[r1, a1, r2, a2]`, and whether both are above the horizon: if not, they mean nothing. Radial
    /// coordinates are in range, azimuths at most 10⁶ rad.
    fn inverse(coords: [f64; 4]) -> ([DVec3; 2], bool);

    /// Absolute coordinates of `[r1, r2, a]` at one orientation of the sample.
    fn lift([r1, r2, a]: [f64; 3]) -> [f64; 4] {
        [r1, 0.0, r2, a]
    }

    /// J of d omega_i d omega_o = J dr1 da1 dr2 da2, from the absolute coordinates.
    fn jacobian(coords: [f64; 4]) -> f64;
}
