//! The two directions of one configuration, and the vectors derived from them.

use super::Direction;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Light and sensor direction of one configuration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DirectionPair {
    /// Towards the light.
    pub omega_i: Direction,
    /// Towards the sensor.
    pub omega_o: Direction,
}

impl DirectionPair {
    /// A pair from its two directions.
    #[inline]
    pub fn new(omega_i: Direction, omega_o: Direction) -> Self {
        Self { omega_i, omega_o }
    }

    /// A number by which pairs can be sorted by light, then by sensor: azimuth before elevation of the sensor, as arms scan; angles
    /// to nine digits, which are the same in files of other units.
    pub(crate) fn rank(&self) -> [i64; 4] {
        let [i, o] = [self.omega_i, self.omega_o].map(|d| [d.theta(), d.phi()]);
        [i[0], i[1], o[1], o[0]].map(|angle| (angle * 1e9).round() as i64)
    }

    /// The pair at elevations and azimuths (rad): `theta_i, phi_i, theta_o, phi_o`.
    #[inline]
    pub fn from_spherical(theta_i: f64, phi_i: f64, theta_o: f64, phi_o: f64) -> Self {
        Self::new(
            Direction::from_spherical(theta_i, phi_i),
            Direction::from_spherical(theta_o, phi_o),
        )
    }

    /// The pair of two unit vectors.
    #[inline(always)]
    pub(crate) fn from_unit(vectors: [DVec3; 2]) -> Self {
        let [omega_i, omega_o] = vectors.map(Direction::from_unit);
        Self { omega_i, omega_o }
    }

    /// Both directions moved by a turn or a mirror.
    pub(crate) fn map(&self, by: impl Fn(DVec3) -> DVec3) -> Self {
        Self::from_unit(self.vectors().map(by))
    }

    /// ω_i and ω_o.
    #[inline(always)]
    pub(crate) fn vectors(&self) -> [DVec3; 2] {
        [self.omega_i.vector(), self.omega_o.vector()]
    }

    /// The unnormalised half vector h = (omega_i + omega_o)/2, |h| = cos theta_d.
    #[inline]
    pub fn half(&self) -> DVec3 {
        0.5 * (self.omega_i.vector() + self.omega_o.vector())
    }

    /// The unnormalised back vector k = (omega_i − omega_o)/2, |k| = sin theta_d.
    #[inline]
    pub fn back(&self) -> DVec3 {
        0.5 * (self.omega_i.vector() - self.omega_o.vector())
    }

    /// `half()` and `back()`, made orthogonal.
    ///
    /// On paper h·k = 0. Rounding the unit vectors leaves an error of one ulp *of 1* in the
    /// component of the smaller vector along the larger, which swamps a small vector near
    /// retro-reflection (k → 0) or opposed grazing (h → 0); it is removed here, and with it
    /// the peers' worst-case error of 1e-4 rad.
    #[inline]
    pub fn half_and_back(&self) -> (DVec3, DVec3) {
        half_and_back(self.vectors())
    }

    /// The pair with light and sensor exchanged.
    #[inline]
    pub fn swapped(&self) -> Self {
        Self::new(self.omega_o, self.omega_i)
    }

    /// The lesser cosine of the two elevations.
    #[inline]
    pub(crate) fn least_cosine(&self) -> f64 {
        self.omega_i.cos_theta().min(self.omega_o.cos_theta())
    }

    /// True if both directions are strictly above the horizon.
    #[inline]
    pub fn is_above_horizon(&self) -> bool {
        self.omega_i.cos_theta() > 0.0 && self.omega_o.cos_theta() > 0.0
    }

    /// Angle between light and sensor (rad), 2 theta_d.
    #[inline]
    pub fn separation(&self) -> f64 {
        super::angle_between(self.omega_i.vector(), self.omega_o.vector())
    }
}

/// [`DirectionPair::half_and_back`] of two unit vectors.
#[inline(always)]
pub(crate) fn half_and_back([i, o]: [DVec3; 2]) -> (DVec3, DVec3) {
    let (h, k) = (0.5 * (i + o), 0.5 * (i - o));
    let (hh, kk, hk) = (h.length_squared(), k.length_squared(), h.dot(k));
    let half_is_larger = hh >= kk;
    let share = hk / if half_is_larger { hh } else { kk };
    let (of_h, of_k) = if half_is_larger {
        (0.0, share)
    } else {
        (share, 0.0)
    };
    (h - k * of_h, k - h * of_k)
}
