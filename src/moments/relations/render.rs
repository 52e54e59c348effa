//! Moments of the radiance that a moving view sees, by quadrature, and those of the light.

use super::super::gaussian::TruncatedGaussian;
use super::super::peak::PeakResolving;
use super::super::slice::Slice;
use super::integrand::{Light, Reflected, reflected, weighted_light};
use super::local::{Local, gaussian};
use super::{Along, AngleMoments, RelationSpec};
use crate::error::ParameterError;
use crate::lighting::Lighting;
use rayon::prelude::*;
use std::f64::consts::SQRT_2;

/// A slice under a lighting.
pub(super) struct Scene<'a> {
    pub slice: Slice<'a>,
    pub lighting: &'a dyn Lighting,
    pub along: Along,
    /// Azimuth of the plane of incidence within the lighting, rad.
    pub azimuth: f64,
    /// Standard deviation of the window, rad.
    pub window: f64,
    pub rule: PeakResolving,
}

/// See the fields of the same names of [`Relation`](super::Relation).
pub(super) struct Rendered {
    pub moments: Option<AngleMoments>,
    pub uncertainty: Option<AngleMoments>,
    pub cut_share: f64,
    pub missing_share: f64,
    pub views: usize,
    pub resolved: bool,
}

impl Scene<'_> {
    /// Half length of the window in standard deviations; it is 4e-6 there.
    const REACH: f64 = 5.0;
    /// Radiance towards the view that moved by t.
    fn radiance(&self, t: f64) -> Result<Reflected, ParameterError> {
        // The isotropic BRDF is looked at in the frame in which the view has azimuth 0.
        let place = self.along.place(self.slice.theta_o, t);
        let slice = Slice::new(self.slice.brdf, self.slice.channel, place.theta_o)?;
        let slice = slice.without(self.slice.diffuse);
        let light = self.light_at(place.phi_o);
        Ok(reflected(slice, light, &self.rule))
    }

    /// The light in the frame of a view at this azimuth, rad.
    pub(super) fn light_at(&self, phi_o: f64) -> Light<'_> {
        Light::new(self.lighting, self.slice.channel, self.azimuth + phi_o)
    }

    /// L_φ or L_θ through a Gaussian window of this width about the centre of the lobe.
    pub(super) fn light(
        &self,
        local: &Local,
        width: f64,
    ) -> Result<Option<AngleMoments>, ParameterError> {
        let is_across = self.along != Along::Theta;
        let across = match is_across {
            false => TruncatedGaussian::matched(0.0, local.variance[1])?,
            true => TruncatedGaussian::matched(local.mean, local.variance[0])?,
        };
        let weight = |theta: f64, phi: f64| match is_across {
            false => gaussian(theta - local.mean, width) * across.density(phi),
            true => gaussian(phi, width) * across.density(theta),
        };
        let (moments, sign) = weighted_light(weight, local.mean, self.light_at(0.0), &self.rule)?;
        let found = || {
            let (mean, [tt, _, pp]) = (moments.mean()?, moments.covariance()?);
            let higher = |[a, b]: [usize; 2]| moments.value(a, b);
            Some(match is_across {
                false => AngleMoments {
                    energy: moments.energy()?,
                    mean: sign * mean[0],
                    variance: tt,
                    skewness: higher([3, 0]).map(|x| sign * x),
                    kurtosis: higher([4, 0]),
                },
                true => AngleMoments {
                    energy: moments.energy()?,
                    mean: mean[1],
                    variance: pp,
                    skewness: higher([0, 3]),
                    kurtosis: higher([0, 4]),
                },
            })
        };
        Ok(found())
    }

    /// Moments of the radiance over t by the trapezoidal rule, which for a smooth window
    /// converges faster than any power; the error estimate is the change from half the nodes.
    pub(super) fn render(&self, spec: &RelationSpec) -> Result<Rendered, ParameterError> {
        let [lo, hi] = self.range();
        let mut intervals = 32;
        let views = |numbers: Vec<usize>, intervals: usize| {
            let at = |i: usize| lo + (hi - lo) * i as f64 / intervals as f64;
            let radiances = numbers.into_par_iter().map(|i| self.radiance(at(i)));
            radiances.collect::<Result<Vec<Reflected>, ParameterError>>()
        };
        let mut known = views((0..=intervals).collect(), intervals)?;
        loop {
            let step = (hi - lo) / intervals as f64;
            let fine = self.moments(&known, lo, step);
            let half: Vec<Reflected> = known.iter().step_by(2).copied().collect();
            let coarse = self.moments(&half, lo, 2.0 * step);
            let uncertainty = fine.zip(coarse).map(|((fine, share), (coarse, _))| {
                let energy = (fine.energy - coarse.energy).abs();
                let off = |a: Option<f64>, b: Option<f64>| Some((a? - b?).abs() + share);
                AngleMoments {
                    energy: energy + share * fine.energy,
                    mean: (fine.mean - coarse.mean).abs() + share * fine.variance.sqrt(),
                    variance: (fine.variance - coarse.variance).abs() + share * fine.variance,
                    skewness: off(fine.skewness, coarse.skewness),
                    kurtosis: off(fine.kurtosis, coarse.kurtosis),
                }
            });
            let close = fine.zip(uncertainty).is_none_or(|((m, _), u)| {
                u.energy <= spec.tolerance * m.energy
                    && u.mean <= spec.tolerance * m.variance.sqrt()
                    && u.variance <= spec.tolerance * m.variance
            });
            if close || 2 * intervals + 1 > spec.max_views {
                let inside = 0.5 * (self.share(hi) - self.share(lo));
                let missing = known.iter().map(|r| r.missing_share);
                return Ok(Rendered {
                    moments: fine.map(|(m, _)| m),
                    uncertainty,
                    cut_share: (1.0 - inside / libm::erf(Self::REACH / SQRT_2)).max(0.0),
                    missing_share: missing.fold(0.0, f64::max),
                    views: known.len(),
                    resolved: close && known.iter().all(|r| r.resolved),
                });
            }
            let between = (0..intervals).map(|i| 2 * i + 1).collect();
            intervals *= 2;
            let new = views(between, intervals)?;
            let mut both = Vec::with_capacity(intervals + 1);
            for (old, new) in known.iter().zip(&new) {
                both.extend([*old, *new]);
            }
            both.extend(known.last());
            known = both;
        }
    }

    /// The views that are rendered: those of the window above the horizon.
    pub(super) fn range(&self) -> [f64; 2] {
        let [lo, hi] = self.along.range(self.slice.theta_o);
        let reach = Self::REACH * self.window;
        [lo.max(-reach), hi.min(reach).max(lo.max(-reach) + 1e-9)]
    }

    fn share(&self, t: f64) -> f64 {
        libm::erf(t / (SQRT_2 * self.window))
    }

    /// Moments of window × radiance, and the share of the energy the cubature is unsure of.
    fn moments(&self, values: &[Reflected], lo: f64, step: f64) -> Option<(AngleMoments, f64)> {
        let last = values.len() - 1;
        let weighted: Vec<(f64, f64)> = values
            .iter()
            .enumerate()
            .map(|(i, r)| {
                let t = lo + step * i as f64;
                let end = if i == 0 || i == last { 0.5 } else { 1.0 };
                (t, end * step * gaussian(t, self.window) * r.radiance)
            })
            .collect();
        let raw = [0, 1, 2, 3, 4].map(|n| weighted.iter().map(|(t, w)| w * t.powi(n)).sum());
        let moments = AngleMoments::from_raw(raw)?;
        let unsure: f64 = values
            .iter()
            .enumerate()
            .map(|(i, r)| step * gaussian(lo + step * i as f64, self.window) * r.uncertainty)
            .sum();
        Some((moments, unsure / moments.energy))
    }
}
