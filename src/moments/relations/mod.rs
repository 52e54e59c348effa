//! Relations: moments of reflected radiance predicted from moments of a BRDF slice and of the light
//! (Zubiaga et al. 2015, §3.2 and §3.3), as printed and corrected, beside the rendered truth.
//!
//! [`docs::relations`](crate::docs::relations) derives the forms and says when they hold.

mod integrand;
mod local;
mod mixture;
mod motion;
mod render;
mod window;

use super::peak::PeakResolving;
use super::profile::Profile;
use super::slice::Slice;
use crate::brdf::Brdf;
use crate::error::{ParameterError, in_closed};
use crate::lighting::Lighting;
use crate::registry::{keys, named};
use local::Local;
pub use mixture::MOST_COMPONENTS;
use mixture::Mixtures;
use rayon::prelude::*;
use render::Scene;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Elevation of the last view that is rendered, rad: 0.1° above the horizon.
const LAST_VIEW: f64 = FRAC_PI_2 - 0.1 * TAU / 360.0;

/// Widest window that one mixture of the slices serves, rad; wider ones are sums of such.
const NARROW: f64 = 5.0 * TAU / 360.0;

/// Widest window over the azimuth of a view that turns, rad.
const NARROW_TURN: f64 = 0.2;

/// Least elevation of a view that turns about the normal, degrees.
pub const LEAST_TURNING_DEG: f64 = 0.01;

/// Distances of directions of the light that a mixture is summed over, degrees: the next is used while it changes the moments.
const STEPS_DEG: [f64; 4] = [2.0, 1.0, 0.5, 0.25];

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
        /// Out of it, about the normal, at the same elevation: by the azimuth t/sin θ_o, from −180° to 180°.
        Azimuth = "azimuth",
    }
}

keys! {
    /// Settings of the measurement of a relation.
    #[derive(PartialEq)]
    pub struct RelationSpec {
        /// Standard deviation of the Gaussian window exp(−t²/(2w²)) over the view, degrees, in
        /// [0.001, 60]. It ends at 5 of them, and 0.1° before the horizon.
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
        /// Gaussians of which a slice is made in the form `mixture`, at most, in [1, 4]: as many as predict left-out views best.
        components: usize = MOST_COMPONENTS;
    }
}

impl RelationSpec {
    /// Checks every key.
    ///
    /// # Errors
    /// Names the key, the value and what is allowed.
    pub fn check(&self) -> Result<(), ParameterError> {
        in_closed("window_deg", self.window_deg, 1e-3, 60.0)?;
        in_closed("azimuth_deg", self.azimuth_deg, -360.0, 360.0)?;
        if !(33..=100_000).contains(&self.max_views) {
            let allowed = "a whole number in [33, 100000]";
            return Err(ParameterError::new("max_views", self.max_views, allowed));
        }
        if !(1..=MOST_COMPONENTS).contains(&self.components) {
            let allowed = format!("a whole number in [1, {MOST_COMPONENTS}]");
            return Err(ParameterError::new("components", self.components, allowed));
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
    /// Skewness, the third central moment over variance^(3/2); `None` where a form has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skewness: Option<f64>,
    /// Excess kurtosis, the fourth central moment over variance² less 3; `None` where a form has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kurtosis: Option<f64>,
}

impl AngleMoments {
    /// Of raw moments of orders 0 to 4; `None` without energy or width.
    fn from_raw(raw: [f64; 5]) -> Option<Self> {
        let energy = raw[0];
        if !(energy > 0.0) {
            return None;
        }
        let [_, mean, second, third, fourth] = raw.map(|m| m / energy);
        let square = mean * mean;
        let variance = second - square;
        let of_third = third - 3.0 * mean * second + 2.0 * mean * square;
        let of_fourth = fourth - 4.0 * mean * third + 6.0 * square * second - 3.0 * square * square;
        Some(Self {
            energy,
            mean,
            variance,
            skewness: (variance > 0.0).then(|| of_third / variance.powf(1.5)),
            kurtosis: (variance > 0.0).then(|| of_fourth / (variance * variance) - 3.0),
        })
    }

    /// What differs from others: relative to their energy and variance, of means to the square root of their variance, the
    /// difference itself of skewness and kurtosis.
    fn errors(&self, of: &Self) -> Self {
        let less = |a: Option<f64>, b: Option<f64>| Some(a? - b?);
        Self {
            energy: self.energy / of.energy - 1.0,
            mean: (self.mean - of.mean) / of.variance.sqrt(),
            variance: self.variance / of.variance - 1.0,
            skewness: less(self.skewness, of.skewness),
            kurtosis: less(self.kurtosis, of.kurtosis),
        }
    }
}

/// What relations are predicted from: the profile of a material, and the mixtures of its slices that were asked for.
#[derive(Debug)]
pub struct SliceModel {
    /// The profile; it decides about channel and diffuse part.
    pub profile: Profile,
    mixtures: Mixtures,
}

impl SliceModel {
    /// Of a profile; mixtures are fitted when they are needed, and kept.
    pub fn new(profile: Profile) -> Self {
        Self {
            profile,
            mixtures: Mixtures::default(),
        }
    }
}

/// A prediction and its errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// The predicted moments.
    pub moments: AngleMoments,
    /// Predicted minus rendered moments: relative to the rendered energy, to the square root of
    /// the rendered variance, to the rendered variance; of skewness and kurtosis the difference. `None` if nothing is rendered.
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
    /// With each slice a sum of a few Gaussians, and the window a sum of narrow ones that ends where views are rendered. `None` if
    /// there is no light, or it is too narrow for the sum over its directions to be within the tolerance.
    #[serde(default)]
    pub mixture: Option<Prediction>,
    /// Gaussians of a slice of the mixture, at most; `None` in rows from before there were any.
    #[serde(default)]
    pub components: Option<usize>,
    /// Half the deviance of slices that were left out of a fit, over their energy: of relative residuals of size ε it is ε²/2. A fit
    /// without a slice begins with that of all and takes three steps.
    #[serde(default)]
    pub misfit: Option<f64>,
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
/// predicts from `model`, whose profile must be of the same BRDF. Parallel over views; the result does not depend on the number of
/// threads.
///
/// The frame of the lighting is that of the surface: z is the normal.
///
/// # Errors
/// If a key of `spec` or `theta_o` (rad) is out of range, the profile has no moments of order 2,
/// or the BRDF is not isotropic or not built for the profile's channel.
pub fn compare(
    brdf: &dyn Brdf,
    model: &SliceModel,
    lighting: &dyn Lighting,
    theta_o: f64,
    along: Along,
    spec: &RelationSpec,
) -> Result<Relation, ParameterError> {
    spec.check()?;
    let profile = &model.profile;
    let slice = Slice::new(brdf, profile.channel, theta_o)?.without(profile.diffuse);
    if !brdf.symmetry().isotropic {
        let allowed = "an isotropic BRDF";
        return Err(ParameterError::new("material", "anisotropic", allowed));
    }
    if along == Along::Azimuth && !(theta_o.to_degrees() >= LEAST_TURNING_DEG * (1.0 - 1e-9)) {
        let allowed = "a view at least 0.01° beside the normal, about which its azimuth turns";
        return Err(ParameterError::new("theta_o", theta_o, allowed));
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
        _ if theta_o < 1e-6 => local.slope,
        _ => local.mean.sin() / theta_o.sin(),
    };
    let (mean, variance) = match along {
        Along::Theta => (local.mean, local.variance[0]),
        _ => (0.0, local.variance[1]),
    };
    let gaussian = Gaussians {
        local: &local,
        slope,
        mean,
        variance,
        window,
    };
    let light = match slope.abs() > 1e-6 {
        true => scene.light(&local, slope.abs() * window)?,
        false => None,
    };
    let full = scene.light(&local, gaussian.spread().sqrt())?;
    let predict = |moments: AngleMoments| Prediction {
        moments,
        errors: rendered.moments.map(|r| moments.errors(&r)),
    };
    let widest = match along {
        Along::Azimuth => NARROW.min(NARROW_TURN * theta_o.sin()),
        _ => NARROW,
    };
    let mixture = Mixed::new(&scene, &model.mixtures, spec, (widest, scene.range()))?;
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
        printed: light.map(|l| predict(gaussian.printed(&l))),
        corrected: light.map(|l| predict(gaussian.corrected(&l))),
        windowed: full.map(|l| predict(gaussian.windowed(&l))),
        mixture: mixture.moments.map(predict),
        components: Some(mixture.components),
        misfit: Some(mixture.misfit),
        cut_share: rendered.cut_share,
        missing_share: rendered.missing_share,
        views: rendered.views,
        resolved: rendered.resolved,
    })
}

/// The forms of which a slice is one Gaussian.
struct Gaussians<'a> {
    local: &'a Local,
    slope: f64,
    mean: f64,
    variance: f64,
    window: f64,
}

impl Gaussians<'_> {
    /// Variance of the Gaussian through which the window and the lobe together see the light, rad².
    fn spread(&self) -> f64 {
        (self.slope * self.window).powi(2) + self.variance
    }

    /// Eqs. 22 to 24.
    fn printed(&self, l: &AngleMoments) -> AngleMoments {
        AngleMoments {
            energy: self.local.energy * l.energy,
            mean: self.mean + l.mean,
            variance: self.variance + l.variance,
            skewness: None,
            kurtosis: None,
        }
    }

    /// With the dilation.
    fn corrected(&self, l: &AngleMoments) -> AngleMoments {
        let rate = self.slope.recip();
        self.seen(
            l,
            self.local.energy * l.energy * rate.abs(),
            rate,
            self.variance * rate * rate,
        )
    }

    /// With the dilation and the window; `l` is seen through [`spread`](Self::spread).
    fn windowed(&self, l: &AngleMoments) -> AngleMoments {
        let spread = self.spread();
        // d t / d θ_i once the window has its say: 1/slope where it is wide against the lobe.
        let rate = self.slope * self.window * self.window / spread;
        let energy = self.local.energy * l.energy * self.window / spread.sqrt();
        self.seen(
            l,
            energy,
            rate,
            self.window * self.window * self.variance / spread,
        )
    }

    /// Of the light l, read at `rate` times its angle from the centre, and blurred by a Gaussian of a variance: the cumulant of
    /// order n is rateⁿ times that of the light, plus the variance for n = 2.
    fn seen(&self, l: &AngleMoments, energy: f64, rate: f64, blur: f64) -> AngleMoments {
        let own = rate * rate * l.variance;
        let variance = own + blur;
        let share = own / variance;
        AngleMoments {
            energy,
            mean: rate * (l.mean - self.mean),
            variance,
            skewness: l.skewness.map(|s| rate.signum() * s * share.powf(1.5)),
            kurtosis: l.kurtosis.map(|k| k * share * share),
        }
    }
}

/// The moments by mixtures of the slices.
struct Mixed {
    moments: Option<AngleMoments>,
    components: usize,
    misfit: f64,
}

impl Mixed {
    /// By windows at most so wide (rad), cut to a range of views.
    fn new(
        scene: &Scene<'_>,
        mixtures: &Mixtures,
        spec: &RelationSpec,
        (widest, range): (f64, [f64; 2]),
    ) -> Result<Self, ParameterError> {
        let windows = window::narrow(scene.window, widest, range);
        // Mixtures stand at multiples of their width, for all views and windows.
        let grid = scene.window.min(widest.max(NARROW));
        let half = 0.5 * windows[0].width;
        let [lo, hi] = range;
        let fit = |w: &window::Window| {
            let t = w.centre.max(lo + half).min(hi - half);
            let place = scene.along.place(scene.slice.theta_o, t);
            let last = ((FRAC_PI_2 / grid).ceil() - 1.0) * grid;
            let at = ((place.theta_o / grid).round() * grid).min(last);
            let mixture = mixtures.near(&scene.slice, at, grid, spec.components)?;
            Ok((*w, place, mixture.moved(place.theta_o - at)))
        };
        let fits = windows.par_iter().map(fit);
        let fits: Vec<_> = fits.collect::<Result<_, ParameterError>>()?;
        let sum = |step_deg: f64| {
            let of =
                |(window, place, mixture): &(window::Window, motion::Place, mixture::Mixture)| {
                    let light = scene.light_at(place.phi_o);
                    window::moments(mixture, window, place, &light, step_deg.to_radians())
                };
            let each: Vec<window::Raw> = fits.par_iter().map(of).collect();
            let mut sum = [0.0; 5];
            for of in each {
                sum.iter_mut().zip(of).for_each(|(sum, of)| *sum += of);
            }
            AngleMoments::from_raw(sum)
        };
        let is_close = |(a, b): (AngleMoments, AngleMoments)| {
            let off = b.errors(&a);
            let all = [off.energy, off.mean, off.variance];
            all.iter().all(|e| e.abs() <= spec.tolerance)
        };
        let (mut moments, mut is_resolved) = (sum(STEPS_DEG[0]), false);
        for step in &STEPS_DEG[1..] {
            let finer = sum(*step);
            is_resolved = finer.zip(moments).is_some_and(is_close);
            moments = finer;
            if is_resolved {
                break;
            }
        }
        let share: f64 = windows.iter().map(|w| w.amplitude).sum();
        let misfit = fits
            .iter()
            .map(|(w, _, m)| w.amplitude * m.misfit)
            .sum::<f64>();
        let components = fits.iter().map(|(_, _, m)| m.components.len()).max();
        Ok(Self {
            moments: moments.filter(|_| is_resolved),
            components: components.unwrap_or(0),
            misfit: misfit / share,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::microfacet::{FresnelSpec, Ggx, MicrofacetSpec};
    use crate::brdf::{BrdfSpec, Channels, Roughness};
    use crate::geometry::Direction;
    use crate::moments::Channel;
    use crate::parametrization::view_centered_angles;

    /// A light of σ = 4.6° beside the mirror direction of a view.
    struct Blob(f64);

    impl Lighting for Blob {
        fn radiance(&self, omega: Direction) -> [f64; 3] {
            let [theta, phi] = view_centered_angles(omega);
            let square = (theta + self.0 - 0.05).powi(2) + (phi - 0.05).powi(2);
            [(-0.5 * square / 0.0064).exp(); 3]
        }
    }

    /// The larger errors of energy and variance through 20° at two views, percent, with parts of the form left out.
    #[test]
    #[ignore = "thorough: what each part of the form buys"]
    fn every_part_of_the_form_lowers_its_error() {
        let spec = RelationSpec {
            window_deg: 20.0,
            tolerance: 5e-3,
            ..RelationSpec::default()
        };
        let names = [
            "all",
            "one component",
            "two components",
            "one window",
            "no end",
        ];
        let mut errors = vec![[0.0_f64; 2]; names.len()];
        let ggx = MicrofacetSpec::<Ggx>::new(Roughness::Isotropic(0.1), FresnelSpec::None);
        let brdf = ggx.build(Channels::Luminance).unwrap();
        let mixtures = Mixtures::default();
        for theta_o in [40_f64, 70.0].map(f64::to_radians) {
            let blob = Blob(theta_o);
            let scene = Scene {
                slice: Slice::new(&*brdf, Channel::Luminance, theta_o).unwrap(),
                lighting: &blob,
                along: Along::Theta,
                azimuth: 0.0,
                window: 20_f64.to_radians(),
                rule: spec.rule(),
            };
            let rendered = scene.render(&spec).unwrap().moments.unwrap();
            let cut = scene.range();
            let forms = [
                (4, NARROW, cut),
                (1, NARROW, cut),
                (2, NARROW, cut),
                (4, 1.0, cut),
                (4, NARROW, [-9.0, 9.0]),
            ];
            for (errors, (components, widest, range)) in errors.iter_mut().zip(forms) {
                let spec = RelationSpec { components, ..spec };
                let mixed = Mixed::new(&scene, &mixtures, &spec, (widest, range)).unwrap();
                let e = mixed.moments.unwrap().errors(&rendered);
                let sizes = [e.energy, e.variance].map(|e| 100.0 * e.abs());
                *errors = [0, 1].map(|k| errors[k].max(sizes[k]));
            }
        }
        for (name, [energy, variance]) in names.iter().zip(&errors) {
            println!("{name}: energy {energy:.1} %, variance {variance:.1} %");
        }
        let [energy, variance] = errors[0];
        for worse in &errors[1..] {
            assert!(worse[0] > 2.0 * energy && worse[1] > 1.5 * variance);
        }
    }
}
