//! How uncertain further readings are, from those there are.

use super::system::NUGGET;
use crate::numeric::upper_median;
use crate::reconstruct::interpolant::Readings;
use crate::reconstruct::transform::EPSILON;

/// Noise of further readings: of f a share of it, and a floor (sr⁻¹).
#[derive(Clone, Copy, Default)]
pub(super) struct Noise {
    relative: f64,
    floor: f64,
}

impl Noise {
    /// The floor is the least uncertainty of the readings; what the share explains is the rest, in the median. `unsaid` is the variance of
    /// ln f of readings that state none.
    pub(crate) fn of(readings: &Readings<'_>, unsaid: f64) -> Self {
        let Some(uncertainties) = readings.noise else {
            return Self {
                relative: unsaid.sqrt(),
                floor: 0.0,
            };
        };
        let all = (0..readings.present.len()).filter(|&i| readings.present[i]);
        let all: Vec<[f64; 2]> = all
            .map(|i| [readings.values[i].max(0.0), uncertainties[i]])
            .collect();
        let floor = all.iter().map(|[_, u]| *u).fold(f64::INFINITY, f64::min);
        let rest = |[f, u]: &[f64; 2]| (u * u - floor * floor).max(0.0).sqrt() / (f + EPSILON);
        let mut shares: Vec<f64> = all.iter().map(rest).collect();
        let median = upper_median(&mut shares).unwrap_or(0.0);
        Self {
            relative: median.hypot(unsaid.sqrt()),
            floor: if floor.is_finite() { floor } else { 0.0 },
        }
    }

    /// The variance of ln(f + ε), where that is `log`.
    pub(crate) fn variance(&self, log: f64) -> f64 {
        let f = log.exp();
        NUGGET + self.relative.powi(2) + (self.floor / f.max(EPSILON)).powi(2)
    }
}
