//! Analytic functions fitted to moment profiles (Zubiaga et al. 2015, §3.4): a base and a Hermite
//! ramp for the energy, a line through the origin for the mean, a constant for the average
//! variance, and a quadratic relation of the last two over materials.
//!
//! All are least-squares fits with equal weights of all used views. Used are the views inside a
//! [`ViewRange`] that have a finite value.
//!
//! ```
//! use gonio::moments::{ViewRange, fit_energy, fit_mean};
//! let views: Vec<f64> = (0..90).map(|i| f64::from(i).to_radians()).collect();
//! let mean: Vec<Option<f64>> = views.iter().map(|t| Some(-0.7 * t)).collect();
//! let fit = fit_mean(&views, &mean, ViewRange::default()).unwrap();
//! assert!((fit.factor + 0.7).abs() < 1e-12 && fit.errors.views == 81);
//! // A constant profile has no ramp, so its knots are not determined.
//! let flat = fit_energy(&views, &[Some(2.0); 90], ViewRange::default(), 1e-4).unwrap();
//! assert!(flat.knots().is_none() && (flat.value(1.0) - 2.0).abs() < 1e-12);
//! ```

mod knots;
mod line;
mod projected;
mod ramp;

pub use knots::{EnergyFit, EnergySeries, Undetermined, fit_energy, fit_energy_shared};
pub use line::{FactorFit, MeanVarianceFit, fit_average_variance, fit_mean, fit_mean_variance};
pub use ramp::Ramp;

use crate::error::{ParameterError, in_closed, in_left_open};
use serde::Serialize;

/// View elevations that are fitted, rad. The default is 0 to 80°: measured data are unreliable
/// beyond.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ViewRange {
    /// First and last elevation, rad.
    pub(crate) ends: [f64; 2],
}

impl ViewRange {
    /// A view this far (rad) beyond an end is still inside: degrees and radians round.
    const SLACK: f64 = 1e-9;

    /// The range from `min_deg` to `max_deg`, both included; 0 ≤ `min_deg` < `max_deg` ≤ 90.
    ///
    /// # Errors
    /// Names the end that is out of range.
    pub fn from_degrees(min_deg: f64, max_deg: f64) -> Result<Self, ParameterError> {
        in_closed("min_view_deg", min_deg, 0.0, 90.0)?;
        in_left_open("max_view_deg", max_deg, min_deg, 90.0)?;
        Ok(Self {
            ends: [min_deg.to_radians(), max_deg.to_radians()],
        })
    }

    /// True for the elevations (rad) that are fitted.
    pub(crate) fn contains(self, theta: f64) -> bool {
        let [lo, hi] = self.ends;
        (lo - Self::SLACK..=hi + Self::SLACK).contains(&theta)
    }

    /// The used views and their values, so many at least.
    fn used(
        self,
        views: &[f64],
        values: &[Option<f64>],
        needed: usize,
    ) -> Result<Vec<(f64, f64)>, FitError> {
        let used = together(views, values)?.filter_map(|(&theta, &value)| {
            let value = value.filter(|v| v.is_finite())?;
            self.contains(theta).then_some((theta, value))
        });
        let used: Vec<(f64, f64)> = used.collect();
        match used.len() {
            found if found < needed => Err(FitError::TooFewViews { found, needed }),
            _ => Ok(used),
        }
    }
}

/// The members of two series that belong together.
fn together<'a, A, B>(
    first: &'a [A],
    second: &'a [B],
) -> Result<impl Iterator<Item = (&'a A, &'a B)>, FitError> {
    let (a, b) = (first.len(), second.len());
    match a == b {
        true => Ok(first.iter().zip(second)),
        false => Err(FitError::Lengths {
            first: a,
            second: b,
        }),
    }
}

impl Default for ViewRange {
    fn default() -> Self {
        Self {
            ends: [0.0, 80f64.to_radians()],
        }
    }
}

/// Reason why a function could not be fitted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Fewer used views (or materials) than the function has parameters.
    #[error("{found} values to fit, at least {needed} are needed")]
    TooFewViews {
        /// Number of used views.
        found: usize,
        /// Number of views that are needed.
        needed: usize,
    },
    /// Series that belong together, as views and values, differ in length.
    #[error("series of lengths {first} and {second} do not belong together")]
    Lengths {
        /// Length of the first.
        first: usize,
        /// Length of the second.
        second: usize,
    },
    /// The mean energy is not positive, so the profile has no scale.
    #[error("the mean energy is not above 0")]
    NoEnergy,
    /// The function is the same for every parameter at the places there are.
    #[error("the values do not determine the parameter")]
    Undetermined,
    /// One of several profiles cannot be fitted.
    #[error("profile {index}: {source}")]
    Profile {
        /// Position of the profile, from 0.
        index: usize,
        /// Reason.
        source: Box<FitError>,
    },
}

/// Deviations of a fitted function from the values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FitErrors {
    /// Mean absolute error, in the unit of the profile.
    pub mae: f64,
    /// Root mean square error, in the unit of the profile.
    pub rmse: f64,
    /// Number of values that were fitted.
    pub views: usize,
}

impl FitErrors {
    /// Deviations from residuals, of which there is at least one.
    fn from_residuals(residuals: impl Iterator<Item = f64>) -> Self {
        let residuals: Vec<f64> = residuals.collect();
        let n = residuals.len() as f64;
        // In units of the largest, so that no square leaves the range of f64.
        let largest = residuals.iter().fold(0.0, |a: f64, r| a.max(r.abs()));
        let unit = if largest > 0.0 { largest } else { 1.0 };
        let square: f64 = residuals.iter().map(|r| (r / unit).powi(2)).sum();
        Self {
            mae: residuals.iter().map(|r| r.abs()).sum::<f64>() / n,
            rmse: unit * (square / n).sqrt(),
            views: residuals.len(),
        }
    }
}
