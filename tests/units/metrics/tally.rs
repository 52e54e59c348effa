use crate::common::{test_pairs, values};
use gonio::geometry::DirectionPair;
use gonio::metrics::{Errors, Measure, Tally, compare, compare_weighted};

fn pairs(n: usize) -> Vec<DirectionPair> {
    test_pairs(Measure::Lobe, n)
}

fn close(got: Option<f64>, want: f64) {
    let got = got.unwrap();
    assert!((got - want).abs() <= 1e-14 * want.max(1.0), "{got} {want}");
}

/// The quantile is known to a step.
fn near(got: Option<f64>, want: f64) {
    let got = got.unwrap();
    assert!((got - want).abs() <= want / 32.0, "{got} {want}");
}

#[test]
fn the_quantile_is_where_a_thousandth_is_above() {
    let pairs = pairs(20_000);
    for scale in [1e-6, 1.0, 1e9] {
        // Relative errors that are evenly spread up to the scale, in no order.
        let error = |i: usize| scale * ((i * 7919) % 20_000) as f64 / 20_000.0;
        let g = (0..20_000).map(|i| 1.0 + error(i)).collect();
        let errors = compare(&pairs, &values(vec![1.0; 20_000]), &values(g));
        near(errors.relative_p999, 0.999 * scale);
        let mut tally = Tally::new(1, 16);
        let g = values((0..20_000).map(|i| 1.0 + error(i)).collect());
        let lists = (pairs.as_slice(), &[vec![2.0; 20_000]][..]);
        let truth = values(vec![1.0; 20_000]);
        let numbers: Vec<u32> = (0..20_000).collect();
        let parts = numbers.chunks(1250);
        for (part, replicate) in parts.zip(tally.replicates_mut()) {
            replicate.add(part, lists, &truth, (&g, 0));
        }
        assert_eq!(tally.errors(0).relative_p999, errors.relative_p999);
        assert!(tally.standard_errors(0).relative_p999.unwrap() < 1e-2 * scale);
    }
    let one = values(vec![1.0; 20_000]);
    let same = compare(&pairs, &one, &one);
    assert_eq!(same.relative_p999, Some(0.0));
}

/// The standard error of a mean of replicates with as many pairs each is that of a mean.
#[test]
fn the_standard_error_of_an_average_is_that_of_a_mean() {
    let mut tally = Tally::new(1, 16);
    let errors: Vec<f64> = (0..16).map(|r| 0.1 + 0.01 * f64::from(r * r % 7)).collect();
    let pairs = pairs(5);
    let lists = (pairs.as_slice(), &[vec![1.0; 5]][..]);
    for (replicate, error) in tally.replicates_mut().iter_mut().zip(&errors) {
        let [f, g] = [1.0, 1.0 + error].map(|v| values(vec![v; 5]));
        replicate.add(&[0, 1, 2, 3, 4], lists, &f, (&g, 0));
    }
    let mean = errors.iter().sum::<f64>() / 16.0;
    let spread: f64 = errors.iter().map(|e| (e - mean).powi(2)).sum();
    close(tally.errors(0).mean_relative, mean);
    let standard = tally.standard_errors(0).mean_relative;
    close(standard, (spread / (16.0 * 15.0)).sqrt());
}

#[test]
fn a_scaled_truth_has_the_errors_on_paper() {
    let pairs = pairs(1000);
    // Values over nine decades, above the floor.
    let decades = (0..1000).map(|i| f64::from(i) / 111.0 - 2.0);
    let f: Vec<f64> = decades.map(|x| 10f64.powf(x)).collect();
    for c in [0.0, 0.5, 1.0, 1.5, 4.0] {
        let g = f.iter().map(|f| c * f).collect();
        let errors = compare(&pairs, &values(f.clone()), &values(g));
        close(errors.nrmse, f64::abs(c - 1.0));
        close(errors.mean_relative, f64::abs(c - 1.0));
        close(errors.energy, c - 1.0);
        near(errors.relative_p999, f64::abs(c - 1.0));
        assert_eq!(errors.pairs, 1000);
        assert_eq!((errors.pairs_missing, errors.pairs_unreconstructed), (0, 0));
    }
}

#[test]
fn a_weight_is_a_number_of_equal_pairs() {
    let pairs = pairs(60);
    let [f, g] = [3.7, 5.1].map(|k| (0..60).map(|i| 1.0 + f64::sin(k * i as f64)).collect());
    let [f, g] = [f, g].map(|v: Vec<f64>| v);
    let weights: Vec<f64> = (0..60).map(|i| f64::from(i % 4)).collect();
    let often = || (0..60).flat_map(|i| std::iter::repeat_n(i, i % 4));
    let many: Vec<_> = often().map(|i| pairs[i]).collect();
    let of = |v: &[f64]| values(often().map(|i| v[i]).collect());
    let repeated = compare(&many, &of(&f), &of(&g));
    let weighted = compare_weighted(&pairs, &weights, &values(f), &values(g));
    for (_, of) in Errors::QUANTITIES {
        close(of(&weighted), of(&repeated).unwrap());
    }
    assert_eq!((weighted.pairs, repeated.pairs), (45, 90));
}

#[test]
fn constants_have_the_errors_on_paper() {
    let pairs = pairs(1000);
    let n = pairs.len() as f64;
    let mean = |of: &dyn Fn(f64) -> f64| {
        let cosines = pairs.iter().map(|p| p.omega_i.cos_theta());
        cosines.map(of).sum::<f64>() / n
    };
    for (f, g) in [(0.3, 0.2), (1e-5, 2e-4), (0.0, 0.1), (5.0, 0.0), (2.0, 2.0)] {
        let errors = compare(&pairs, &values(vec![f; 1000]), &values(vec![g; 1000]));
        close(errors.log_relative, ((g + 1e-3) / (f + 1e-3)).ln().abs());
        let log1p = |cos: f64| ((1.0 + g * cos).ln() - (1.0 + f * cos).ln()).abs();
        close(errors.log1p, mean(&log1p));
        let cbrt = mean(&|cos| cos.powf(2.0 / 3.0)).sqrt() * (g.cbrt() - f.cbrt()).abs();
        close(errors.cbrt, cbrt);
        close(errors.mean_relative, f64::abs(g - f) / f.max(1e-3));
        near(errors.relative_p999, f64::abs(g - f) / f.max(1e-3));
        if f > 0.0 {
            close(errors.nrmse, f64::abs(g / f - 1.0));
        } else {
            assert_eq!((errors.nrmse, errors.energy), (None, None));
        }
    }
}

#[test]
fn the_cosine_is_that_of_the_light() {
    let pair = DirectionPair::from_spherical(1.0, 0.0, 0.2, 0.5);
    let errors = compare(&[pair], &values(vec![1.0]), &values(vec![8.0]));
    close(errors.cbrt, 1.0_f64.cos().cbrt());
    let two = [pair, pair.swapped()];
    let errors = compare(&two, &values(vec![1.0, 1.0]), &values(vec![2.0, 1.0]));
    let (c2, d2) = (1.0_f64.cos().powi(2), 0.2_f64.cos().powi(2));
    close(errors.nrmse, (c2 / (c2 + d2)).sqrt());
    close(errors.mean_relative, 0.5);
    close(errors.energy, 0.5);
    near(errors.relative_p999, 1.0);
}

#[test]
fn missing_pairs_are_left_out_and_counted() {
    let pairs = pairs(6);
    let mut truth = values(vec![1.0; 6]);
    truth.missing = vec![true, true, false, false, false, false];
    let mut reconstruction = values(vec![9.0, 9.0, 9.0, 1.5, 1.5, 1.5]);
    reconstruction.missing = vec![false, true, true, false, false, false];
    let errors = compare(&pairs, &truth, &reconstruction);
    assert_eq!(errors.pairs, 3);
    assert_eq!(errors.pairs_missing, 2);
    assert_eq!(errors.pairs_unreconstructed, 1);
    close(errors.nrmse, 0.5);
    near(errors.relative_p999, 0.5);
}

#[test]
fn values_that_break_the_promise_count_as_missing() {
    let pairs = pairs(4);
    let broken = values(vec![f64::NAN, f64::INFINITY, -0.1, 2.0]);
    let errors = compare(&pairs, &values(vec![1.0; 4]), &broken);
    assert_eq!((errors.pairs, errors.pairs_unreconstructed), (1, 3));
    close(errors.nrmse, 1.0);
}

#[test]
fn undefined_errors_are_empty() {
    let pairs = pairs(3);
    let black = compare(&pairs, &values(vec![0.0; 3]), &values(vec![0.0; 3]));
    assert_eq!(black.nrmse, None);
    assert_eq!(black.mean_relative, Some(0.0));
    let mut none = values(vec![0.0; 3]);
    none.missing = vec![true; 3];
    for errors in [
        compare(&pairs, &none, &values(vec![1.0; 3])),
        compare(&[], &values(vec![]), &values(vec![])),
    ] {
        assert_eq!(errors.pairs, 0);
        let mut quantities = Errors::QUANTITIES.iter();
        assert!(quantities.all(|(_, of)| of(&errors).is_none()));
    }
    // The squares overflow, the logarithms do not.
    let huge = compare(&pairs, &values(vec![1.0; 3]), &values(vec![1e200; 3]));
    assert_eq!(huge.nrmse, None);
    assert!(huge.log_relative.is_some());
}
