//! The slice model and the relations of Zubiaga, Belcour, Bosch, Muñoz and Barla 2015 (**Z15**
//! in `docs::errata`): closed forms against quadrature, claims against rendering, errata by a
//! test that shows the printed form failing and the corrected one holding.
#![cfg(feature = "experiments")]

mod common;

use common::{ISOTROPIC, made, model, near, product};
use gonio::brdf::Brdf;
use gonio::geometry::Direction;
use gonio::lighting::Lighting;
use gonio::moments::relations::{
    Along, AngleMoments, Prediction, Relation, RelationSpec, SliceModel, compare,
};
use gonio::moments::{Channel, Estimator, Order, PeakResolving, Profile, Slice, TruncatedGaussian};
use gonio::parametrization::view_centered_angles;
use gonio::sampling::gauss_legendre;
use std::f64::consts::{FRAC_PI_2, PI};

/// ∫ over [lo, hi] by 60 panels of 40 nodes.
fn integral(lo: f64, hi: f64, f: impl Fn(f64) -> f64) -> f64 {
    let rule = gauss_legendre(40);
    let width = (hi - lo) / 60.0;
    let panel = |i: i32| {
        let middle = lo + (f64::from(i) + 0.5) * width;
        let term = |(x, w): &(f64, f64)| 0.5 * width * w * f(middle + 0.5 * width * x);
        rule.iter().map(term).sum::<f64>()
    };
    (0..60).map(panel).sum()
}

/// Mass, mean and variance of a density on the part of [−π/2, π/2] around `centre`.
fn moments_by_quadrature(centre: f64, reach: f64, f: impl Fn(f64) -> f64) -> [f64; 3] {
    let ends = [centre - reach, centre + reach];
    let [lo, hi] = ends.map(|end| end.clamp(-FRAC_PI_2, FRAC_PI_2));
    let mass = integral(lo, hi, &f);
    // Of differences, so that narrow lobes far from 0 keep their digits.
    let mean = centre + integral(lo, hi, |t| (t - centre) * f(t)) / mass;
    let variance = integral(lo, hi, |t| (t - mean) * (t - mean) * f(t)) / mass;
    [mass, mean, variance]
}

#[test]
fn closed_forms_are_those_of_a_quadrature() {
    let sigmas = [1e-6, 1e-4, 1e-2, 0.1, 0.4, 0.785, 1.0, 1.6, 4.0, 10.0];
    let centres = [0.0, 0.3, -0.9, 1.5, -1.57, FRAC_PI_2, 1.9, -4.0];
    for (sigma, centre) in product(sigmas, centres) {
        if f64::abs(centre) > FRAC_PI_2 && sigma < 0.1 {
            continue;
        }
        let lobe = TruncatedGaussian::new(centre, sigma).unwrap();
        let nearest = centre.clamp(-FRAC_PI_2, FRAC_PI_2);
        let bell = |t: f64| (-0.5 * ((t - centre) / sigma).powi(2)).exp();
        let [_, mean, variance] = moments_by_quadrature(nearest, 12.0 * sigma, bell);
        let [mass, ..] = moments_by_quadrature(nearest, 12.0 * sigma, |t| lobe.density(t));
        let [m, v] = lobe.mean_and_variance();
        let what = format!("sigma {sigma} centre {centre}");
        // The angles themselves are rounded: 2e-16 of 1.57 against σ.
        let rounding = 1e-12 + 1e-15 / sigma;
        near(mass, 1.0, rounding, &what);
        near(m, mean, rounding * variance.sqrt(), &what);
        near(v / variance, 1.0, rounding, what);
    }
}

#[test]
fn centres_far_outside_give_the_exponential() {
    // The tail beyond many σ is an exponential of scale σ²/distance, with corrections of
    // (σ/distance)².
    for sigma in [1e-1, 1e-2, 1e-4, 1e-6] {
        let distance = 1.0;
        let lobe = TruncatedGaussian::new(FRAC_PI_2 + distance, sigma).unwrap();
        let scale = sigma * sigma / distance;
        let [mean, variance] = lobe.mean_and_variance();
        let off = 8.0 * (sigma / distance).powi(2);
        assert!(((FRAC_PI_2 - mean) / scale - 1.0).abs() < off + 4e-16 / scale);
        assert!((variance / (scale * scale) - 1.0).abs() < off + 1e-12);
        assert!((lobe.density(FRAC_PI_2) * scale - 1.0).abs() < off);
    }
    for (centre, sigma) in [(0.0, 0.0), (0.0, f64::NAN), (f64::INFINITY, 1.0)] {
        assert!(TruncatedGaussian::new(centre, sigma).is_err());
    }
}

#[test]
fn every_possible_mean_and_variance_is_met() {
    let (mut inverted, mut worst) = (0, 0.0_f64);
    for mean in [0.0, 0.2, -0.7, 1.2, -1.5, 1.569] {
        let limit = FRAC_PI_2 * FRAC_PI_2 - mean * mean;
        for share in [1e-12, 1e-6, 1e-3, 0.01, 0.1, 0.3, 0.333, 0.5, 0.8, 0.95] {
            let variance = limit * share;
            let lobe = TruncatedGaussian::matched(mean, variance);
            let lobe = lobe.unwrap_or_else(|e| panic!("{mean} {share}: {e}"));
            let [m, v] = lobe.mean_and_variance();
            worst = worst.max((m - mean).abs() / variance.sqrt());
            worst = worst.max((v / variance - 1.0).abs());
            inverted += i32::from(lobe.precision() < 0.0);
            // Nearer to the end the test's own quadrature is too coarse.
            if share >= 0.01 && mean < 1.55 {
                let density = |t: f64| lobe.density(t);
                let [mass, m, v] = moments_by_quadrature(0.0, FRAC_PI_2, density);
                assert!((mass - 1.0).abs() < 1e-8, "{mean} {share}: {mass}");
                assert!((m - mean).abs() < 1e-8, "{mean} {share}: {m}");
                assert!((v / variance - 1.0).abs() < 1e-8, "{mean} {share}");
            }
        }
        for variance in [0.0, limit, 1.1 * limit, f64::NAN] {
            assert!(TruncatedGaussian::matched(mean, variance).is_err());
        }
    }
    assert!(worst < 2e-9, "{worst}");
    assert!(inverted > 10);
    // The flat density is where the sign turns.
    let flat = TruncatedGaussian::matched(0.0, PI * PI / 12.0).unwrap();
    assert!(flat.precision().abs() < 1e-8 && (flat.density(1.0) * PI - 1.0).abs() < 1e-8);
}

#[test]
fn z15_eq_8_has_two_ends() {
    // Printed: π/2 − t_0 in both error functions.
    let (sigma, t_0) = (0.4_f64, -0.9);
    let [x, y] = [FRAC_PI_2 - t_0, FRAC_PI_2 + t_0].map(|d| d / (2.0 * sigma * sigma).sqrt());
    let scale = (0.5 * PI * sigma * sigma).sqrt();
    let printed = scale * (libm::erf(x) - libm::erf(-x));
    let corrected = scale * (libm::erf(x) + libm::erf(y));
    let bell = |t: f64| (-0.5 * ((t - t_0) / sigma).powi(2)).exp();
    let truth = integral(-FRAC_PI_2, FRAC_PI_2, bell);
    assert!((printed - 1.00265).abs() < 5e-6);
    assert!((truth - 0.95576).abs() < 5e-6 && (corrected - truth).abs() < 1e-14);
}

#[test]
fn z15_parameters_are_not_moments() {
    let asked = PI * PI / 12.0;
    let lobe = TruncatedGaussian::new(0.0, asked.sqrt()).unwrap();
    let [_, got] = lobe.mean_and_variance();
    assert!((asked - 0.823).abs() < 1e-3 && (got - 0.546).abs() < 1e-3);
}

struct Linear {
    slope: f64,
    offset: f64,
    energy: f64,
    sigma: [f64; 2],
}

/// A model of one width with its errors in a blob of light, seen from an elevation in a window, degrees.
fn compared(
    [slope, offset, energy, sigma]: [f64; 4],
    (centre, theta_o, along): ([f64; 2], f64, Along),
    [window_deg, tolerance]: [f64; 2],
) -> Relation {
    let model = Linear {
        slope,
        offset,
        energy,
        sigma: [sigma; 2],
    };
    let brdf = model.brdf();
    let light = Blob { centre, sigma };
    let spec = spec(window_deg, tolerance);
    let profile = profile(&brdf, 45, 1e-5);
    compare(&brdf, &profile, &light, theta_o, along, &spec).unwrap()
}

impl Linear {
    /// The densities along θ and along φ at a view elevation.
    fn lobes(&self, theta_o: f64) -> [TruncatedGaussian; 2] {
        let centres = [self.offset + self.slope * theta_o, 0.0];
        [0, 1].map(|i| TruncatedGaussian::new(centres[i], self.sigma[i]).unwrap())
    }

    fn brdf(&self) -> impl Brdf {
        let mut symmetry = ISOTROPIC;
        symmetry.bilateral = true;
        made(symmetry, |pair| {
            let [light, view] = [pair.omega_i, pair.omega_o];
            let turned = Direction::from_spherical(light.theta(), light.phi() - view.phi());
            let [theta, phi] = view_centered_angles(turned);
            let [along, across] = self.lobes(view.theta());
            let value = || self.energy * along.density(theta) * across.density(phi);
            Some([pair.is_above_horizon().then(value).unwrap_or_default()])
        })
    }
}

fn profile(brdf: &dyn Brdf, views: usize, tolerance: f64) -> SliceModel {
    let mut spec = common::views(views, 88.0);
    spec.order = Order::new(2).unwrap();
    let estimator = common::peak_resolving(tolerance);
    SliceModel::new(Profile::new(brdf, Channel::Luminance, &spec, &estimator, 1).unwrap())
}

#[test]
fn slices_of_the_model_have_its_moments() {
    let wide = (-0.6, 0.3, [0.7, 0.5], 2e-5);
    for (slope, energy, sigma, tolerance) in [wide, (-1.0, 0.7, [1e-6; 2], 1e-4)] {
        let model = Linear {
            slope,
            offset: 0.0,
            energy,
            sigma,
        };
        let brdf = model.brdf();
        for theta_o in [0.0, 0.1, 0.6, 0.85, 1.2, 1.4] {
            let slice = Slice::new(&brdf, Channel::Luminance, theta_o).unwrap();
            let got = PeakResolving::default().estimate(&slice, Order::MAX, 1);
            let got = got.moments;
            let [[mean, tt], [zero, pp]] = model.lobes(theta_o).map(|l| l.mean_and_variance());
            assert!(zero.abs() < 1e-12);
            let close = |a: f64, b: f64| assert!((a - b).abs() < tolerance * b.abs(), "{a} {b}");
            close(got.energy().unwrap(), model.energy);
            let [m_t, m_p] = got.mean().unwrap();
            near(m_t, mean, tolerance * tt.sqrt(), theta_o);
            near(m_p, 0.0, tolerance * pp.sqrt(), theta_o);
            let [c_tt, c_tp, c_pp] = got.covariance().unwrap();
            close(c_tt, tt);
            close(c_pp, pp);
            assert!(c_tp.abs() < tolerance * (tt * pp).sqrt());
        }
    }
}

/// A round blob of light in the chart.
struct Blob {
    centre: [f64; 2],
    sigma: f64,
}

impl Lighting for Blob {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let [t, p] = view_centered_angles(omega);
        let square = (t - self.centre[0]).powi(2) + (p - self.centre[1]).powi(2);
        [(-0.5 * square / (self.sigma * self.sigma)).exp(); 3]
    }
}

/// A sky that is brighter towards one side, and a ground that is not seen.
struct Sky;

impl Lighting for Sky {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let v = omega.vector();
        [1.0 + 0.5 * (3.0 * v.x + 1.0).sin() + 0.3 * (4.0 * v.y + 0.5).cos(); 3]
    }
}

fn spec(window_deg: f64, tolerance: f64) -> RelationSpec {
    RelationSpec {
        window_deg,
        tolerance,
        max_evaluations: 1_000_000,
        components: 1,
        ..RelationSpec::default()
    }
}

fn largest(errors: &AngleMoments) -> f64 {
    let all = [errors.energy, errors.mean, errors.variance];
    all.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// Moments of α g ⊗ L, the convolution the paper has in mind, before and after normalising.
#[test]
fn z15_eqs_20_and_21_hold_once_normalised() {
    let alpha = 0.3;
    let bell = |x: f64, centre: f64, s: f64| (-0.5 * ((x - centre) / s).powi(2)).exp();
    let g = |x: f64| bell(x, -0.2, 0.1) / (0.1 * (2.0 * PI).sqrt());
    let l = |x: f64| 2.5 * bell(x, 0.45, 0.12);
    let step = 0.01;
    let grid = || (-300..=300).map(|i| f64::from(i) * step);
    let moments = |f: &dyn Fn(f64) -> f64| {
        [0, 1, 2].map(|k| grid().map(|x| x.powi(k) * f(x)).sum::<f64>() * step)
    };
    let r = moments(&|t| alpha * grid().map(|x| g(t - x) * l(x)).sum::<f64>() * step);
    let (g, l) = (moments(&g), moments(&l));
    let first = |g: [f64; 3], l: [f64; 3]| g[1] + l[1];
    let second = |g: [f64; 3], l: [f64; 3]| g[2] + l[2] + 2.0 * g[1] * l[1];
    assert!((first(g, l) - r[1]).abs() > 0.05 && (second(g, l) - r[2]).abs() > 0.05);
    assert!((alpha * (g[1] * l[0] + l[1]) - r[1]).abs() < 1e-9);
    assert!((alpha * (g[2] * l[0] + l[2] + 2.0 * g[1] * l[1]) - r[2]).abs() < 1e-9);
    let bar = |m: [f64; 3]| m.map(|x| x / m[0]);
    assert!((first(bar(g), bar(l)) - bar(r)[1]).abs() < 1e-9);
    assert!((second(bar(g), bar(l)) - bar(r)[2]).abs() < 1e-9);
}

/// The same on the hemisphere: all widths a third, so that views stay above the horizon, and a
/// window of 57° so that it hardly matters.
#[test]
fn z15_the_dilation_is_seen_in_rendering() {
    let (theta_o, slope) = (0.9, -0.6);
    let model = [slope, 0.15 - slope * theta_o, 0.5, 0.1 / 3.0];
    let r = compared(model, ([0.45, 0.0], theta_o, Along::Theta), [57.0, 1e-3]);
    let (rendered, printed) = (r.rendered.unwrap(), r.printed.unwrap().moments);
    assert!(r.resolved && (r.slope - slope).abs() < 1e-3);
    assert!((rendered.mean + 0.500).abs() < 5e-3, "{rendered:?}");
    near(9.0 * rendered.variance, 0.0555, 1e-3, rendered);
    assert!((printed.mean - 0.600).abs() < 3e-3);
    assert!((9.0 * printed.variance - 0.020).abs() < 1e-3);
    assert!(largest(&r.windowed.unwrap().errors.unwrap()) < 3e-3);
}

#[test]
fn the_ideal_case_is_exact_with_the_window_and_in_the_limit_without() {
    let (theta_o, slope, window) = (0.6, -0.7, 35.0);
    let mut last: Option<f64> = None;
    for sigma in [0.06_f64, 0.03] {
        let seen = ([slope * theta_o + 0.05, 0.01], theta_o, Along::Theta);
        let r = compared([slope, 0.0, 0.4, sigma], seen, [window, 1e-4]);
        assert!(r.resolved, "{r:?}");
        let errors = |p: Option<Prediction>| p.unwrap().errors.unwrap();
        // A slice of one Gaussian is a mixture of one.
        for form in [r.windowed, r.mixture] {
            assert!(largest(&errors(form)) < 2e-3, "{r:?}");
        }
        let corrected = largest(&errors(r.corrected));
        if let Some(last) = last {
            assert!(corrected < 0.35 * last, "{corrected} {last}");
        }
        assert!(sigma > 0.03 || corrected < 0.01, "{corrected}");
        last = Some(corrected);
        // Energy lacks 1/|slope| and variance its square.
        let printed = errors(r.printed);
        assert!((printed.energy + 0.3).abs() < 0.06 && (printed.variance + 0.51).abs() < 0.08);
        assert!(printed.mean.abs() > 3.0);
    }
}

/// Across the plane of incidence the rotation shears the lobe, so that the relations hold in the
/// limit of narrow lobes only; the dilation is sin µ_θ/sin θ_o.
#[test]
fn across_the_plane_the_dilation_is_that_of_the_sines() {
    let (theta_o, slope) = (0.6_f64, -0.7);
    let dilation = (slope * theta_o).sin() / theta_o.sin();
    let mut last: Option<f64> = None;
    for sigma in [0.12, 0.06, 0.03] {
        let seen = ([slope * theta_o, sigma], theta_o, Along::Phi);
        let r = compared([slope, 0.0, 0.4, sigma], seen, [20.0, 1e-4]);
        assert!(r.resolved && (r.slope - dilation).abs() < 1e-4, "{r:?}");
        let windowed = largest(&r.windowed.unwrap().errors.unwrap());
        assert!(last.is_none_or(|last| windowed < 0.4 * last), "{windowed}");
        last = Some(windowed);
        let printed = r.printed.unwrap().errors.unwrap();
        // Printed: the other side of the plane.
        assert!(printed.mean.abs() > 0.5, "{printed:?}");
    }
    assert!(last.unwrap() < 0.01);
}

/// The same flat answer to every view: no slope, no relation but through the window.
#[test]
fn without_a_slope_only_the_window_is_left() {
    let lambert = model("lambert", "albedo = 0.5");
    let profile = profile(&*lambert, 20, 1e-6);
    let spec = spec(5.0, 1e-4);
    let r = compare(&*lambert, &profile, &Sky, 0.5, Along::Theta, &spec).unwrap();
    assert!(r.slope.abs() < 1e-6 && r.printed.is_none() && r.corrected.is_none());
    let (rendered, windowed) = (r.rendered.unwrap(), r.windowed.unwrap().moments);
    // The radiance is the same for all views: mean 0 and the variance of the window.
    assert!(rendered.mean.abs() < 1e-4 * r.window);
    assert!((rendered.variance / r.window.powi(2) - 1.0).abs() < 1e-3);
    assert!((windowed.variance / r.window.powi(2) - 1.0).abs() < 1e-2);
}

#[test]
fn what_is_out_of_range_is_refused() {
    let ggx = model("ggx", "alpha = 0.3");
    let profile = profile(&*ggx, 5, 1e-3);
    let run = |theta_o: f64, spec: &RelationSpec| {
        compare(&*ggx, &profile, &Sky, theta_o, Along::Theta, spec)
    };
    let wrong = "window_deg = 0.0, window_deg = 61.0, tolerance = 0.0, max_views = 10, \
                 max_evaluations = 10, azimuth_deg = nan, components = 0, components = 5";
    for wrong in wrong.split(", ") {
        let spec: RelationSpec = toml::from_str(wrong).unwrap();
        assert!(run(0.3, &spec).is_err(), "{wrong}");
    }
    assert!(toml::from_str::<RelationSpec>("window = 5.0").is_err());
    assert!(run(FRAC_PI_2, &RelationSpec::default()).is_err());
    let spec = RelationSpec::default();
    assert!(compare(&*ggx, &profile, &Sky, 0.0, Along::Azimuth, &spec).is_err());
    let brushed = model("ward", "alpha = [0.1, 0.3]");
    let spec = RelationSpec::default();
    assert!(compare(&*brushed, &profile, &Sky, 0.3, Along::Theta, &spec).is_err());
}

/// The table of `docs::relations`.
#[test]
fn real_lobes_are_not_gaussian() {
    let cells = |p: Option<Prediction>| match p.and_then(|p| p.errors) {
        Some(e) => {
            let (energy, variance) = (100.0 * e.energy, 100.0 * e.variance);
            format!("{energy:.0} %, {:.2}, {variance:.0} %", e.mean)
        }
        None => "-".into(),
    };
    println!("| GGX | light | window | along | slope | sigma | printed | corrected | windowed |");
    let theta_o = 40_f64.to_radians();
    let blob = Blob {
        centre: [-theta_o + 0.05, 0.05],
        sigma: 0.08,
    };
    let lights: [(&str, &dyn Lighting); 2] = [("blob", &blob), ("waves", &Sky)];
    for alpha in [0.05, 0.3] {
        let ggx = model("ggx", &format!("alpha = {alpha}"));
        let profile = profile(&*ggx, 45, 1e-4);
        for ((name, light), window_deg) in product(lights, [5.0, 20.0]) {
            for along in [Along::Theta, Along::Phi] {
                let spec = RelationSpec {
                    window_deg,
                    components: 1,
                    ..RelationSpec::default()
                };
                let r = compare(&*ggx, &profile, light, theta_o, along, &spec).unwrap();
                let forms = [r.printed, r.corrected, r.windowed];
                let (slope, sigma) = (r.slope, r.variance.sqrt().to_degrees());
                let along = format!("{along:?}").to_lowercase();
                println!(
                    "| {alpha} | {name} | {window_deg}° | {along} | {slope:.2} | {sigma:.0}° | {} |",
                    forms.map(cells).join(" | "),
                );
                let [printed, corrected, windowed] = forms
                    .map(|p| p.unwrap().errors.unwrap())
                    .map(|e| [e.mean, e.variance].map(f64::abs));
                // The last form has the least error of the variance.
                assert!(windowed[1] < printed[1].min(corrected[1]), "{r:?}");
                // Light that changes slowly asks little of the shape of a lobe.
                assert!(
                    name == "blob" || windowed[1] < 0.25 && windowed[0] < 0.3,
                    "{r:?}"
                );
            }
        }
    }
}

/// Errors of the mixture of a lobe in a light of 4.6° beside the mirror direction of each view: energies relative to those rendered.
fn energies(ggx: &dyn Brdf, views_deg: &[f64], window_deg: f64) -> Vec<f64> {
    let profile = profile(ggx, 45, 1e-4);
    let spec = RelationSpec {
        window_deg,
        tolerance: 5e-3,
        ..RelationSpec::default()
    };
    let of = |view: &f64| {
        let theta_o = view.to_radians();
        let blob = Blob {
            centre: [-theta_o + 0.05, 0.05],
            sigma: 0.08,
        };
        let r = compare(ggx, &profile, &blob, theta_o, Along::Theta, &spec).unwrap();
        let [windowed, mixture] = [r.windowed, r.mixture].map(|p| p.unwrap().errors.unwrap());
        println!(
            "{window_deg}°, view {view}°, {:?} components: energy {:.2} %, mean {:.3}, variance {:.2} %, skewness {:.3}, kurtosis {:.3}; windowed: {:.0} %",
            r.components,
            100.0 * mixture.energy,
            mixture.mean,
            100.0 * mixture.variance,
            mixture.skewness.unwrap(),
            mixture.kurtosis.unwrap(),
            100.0 * windowed.energy
        );
        mixture.energy.abs()
    };
    views_deg.iter().map(of).collect()
}

#[test]
fn a_sum_of_gaussians_has_the_energy_of_a_lobe_with_tails() {
    let ggx = model("ggx", "alpha = 0.1\nfresnel = { kind = \"none\" }");
    let errors = energies(&*ggx, &[40.0], 5.0);
    assert!(errors[0] < 0.02, "{errors:?}");
}

/// Out of the plane, near the normal and far from it, in a light beside the plane.
#[test]
fn a_sum_of_gaussians_is_seen_from_views_that_turn() {
    let brdf = model("beckmann", "alpha = 0.2\nfresnel = { kind = \"none\" }");
    let profile = profile(&*brdf, 45, 1e-3);
    for (along, view_deg, window_deg) in [
        (Along::Phi, 0.1, 5.0),
        (Along::Phi, 5.0, 5.0),
        (Along::Phi, 40.0, 20.0),
        (Along::Azimuth, 0.1, 5.0),
        (Along::Azimuth, 5.0, 20.0),
        (Along::Azimuth, 40.0, 20.0),
    ] {
        let theta_o = f64::to_radians(view_deg);
        let blob = Blob {
            centre: [-theta_o, 0.15],
            sigma: 0.15,
        };
        let spec = RelationSpec {
            window_deg,
            tolerance: 5e-3,
            components: 2,
            ..RelationSpec::default()
        };
        let r = compare(&*brdf, &profile, &blob, theta_o, along, &spec).unwrap();
        let e = r.mixture.unwrap().errors.unwrap();
        println!("{along:?} {view_deg}° {window_deg}°: {e:?}");
        assert!(
            e.energy.abs() < 0.02 && e.mean.abs() < 0.03,
            "{along:?} {view_deg}: {e:?}"
        );
        assert!(e.variance.abs() < 0.05, "{along:?} {view_deg}: {e:?}");
    }
}

#[test]
#[ignore = "thorough: four lobes at three views through two windows"]
fn sums_of_gaussians_have_the_energies_of_lobes() {
    let lobes = [("ggx", 0.05), ("ggx", 0.1), ("ggx", 0.3), ("beckmann", 0.1)];
    for (window_deg, largest) in [(5.0, 0.025), (20.0, 0.01)] {
        let mut all = Vec::new();
        for (kind, alpha) in lobes {
            println!("{kind} {alpha}");
            let brdf = model(
                kind,
                &format!("alpha = {alpha}\nfresnel = {{ kind = \"none\" }}"),
            );
            all.extend(energies(&*brdf, &[10.0, 40.0, 70.0], window_deg));
        }
        all.sort_by(f64::total_cmp);
        assert!(
            all[all.len() / 2] < 0.02 && all[all.len() - 1] < largest,
            "{all:?}"
        );
    }
}
