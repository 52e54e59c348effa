//! Functions whose isolines are known.

use crate::common::{ONE_SIDED, made, near};
use gonio::analysis::{Distortion, Gradients, Scale, View, Weight, slice_angles};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization::find;
use std::f64::consts::PI;

fn measured(
    name: &str,
    scale: Scale,
    weight: Weight,
    f: impl Fn(&DirectionPair) -> f64 + Send + Sync,
) -> (Distortion, Gradients) {
    let form = crate::common::form(name, Symmetry::FULL);
    let brdf = made(Symmetry::FULL, move |pair| Some([f(pair)]));
    let view = View::new(&brdf, scale, &*form, weight);
    (view.distortion(), view.gradients())
}

/// Every share of a function that one axis explains wholly.
fn aligned((found, gradients): &(Distortion, Gradients), axis: usize) {
    let slices = found.slices.iter().zip(&gradients.slices);
    let slices = slices.map(|(s, g)| (s.shares, g.energy().to_vec()));
    for (shares, gradient) in slices.chain([(found.shares, gradients.all.energy().to_vec())]) {
        let shares = shares.unwrap();
        assert!((shares.axis[axis] - 1.0).abs() < 1e-12, "{shares:?}");
        assert!((shares.additive - 1.0).abs() < 1e-10, "{shares:?}");
        assert!((shares.both - 1.0).abs() < 1e-12, "{shares:?}");
        assert!(shares.axis[1 - axis] < 0.9, "{shares:?}");
        for (i, energy) in gradient.iter().enumerate() {
            // Rounding of 1e-15 over a step of 1e-5, squared.
            assert_eq!(i == axis, *energy > 1e-17, "{gradient:?}");
        }
    }
}

#[test]
fn the_test_functions_lie_along_the_axes_they_are_made_of() {
    for weight in Weight::ALL {
        let s = |p: &DirectionPair| 1.0 - p.half().truncate().length();
        let f = |p: &DirectionPair| 1.0 - p.half_and_back().0.length();
        for name in ["hybrid", "orthographic", "stark"] {
            aligned(&measured(name, Scale::Value, weight, s), 0);
        }
        for name in ["hybrid", "half-difference", "stark"] {
            aligned(&measured(name, Scale::Value, weight, f), 1);
        }
    }
}

#[test]
fn the_grazing_function_is_a_sum_where_k_lies_in_the_tangent_plane() {
    // G = 1 − h_z² + k_z² and k_z = 0 at 90°, which leaves |h_bar|² + |k|².
    let g = |p: &DirectionPair| 1.0 - p.omega_i.cos_theta() * p.omega_o.cos_theta();
    for name in ["hybrid", "orthographic", "stark"] {
        let (found, _) = measured(name, Scale::Value, Weight::Coordinates, g);
        let shares = found.slices.iter().map(|s| s.shares.unwrap().additive);
        let shares: Vec<f64> = shares.collect();
        assert!((shares[3] - 1.0).abs() < 1e-10, "{shares:?}");
        assert!(shares[0] < 0.9999, "{shares:?}");
    }
}

#[test]
fn what_changes_with_the_azimuth_is_not_explained_by_two_axes() {
    // Every θ_i, θ_o and azimuth is physical: independent factors.
    // The form holds the sensor at azimuth 0.
    let turn = |p: &DirectionPair| 2.0 + p.omega_i.phi().cos();
    let weight = Weight::Coordinates;
    let (found, gradients) = measured("spherical", Scale::Value, weight, turn);
    let shares = found.shares.unwrap();
    assert!(shares.both < 1e-20, "{shares:?}");
    assert!(found.slices.iter().all(|s| s.shares.is_none()));
    assert_eq!(found.physical, 1.0);
    // ∫ sin² over [0, π], in units of the axis: π²/2.
    let half = 0.5 * PI * PI;
    let energy = gradients.all.energy();
    assert!((energy[2] / half - 1.0).abs() < 0.01, "{energy:?}");
    assert!(energy[0] < 1e-17 && energy[1] < 1e-17);
}

#[test]
fn slices_lie_from_end_to_end() {
    let angles = |name: &str, symmetry: Symmetry| {
        slice_angles(&find(name).unwrap().axes(symmetry)[2]).map(f64::to_degrees)
    };
    for (name, symmetry, want) in [
        ("hybrid", Symmetry::FULL, [0.0, 30.0, 60.0, 90.0]),
        ("spherical", Symmetry::FULL, [0.0, 60.0, 120.0, 180.0]),
        ("hybrid", ONE_SIDED, [0.0, 45.0, 90.0, 135.0]),
    ] {
        for (got, want) in angles(name, symmetry).into_iter().zip(want) {
            near(got, want, 1e-12, name);
        }
    }
}

#[test]
fn shares_of_a_separable_logarithm_add_up() {
    let f = |p: &DirectionPair| {
        let (h, k) = p.half_and_back();
        (3.0 * h.truncate().length_squared() - 2.0 * k.length_squared()).exp() - 1e-3
    };
    let (found, gradients) = measured("stark", Scale::Log, Weight::SolidAngle, f);
    let gradient = gradients.all;
    assert!((found.shares.unwrap().additive - 1.0).abs() < 1e-9);
    // Linear along both axes: slopes 3 and 2, and none along the azimuth.
    for (got, want) in gradient.energy().into_iter().zip([9.0, 4.0, 0.0]) {
        assert!((got - want).abs() < 1e-8, "{got} {want}");
    }
    let shares = gradient.shares().unwrap();
    assert!((shares[0].0 - 9.0 / 13.0).abs() < 1e-9 && shares[0].1 < 1e-9);
}

#[test]
fn the_lattice_is_physical_where_the_form_is() {
    // Shares of the isotropic box above the horizon, from independent Monte Carlo.
    let one = |_: &DirectionPair| 1.0;
    let shares = [
        ("half-difference", 0.617),
        ("orthographic", 0.583),
        ("hybrid", 0.698),
    ];
    for (name, share) in shares {
        let (found, _) = measured(name, Scale::Value, Weight::Coordinates, one);
        // Cells of a 64th and a 16th along the edge.
        near(found.physical, share, 0.004, name);
        assert_eq!(found.shares, None);
    }
}

#[test]
fn a_window_looks_at_its_part() {
    // (sigma, alpha) of Stark's chart: x + 5 y on [0, 1/4] × [1/4, 3/4], where all is physical at 90°.
    let f = |p: &DirectionPair| {
        let (h, k) = p.half_and_back();
        h.truncate().length_squared() + 5.0 * k.length_squared()
    };
    let form = crate::common::form("stark", Symmetry::FULL);
    let window = [[0.0, 0.25], [0.25, 0.75]];
    let brdf = made(Symmetry::FULL, move |pair| Some([f(pair)]));
    let view = View::new(&brdf, Scale::Value, &*form, Weight::Coordinates).within(window);
    let found = view.distortion();
    let gradients = view.gradients();
    assert_eq!(found.slices[3].physical, 1.0);
    let shares = found.slices[3].shares.unwrap();
    // Variances of two uniform variables: 1²/4²/12 and 5²/2²/12.
    let (x, y) = (1.0 / 16.0, 25.0 / 4.0);
    assert!((shares.axis[0] - x / (x + y)).abs() < 1e-12, "{shares:?}");
    let [a, b] = gradients.slices[3].energy();
    assert!((a - 1.0).abs() < 1e-8 && (b - 25.0).abs() < 1e-8, "{a} {b}");
}

#[test]
fn slices_of_a_wave_deviate_as_its_cosine_does() {
    // cos 2φ on [0, π]: variance 1/2 over all azimuths, average 0, at 0°, 60°, 120°, 180°
    // cos² of 1, 1/4, 1/4, 1.
    let wave = |p: &DirectionPair| 2.0 + (2.0 * p.omega_i.phi()).cos();
    let (found, _) = measured("spherical", Scale::Value, Weight::Coordinates, wave);
    for (slice, want) in found.slices.iter().zip([2.0, 0.5, 0.5, 2.0]) {
        let got = slice.deviation.unwrap();
        // Rounding of a sum of 65 536 terms.
        assert!((got - want).abs() < 1e-11, "{got} {want}");
    }
}
