//! What a profile says of the slices near a view.

use super::super::curve::Curve;
use super::super::estimator::SliceMoments;
use super::super::profile::Profile;
use crate::error::ParameterError;

/// View elevations (rad) of a profile whose moments up to order 2 are defined; with each the energy (rad² sr⁻¹), µ_θ (rad), σ_θ²
/// and σ_φ² (rad²).
fn nodes(profile: &Profile) -> Vec<(f64, [f64; 4])> {
    let node = |(theta_o, slice): (&f64, &SliceMoments)| {
        let m = slice.moments;
        let [tt, _, pp] = m.covariance()?;
        let moments = [m.energy()?, m.mean()?[0], tt, pp];
        (tt > 0.0 && pp > 0.0).then_some((*theta_o, moments))
    };
    let slices = profile.views.iter().zip(&profile.slices);
    slices.filter_map(node).collect()
}

/// Numbers of a profile for the relations: constants at θ_o, and the slope of the mean.
pub(super) struct Local {
    /// Energy α, rad² sr⁻¹.
    pub energy: f64,
    /// Centre µ_θ, rad.
    pub mean: f64,
    /// Variances σ_θ² and σ_φ², rad².
    pub variance: [f64; 2],
    /// dµ_θ/dθ_o, fitted over the window.
    pub slope: f64,
}

impl Local {
    pub(super) fn new(
        profile: &Profile,
        theta_o: f64,
        window: f64,
    ) -> Result<Self, ParameterError> {
        let nodes = nodes(profile);
        let curve = |of: usize| {
            let curve = Curve::new(
                nodes
                    .iter()
                    .map(|(theta_o, moments)| (*theta_o, moments[of])),
            );
            let allowed = "one whose slices, without its diffuse part, have a width";
            curve.ok_or_else(|| ParameterError::new("material", "black", allowed))
        };
        let mean = curve(1)?;
        // Least squares over the views of the profile that the window sees; a hundred points of
        // the interpolant weigh unevenly spaced views fairly.
        let from = (-3.0 * window).max(mean.first() - theta_o);
        let to = (3.0 * window).min(mean.last() - theta_o);
        let points: Vec<(f64, f64, f64)> = (0..=100)
            .map(|i| from + (to - from) * f64::from(i) * 0.01)
            .map(|t| (t, mean.value_at(theta_o + t), gaussian(t, window)))
            .collect();
        let sum = |of: fn(&(f64, f64, f64)) -> f64| points.iter().map(of).sum::<f64>();
        let weight = sum(|(_, _, w)| *w);
        let (t0, m0) = (
            sum(|(t, _, w)| w * t) / weight,
            sum(|(_, m, w)| w * m) / weight,
        );
        let product: f64 = points.iter().map(|(t, m, w)| w * (t - t0) * (m - m0)).sum();
        let square: f64 = points.iter().map(|(t, _, w)| w * (t - t0) * (t - t0)).sum();
        if !(square > 0.0) {
            let allowed = "two views or more within three window widths";
            return Err(ParameterError::new("profile", nodes.len(), allowed));
        }
        Ok(Self {
            energy: curve(0)?.value_at(theta_o),
            mean: mean.value_at(theta_o),
            variance: [curve(2)?.value_at(theta_o), curve(3)?.value_at(theta_o)],
            slope: product / square,
        })
    }
}

pub(super) fn gaussian(t: f64, width: f64) -> f64 {
    (-0.5 * (t / width) * (t / width)).exp()
}
