//! Energy profiles as a base and a Hermite ramp, with knots of their own or shared.

use super::energy::{EnergyFit, EnergySeries, SharedEnergyFit, Undetermined};
use super::projected::{Block, Solved, best_knots, solve};
use super::ramp::Ramp;
use super::{FitError, FitErrors, ViewRange};
use nalgebra::DVector;
use std::f64::consts::{FRAC_PI_4, PI};

/// The first start of the optimiser, 45° and 75°, as in Zubiaga et al. 2015, §3.4.
const FIRST_START: [f64; 2] = [FRAC_PI_4, 75.0 / 180.0 * PI];
/// Ratio of variances below which a ramp is noise. Knots that are searched for raise it above the
/// quantiles of an F distribution: of 4000 profiles of normal noise at 81 views one in a thousand
/// exceeded 5.8, and none 7.7.
const NOISE: f64 = 10.0;
/// Share of the ramp by which a change of the knots by 1 rad must change the fit at least.
const SEEN: f64 = 1e-6;

/// Fits base, ramp and knots to the energy ([`Component::ENERGY`](crate::moments::Component)) over
/// the view elevations (rad). Both knots are between the first and the last used view.
///
/// # Errors
/// If fewer than five views are used or all are the same, their mean energy is not positive, or
/// the numbers of views and values differ.
pub fn fit_energy(
    views: &[f64],
    values: &[Option<f64>],
    range: ViewRange,
    tolerance: f64,
) -> Result<EnergyFit, FitError> {
    let shared = fit_energy_shared(&[EnergySeries { views, values }], range, tolerance);
    let mut shared = shared.map_err(|e| match e {
        FitError::Profile { source, .. } => *source,
        other => other,
    })?;
    Ok(shared.fits.remove(0))
}

/// Fits a base and a ramp to each of several profiles and one pair of knots to all. Each profile
/// counts in units of its mean energy, so that a dark material weighs as much as a bright one;
/// a profile with more views weighs more. `tolerance` as for [`fit_energy`], of all profiles together.
///
/// # Errors
/// If a profile has fewer than three used views or no positive mean energy, or all together have
/// fewer views than parameters (three a profile and two knots) or one and the same view.
pub fn fit_energy_shared(
    profiles: &[EnergySeries<'_>],
    range: ViewRange,
    tolerance: f64,
) -> Result<SharedEnergyFit, FitError> {
    // Alone, a profile must determine the knots as well.
    let needed = if profiles.len() == 1 { 5 } else { 3 };
    let mut units = Vec::with_capacity(profiles.len());
    for (index, &series) in profiles.iter().enumerate() {
        let unit = Unit::new(series, range, needed).map_err(|source| FitError::Profile {
            index,
            source: Box::new(source),
        });
        units.push(unit?);
    }
    let found = units.iter().map(|u| u.views.len()).sum();
    let needed = 3 * units.len().max(1) + 2;
    if found < needed {
        return Err(FitError::TooFewViews { found, needed });
    }
    let (blocks, order) = blocks(&units);
    let views = || units.iter().flat_map(|u| u.views.iter().copied());
    let ends = [
        views().fold(f64::INFINITY, f64::min),
        views().fold(f64::NEG_INFINITY, f64::max),
    ];
    if ends[0] == ends[1] {
        return Err(FitError::Undetermined);
    }
    let (knots, upper_at_end) = best_knots(&blocks, ends, FIRST_START);
    let solved = solve(&blocks, knots);
    let undetermined = undetermined(&units, &order, &solved, upper_at_end, tolerance);
    let constant = matches!(undetermined, Some(Undetermined::Flat | Undetermined::Noise));
    let mut fits: Vec<Option<EnergyFit>> = vec![None; units.len()];
    for (&index, linear) in order.iter().zip(&solved.linear) {
        let unit = &units[index];
        let [base, height, slope] = *linear;
        let ramp = Ramp {
            knots,
            height,
            slope,
        };
        fits[index] = Some(EnergyFit {
            undetermined,
            upper_at_end: upper_at_end && !constant,
            ..match constant {
                true => unit.finish(1.0, None),
                false => unit.finish(base, Some(ramp)),
            }
        });
    }
    Ok(SharedEnergyFit {
        knots: match undetermined {
            None => Some(knots),
            Some(_) => None,
        },
        undetermined,
        upper_at_end: upper_at_end && !constant,
        fits: fits.into_iter().flatten().collect(),
    })
}

/// A profile in units of its mean.
struct Unit {
    views: Vec<f64>,
    values: DVector<f64>,
    mean: f64,
}

impl Unit {
    fn new(series: EnergySeries<'_>, range: ViewRange, needed: usize) -> Result<Self, FitError> {
        let (views, values) = range.used(series.views, series.values, needed)?;
        let n = values.len() as f64;
        let mean = values.iter().map(|v| v / n).sum::<f64>();
        if !(mean > 0.0) {
            return Err(FitError::NoEnergy);
        }
        let values = values.into_iter().map(|v| v / mean).collect::<Vec<_>>();
        Ok(Self {
            views,
            values: values.into(),
            mean,
        })
    }

    /// The fit in the unit of the energy.
    fn finish(&self, base: f64, ramp: Option<Ramp>) -> EnergyFit {
        let value = |theta: f64| base + ramp.map_or(0.0, |ramp| ramp.value(theta));
        let pairs = self.views.iter().zip(&self.values);
        let relative = FitErrors::of(pairs.map(|(&theta, v)| v - value(theta)));
        EnergyFit {
            base: self.mean * base,
            ramp: ramp.map(|ramp| Ramp {
                height: self.mean * ramp.height,
                slope: self.mean * ramp.slope,
                ..ramp
            }),
            undetermined: None,
            upper_at_end: false,
            mean: self.mean,
            errors: FitErrors {
                mae: self.mean * relative.mae,
                rmse: self.mean * relative.rmse,
                views: relative.views,
            },
            relative,
        }
    }
}

/// Blocks of profiles with the same views, and the profile at each place.
fn blocks(units: &[Unit]) -> (Vec<Block>, Vec<usize>) {
    let mut blocks: Vec<(Block, Vec<usize>)> = Vec::new();
    for (index, unit) in units.iter().enumerate() {
        let known = blocks.iter_mut().find(|(b, _)| b.views == unit.views);
        match known {
            Some((block, members)) => {
                block.profiles.push(unit.values.clone());
                members.push(index);
            }
            None => {
                let block = Block {
                    views: unit.views.clone(),
                    profiles: vec![unit.values.clone()],
                };
                blocks.push((block, vec![index]));
            }
        }
    }
    let (blocks, members): (Vec<Block>, Vec<Vec<usize>>) = blocks.into_iter().unzip();
    (blocks, members.concat())
}

/// The criteria of [`Undetermined`].
fn undetermined(
    units: &[Unit],
    order: &[usize],
    solved: &Solved,
    upper_at_end: bool,
    tolerance: f64,
) -> Option<Undetermined> {
    let n = solved.residuals.len();
    let about_mean = |u: &Unit| u.values.iter().map(|v| (v - 1.0).powi(2)).sum::<f64>();
    let spread: f64 = units.iter().map(about_mean).sum();
    if (spread / n as f64).sqrt() <= tolerance {
        return Some(Undetermined::Flat);
    }
    let freedom = n - 3 * units.len() - 2;
    let gain = (spread - solved.cost()) / (2 * units.len() + 2) as f64;
    if freedom > 0 && gain < NOISE * solved.cost() / freedom as f64 {
        return Some(Undetermined::Noise);
    }
    let (mut ramp, mut row) = (0.0, 0);
    for (&index, linear) in order.iter().zip(&solved.linear) {
        for value in units[index].values.iter() {
            ramp += (value - solved.residuals[row] - linear[0]).powi(2);
            row += 1;
        }
    }
    let least = match upper_at_end {
        true => solved.jacobian.column(0).norm(),
        false => {
            let svd = solved.jacobian.clone().svd(false, false);
            svd.singular_values.min()
        }
    };
    (least <= SEEN * ramp.sqrt()).then_some(Undetermined::Unseen)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: f64 = 1e-4;

    /// Every degree from 0 to 80.
    fn views() -> Vec<f64> {
        (0..=80).map(|i| f64::from(i).to_radians()).collect()
    }

    fn series(views: &[f64], f: impl Fn(f64) -> f64) -> Vec<Option<f64>> {
        views.iter().map(|&theta| Some(f(theta))).collect()
    }

    fn exact(base: f64, height: f64, slope: f64, knots: [f64; 2]) -> EnergyFit {
        EnergyFit {
            base,
            ramp: Some(Ramp {
                knots,
                height,
                slope,
            }),
            undetermined: None,
            upper_at_end: false,
            mean: f64::NAN,
            errors: FitErrors::of([0.0].into_iter()),
            relative: FitErrors::of([0.0].into_iter()),
        }
    }

    /// θ_0, θ_1, and base, height and slope over the base.
    fn parameters(fit: &EnergyFit) -> [f64; 5] {
        let ramp = fit.ramp().unwrap();
        let [lower, upper] = ramp.knots;
        let [h, m] = [ramp.height, ramp.slope].map(|x| x / fit.base());
        [lower, upper, fit.base(), h, m]
    }

    fn with_parameters([lower, upper, base, h, m]: [f64; 5]) -> EnergyFit {
        exact(base, h * base, m * base, [lower, upper])
    }

    fn rmse(fit: &EnergyFit, views: &[f64], values: &[Option<f64>]) -> f64 {
        let square = |(&t, v): (&f64, &Option<f64>)| (v.unwrap() - fit.value(t)).powi(2);
        let sum: f64 = views.iter().zip(values).map(square).sum();
        (sum / views.len() as f64).sqrt()
    }

    /// Without a pattern and without a generator: view i of profile k.
    fn noise(i: usize, k: usize) -> f64 {
        let i = i as f64;
        (7.0 * i * i + k as f64 * (1.0 + i)).cos()
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
        for shape in shapes {
            for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
                let mut truth = shape;
                truth[2] = scale;
                let values = series(&views, |t| with_parameters(truth).value(t));
                let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
                assert_eq!(fit.undetermined(), None);
                let found = parameters(&fit);
                for (a, b) in found.into_iter().zip(truth) {
                    let unit = if b == scale { scale } else { 1.0 };
                    assert!((a - b).abs() < 1e-8 * unit, "{found:?} {truth:?}");
                }
                assert!(fit.relative_errors().rmse < 1e-9 && fit.errors().views == 81);
            }
        }
    }

    #[test]
    fn parameter_errors_shrink_like_the_noise() {
        let views = views();
        let truth = [0.6, 1.2, 2.0, 0.5, 1.5];
        let error = |amplitude: f64| {
            let clean = with_parameters(truth);
            let mut values = series(&views, |t| clean.value(t));
            for (i, value) in values.iter_mut().enumerate() {
                *value = value.map(|v| v + amplitude * noise(i, 0));
            }
            let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
            let found = parameters(&fit);
            let errors: Vec<f64> = found
                .iter()
                .zip(truth)
                .map(|(a, b)| (a - b).abs())
                .collect();
            errors.into_iter().fold(0.0, f64::max)
        };
        let [coarse, fine, finest] = [1e-3, 1e-4, 1e-5].map(error);
        assert!(coarse < 0.02, "{coarse}");
        for ratio in [coarse / fine, fine / finest] {
            assert!((8.0..12.5).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn the_optimum_is_a_minimum() {
        let views = views();
        // Not a ramp, so that the residual does not vanish.
        let values = series(&views, |t| 1.0 + 0.5 * (-((t - 1.2) / 0.3).powi(2)).exp());
        let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
        let best = parameters(&fit);
        let least = rmse(&fit, &views, &values);
        assert!((least - fit.errors().rmse).abs() < 1e-12 * least);
        assert!(least > 1e-4 && fit.knots().is_some() && !fit.upper_at_end());
        for parameter in 0..5 {
            for change in [-1e-2, -1e-4, 1e-4, 1e-2] {
                let mut moved = best;
                moved[parameter] += change;
                let moved = rmse(&with_parameters(moved), &views, &values);
                assert!(moved > least, "parameter {parameter}: {moved} {least}");
            }
        }
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
            assert!(fit.upper_at_end() && upper == views[80]);
            // With a cubic over all views beyond θ_0, any θ_1 beyond the last fits as well ...
            let ramp = fit.ramp().unwrap();
            let (w, v) = (upper - lower, 1.3 * (upper - lower));
            let (cubic, square) = (
                (ramp.slope * w - 2.0 * ramp.height) / w.powi(3),
                (3.0 * ramp.height - ramp.slope * w) / w.powi(2),
            );
            let height = cubic * v.powi(3) + square * v.powi(2);
            let slope = 3.0 * cubic * v.powi(2) + 2.0 * square * v;
            let beyond = exact(fit.base(), height, slope, [lower, lower + v]);
            let least = fit.errors().rmse;
            assert!((rmse(&beyond, &views, &values) - least).abs() < 1e-12);
            // ... and none within does, nor another θ_0, with the best base, height and slope.
            let block = Block {
                views: views.clone(),
                profiles: vec![DVector::from_iterator(81, values.iter().flatten().copied())],
            };
            for [a, b] in [[-0.05, 0.0], [0.05, 0.0], [0.0, -0.1], [0.05, -0.1]] {
                let moved = solve(std::slice::from_ref(&block), [lower + a, upper + b]);
                assert!((moved.cost() / 81.0).sqrt() > least);
            }
        }
        // The last view that has a value counts, not the end of the range.
        let mut values = series(&views, rises[0]);
        values[71..].fill(None);
        let fit = fit_energy(&views, &values, range, TOLERANCE).unwrap();
        assert!(fit.upper_at_end() && fit.knots().unwrap()[1] == views[70]);
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
        let ramp = fit.ramp().unwrap();
        let [lower, upper] = fit.knots().unwrap();
        let found = [lower, upper, fit.base(), ramp.height, ramp.slope];
        for (a, b) in found.into_iter().zip(expected) {
            assert!((a - b).abs() < 1e-6, "{found:?}");
        }
        assert!((fit.errors().rmse - 0.013_467_322_842_429_335).abs() < 1e-13);
        assert!((fit.errors().mae - 0.011_844_368_475_522_527).abs() < 1e-8);
        let relative = fit.relative_errors().rmse * fit.mean();
        assert!((relative - fit.errors().rmse).abs() < 1e-15);
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
            let values =
                values.map(|(i, &t)| Some(clean.value(t) + scale * amplitude * noise(i, k)));
            let values = values.collect();
            (views, values)
        };
        (0..10).map(profile).collect()
    }

    fn shared(profiles: &[(Vec<f64>, Vec<Option<f64>>)]) -> SharedEnergyFit {
        let series: Vec<EnergySeries> = profiles
            .iter()
            .map(|(views, values)| EnergySeries { views, values })
            .collect();
        fit_energy_shared(&series, ViewRange::default(), TOLERANCE).unwrap()
    }

    #[test]
    fn shared_knots_are_recovered() {
        let fit = shared(&many(0.0));
        let [lower, upper] = fit.knots().unwrap();
        assert!((lower - 0.68).abs() < 1e-8 && (upper - 1.21).abs() < 1e-8);
        for (k, one) in fit.fits().iter().enumerate() {
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
        let before = shared(&profiles).knots().unwrap();
        assert!((before[0] - 0.68).abs() < 0.05 && (before[1] - 1.21).abs() < 0.05);
        for value in profiles[3].1.iter_mut() {
            *value = value.map(|v| 1e6 * v);
        }
        let after = shared(&profiles).knots().unwrap();
        assert!((0..2).all(|i| (before[i] - after[i]).abs() < 1e-7));
    }

    #[test]
    fn no_profile_is_fitted_better_with_shared_knots() {
        let profiles = many(0.02);
        let fits = shared(&profiles);
        for ((views, values), with_others) in profiles.iter().zip(fits.fits()) {
            let alone = fit_energy(views, values, ViewRange::default(), TOLERANCE).unwrap();
            let [alone, with_others] = [&alone, with_others].map(|f| f.relative_errors().rmse);
            assert!(alone <= with_others * (1.0 + 1e-9));
        }
        let (views, values) = &profiles[2];
        let alone = fit_energy(views, values, ViewRange::default(), TOLERANCE).unwrap();
        assert_eq!(shared(&profiles[2..3]).fits(), [alone]);
    }

    #[test]
    fn a_profile_is_flat_to_the_tolerance_of_its_values() {
        let views = views();
        let range = ViewRange::default();
        let truth = [0.6, 1.2, 2.0, 1e-3, 3e-3];
        let values = series(&views, |t| with_parameters(truth).value(t));
        let about_mean = FitErrors::of({
            let mean = values.iter().flatten().sum::<f64>() / 81.0;
            let values: Vec<f64> = values.iter().flatten().copied().collect();
            values.into_iter().map(move |v| v / mean - 1.0)
        });
        for (share, flat) in [(0.1, false), (0.99, false), (1.01, true), (10.0, true)] {
            let fit = fit_energy(&views, &values, range, share * about_mean.rmse).unwrap();
            assert_eq!(fit.undetermined() == Some(Undetermined::Flat), flat);
            assert_eq!(fit.knots().is_none(), flat);
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
        assert_eq!(fit.errors().views, 79);
        assert!((fit.value(1.3) - clean.value(1.3)).abs() < 1e-8);
    }
}
