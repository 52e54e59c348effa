//! Results of fits of energy profiles.

use super::FitErrors;
use super::ramp::Ramp;
use serde::Serialize;
use std::fmt;

/// Reason why the values do not determine the knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Undetermined {
    /// The RMS deviation from the mean is at most the values' tolerance times it. The fit is the mean.
    Flat,
    /// The ramp explains less than ten times as much variance per parameter as it leaves per
    /// degree of freedom: ((S_0 − S)/(2p + 2))/(S/(n − 3p − 2)) < 10 with S_0 and S the sums of
    /// squares about the mean and about the fit, n values, p profiles. The fit is the mean.
    Noise,
    /// No view tells where a knot is, as when the energy steps between two neighbouring views:
    /// moving the knots by 1 rad, in one direction of the plane (θ_0, θ_1), changes the fit (to
    /// first order, base, height and slope fitted again) by less than 10⁻⁶ of the ramp. A θ_1 at
    /// the end of the views is held there and not judged. The fit is the best there is.
    Unseen,
}

impl fmt::Display for Undetermined {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Undetermined::Flat => "the energy is constant",
            Undetermined::Noise => "the energy has no ramp above its noise",
            Undetermined::Unseen => "no view tells where the knots are",
        })
    }
}

/// α(θ_o) ≈ base + ramp (Zubiaga et al. 2015, §3.4).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnergyFit {
    /// Energy below the first knot, rad² sr⁻¹.
    pub base: f64,
    /// Ramp that is added to the base; `None` if the fit is a constant.
    pub ramp: Option<Ramp>,
    /// Reason why the knots are not determined; `None` if they are.
    pub undetermined: Option<Undetermined>,
    /// True if θ_1 is the last used view: one cubic covers all views beyond θ_0, and every θ_1
    /// beyond them would fit as well. θ_0 is determined nevertheless.
    pub upper_at_end: bool,
    /// Mean energy of the used views, rad² sr⁻¹.
    pub mean: f64,
    /// Errors of the fit, rad² sr⁻¹.
    pub errors: FitErrors,
    /// Errors of the fit in units of the mean energy.
    pub relative_errors: FitErrors,
}

impl EnergyFit {
    /// θ_0 and θ_1, rad; `None` if they are not determined.
    pub fn knots(&self) -> Option<[f64; 2]> {
        let ramp = self.ramp.filter(|_| self.undetermined.is_none());
        ramp.map(|ramp| ramp.knots)
    }

    /// The fitted energy (rad² sr⁻¹) at a view elevation (rad).
    pub fn value(&self, theta: f64) -> f64 {
        self.base + self.ramp.map_or(0.0, |ramp| ramp.value(theta))
    }
}

/// Several energy profiles fitted with the same knots.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SharedEnergyFit {
    /// θ_0 and θ_1 of all, rad; `None` if they are not determined.
    pub knots: Option<[f64; 2]>,
    /// Reason why the knots are not determined; `None` if they are.
    pub undetermined: Option<Undetermined>,
    /// True if θ_1 is the last used view of all, see [`EnergyFit::upper_at_end`].
    pub upper_at_end: bool,
    /// The fits, one per profile, in the order given.
    pub fits: Vec<EnergyFit>,
}

/// An energy profile.
#[derive(Clone, Copy, Debug)]
pub struct EnergySeries<'a> {
    /// View elevations, rad.
    pub views: &'a [f64],
    /// Energies, rad² sr⁻¹, one per view.
    pub values: &'a [Option<f64>],
}
