//! A unit vector, unit by construction.

use glam::DVec3;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// A unit vector in the local frame (n = +z).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Direction(#[serde(deserialize_with = "unit")] DVec3);

/// Largest difference of a squared length from 1: the orthographic and hybrid inverses are only good to about 4e-8 at the horizon.
const SLACK: f64 = 1e-7;

/// A vector that is unit to rounding, its bits as they were written.
fn unit<'de, D: Deserializer<'de>>(from: D) -> Result<DVec3, D::Error> {
    let v = DVec3::deserialize(from)?;
    match (v.length_squared() - 1.0).abs() < SLACK {
        true => Ok(v),
        false => Err(D::Error::custom(format!("{v} is no unit vector"))),
    }
}

impl Direction {
    /// The surface normal.
    pub const NORMAL: Direction = Direction(DVec3::Z);

    /// The direction of elevation `theta` (rad, from the normal), azimuth `phi` (rad, from t to b).
    ///
    /// ```
    /// use gonio::geometry::Direction;
    /// let d = Direction::from_spherical(0.5, 1.0);
    /// assert!((d.theta() - 0.5).abs() < 1e-15 && (d.phi() - 1.0).abs() < 1e-15);
    /// ```
    #[inline]
    pub fn from_spherical(theta: f64, phi: f64) -> Self {
        let (st, ct) = theta.sin_cos();
        let (sp, cp) = phi.sin_cos();
        Direction(DVec3::new(st * cp, st * sp, ct))
    }

    /// Normalises `v`; `None` if it has no direction (zero, NaN or infinite length).
    pub fn try_new(v: DVec3) -> Option<Self> {
        // Scaling first keeps vectors of 1e-200 and 1e200 from under- and overflowing.
        let scale = v.abs().max_element();
        if !v.is_finite() || scale == 0.0 {
            return None;
        }
        let v = v / scale;
        Some(Direction(v / v.length()))
    }

    /// Takes a vector that is already unit to rounding; debug builds check it.
    #[inline]
    pub fn from_unit(v: DVec3) -> Self {
        debug_assert!((v.length_squared() - 1.0).abs() < SLACK, "{v} is not unit");
        Direction(v)
    }

    /// The vector.
    #[inline(always)]
    pub fn vector(self) -> DVec3 {
        self.0
    }

    /// Cosine of the elevation, the z component.
    #[inline]
    pub fn cos_theta(self) -> f64 {
        self.0.z
    }

    /// Sine of the elevation, from the tangent-plane length (exact near the normal).
    #[inline]
    pub fn sin_theta(self) -> f64 {
        self.0.x.hypot(self.0.y)
    }

    /// Elevation (rad) in `[0, π]`, accurate near the normal and near the horizon.
    #[inline]
    pub fn theta(self) -> f64 {
        self.sin_theta().atan2(self.0.z)
    }

    /// Azimuth (rad) in `[-π, π]`; 0 at the normal, where any value is right.
    #[inline]
    pub fn phi(self) -> f64 {
        // `+ 0.0` turns -0 into +0: atan2(±0, -0) would be ±π for a vector along the normal.
        (self.0.y + 0.0).atan2(self.0.x + 0.0)
    }
}

/// Angle (rad) between two vectors of equal length, accurate near 0 and near π.
///
/// `2 atan2(|a - b|, |a + b|)` (Kahan); `acos(a·b)` loses half the digits at both ends.
#[inline]
pub fn angle_between(a: DVec3, b: DVec3) -> f64 {
    2.0 * (a - b).length().atan2((a + b).length())
}
