//! Clamping: the share of a profile's course that the horizon causes.
//!
//! Zubiaga et al. 2015 (§2.5, §4) see means, variances, skewness and kurtosis leave their simple
//! course towards grazing views, and conjecture that the horizon, which cuts lobes off, is the
//! cause. Test: take the lobe at normal view, where it is cut least, move it rigidly in the chart
//! (θ, φ) until it is centred on the mirror direction of the view, let the horizon cut it, and
//! change nothing else. Its moments leave their course for no other reason than the cut:
//!
//! - uncut, the moved lobe has the mean µ(0) − θ_o and all central moments of θ_o = 0;
//! - cut, it has the moments of [`HorizonCopy`].
//!
//! The share of a deviation that the cut explains is 1 − Σ (actual − cut)² / Σ (actual − uncut)²
//! over the views: 1 if the cut is all there is, 0 if it explains nothing, negative if it leads
//! away.

use super::component::Component;
use super::estimator::Estimator;
use super::profile::Profile;
use super::slice::Slice;
use crate::brdf::{Brdf, Channels, Presence};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::parametrization::{view_centered, view_centered_angles};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// A BRDF's lobe at normal view, moved to the mirror direction of every other view; not reciprocal.
#[derive(Clone, Copy)]
pub struct HorizonCopy<'a> {
    of: &'a dyn Brdf,
}

impl<'a> HorizonCopy<'a> {
    /// Copies the lobe of an isotropic BRDF.
    pub fn new(of: &'a dyn Brdf) -> Self {
        Self { of }
    }
}

impl Brdf for HorizonCopy<'_> {
    fn channels(&self) -> &Channels {
        self.of.channels()
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry {
            reciprocal: false,
            ..self.of.symmetry()
        }
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(0.0);
        if !pair.is_above_horizon() {
            return Presence::Present;
        }
        let (i, o) = (pair.omega_i.vector(), pair.omega_o.vector());
        // Turns the view into the x–z plane.
        let (sin, cos) = pair.omega_o.phi().sin_cos();
        let turned = DVec3::new(i.x * cos + i.y * sin, i.y * cos - i.x * sin, i.z);
        let [theta, phi] = view_centered_angles(Direction::from_unit(turned));
        let theta = theta + pair.omega_o.sin_theta().atan2(o.z);
        if theta.abs() >= FRAC_PI_2 {
            // Beyond the horizon of the normal view nothing is known of the lobe but its end.
            return Presence::Present;
        }
        let there = DirectionPair::new(view_centered(theta, phi), Direction::NORMAL);
        self.of.eval(&there, out)
    }
}

/// Share of a profile's course that the horizon explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clamping {
    /// Share of the deviation of each component that is explained, at the component's index;
    /// `None` for the energy, for components that vanish by symmetry, where the deviation is next
    /// to nothing (an RMS below `Clamping::NOTHING` of σ, σ², or the larger of 1 and the moment),
    /// and if the profile does not start at normal view.
    pub explained: Vec<Option<f64>>,
    /// The last view that counts, rad.
    pub last_view: f64,
}

impl Clamping {
    /// Deviations below this share of their scale have no course to be explained.
    pub(crate) const NOTHING: f64 = 0.05;

    /// Compares a profile that starts at normal view with that of the moved lobe, over the views
    /// up to `last_view` (rad).
    ///
    /// # Errors
    /// If the BRDF was not built for the profile's channel.
    pub fn of(
        brdf: &dyn Brdf,
        profile: &Profile,
        estimator: &dyn Estimator,
        last_view: f64,
    ) -> Result<Self, ParameterError> {
        let copy = HorizonCopy::new(brdf);
        let views = profile.views.par_iter().filter(|v| **v <= last_view);
        let cut = views.map(|&theta_o| {
            let slice = Slice::new(&copy, profile.channel, theta_o)?.without(profile.diffuse);
            Ok(estimator.estimate(&slice, profile.order, 0).moments)
        });
        let cut = cut.collect::<Result<Vec<_>, ParameterError>>()?;
        let explained = Component::ALL.map(|c| {
            if c.order() == 0 || c.is_odd() {
                return None;
            }
            if *profile.views.first()? != 0.0 {
                return None;
            }
            let normal = &profile.slices.first()?.moments;
            let start = normal.get(c)?.value;
            let [s, t] = normal.sigma()?;
            let scale = match c.order() {
                1 | 2 => s.powi(c.n as i32) * t.powi(c.m as i32),
                _ => start.abs().max(1.0),
            };
            let (mut left, mut all, mut views) = (0.0, 0.0, 0);
            let actual = profile.slices.iter().zip(&profile.views);
            for ((slice, theta_o), cut) in actual.zip(&cut) {
                let (Some(actual), Some(cut)) = (slice.moments.get(c), cut.get(c)) else {
                    continue;
                };
                let uncut = if c.order() == 1 {
                    start - theta_o
                } else {
                    start
                };
                left += (actual.value - cut.value).powi(2);
                all += (actual.value - uncut).powi(2);
                views += 1;
            }
            let least = f64::from(views) * (Self::NOTHING * scale).powi(2);
            (all > least).then(|| 1.0 - left / all)
        });
        Ok(Self {
            explained: explained.to_vec(),
            last_view,
        })
    }
}
