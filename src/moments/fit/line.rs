//! The mean profile as a line through the origin, the average variance as a constant.

use super::{FitError, FitErrors, ViewRange};
use serde::Serialize;

/// µ_θ(θ_o) ≈ µ̃ θ_o (Zubiaga et al. 2015, §3.4).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeanFit {
    /// Slope µ̃, without a unit: −1 for a mirror, 0 for a Lambertian material.
    pub slope: f64,
    /// Errors of the fit, rad.
    pub errors: FitErrors,
}

impl MeanFit {
    /// The fitted mean (rad) at a view elevation (rad).
    pub fn value(&self, theta: f64) -> f64 {
        self.slope * theta
    }
}

/// Fits the mean µ_θ (rad, [`Component`](crate::moments::Component) (1, 0)) over the view
/// elevations (rad): µ̃ = Σ θ µ / Σ θ².
///
/// # Errors
/// If no view but 0 is used, or the numbers of views and values differ.
pub fn fit_mean(
    views: &[f64],
    values: &[Option<f64>],
    range: ViewRange,
) -> Result<MeanFit, FitError> {
    let (views, values) = range.used(views, values, 1)?;
    let square: f64 = views.iter().map(|t| t * t).sum();
    if square == 0.0 {
        return Err(FitError::Undetermined);
    }
    let pairs = || views.iter().zip(&values);
    let slope = pairs().map(|(t, v)| t * v).sum::<f64>() / square;
    Ok(MeanFit {
        slope,
        errors: FitErrors::of(pairs().map(|(t, v)| v - slope * t)),
    })
}

/// (σ_θ² + σ_φ²)/2 ≈ σ̃² (Zubiaga et al. 2015, §3.4).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VarianceFit {
    /// Average variance σ̃², rad²: 0 for a mirror, π²/12 for a Lambertian material.
    pub variance: f64,
    /// Errors of the fit, rad².
    pub errors: FitErrors,
}

impl VarianceFit {
    /// The fitted average variance, rad²; equal at every view.
    pub fn value(&self, _theta: f64) -> f64 {
        self.variance
    }
}

/// Fits the average of the variances σ_θ² and σ_φ² (rad²,
/// [`Component`](crate::moments::Component) (2, 0) and (0, 2)) over the view elevations (rad). A
/// view is used if it has both.
///
/// # Errors
/// If no view is used, or the numbers of views and values differ.
pub fn fit_average_variance(
    views: &[f64],
    along_theta: &[Option<f64>],
    along_phi: &[Option<f64>],
    range: ViewRange,
) -> Result<VarianceFit, FitError> {
    if along_theta.len() != along_phi.len() {
        return Err(FitError::Lengths {
            first: along_theta.len(),
            second: along_phi.len(),
        });
    }
    let pairs = along_theta.iter().zip(along_phi);
    let average: Vec<Option<f64>> = pairs.map(|(&t, &p)| Some(0.5 * (t? + p?))).collect();
    let (_, values) = range.used(views, &average, 1)?;
    let variance = values.iter().sum::<f64>() / values.len() as f64;
    Ok(VarianceFit {
        variance,
        errors: FitErrors::of(values.iter().map(|v| v - variance)),
    })
}
