use crate::common::test_pairs;
use gonio::analysis::{Averaging, reduced};
use gonio::brdf::{Brdf, BrdfSpec, Channels, Lambert, Spectrum, TestFunctionSpec};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::metrics;
use gonio::metrics::Measure;
use gonio::parametrization::find;

fn pairs() -> Vec<DirectionPair> {
    test_pairs(Measure::Cosine, 500)
}

fn of(brdf: &dyn Brdf, name: &str, averaging: Averaging) -> Vec<f64> {
    let form = find(name).unwrap().form(Symmetry::FULL);
    let values = reduced(brdf, &*form, averaging, &pairs());
    assert!(values.missing.is_empty());
    values.luminance
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    let miss = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    miss.fold(0.0, f64::max)
}

#[test]
fn functions_of_two_coordinates_stay() {
    let s = TestFunctionSpec::S.build(Channels::Luminance).unwrap();
    let truth = metrics::evaluate(&*s, &pairs()).luminance;
    for name in ["half-difference", "hybrid", "orthographic", "stark"] {
        for averaging in Averaging::ALL {
            let miss = worst(&of(&*s, name, averaging), &truth);
            // Orthographic square roots near the horizon keep 8 digits.
            assert!(miss < 1e-7, "{name} {averaging:?}: {miss}");
        }
    }
    let lambert = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
    for value in of(&lambert, "spherical", Averaging::Uniform) {
        assert!((value * std::f64::consts::PI - 0.5).abs() < 1e-12);
    }
}

#[test]
fn the_grazing_function_has_closed_averages() {
    // G = 1 − h_z² + k_z². Half/difference: k_z² = |k|² sin² θ_h cos² φ_d; hybrid:
    // |k|² |h_bar|² cos² Δ/(h_z² + |h_bar|² cos² Δ). Averaged over a whole circle:
    // |k|² sin² θ_h/2 and |k|² (1 − cos θ_h).
    let g = TestFunctionSpec::G.build(Channels::Luminance).unwrap();
    let half = of(&*g, "half-difference", Averaging::Uniform);
    let hybrid = of(&*g, "hybrid", Averaging::Uniform);
    let mut whole = 0;
    for ((pair, half), hybrid) in pairs().iter().zip(half).zip(hybrid) {
        let (h, k) = pair.half_and_back();
        let cos = h.z / h.length();
        let sin2 = 1.0 - cos * cos;
        // The circle is whole if k_z stays below h_z.
        if k.length() * sin2.sqrt() > h.z {
            continue;
        }
        whole += 1;
        let flat = 1.0 - h.z * h.z;
        let kk = k.length_squared();
        assert!((half - flat - 0.5 * kk * sin2).abs() < 1e-12);
        // Poles of the integrand at a distance acosh-like in cos θ_h: fast but not at once.
        assert!((hybrid - flat - kk * (1.0 - cos)).abs() < 1e-6, "{hybrid}");
    }
    assert!(whole > 200);
}

#[test]
fn projections_that_know_no_coordinates_agree() {
    let g = TestFunctionSpec::G.build(Channels::Luminance).unwrap();
    for averaging in [Averaging::SolidAngle, Averaging::Cosine] {
        let half = of(&*g, "half-difference", averaging);
        let hybrid = of(&*g, "hybrid", averaging);
        let miss = worst(&half, &hybrid);
        assert!(miss < 1e-5, "{averaging:?}: {miss}");
    }
    let uniform = worst(
        &of(&*g, "half-difference", Averaging::Uniform),
        &of(&*g, "hybrid", Averaging::Uniform),
    );
    assert!(uniform > 0.01, "{uniform}");
    // J of half/difference does not depend on φ_d.
    let a = of(&*g, "half-difference", Averaging::Uniform);
    let b = of(&*g, "half-difference", Averaging::SolidAngle);
    assert!(worst(&a, &b) < 1e-13);
    // Stark's coordinates are the squares of the hybrid ones: same curves, same azimuth.
    let c = of(&*g, "hybrid", Averaging::Uniform);
    assert!(worst(&c, &of(&*g, "stark", Averaging::Uniform)) < 1e-10);
}
