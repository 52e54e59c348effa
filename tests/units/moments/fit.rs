use crate::common::product;
use gonio::moments::{
    EnergyFit, EnergySeries, FitError, MeanVarianceFit, Ramp, Undetermined, ViewRange,
    fit_average_variance, fit_energy, fit_energy_shared, fit_mean, fit_mean_variance,
};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

const TOLERANCE: f64 = 1e-4;

/// Every degree from 0 to 80.
fn views() -> Vec<f64> {
    (0..=80).map(|i| f64::from(i).to_radians()).collect()
}

fn series(views: &[f64], f: impl Fn(f64) -> f64) -> Vec<Option<f64>> {
    views.iter().map(|&theta| Some(f(theta))).collect()
}

/// Without a pattern and without a generator: view i of profile k.
fn noise(i: usize, k: usize) -> f64 {
    let i = i as f64;
    (7.0 * i * i + k as f64 * (1.0 + i)).cos()
}

#[test]
fn a_ramp_is_not_read_from_noise() {
    let views = views();
    for k in 0..50 {
        let mut values = series(&views, |_| 1.0);
        for (i, value) in values.iter_mut().enumerate() {
            *value = value.map(|v| v + 0.1 * noise(i, k));
        }
        let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
        assert_eq!(fit.undetermined, Some(Undetermined::Noise), "{k}");
        assert!((fit.base - fit.mean).abs() < 1e-15 && fit.ramp.is_none());
    }
}

#[test]
fn a_step_between_two_views_is_fitted_without_knots() {
    let views = views();
    let values = series(&views, |t| if t < 0.9 { 1.0 } else { 2.0 });
    let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
    assert_eq!(fit.undetermined, Some(Undetermined::Unseen));
    assert!(fit.knots().is_none() && fit.errors.rmse < 1e-10);
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let views = views();
    let range = ViewRange::default();
    let mut values = vec![None; 81];
    for i in 0..4 {
        values[20 * i] = Some(1.0 + i as f64);
    }
    let few = FitError::TooFewViews {
        found: 4,
        needed: 5,
    };
    assert_eq!(fit_energy(&views, &values, range, TOLERANCE), Err(few));
    let black = vec![Some(0.0); 81];
    let of_black = fit_energy(&views, &black, range, TOLERANCE);
    assert_eq!(of_black, Err(FitError::NoEnergy));
    assert!(fit_energy(&views, &black[1..], range, TOLERANCE).is_err());
    assert!(fit_energy_shared(&[], range, TOLERANCE).is_err());
    let same = fit_energy(&[0.5; 6], &[Some(1.0); 6], range, TOLERANCE);
    assert_eq!(same, Err(FitError::Undetermined));
    let series = [&values, &black].map(|values| EnergySeries {
        views: &views,
        values,
    });
    let second = fit_energy_shared(&series, range, TOLERANCE).unwrap_err();
    let source = Box::new(FitError::NoEnergy);
    assert_eq!(second, FitError::Profile { index: 1, source });
    // Five values are as many as there are parameters: found without a panic.
    values[80] = Some(9.0);
    assert!(fit_energy(&views, &values, range, TOLERANCE).is_ok());
}

/// A base, and a ramp on it.
struct Profile {
    base: f64,
    ramp: Ramp,
}

impl Profile {
    fn value(&self, theta: f64) -> f64 {
        self.base + self.ramp.value(theta)
    }
}

fn exact(base: f64, height: f64, slope: f64, knots: [f64; 2]) -> Profile {
    Profile {
        base,
        ramp: Ramp {
            knots,
            height,
            slope,
        },
    }
}

/// θ_0, θ_1, and base, height and slope over the base.
fn parameters(fit: &EnergyFit) -> [f64; 5] {
    let ramp = fit.ramp.unwrap();
    let [lower, upper] = ramp.knots;
    let [h, m] = [ramp.height, ramp.slope].map(|x| x / fit.base);
    [lower, upper, fit.base, h, m]
}

fn with_parameters([lower, upper, base, h, m]: [f64; 5]) -> Profile {
    exact(base, h * base, m * base, [lower, upper])
}

fn rmse(value: impl Fn(f64) -> f64, views: &[f64], values: &[Option<f64>]) -> f64 {
    let square = |(&t, v): (&f64, &Option<f64>)| (v.unwrap() - value(t)).powi(2);
    let sum: f64 = views.iter().zip(values).map(square).sum();
    (sum / views.len() as f64).sqrt()
}

#[test]
fn parameters_are_recovered_at_every_scale() {
    let views = views();
    let shapes = [
        [0.6, 1.2, 1.0, 0.9, 3.0],
        [0.3, 0.9, 1.0, 0.2, 2.0],
        [0.9, 1.3, 1.0, 4.0, 18.0],
        [0.5, 1.1, 1.0, -0.3, -0.9],
        [0.7, 1.0, 1.0, 0.5, 0.0],
        [0.05, 0.4, 1.0, 0.01, 0.1],
    ];
    for (shape, scale) in product(shapes, [1e-6, 1e-3, 1.0, 1e3, 1e6]) {
        let mut truth = shape;
        truth[2] = scale;
        let values = series(&views, |t| with_parameters(truth).value(t));
        let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
        assert_eq!(fit.undetermined, None);
        let found = parameters(&fit);
        for (a, b) in found.into_iter().zip(truth) {
            let unit = if b == scale { scale } else { 1.0 };
            assert!((a - b).abs() < 1e-8 * unit, "{found:?} {truth:?}");
        }
        assert!(fit.relative_errors.rmse < 1e-9 && fit.errors.views == 81);
    }
}

/// The least RMS error of a base and a ramp with these knots, by a QR decomposition.
fn best_with(knots: [f64; 2], views: &[f64], values: &[Option<f64>]) -> f64 {
    let parts = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)];
    let parts = parts.map(|(base, h, m)| exact(base, h, m, knots));
    let columns = DMatrix::from_fn(views.len(), 3, |i, k| parts[k].value(views[i]));
    let values = DVector::from_iterator(views.len(), values.iter().map(|v| v.unwrap()));
    let qr = columns.clone().qr();
    let right = qr.q().transpose() * &values;
    let solved = qr.r().solve_upper_triangular(&right);
    (columns * solved.unwrap() - values).norm() / (views.len() as f64).sqrt()
}

#[test]
fn the_upper_knot_of_a_convex_profile_is_the_last_view() {
    let range = ViewRange::default();
    let views = views();
    let rises: [fn(f64) -> f64; 3] = [
        |t| 1.0 + 0.3 * t.powi(4),
        |t| 1.0 + 0.1 * (3.0 * (t - 0.8)).exp(),
        |t| 1.0 / (t.cos() + 0.05).sqrt(),
    ];
    for rise in rises {
        let values = series(&views, rise);
        let fit = fit_energy(&views, &values, range, TOLERANCE).unwrap();
        let [lower, upper] = fit.knots().unwrap();
        assert!(fit.upper_at_end && upper == views[80]);
        // With a cubic over all views beyond θ_0, any θ_1 beyond the last fits as well ...
        let ramp = fit.ramp.unwrap();
        let (w, v) = (upper - lower, 1.3 * (upper - lower));
        let cubic = (ramp.slope * w - 2.0 * ramp.height) / w.powi(3);
        let square = (3.0 * ramp.height - ramp.slope * w) / w.powi(2);
        let height = cubic * v.powi(3) + square * v.powi(2);
        let slope = 3.0 * cubic * v.powi(2) + 2.0 * square * v;
        let beyond = exact(fit.base, height, slope, [lower, lower + v]);
        let least = fit.errors.rmse;
        assert!((rmse(|t| beyond.value(t), &views, &values) - least).abs() < 1e-12);
        // ... and none within does, nor another θ_0, with the best base, height and slope.
        for [a, b] in [[-0.05, 0.0], [0.05, 0.0], [0.0, -0.1], [0.05, -0.1]] {
            assert!(best_with([lower + a, upper + b], &views, &values) > least);
        }
    }
    // The last view that has a value counts, not the end of the range.
    let mut values = series(&views, rises[0]);
    values[71..].fill(None);
    let fit = fit_energy(&views, &values, range, TOLERANCE).unwrap();
    assert!(fit.upper_at_end && fit.knots().unwrap()[1] == views[70]);
}

#[test]
fn scipy_finds_the_same_optimum() {
    // scipy.optimize.curve_fit with the piecewise function of `Ramp`, start 45° and 75°, base
    // 2, height 1, slope 1, all tolerances 1e-15, on the 81 values at θ = i degrees
    // 2 + ramp(knots 0.6, 1.2; height 0.9; slope 3) + 0.02 cos(7 i²).
    let expected = [
        0.585_788_360_409_119_3,
        1.181_973_835_494_959,
        2.000_778_828_728_266,
        0.851_412_420_698_743_6,
        3.011_571_657_588_419_7,
    ];
    let views = views();
    let clean = exact(2.0, 0.9, 3.0, [0.6, 1.2]);
    let mut values = series(&views, |t| clean.value(t));
    for (i, value) in values.iter_mut().enumerate() {
        *value = value.map(|v| v + 0.02 * (7.0 * (i * i) as f64).cos());
    }
    let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
    let ramp = fit.ramp.unwrap();
    let [lower, upper] = fit.knots().unwrap();
    let found = [lower, upper, fit.base, ramp.height, ramp.slope];
    for (a, b) in found.into_iter().zip(expected) {
        assert!((a - b).abs() < 1e-6, "{found:?}");
    }
    assert!((fit.errors.rmse - 0.013_467_322_842_429_335).abs() < 1e-13);
    assert!((fit.errors.mae - 0.011_844_368_475_522_527).abs() < 1e-8);
    let relative = fit.relative_errors.rmse * fit.mean;
    assert!((relative - fit.errors.rmse).abs() < 1e-15);
}

/// Ten profiles of bases from 1e-4 to 1e5 over two sets of views.
fn many(amplitude: f64) -> Vec<(Vec<f64>, Vec<Option<f64>>)> {
    let profile = |k: usize| {
        let scale = 10f64.powi(k as i32 - 4);
        let (h, m) = (0.3 + 0.1 * k as f64, 1.0 + 0.7 * (k % 4) as f64);
        let clean = exact(scale, h * scale, m * scale, [0.68, 1.21]);
        let step = [1.0, 0.8][k % 2];
        let views: Vec<f64> = (0..=80).map(|i| step * f64::from(i)).collect();
        let views: Vec<f64> = views.into_iter().map(f64::to_radians).collect();
        let values = views.iter().enumerate();
        let values = values.map(|(i, &t)| Some(clean.value(t) + scale * amplitude * noise(i, k)));
        let values = values.collect();
        (views, values)
    };
    (0..10).map(profile).collect()
}

fn shared(profiles: &[(Vec<f64>, Vec<Option<f64>>)]) -> Vec<EnergyFit> {
    let series: Vec<EnergySeries> = profiles
        .iter()
        .map(|(views, values)| EnergySeries { views, values })
        .collect();
    fit_energy_shared(&series, ViewRange::default(), TOLERANCE).unwrap()
}

#[test]
fn shared_knots_are_recovered() {
    let fit = shared(&many(0.0));
    let [lower, upper] = fit[0].knots().unwrap();
    assert!((lower - 0.68).abs() < 1e-8 && (upper - 1.21).abs() < 1e-8);
    for (k, one) in fit.iter().enumerate() {
        let base = 10f64.powi(k as i32 - 4);
        let [.., found, h, m] = parameters(one);
        assert!((found / base - 1.0).abs() < 1e-8, "{found} {base}");
        assert!((h - (0.3 + 0.1 * k as f64)).abs() < 1e-8);
        assert!((m - (1.0 + 0.7 * (k % 4) as f64)).abs() < 1e-8);
    }
}

#[test]
fn shared_knots_do_not_depend_on_brightness() {
    let mut profiles = many(0.02);
    let before = shared(&profiles)[0].knots().unwrap();
    assert!((before[0] - 0.68).abs() < 0.05 && (before[1] - 1.21).abs() < 0.05);
    for value in profiles[3].1.iter_mut() {
        *value = value.map(|v| 1e6 * v);
    }
    let after = shared(&profiles)[0].knots().unwrap();
    assert!((0..2).all(|i| (before[i] - after[i]).abs() < 1e-7));
}

#[test]
fn no_profile_is_fitted_better_with_shared_knots() {
    let profiles = many(0.02);
    let fits = shared(&profiles);
    for ((views, values), with_others) in profiles.iter().zip(&fits) {
        let alone = fit_energy(views, values, ViewRange::default(), TOLERANCE).unwrap();
        let [alone, with_others] = [&alone, with_others].map(|f| f.relative_errors.rmse);
        assert!(alone <= with_others * (1.0 + 1e-9));
    }
    let (views, values) = &profiles[2];
    let alone = fit_energy(views, values, ViewRange::default(), TOLERANCE).unwrap();
    assert_eq!(shared(&profiles[2..3]), [alone]);
}

#[test]
fn a_profile_is_flat_to_the_tolerance_of_its_values() {
    let views = views();
    let range = ViewRange::default();
    let truth = [0.6, 1.2, 2.0, 1e-3, 3e-3];
    let values = series(&views, |t| with_parameters(truth).value(t));
    let mean = values.iter().flatten().sum::<f64>() / 81.0;
    let about_mean = rmse(|_| mean, &views, &values) / mean;
    for (share, flat) in [(0.1, false), (0.99, false), (1.01, true), (10.0, true)] {
        let fit = fit_energy(&views, &values, range, share * about_mean).unwrap();
        assert_eq!(fit.undetermined == Some(Undetermined::Flat), flat);
        assert_eq!(fit.knots().is_none(), flat);
    }
    for value in [3.0, 1e-5] {
        let constant = series(&views, |_| value);
        let fit = fit_energy(&views, &constant, range, TOLERANCE).unwrap();
        assert_eq!(fit.undetermined, Some(Undetermined::Flat));
        assert!(fit.ramp.is_none() && (fit.value(1.0) / value - 1.0).abs() < 1e-4);
    }
}

#[test]
fn views_without_value_and_beyond_the_range_do_not_matter() {
    let views: Vec<f64> = (0..90).map(|i| f64::from(i).to_radians()).collect();
    let clean = exact(2.0, 0.9, 3.0, [0.6, 1.2]);
    let mut values = series(&views, |t| clean.value(t));
    for i in 81..90 {
        values[i] = Some(1e3);
    }
    values[7] = None;
    values[60] = Some(f64::NAN);
    let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
    assert_eq!(fit.errors.views, 79);
    assert!((fit.value(1.3) - clean.value(1.3)).abs() < 1e-8);
}

#[test]
fn slope_by_hand() {
    // Σ θ µ / Σ θ² = (0.5 · −0.2 + 1 · −0.9)/(0.25 + 1) = −0.8; residuals 0.2, −0.1 and 0 at 0.
    let views = [0.0, 0.5, 1.0, 1.2, 1.5];
    let values = [Some(0.0), Some(-0.2), Some(-0.9), None, Some(7.0)];
    let fit = fit_mean(&views, &values, ViewRange::default()).unwrap();
    assert!((fit.factor + 0.8).abs() < 1e-15);
    assert!((fit.errors.mae - 0.1).abs() < 1e-15);
    assert!((fit.errors.rmse - (0.05f64 / 3.0).sqrt()).abs() < 1e-15);
    assert_eq!(fit.errors.views, 3);
    let one = fit_mean(&[0.0], &[Some(0.0)], ViewRange::default());
    assert_eq!(one, Err(FitError::Undetermined));
}

#[test]
fn variance_by_hand() {
    // Averages 0.2 and 0.4; the other views lack one of the two.
    let views = [0.0, 0.2, 0.4, 0.6];
    let theta = [Some(0.1), Some(0.5), None, Some(1.0)];
    let phi = [Some(0.3), Some(0.3), Some(9.0), None];
    let fit = fit_average_variance(&views, &theta, &phi, ViewRange::default()).unwrap();
    assert!((fit.factor - 0.3).abs() < 1e-15);
    assert!((fit.errors.mae - 0.1).abs() < 1e-15);
    assert!((fit.errors.rmse - 0.1).abs() < 1e-15 && fit.errors.views == 2);
    let short = fit_average_variance(&views, &theta, &phi[1..], ViewRange::default());
    assert!(short.is_err());
}

#[test]
fn a_range_keeps_what_is_inside_and_has_a_value() {
    let range = ViewRange::from_degrees(10.0, 40.0).unwrap();
    let views: Vec<f64> = (0..6).map(|i| (10.0 * f64::from(i)).to_radians()).collect();
    let values = [0.0, 1.0, f64::NAN, 3.0, 4.0, 5.0].map(Some);
    assert_eq!(fit_mean(&views, &values, range).unwrap().errors.views, 3);
    let few = fit_energy(&views, &values, range, 1e-4);
    assert!(matches!(few, Err(FitError::TooFewViews { found: 3, .. })));
    assert!(fit_mean(&views, &values[1..], range).is_err());
    assert!(ViewRange::from_degrees(40.0, 40.0).is_err());
    assert!(ViewRange::from_degrees(-1.0, 40.0).is_err());
    assert!(ViewRange::from_degrees(0.0, 91.0).is_err());
}

#[test]
fn the_ramp_has_the_asked_values_and_slopes() {
    let ramp = exact(0.0, 0.4, 1.7, [0.7, 1.2]).ramp;
    let slope = |theta: f64| (ramp.value(theta + 1e-6) - ramp.value(theta - 1e-6)) / 2e-6;
    assert_eq!(ramp.value(0.3), 0.0);
    assert!(ramp.value(0.7).abs() < 1e-15 && slope(0.7).abs() < 1e-4);
    assert!((ramp.value(1.2) - 0.4).abs() < 1e-15 && (slope(1.2) - 1.7).abs() < 1e-4);
    assert!((ramp.value(1.4) - (0.4 + 0.2 * 1.7)).abs() < 1e-15);
    // A cubic through t = 1/2: half the height, less an eighth of the width times the slope.
    assert!((ramp.value(0.95) - (0.2 - 0.5 * 1.7 / 8.0)).abs() < 1e-15);
}

fn fit(points: &[(f64, f64)]) -> Result<MeanVarianceFit, FitError> {
    let (slopes, variances): (Vec<_>, Vec<_>) =
        points.iter().map(|p| (Some(p.0), Some(p.1))).unzip();
    fit_mean_variance(&slopes, &variances)
}

#[test]
fn one_material_by_hand() {
    // At µ̃ = −1/2 the curve is π²/24 − c/4.
    let fit = fit(&[(-0.5, 0.2)]).unwrap();
    assert!((fit.coefficient - 4.0 * (PI * PI / 24.0 - 0.2)).abs() < 1e-15);
    assert!(fit.r_squared.is_none() && fit.correlation.pearson.is_none());
}

/// σ̃² of the Lambertian material.
const LAMBERTIAN: f64 = PI * PI / 12.0;

#[test]
fn r_squared_is_the_explained_share() {
    let points = [(-0.8, 0.15), (-0.6, 0.2), (-0.3, 0.6), (-0.1, 0.7)];
    let fit = fit(&points).unwrap();
    let mean = (0.15 + 0.2 + 0.6 + 0.7) / 4.0;
    let left: f64 = points.iter().map(|p| (p.1 - fit.value(p.0)).powi(2)).sum();
    let all: f64 = points.iter().map(|p| (p.1 - mean).powi(2)).sum();
    // Through the mirror and Lambert.
    assert_eq!([fit.value(-1.0), fit.value(0.0)], [0.0, LAMBERTIAN]);
    assert!((fit.r_squared.unwrap() - (1.0 - left / all)).abs() < 1e-14);
    for change in [-1e-4, 1e-4] {
        let off = |p: &(f64, f64)| p.1 - fit.value(p.0) - change * p.0 * (1.0 + p.0);
        assert!(points.iter().map(|p| off(p).powi(2)).sum::<f64>() > left);
    }
}

#[test]
fn end_points_alone_determine_nothing() {
    let ends = fit(&[(-1.0, 0.0), (0.0, LAMBERTIAN)]);
    assert_eq!(ends, Err(FitError::Undetermined));
    assert!(fit_mean_variance(&[None], &[Some(1.0)]).is_err());
    assert!(fit_mean_variance(&[Some(0.5)], &[]).is_err());
}
