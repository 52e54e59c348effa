//! Moment profiles: the moments of a BRDF's slices as functions of the view elevation.

use super::component::{Component, Order};
use super::estimator::{Estimator, SliceMoments};
use super::noise;
use super::slice::{Batch, Channel, Kind, Slice};
use crate::brdf::{Brdf, Channels};
use crate::error::ParameterError;
use crate::parametrization::view_centered;
use crate::registry::keys;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// The part of a BRDF that is analysed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Split {
    /// The whole BRDF.
    #[default]
    None,
    /// The part above the smallest value of the slice at θ_o = 45° ([`lambertian_part`]), clamped
    /// at 0 where other views fall below it.
    Minimum,
}

keys! {
    /// The keys of a config about profiles, but for the estimator.
    #[derive(PartialEq)]
    pub struct MomentsSpec {
        /// Channels of the BRDF, one profile each.
        channels: Vec<Channel> = vec![Channel::Luminance];
        /// Number of view elevations, equally spaced from 0 to `max_view_deg`.
        views: usize = 90;
        /// The last view elevation, degrees, in (0, 90).
        max_view_deg: f64 = 89.0;
        /// Number of view azimuths, equally spaced on the circle from 0, of an anisotropic BRDF.
        #[serde(skip_serializing_if = "is_one")]
        azimuths: usize = 1;
        /// Highest order of the moments.
        order: Order = Order::MAX;
        /// The part of the BRDF.
        split: Split = Split::None;
    }
}

fn is_one(n: &usize) -> bool {
    *n == 1
}

impl MomentsSpec {
    /// Most views that are allowed.
    pub(crate) const MAX_VIEWS: usize = 100_000;

    /// Most view azimuths that are allowed.
    const MAX_AZIMUTHS: usize = 360;

    /// The view azimuths after the first of a BRDF, rad: none of an isotropic one.
    pub fn further_azimuths(&self, brdf: &dyn Brdf) -> impl Iterator<Item = f64> + use<> {
        let n = match brdf.symmetry().isotropic {
            true => 1,
            false => self.azimuths,
        };
        (1..n).map(move |k| k as f64 / n as f64 * TAU)
    }

    /// Checks every key.
    ///
    /// # Errors
    /// Names the key, the value and what is allowed.
    pub fn check(&self) -> Result<(), ParameterError> {
        let names = self.channels.iter().map(|c| c.name());
        let names: Vec<_> = names.collect();
        let twice = (1..names.len()).any(|i| names[..i].contains(&names[i]));
        if names.is_empty() || twice {
            let allowed = format!("at least one of {}, each once", Channel::names());
            let found = format!("[{}]", names.join(", "));
            return Err(ParameterError::new("channels", found, allowed));
        }
        if !(1..=Self::MAX_VIEWS).contains(&self.views) {
            let allowed = format!("a whole number in [1, {}]", Self::MAX_VIEWS);
            return Err(ParameterError::new("views", self.views, allowed));
        }
        if !(1..=Self::MAX_AZIMUTHS).contains(&self.azimuths) {
            let allowed = format!("a whole number from 1 to {}", Self::MAX_AZIMUTHS);
            return Err(ParameterError::new("azimuths", self.azimuths, allowed));
        }
        if !(self.max_view_deg > 0.0 && self.max_view_deg < 90.0) {
            let allowed = "a number in (0, 90)";
            return Err(ParameterError::new(
                "max_view_deg",
                self.max_view_deg,
                allowed,
            ));
        }
        Ok(())
    }

    /// Channels that a BRDF must be built for.
    pub(crate) fn needs(&self) -> Channels {
        let rgb = self.channels.iter().any(|c| c.needs() == Channels::Rgb);
        if rgb {
            Channels::Rgb
        } else {
            Channels::Luminance
        }
    }

    /// The view elevations, rad, ascending. One view alone is the last.
    pub fn view_angles(&self) -> Vec<f64> {
        let last = self.max_view_deg.to_radians();
        let at = |i: usize| match self.views {
            1 => last,
            n => last * i as f64 / (n - 1) as f64,
        };
        (0..self.views).map(at).collect()
    }
}

fn is_zero(azimuth: &f64) -> bool {
    *azimuth == 0.0
}

/// The moments of a BRDF's slices over the view elevation, at one view azimuth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Channel of the BRDF.
    pub channel: Channel,
    /// Highest order of the moments.
    pub order: Order,
    /// View elevations, rad, ascending.
    pub views: Vec<f64>,
    /// View azimuth, rad.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub azimuth: f64,
    /// Diffuse part that was subtracted before, sr⁻¹.
    pub diffuse: f64,
    /// Moments of the slices, one per view.
    pub slices: Vec<SliceMoments>,
}

impl Profile {
    /// Integrates the slices of a BRDF, in parallel; the result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// If the BRDF was not built for the channel, or a key of `spec` is out of range.
    pub fn new(
        brdf: &dyn Brdf,
        channel: Channel,
        spec: &MomentsSpec,
        estimator: &dyn Estimator,
        seed: u64,
    ) -> Result<Self, ParameterError> {
        spec.check()?;
        let diffuse = match spec.split {
            Split::None => 0.0,
            Split::Minimum => lambertian_part(brdf, channel)?,
        };
        Self::made(brdf, (channel, 0.0, diffuse), spec, estimator, seed, None)
    }

    /// The profile of views at another azimuth, rad, without the same diffuse part.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn at_azimuth(
        &self,
        azimuth: f64,
        brdf: &dyn Brdf,
        spec: &MomentsSpec,
        estimator: &dyn Estimator,
        seed: u64,
    ) -> Result<Self, ParameterError> {
        let at = (self.channel, azimuth, self.diffuse);
        Self::made(brdf, at, spec, estimator, seed, None)
    }

    /// The profile of a reconstruction, which is compared with that of its truth, of the same views: the diffuse part of the truth is
    /// subtracted, and slices are integrated by [`Estimator::estimate_against`].
    ///
    /// # Errors
    /// As [`new`](Self::new).
    ///
    /// # Panics
    /// If the truth has other views than `spec`.
    pub fn against(
        truth: &Self,
        brdf: &dyn Brdf,
        spec: &MomentsSpec,
        estimator: &dyn Estimator,
        seed: u64,
    ) -> Result<Self, ParameterError> {
        let at = (truth.channel, truth.azimuth, truth.diffuse);
        Self::made(brdf, at, spec, estimator, seed, Some(truth))
    }

    fn made(
        brdf: &dyn Brdf,
        (channel, azimuth, diffuse): (Channel, f64, f64),
        spec: &MomentsSpec,
        estimator: &dyn Estimator,
        seed: u64,
        truth: Option<&Self>,
    ) -> Result<Self, ParameterError> {
        spec.check()?;
        assert!(truth.is_none_or(|truth| truth.views == spec.view_angles()));
        let views = spec.view_angles();
        if let Some(estimated) = brdf.as_estimated() {
            estimated.prepare();
        }
        let slices = views.par_iter().enumerate().map(|(i, &theta_o)| {
            let slice = Slice::new(brdf, channel, theta_o)?;
            let slice = slice.without(diffuse).at_azimuth(azimuth);
            // An odd multiplier keeps the seeds of a profile's views apart from those of the next seed.
            let seed = seed
                .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                .wrapping_add(i as u64);
            let mut found = match truth.map(|truth| &truth.slices[i].moments) {
                Some(truth) => estimator.estimate_against(&slice, truth, spec.order, seed),
                None => estimator.estimate(&slice, spec.order, seed),
            };
            noise::add(&slice, &mut found.moments);
            Ok(found)
        });
        Ok(Self {
            channel,
            order: spec.order,
            slices: slices.collect::<Result<_, ParameterError>>()?,
            views,
            azimuth,
            diffuse,
        })
    }

    /// One component over the views; `None` where it is undefined or was not asked for.
    pub(crate) fn values(&self, component: Component) -> Vec<Option<f64>> {
        let value = |s: &SliceMoments| Some(s.moments.get(component)?.value);
        self.slices.iter().map(value).collect()
    }

    /// Number of views whose uncertainties are not to be trusted.
    pub(crate) fn unresolved(&self) -> usize {
        self.slices
            .iter()
            .filter(|s| s.unresolved.is_some())
            .count()
    }
}

/// Nodes along each angle, first over the square and then around the best node.
const NODES: usize = 128;
/// Nodes along each angle of a refinement.
const FINE: usize = 17;
/// Refinements; each is 8 times finer.
const ROUNDS: usize = 3;

/// The diffuse part of a BRDF, as Zubiaga et al. 2015 (§2.2) take it: the smallest value (sr⁻¹) of the slice at θ_o = 45°. 128 × 128 nodes at the middle of equal
/// cells of the square (θ, φ), then three times a finer grid around the smallest. Nodes without
/// data are left out; 0 if that leaves none.
///
/// # Errors
/// If the BRDF was not built for the channel.
pub fn lambertian_part(brdf: &dyn Brdf, channel: Channel) -> Result<f64, ParameterError> {
    let slice = Slice::new(brdf, channel, FRAC_PI_4)?;
    let mut batch = Batch::default();
    let mut least: Option<(f64, [f64; 2])> = None;
    let mut cell = 2.0 * FRAC_PI_2 / NODES as f64;
    let mut look = |centre: [f64; 2], cell: f64, n: usize, least: &mut Option<(f64, [f64; 2])>| {
        // The middle of the outermost cells of the square, so that no node is on the horizon.
        let limit = FRAC_PI_2 - 0.5 * cell.min(2.0 * FRAC_PI_2 / NODES as f64);
        let step = |i: usize| (i as f64 - 0.5 * (n - 1) as f64) * cell;
        let mut points = Vec::with_capacity(n * n);
        batch.clear();
        for i in 0..n {
            for j in 0..n {
                let [theta, phi] =
                    [centre[0] + step(i), centre[1] + step(j)].map(|a| a.clamp(-limit, limit));
                points.push([theta, phi]);
                batch.push(&slice, view_centered(theta, phi));
            }
        }
        slice.evaluate(&mut batch);
        for ((&value, kind), point) in batch.values().iter().zip(batch.kinds()).zip(points) {
            if *kind != Kind::Missing && least.is_none_or(|(smallest, _)| value < smallest) {
                *least = Some((value, point));
            }
        }
    };
    look([0.0; 2], cell, NODES, &mut least);
    for _ in 0..ROUNDS {
        let Some((_, centre)) = least else {
            break;
        };
        cell /= (FINE / 2) as f64;
        look(centre, cell, FINE, &mut least);
    }
    Ok(least.map_or(0.0, |(value, _)| value))
}
