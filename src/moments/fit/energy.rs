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
    pub(super) base: f64,
    pub(super) ramp: Option<Ramp>,
    pub(super) undetermined: Option<Undetermined>,
    pub(super) upper_at_end: bool,
    pub(super) mean: f64,
    pub(super) errors: FitErrors,
    pub(super) relative: FitErrors,
}

impl EnergyFit {
    /// Energy below the first knot, rad² sr⁻¹.
    pub fn base(&self) -> f64 {
        self.base
    }

    /// Ramp that is added to the base; `None` if the fit is a constant.
    pub fn ramp(&self) -> Option<Ramp> {
        self.ramp
    }

    /// θ_0 and θ_1, rad; `None` if they are not determined.
    pub fn knots(&self) -> Option<[f64; 2]> {
        match self.undetermined {
            None => self.ramp.map(|ramp| ramp.knots),
            Some(_) => None,
        }
    }

    /// Reason why the knots are not determined; `None` if they are.
    pub fn undetermined(&self) -> Option<Undetermined> {
        self.undetermined
    }

    /// True if θ_1 is the last used view: one cubic covers all views beyond θ_0, and every θ_1
    /// beyond them would fit as well. θ_0 is determined nevertheless.
    pub fn upper_at_end(&self) -> bool {
        self.upper_at_end
    }

    /// Mean energy of the used views, rad² sr⁻¹.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Errors of the fit, rad² sr⁻¹.
    pub fn errors(&self) -> FitErrors {
        self.errors
    }

    /// Errors of the fit in units of the mean energy.
    pub fn relative_errors(&self) -> FitErrors {
        self.relative
    }

    /// The fitted energy (rad² sr⁻¹) at a view elevation (rad).
    pub fn value(&self, theta: f64) -> f64 {
        self.base + self.ramp.map_or(0.0, |ramp| ramp.value(theta))
    }
}

/// Several energy profiles fitted with the same knots.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SharedEnergyFit {
    pub(super) knots: Option<[f64; 2]>,
    pub(super) undetermined: Option<Undetermined>,
    pub(super) upper_at_end: bool,
    pub(super) fits: Vec<EnergyFit>,
}

impl SharedEnergyFit {
    /// θ_0 and θ_1 of all, rad; `None` if they are not determined.
    pub fn knots(&self) -> Option<[f64; 2]> {
        self.knots
    }

    /// Reason why the knots are not determined; `None` if they are.
    pub fn undetermined(&self) -> Option<Undetermined> {
        self.undetermined
    }

    /// True if θ_1 is the last used view of all, see [`EnergyFit::upper_at_end`].
    pub fn upper_at_end(&self) -> bool {
        self.upper_at_end
    }

    /// The fits, one per profile, in the order given.
    pub fn fits(&self) -> &[EnergyFit] {
        &self.fits
    }
}

/// An energy profile.
#[derive(Clone, Copy, Debug)]
pub struct EnergySeries<'a> {
    /// View elevations, rad.
    pub views: &'a [f64],
    /// Energies, rad² sr⁻¹, one per view.
    pub values: &'a [Option<f64>],
}
