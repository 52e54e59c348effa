//! Travel times of the axes from one set of positions to another.

use crate::schedule::Positions;
use std::f64::consts::TAU;

/// Speed and acceleration of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisMotion {
    /// Highest speed, rad/s, > 0.
    pub speed: f64,
    /// Acceleration and deceleration, rad/s², > 0.
    pub acceleration: f64,
    /// True if it turns round without end; it then takes the shorter way.
    pub wraps: bool,
}

/// The metric of travel times: every axis accelerates at its limit, cruises at its limit and
/// brakes at its limit (a trapezoid of velocity), all start together, and the slowest counts.
///
/// A move of `d` rad takes 2 √(d/a) if d ≤ v²/a, where the axis never reaches its speed, and
/// d/v + v/a otherwise (e.g. Biagiotti & Melchiorri, *Trajectory Planning for Automatic Machines
/// and Robots*, 2008, ch. 3). This is concave in d, so that the triangle inequality holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Travel {
    inverse_speed: Positions,
    /// v/a: ramps up and down cost this much more than the cruise.
    ramp: Positions,
    /// v²/a: shorter moves are triangles.
    knee: Positions,
    /// 4/a: the square of a triangle's time per rad.
    triangle: Positions,
    /// 2π where the axis wraps, infinite elsewhere.
    period: Positions,
}

impl Travel {
    /// The metric of at most [`MAX_AXES`](crate::schedule::MAX_AXES) axes; those beyond the slice stand still.
    pub fn new(axes: &[AxisMotion]) -> Self {
        let each = |of: fn(&AxisMotion) -> f64, absent: f64| {
            std::array::from_fn(|j| axes.get(j).map_or(absent, of))
        };
        Self {
            inverse_speed: each(|a| 1.0 / a.speed, 0.0),
            ramp: each(|a| a.speed / a.acceleration, 0.0),
            knee: each(|a| a.speed * a.speed / a.acceleration, f64::INFINITY),
            triangle: each(|a| 4.0 / a.acceleration, 0.0),
            period: each(|a| if a.wraps { TAU } else { f64::INFINITY }, f64::INFINITY),
        }
    }

    /// Seconds from rest at `from` to rest at `to`. Positions of an axis that wraps are less than
    /// a turn apart.
    #[inline]
    pub fn seconds(&self, from: &Positions, to: &Positions) -> f64 {
        let squares = self.squares(from, to).into_iter();
        squares.fold(0.0, f64::max).sqrt()
    }

    /// The square of the time each axis needs, s²: comparisons do without the root.
    #[inline]
    pub(in crate::instrument) fn squares(&self, from: &Positions, to: &Positions) -> Positions {
        self.squares_of(|j| {
            let d = (from[j] - to[j]).abs();
            d.min((self.period[j] - d).abs())
        })
    }

    /// The squares of the times, s², to the nearest point of a box.
    #[inline]
    pub(in crate::instrument) fn squares_to_box(
        &self,
        from: &Positions,
        low: &Positions,
        high: &Positions,
    ) -> Positions {
        self.squares_of(|j| {
            let d = (low[j] - from[j]).max(from[j] - high[j]).max(0.0);
            // The other way round the circle, the box itself is not in the way.
            let around = self.period[j] - (high[j] - low[j]) - d;
            d.min(around.max(0.0))
        })
    }

    #[inline]
    fn squares_of(&self, distance: impl Fn(usize) -> f64) -> Positions {
        std::array::from_fn(|j| match distance(j) {
            d if d <= self.knee[j] => d * self.triangle[j],
            d => {
                let t = d * self.inverse_speed[j] + self.ramp[j];
                t * t
            }
        })
    }

    /// The way of axis `j`, rad, with its sign: the shorter one if it wraps.
    #[inline]
    pub fn way(&self, j: usize, from: &Positions, to: &Positions) -> f64 {
        match to[j] - from[j] {
            d if d.abs() <= self.period[j] - d.abs() => d,
            d => d - self.period[j].copysign(d),
        }
    }

    /// Highest speed of axis `j` in one move of `distance` rad, rad/s.
    pub(super) fn peak_speed(&self, j: usize, distance: f64) -> f64 {
        // Half of v²/a is spent on either ramp: v² = a d.
        (self.acceleration(j) * distance).sqrt().min(self.speed(j))
    }

    /// Highest speed of axis `j`, rad/s.
    pub(in crate::instrument) fn speed(&self, j: usize) -> f64 {
        1.0 / self.inverse_speed[j]
    }

    /// Acceleration of axis `j`, rad/s².
    pub(super) fn acceleration(&self, j: usize) -> f64 {
        4.0 / self.triangle[j]
    }
}
