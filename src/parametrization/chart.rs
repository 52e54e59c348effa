//! The bare formulas of one parametrization.

use super::Unit;
use crate::geometry::DirectionPair;

/// One parametrization in its four coordinates `[r1, a1, r2, a2]`: two radial coordinates and two
/// azimuths, without any folding. [`Form`](super::Form) adds symmetry.
pub trait Chart: Copy + Send + Sync + 'static {
    /// Name in configs and result files.
    const NAME: &'static str;
    /// Symbol, unit and largest value of the radial coordinates; the smallest is 0.
    const RADIAL: [(&'static str, Unit, f64); 2];
    /// Symbols of the azimuths.
    const AZIMUTH: [&'static str; 2];
    /// Symbol of the one azimuth that is left for isotropic materials.
    const RELATIVE: &'static str;
    /// True if exchanging light and sensor exchanges `(r1, a1)` and `(r2, a2)` (spherical);
    /// otherwise it turns the second azimuth by π.
    const EXCHANGE: bool;
    /// True if the second azimuth is measured in a frame that turns with the first direction
    /// (half/difference); otherwise both are measured from t.
    const NESTED: bool;
    /// True if the mirror direction is at r1 = 0.
    const PEAK_AT_START: bool;

    /// How many nodes a grid puts along a radial axis for each one along a quarter turn, if it is
    /// not told: lobes are narrow along the radial axes of the half-vector charts and change
    /// slowly with azimuth, but spread over all axes of the spherical one.
    const RADIAL_DENSITY: f64 = 4.0;

    /// `[r1, a1, r2, a2]` of a pair.
    fn absolute(&self, pair: &DirectionPair) -> [f64; 4];

    /// `[r1, r2, a]` of a pair, a the azimuth that does not change when the sample turns;
    /// a = 0 where r1 or r2 vanishes.
    fn relative(&self, pair: &DirectionPair) -> [f64; 3];

    /// The pair at `[r1, a1, r2, a2]`, `None` below the horizon. Radial coordinates are in range.
    fn inverse(&self, coords: [f64; 4]) -> Option<DirectionPair>;

    /// Absolute coordinates of `[r1, r2, a]` at one orientation of the sample.
    fn lift(&self, [r1, r2, a]: [f64; 3]) -> [f64; 4] {
        [r1, 0.0, r2, a]
    }

    /// J of d omega_i d omega_o = J dr1 da1 dr2 da2, from the absolute coordinates.
    fn jacobian(&self, coords: [f64; 4]) -> f64;
}
