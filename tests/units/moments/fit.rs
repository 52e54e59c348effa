mod knots {
    use gonio::moments::{
        EnergyFit, EnergySeries, FitError, Undetermined, ViewRange, fit_energy, fit_energy_shared,
    };

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
    fn knots_of_a_constant_are_not_determined() {
        let views = views();
        for (value, ripple) in [(3.0, 0.0), (1e-5, 0.0), (2.0, 1e-4)] {
            let values = series(&views, |t| value * (1.0 + ripple * (20.0 * t).sin()));
            let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
            assert_eq!(fit.undetermined(), Some(Undetermined::Flat));
            assert!(fit.knots().is_none() && fit.ramp().is_none());
            assert!((fit.value(1.0) / value - 1.0).abs() < 1e-4);
        }
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
            assert_eq!(fit.undetermined(), Some(Undetermined::Noise), "{k}");
            assert!((fit.base() - fit.mean()).abs() < 1e-15 && fit.ramp().is_none());
        }
    }

    #[test]
    fn a_step_between_two_views_is_fitted_without_knots() {
        let views = views();
        let values = series(&views, |t| if t < 0.9 { 1.0 } else { 2.0 });
        let fit = fit_energy(&views, &values, ViewRange::default(), TOLERANCE).unwrap();
        assert_eq!(fit.undetermined(), Some(Undetermined::Unseen));
        assert!(fit.knots().is_none() && fit.errors().rmse < 1e-10);
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
        assert_eq!(
            fit_energy(&views, &black, range, TOLERANCE),
            Err(FitError::NoEnergy)
        );
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
}

mod line {
    use gonio::moments::{FitError, ViewRange, fit_average_variance, fit_mean};

    #[test]
    fn slope_by_hand() {
        // Σ θ µ / Σ θ² = (0.5 · −0.2 + 1 · −0.9)/(0.25 + 1) = −0.8; residuals 0.2, −0.1 and 0 at 0.
        let views = [0.0, 0.5, 1.0, 1.2, 1.5];
        let values = [Some(0.0), Some(-0.2), Some(-0.9), None, Some(7.0)];
        let fit = fit_mean(&views, &values, ViewRange::default()).unwrap();
        assert!((fit.slope() + 0.8).abs() < 1e-15);
        assert!((fit.errors().mae - 0.1).abs() < 1e-15);
        assert!((fit.errors().rmse - (0.05f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(fit.errors().views, 3);
        assert_eq!(fit.value(0.5), 0.5 * fit.slope());
        assert_eq!(
            fit_mean(&[0.0], &[Some(0.0)], ViewRange::default()),
            Err(FitError::Undetermined)
        );
    }

    #[test]
    fn variance_by_hand() {
        // Averages 0.2 and 0.4; the other views lack one of the two.
        let views = [0.0, 0.2, 0.4, 0.6];
        let (theta, phi) = (
            [Some(0.1), Some(0.5), None, Some(1.0)],
            [Some(0.3), Some(0.3), Some(9.0), None],
        );
        let fit = fit_average_variance(&views, &theta, &phi, ViewRange::default()).unwrap();
        assert!((fit.variance() - 0.3).abs() < 1e-15 && fit.value(1.0) == fit.variance());
        assert!((fit.errors().mae - 0.1).abs() < 1e-15);
        assert!((fit.errors().rmse - 0.1).abs() < 1e-15 && fit.errors().views == 2);
        let short = fit_average_variance(&views, &theta, &phi[1..], ViewRange::default());
        assert!(short.is_err());
    }
}

mod ramp {
    use gonio::moments::Ramp;

    const KNOTS: [f64; 2] = [0.7, 1.2];

    #[test]
    fn the_ramp_has_the_asked_values_and_slopes() {
        let ramp = Ramp {
            knots: KNOTS,
            height: 0.4,
            slope: 1.7,
        };
        let slope = |theta: f64| (ramp.value(theta + 1e-6) - ramp.value(theta - 1e-6)) / 2e-6;
        assert_eq!(ramp.value(0.3), 0.0);
        assert!(ramp.value(0.7).abs() < 1e-15 && slope(0.7).abs() < 1e-4);
        assert!((ramp.value(1.2) - 0.4).abs() < 1e-15 && (slope(1.2) - 1.7).abs() < 1e-4);
        assert!((ramp.value(1.4) - (0.4 + 0.2 * 1.7)).abs() < 1e-15);
        // A cubic through t = 1/2: half the height, less an eighth of the width times the slope.
        assert!((ramp.value(0.95) - (0.2 - 0.5 * 1.7 / 8.0)).abs() < 1e-15);
    }
}

mod relation {
    use gonio::moments::{FitError, MeanVarianceFit, fit_mean_variance};
    use std::f64::consts::PI;

    fn fit(points: &[(f64, f64)]) -> Result<MeanVarianceFit, FitError> {
        let (slopes, variances): (Vec<_>, Vec<_>) =
            points.iter().map(|p| (Some(p.0), Some(p.1))).unzip();
        fit_mean_variance(&slopes, &variances)
    }

    #[test]
    fn one_material_by_hand() {
        // At µ̃ = −1/2 the curve is π²/24 − c/4.
        let fit = fit(&[(-0.5, 0.2)]).unwrap();
        assert!((fit.coefficient() - 4.0 * (PI * PI / 24.0 - 0.2)).abs() < 1e-15);
        assert!(fit.r_squared().is_none() && fit.correlation().pearson.is_none());
    }
}
