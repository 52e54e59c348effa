//! Relations: moments of reflected radiance predicted from moments of a BRDF slice and of the light
//! (Zubiaga et al. 2015, §3.2 and §3.3), as printed and corrected, beside the rendered truth.
//!
//! [`docs::relations`](crate::docs::relations) derives the forms and says when they hold.

mod integrand;

use super::curve::Curve;
use super::estimator::SliceMoments;
use super::gaussian::TruncatedGaussian;
use super::peak::PeakResolving;
use super::profile::Profile;
use super::slice::Slice;
use crate::brdf::Brdf;
use crate::error::{ParameterError, in_closed, in_left_open};
use crate::lighting::Lighting;
use crate::registry::{keys, named};
use integrand::{Light, Reflected, reflected, weighted_light};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, SQRT_2, TAU};

named! {
    /// Direction in which the view moves while the normal stays.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Along {
        /// In the plane of incidence: omega_o(t) = m(θ_o + t, 0).
        Theta = "theta",
        /// Out of it, along the great circle across: omega_o(t) = m(θ_o, t). Turning the azimuth of
        /// the view by a moves it by t = a sin θ_o to first order.
        Phi = "phi",
    }
}

keys! {
    /// Settings of the measurement of a relation.
    #[derive(PartialEq)]
    pub struct RelationSpec {
        /// Standard deviation of the Gaussian window exp(−t²/(2w²)) over the view, degrees, in
        /// (0, 60]. It ends at 5 of them, and 0.1° before the horizon.
        window_deg: f64 = 5.0;
        /// Azimuth of the plane of incidence within the lighting, degrees.
        azimuth_deg: f64 = 0.0;
        /// Largest error of the rendered moments: of energy and variance relative to them, of the mean
        /// relative to the standard deviation.
        tolerance: f64 = 1e-3;
        /// Most evaluations of the BRDF per view.
        max_evaluations: usize = 400_000;
        /// Views within the window: doubled from 33 until the tolerance is reached or this is exceeded.
        max_views: usize = 257;
    }
}

impl RelationSpec {
    /// Checks every key.
    ///
    /// # Errors
    /// Names the key, the value and what is allowed.
    pub fn check(&self) -> Result<(), ParameterError> {
        in_left_open("window_deg", self.window_deg, 0.0, 60.0)?;
        in_closed("azimuth_deg", self.azimuth_deg, -360.0, 360.0)?;
        if !(33..=100_000).contains(&self.max_views) {
            let allowed = "a whole number in [33, 100000]";
            return Err(ParameterError::new("max_views", self.max_views, allowed));
        }
        super::Estimator::check(&self.rule())
    }

    fn rule(&self) -> PeakResolving {
        PeakResolving {
            tolerance: self.tolerance,
            max_evaluations: self.max_evaluations,
        }
    }
}

/// Moments of a function of one angle, seen through a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AngleMoments {
    /// Integral; of radiance over the view: radiance × rad.
    #[serde(with = "crate::numeric::infinite_as_null")]
    pub energy: f64,
    /// Mean, rad.
    #[serde(with = "crate::numeric::infinite_as_null")]
    pub mean: f64,
    /// Variance, rad².
    #[serde(with = "crate::numeric::infinite_as_null")]
    pub variance: f64,
}

/// A prediction and its errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// The predicted moments.
    pub moments: AngleMoments,
    /// Predicted minus rendered moments: relative to the rendered energy, to the square root of
    /// the rendered variance, to the rendered variance. `None` if nothing is rendered.
    pub errors: Option<AngleMoments>,
}

/// Rendered moments at one view and direction of its motion, and predictions by Eqs. 22 to 24.
///
/// Means of radiance are of t, the angle (rad) by which the view moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Relation {
    /// Direction in which the view moves.
    pub along: Along,
    /// View elevation, rad.
    pub theta_o: f64,
    /// w: standard deviation of the window over t, rad.
    pub window: f64,
    /// Energy α of the slice, rad² sr⁻¹.
    pub energy: f64,
    /// Centre of the slice in the angle along which the view moves: µ_θ or 0, rad.
    pub mean: f64,
    /// Slope of the centre: dµ_θ/dθ_o fitted over the window, or sin µ_θ/sin θ_o.
    pub slope: f64,
    /// Variance σ_θ² or σ_φ², rad².
    pub variance: f64,
    /// L_φ or L_θ through a window of |slope| w about the centre; `None` if there is no light, or
    /// the slope is within 1e-6 of 0.
    pub light: Option<AngleMoments>,
    /// Moments by Eq. 9 with the BRDF itself; `None` if no light is reflected.
    pub rendered: Option<AngleMoments>,
    /// Errors of the rendered quadrature, in the units of the moments.
    pub uncertainty: Option<AngleMoments>,
    /// Prediction by Eqs. 22 to 24: α µ_0, µ + E, σ² + Var.
    pub printed: Option<Prediction>,
    /// Prediction with the dilation: α µ_0/|slope|, (E − µ)/slope, (σ² + Var)/slope².
    pub corrected: Option<Prediction>,
    /// With the dilation and the window carried through the lobe: exact for the slice model with
    /// linear mean, constant energy and variance, whatever light and window. `None` if there is
    /// no light.
    pub windowed: Option<Prediction>,
    /// Share of the window that is cut off at the horizon, in [0, 1].
    pub cut_share: f64,
    /// Largest share of a slice without data.
    pub missing_share: f64,
    /// Views that were rendered.
    pub views: usize,
    /// True if the rendered moments are within the tolerance.
    pub resolved: bool,
}

/// Measures the relations of one view: renders `brdf` under `lighting` through the window, and
/// predicts from `profile`, which must be of the same BRDF and decides about channel and diffuse
/// part. Parallel over views; the result does not depend on the number of threads.
///
/// The frame of the lighting is that of the surface: z is the normal.
///
/// # Errors
/// If a key of `spec` or `theta_o` (rad) is out of range, the profile has no moments of order 2,
/// or the BRDF is not isotropic or not built for the profile's channel.
pub fn compare(
    brdf: &dyn Brdf,
    profile: &Profile,
    lighting: &dyn Lighting,
    theta_o: f64,
    along: Along,
    spec: &RelationSpec,
) -> Result<Relation, ParameterError> {
    spec.check()?;
    let slice = Slice::new(brdf, profile.channel, theta_o)?.without(profile.diffuse);
    if !brdf.symmetry().isotropic {
        let allowed = "an isotropic BRDF";
        return Err(ParameterError::new("material", "anisotropic", allowed));
    }
    let window = spec.window_deg.to_radians();
    let local = Local::new(profile, theta_o, window)?;
    let scene = Scene {
        slice,
        lighting,
        along,
        azimuth: spec.azimuth_deg.to_radians(),
        window,
        rule: spec.rule(),
    };
    let rendered = scene.render(spec)?;
    let slope = match along {
        Along::Theta => local.slope,
        // Both sines vanish together.
        Along::Phi if theta_o < 1e-6 => local.slope,
        Along::Phi => local.mean.sin() / theta_o.sin(),
    };
    let (mean, variance) = match along {
        Along::Theta => (local.mean, local.variance[0]),
        Along::Phi => (0.0, local.variance[1]),
    };
    let shadow = slope.abs() * window;
    let light = match slope.abs() > 1e-6 {
        true => scene.light(&local, shadow)?,
        false => None,
    };
    let full = scene.light(&local, shadow.hypot(variance.sqrt()))?;
    let predict = |moments: AngleMoments| Prediction {
        moments,
        errors: rendered.moments.map(|r| AngleMoments {
            energy: moments.energy / r.energy - 1.0,
            mean: (moments.mean - r.mean) / r.variance.sqrt(),
            variance: moments.variance / r.variance - 1.0,
        }),
    };
    let printed = |l: AngleMoments| AngleMoments {
        energy: local.energy * l.energy,
        mean: mean + l.mean,
        variance: variance + l.variance,
    };
    let corrected = |l: AngleMoments| AngleMoments {
        energy: local.energy * l.energy / slope.abs(),
        mean: (l.mean - mean) / slope,
        variance: (variance + l.variance) / (slope * slope),
    };
    let windowed = |l: AngleMoments| {
        let spread = shadow * shadow + variance;
        // d t / d θ_i once the window has its say: 1/slope where it is wide against the lobe.
        let rate = slope * window * window / spread;
        AngleMoments {
            energy: local.energy * l.energy * window / spread.sqrt(),
            mean: rate * (l.mean - mean),
            variance: rate * rate * l.variance + window * window * variance / spread,
        }
    };
    Ok(Relation {
        along,
        theta_o,
        window,
        energy: local.energy,
        mean,
        slope,
        variance,
        light,
        rendered: rendered.moments,
        uncertainty: rendered.uncertainty,
        printed: light.map(|l| predict(printed(l))),
        corrected: light.map(|l| predict(corrected(l))),
        windowed: full.map(|l| predict(windowed(l))),
        cut_share: rendered.cut_share,
        missing_share: rendered.missing_share,
        views: rendered.views,
        resolved: rendered.resolved,
    })
}

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
struct Local {
    energy: f64,
    mean: f64,
    variance: [f64; 2],
    slope: f64,
}

impl Local {
    fn new(profile: &Profile, theta_o: f64, window: f64) -> Result<Self, ParameterError> {
        let nodes = nodes(profile);
        let curve = |of: usize| {
            let curve = Curve::new(
                nodes
                    .iter()
                    .map(|(theta_o, moments)| (*theta_o, moments[of])),
            );
            curve.ok_or_else(|| ParameterError::new("profile", 0, "views with moments of order 2"))
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

fn gaussian(t: f64, width: f64) -> f64 {
    (-0.5 * (t / width) * (t / width)).exp()
}

/// A slice under a lighting.
struct Scene<'a> {
    slice: Slice<'a>,
    lighting: &'a dyn Lighting,
    along: Along,
    azimuth: f64,
    window: f64,
    rule: PeakResolving,
}

struct Rendered {
    moments: Option<AngleMoments>,
    uncertainty: Option<AngleMoments>,
    cut_share: f64,
    missing_share: f64,
    views: usize,
    resolved: bool,
}

impl Scene<'_> {
    /// Half length of the window in standard deviations; it is 4e-6 there.
    const REACH: f64 = 5.0;
    /// Smallest distance of a view from the horizon, rad.
    const HORIZON: f64 = 0.1 * TAU / 360.0;

    /// Radiance towards the view that moved by t.
    fn radiance(&self, t: f64) -> Result<Reflected, ParameterError> {
        let theta_o = self.slice.theta_o;
        // The isotropic BRDF is looked at in the frame in which the view has azimuth 0.
        let (elevation, turn) = match self.along {
            Along::Theta if theta_o + t < 0.0 => (-theta_o - t, 0.5 * TAU),
            Along::Theta => (theta_o + t, 0.0),
            Along::Phi => {
                let (x, y) = (theta_o.sin() * t.cos(), t.sin());
                let elevation = x.hypot(y).atan2(theta_o.cos() * t.cos());
                (elevation, (y + 0.0).atan2(x + 0.0))
            }
        };
        let slice = Slice::new(self.slice.brdf, self.slice.channel, elevation)?;
        let slice = slice.without(self.slice.diffuse);
        let light = Light::new(self.lighting, slice.channel, self.azimuth + turn);
        Ok(reflected(slice, light, &self.rule))
    }

    /// L_φ or L_θ through a Gaussian window of this width about the centre of the lobe.
    fn light(&self, local: &Local, width: f64) -> Result<Option<AngleMoments>, ParameterError> {
        let light = Light::new(self.lighting, self.slice.channel, self.azimuth);
        let along = self.along;
        let across = match along {
            Along::Theta => TruncatedGaussian::matched(0.0, local.variance[1])?,
            Along::Phi => TruncatedGaussian::matched(local.mean, local.variance[0])?,
        };
        let weight = |theta: f64, phi: f64| match along {
            Along::Theta => gaussian(theta - local.mean, width) * across.density(phi),
            Along::Phi => gaussian(phi, width) * across.density(theta),
        };
        let (moments, sign) = weighted_light(weight, local.mean, light, &self.rule)?;
        let found = || {
            let (mean, [tt, _, pp]) = (moments.mean()?, moments.covariance()?);
            let (mean, variance) = match along {
                Along::Theta => (sign * mean[0], tt),
                Along::Phi => (mean[1], pp),
            };
            Some(AngleMoments {
                energy: moments.energy()?,
                mean,
                variance,
            })
        };
        Ok(found())
    }

    /// Moments of the radiance over t by the trapezoidal rule, which for a smooth window
    /// converges faster than any power; the error estimate is the change from half the nodes.
    fn render(&self, spec: &RelationSpec) -> Result<Rendered, ParameterError> {
        let theta_o = self.slice.theta_o;
        let limit = FRAC_PI_2 - Self::HORIZON;
        let reach = Self::REACH * self.window;
        let [lo, hi] = match self.along {
            Along::Theta => [-limit - theta_o, limit - theta_o],
            Along::Phi => [-limit, limit],
        };
        let [lo, hi] = [lo.max(-reach), hi.min(reach).max(lo.max(-reach) + 1e-9)];
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
                AngleMoments {
                    energy: energy + share * fine.energy,
                    mean: (fine.mean - coarse.mean).abs() + share * fine.variance.sqrt(),
                    variance: (fine.variance - coarse.variance).abs() + share * fine.variance,
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
        let energy: f64 = weighted.iter().map(|(_, w)| w).sum();
        if !(energy > 0.0) {
            return None;
        }
        let mean = weighted.iter().map(|(t, w)| w * t).sum::<f64>() / energy;
        let square: f64 = weighted
            .iter()
            .map(|(t, w)| w * (t - mean) * (t - mean))
            .sum();
        let unsure: f64 = values
            .iter()
            .enumerate()
            .map(|(i, r)| step * gaussian(lo + step * i as f64, self.window) * r.uncertainty)
            .sum();
        let moments = AngleMoments {
            energy,
            mean,
            variance: square / energy,
        };
        Some((moments, unsure / energy))
    }
}
