//! The mean profile as a line through the origin, the average variance as a constant, and the relation of both over
//! materials.

use super::{FitError, FitErrors, ViewRange, together};
use crate::numeric::{Correlation, correlate};
use serde::Serialize;
use std::f64::consts::PI;

/// A factor of a known function of the view, fitted to values.
#[derive(Clone, Debug, PartialEq)]
pub struct FactorFit {
    /// The factor, in the unit of the values over that of the function.
    pub factor: f64,
    /// Errors of the fit, in the unit of the values.
    pub errors: FitErrors,
}

impl FactorFit {
    /// The best factor of functions (first) to values (second): Σ xy / Σ x².
    fn new(pairs: &[(f64, f64)]) -> Result<Self, FitError> {
        let square: f64 = pairs.iter().map(|(x, _)| x * x).sum();
        if square == 0.0 {
            return Err(FitError::Undetermined);
        }
        let factor = pairs.iter().map(|(x, y)| x * y).sum::<f64>() / square;
        let residuals = pairs.iter().map(|(x, y)| y - factor * x);
        Ok(Self {
            factor,
            errors: FitErrors::from_residuals(residuals),
        })
    }
}

/// Fits µ_θ(θ_o) ≈ µ̃ θ_o (Zubiaga et al. 2015, §3.4) to the mean µ_θ (rad,
/// [`Component`](crate::moments::Component) (1, 0)) over the view elevations (rad). The slope µ̃ has no
/// unit: −1 for a mirror, 0 for a Lambertian material.
///
/// # Errors
/// If no view but 0 is used, or the numbers of views and values differ.
pub fn fit_mean(
    views: &[f64],
    values: &[Option<f64>],
    range: ViewRange,
) -> Result<FactorFit, FitError> {
    FactorFit::new(&range.used(views, values, 1)?)
}

/// Fits (σ_θ² + σ_φ²)/2 ≈ σ̃² (Zubiaga et al. 2015, §3.4) to the variances σ_θ² and σ_φ² (rad²,
/// [`Component`](crate::moments::Component) (2, 0) and (0, 2)) over the view elevations (rad). A
/// view is used if it has both. σ̃² is 0 for a mirror, π²/12 for a Lambertian material.
///
/// # Errors
/// If no view is used, or the numbers of views and values differ.
pub fn fit_average_variance(
    views: &[f64],
    along_theta: &[Option<f64>],
    along_phi: &[Option<f64>],
    range: ViewRange,
) -> Result<FactorFit, FitError> {
    let pairs = together(along_theta, along_phi)?;
    let average: Vec<Option<f64>> = pairs.map(|(&t, &p)| Some(0.5 * (t? + p?))).collect();
    let used = range.used(views, &average, 1)?.into_iter();
    FactorFit::new(&used.map(|(_, value)| (1.0, value)).collect::<Vec<_>>())
}

/// π²/12 rad², the variance of a Lambertian slice.
const LAMBERTIAN: f64 = PI * PI / 12.0;

/// σ̃² ≈ (π²/12)(1 + µ̃) + c µ̃ (1 + µ̃): every quadratic function through the mirror (−1, 0) and the
/// Lambertian material (0, π²/12), as in Zubiaga et al. 2015, §3.4 and Fig. 7b.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeanVarianceFit {
    /// Coefficient c, rad². 0 is the straight line; π²/12 · µ̃ (1 + µ̃) added to it is
    /// π²/12 (1 + µ̃)².
    pub coefficient: f64,
    /// Errors of the fit, rad²; `views` counts materials.
    pub errors: FitErrors,
    /// 1 − Σ residual² / Σ (σ̃² − its average)²: at most 1, below 0 if the function is worse than the
    /// average. `None` if all materials have the same variance.
    pub r_squared: Option<f64>,
    /// Correlation of slopes and variances.
    pub correlation: Correlation,
}

/// The average variance (rad²) at the slope `slope` of the mean profile, with a coefficient c.
fn variance(coefficient: f64, slope: f64) -> f64 {
    (1.0 + slope) * (LAMBERTIAN + coefficient * slope)
}

impl MeanVarianceFit {
    /// The average variance (rad²) at the slope `slope` of the mean profile.
    pub fn value(&self, slope: f64) -> f64 {
        variance(self.coefficient, slope)
    }
}

/// Fits the relation to one slope µ̃ and one average variance σ̃² (rad²) per material. A material
/// is used if it has both.
///
/// # Errors
/// If no material is used, none is away from the two end points, or the lengths differ.
pub fn fit_mean_variance(
    slopes: &[Option<f64>],
    variances: &[Option<f64>],
) -> Result<MeanVarianceFit, FitError> {
    let pairs = together(slopes, variances)?;
    let used: Vec<(f64, f64)> = pairs
        .filter_map(|(&slope, &variance)| Some((slope?, variance?)))
        .filter(|(slope, variance)| slope.is_finite() && variance.is_finite())
        .collect();
    if used.is_empty() {
        return Err(FitError::TooFewViews {
            found: 0,
            needed: 1,
        });
    }
    let beyond = |&(slope, variance): &(f64, f64)| {
        (slope * (1.0 + slope), variance - LAMBERTIAN * (1.0 + slope))
    };
    let coefficient = FactorFit::new(&used.iter().map(beyond).collect::<Vec<_>>())?.factor;
    let errors = FitErrors::from_residuals(
        used.iter()
            .map(|&(slope, v)| v - variance(coefficient, slope)),
    );
    let average = used.iter().map(|p| p.1).sum::<f64>() / used.len() as f64;
    let spread = FitErrors::from_residuals(used.iter().map(|p| p.1 - average)).rmse;
    // Equal numbers may have an average that is rounded away from them.
    let rounding = 4.0 * f64::EPSILON * average.abs();
    Ok(MeanVarianceFit {
        coefficient,
        errors,
        r_squared: (spread > rounding).then(|| 1.0 - (errors.rmse / spread).powi(2)),
        correlation: correlate(slopes, variances),
    })
}
