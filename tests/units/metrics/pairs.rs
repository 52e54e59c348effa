use crate::common::chi_squared::{equal_bins, uniformity};
use gonio::geometry::{Direction, DirectionPair};
use gonio::metrics::{Measure, MetricsSpec, test_pairs};

fn spec(pairs: usize, mask_deg: f64, min_separation_deg: f64) -> MetricsSpec {
    super::spec(pairs, mask_deg, min_separation_deg, 7)
}

#[test]
fn cosine_pairs_have_uniform_cos_squared() {
    for mask_deg in [90.0, 80.0, 30.0, 0.1] {
        let pairs = test_pairs(Measure::Cosine, &spec(30_000, mask_deg, 0.0)).unwrap();
        let sin2_mask = f64::to_radians(mask_deg).sin().powi(2);
        let sin2 = |d: Direction| d.sin_theta().powi(2) / sin2_mask;
        let azimuth = |d: Direction| d.phi() / std::f64::consts::TAU + 0.5;
        for end in [|p: &DirectionPair| p.omega_i, |p: &DirectionPair| p.omega_o] {
            for of in [&sin2 as &dyn Fn(Direction) -> f64, &azimuth] {
                let p = uniformity(&equal_bins(pairs.iter().map(|p| of(end(p))), 50));
                assert!(p > 1e-3, "{mask_deg}: p = {p}");
            }
        }
    }
}

#[test]
fn mask_separation_and_number_hold() {
    for measure in Measure::USUAL {
        for (n, mask_deg, separation_deg) in [
            (1, 80.0, 0.0),
            (2, 90.0, 0.0),
            (999, 80.0, 5.0),
            (1000, 45.0, 60.0),
            (500, 90.0, 120.0),
            (500, 1e-3, 0.0),
        ] {
            let pairs = test_pairs(measure, &spec(n, mask_deg, separation_deg)).unwrap();
            assert_eq!(pairs.len(), n);
            let mask = f64::to_radians(mask_deg);
            for pair in &pairs {
                assert!(pair.is_above_horizon());
                // Half an ulp of cos 1e-3° is 6e-12 rad.
                assert!(pair.omega_i.theta() < mask + 1e-11);
                assert!(pair.omega_o.theta() < mask + 1e-11);
                assert!(pair.separation() >= separation_deg.to_radians());
            }
        }
    }
}

#[test]
fn the_set_depends_on_the_seed_and_a_shorter_one_is_its_beginning() {
    for measure in Measure::USUAL {
        let long = test_pairs(measure, &spec(1000, 80.0, 0.0)).unwrap();
        let short = test_pairs(measure, &spec(100, 80.0, 0.0)).unwrap();
        assert_eq!(long[..100], short);
        let other = test_pairs(measure, &super::spec(100, 80.0, 0.0, 8)).unwrap();
        assert!(short.iter().zip(&other).all(|(a, b)| a != b));
    }
}

#[test]
fn steep_and_grazing_pairs_are_the_parts_of_the_cosine_pairs() {
    let of = |measure| test_pairs(measure, &spec(20_000, 80.0, 0.0)).unwrap();
    let grazes = |p: &DirectionPair| p.omega_i.theta().max(p.omega_o.theta()).to_degrees() > 65.0;
    assert!(of(Measure::Grazing).iter().all(grazes));
    assert!(!of(Measure::Steep).iter().any(grazes));
    let cosine = of(Measure::Cosine);
    // sin² is uniform up to the mask.
    let below = (65_f64.to_radians().sin() / 80_f64.to_radians().sin()).powi(4);
    let share = cosine.iter().filter(|p| !grazes(p)).count() as f64 / 20_000.0;
    assert!((share - below).abs() < 5e-3, "{share} {below}");
    // They begin as the cosine pairs do.
    let part: Vec<_> = cosine.iter().filter(|p| grazes(p)).copied().collect();
    assert_eq!(of(Measure::Grazing)[..part.len()], part);
    let hopeless = test_pairs(Measure::Grazing, &spec(10, 60.0, 0.0)).unwrap_err();
    assert!(hopeless.key.contains("mask_deg"));
}

#[test]
fn impossible_specs_are_refused() {
    for (bad, key) in [
        (spec(0, 80.0, 0.0), "pairs"),
        (spec(10_000_001, 80.0, 0.0), "pairs"),
        (spec(10, 0.0, 0.0), "mask_deg"),
        (spec(10, -1.0, 0.0), "mask_deg"),
        (spec(10, 90.1, 0.0), "mask_deg"),
        (spec(10, f64::NAN, 0.0), "mask_deg"),
        (spec(10, 80.0, -1.0), "min_separation_deg"),
        (spec(10, 90.0, 180.0), "min_separation_deg"),
        (spec(10, 30.0, 60.0), "min_separation_deg"),
        (spec(10, 80.0, f64::NAN), "min_separation_deg"),
        (spec(10, 80.0, f64::INFINITY), "min_separation_deg"),
    ] {
        assert_eq!(bad.check().unwrap_err().key, key, "{bad:?}");
        assert_eq!(test_pairs(Measure::Cosine, &bad).unwrap_err().key, key);
    }
    // Possible on paper, but next to no pairs; at 1e-7° no cosine exceeds the mask's.
    for hopeless in [spec(10, 80.0, 159.0), spec(10, 1e-7, 0.0)] {
        assert!(hopeless.check().is_ok());
        for measure in Measure::USUAL {
            let error = test_pairs(measure, &hopeless).unwrap_err();
            assert!(error.key.contains("mask_deg"), "{error}");
            assert!(error.key.contains("min_separation_deg"), "{error}");
        }
    }
}

/// Roughness of the lobes, one after the other.
const LOBE_ALPHAS: [f64; 4] = [0.3, 0.1, 0.03, 0.01];

/// The pairs of the lobe with roughness `LOBE_ALPHAS[lobe]`.
fn of_lobe(pairs: &[DirectionPair], lobe: usize) -> impl Iterator<Item = &DirectionPair> {
    pairs.iter().skip(1 + 2 * lobe).step_by(8)
}

#[test]
fn lobe_half_vectors_follow_ggx() {
    // With omega_o within 45° − θ_h of the normal nothing is dropped at that θ_h: there the
    // distribution of half vectors is GGX itself.
    let pairs = test_pairs(Measure::Lobe, &spec(80_000, 90.0, 0.0)).unwrap();
    for (lobe, alpha) in LOBE_ALPHAS.into_iter().enumerate() {
        let theta_max = 20.0_f64.to_radians();
        let share = |theta: f64| {
            let tan2 = theta.tan().powi(2);
            tan2 / (tan2 + alpha * alpha)
        };
        let u = of_lobe(&pairs, lobe)
            .filter(|p| p.omega_o.theta() < 50.0_f64.to_radians())
            .map(|p| p.half().truncate().length().atan2(p.half().z))
            .filter(|theta| *theta < theta_max)
            .map(|theta| share(theta) / share(theta_max));
        let p = uniformity(&equal_bins(u, 40));
        assert!(p > 1e-3, "alpha {alpha}: p = {p}");
    }
}

#[test]
fn half_of_the_lobe_pairs_are_the_cosine_pairs() {
    let lobe = test_pairs(Measure::Lobe, &spec(2001, 80.0, 0.0)).unwrap();
    let cosine = test_pairs(Measure::Cosine, &spec(1001, 80.0, 0.0)).unwrap();
    assert!(lobe.iter().step_by(2).eq(cosine.iter()));
    // Half of the GGX half vectors lie within atan(alpha): 250 pairs a lobe, less the dropped.
    for (i, alpha) in LOBE_ALPHAS.into_iter().enumerate() {
        assert_eq!(of_lobe(&lobe, i).count(), 250);
        let near = of_lobe(&lobe, i)
            .filter(|p| p.half().truncate().length() < alpha * p.half().z)
            .count();
        assert!((110..160).contains(&near), "{alpha}: {near}");
    }
}
