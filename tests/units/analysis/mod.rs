mod claims;
mod distortion;
mod subset;
mod symmetry;

use crate::common::{ISOTROPIC, form, made, matte, model, near, product, test_pairs};
use gonio::analysis::{Averaging, Cell, Shares, alignment, anisotropy, reduced, stretches};
use gonio::brdf::{Brdf, BrdfSpec, Channels, TestFunctionSpec};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::metrics::{self, Measure};
use gonio::parametrization::{all, find};
use std::f64::consts::FRAC_PI_2;

/// A lobe over (theta_h, |h_bar|).
fn lobe(f: impl Fn(f64, f64) -> f64 + Send + Sync) -> impl Brdf {
    made(Symmetry::FULL, move |pair| {
        let h = pair.half();
        let h_bar = h.x.hypot(h.y);
        Some([f(h_bar.atan2(h.z), h_bar)])
    })
}

fn gauss(x: f64) -> f64 {
    (-x * x).exp()
}

#[test]
fn functions_of_one_coordinate_have_their_exponent() {
    for width in [1e-5, 0.01, 0.1] {
        let half_width = width * 2f64.ln().sqrt();
        for base in [0.0, 0.3] {
            let angle = alignment(&lobe(|t: f64, _| base + gauss(t / width))).unwrap();
            let length = alignment(&lobe(|_, l: f64| base + gauss(l / width))).unwrap();
            // Rounding of the half vector, of size 1e-16, against the width.
            let tolerance = 1e-15 / width + 1e-9;
            assert!(angle.q.abs() < tolerance, "{width}: {angle:?}");
            assert!((length.q - 1.0).abs() < tolerance, "{width}: {length:?}");
            assert_eq!((angle.slices, length.slices), (13, 13));
            assert!((angle.half_width / half_width - 1.0).abs() < 1e-6);
            assert!((length.half_width / half_width.asin() - 1.0).abs() < 1e-6);
        }
    }
    // Between the two: sin(theta_h) = |h_bar|/cos(theta_d), so that this is q = 1/2.
    let between = |t: f64, l: f64| gauss((t.sin() * l).sqrt() / 0.05);
    let found = alignment(&lobe(between)).unwrap();
    assert!((found.q - 0.5).abs() < 1e-9, "{found:?}");
}

/// The exponent of a lobe and how far off it may be: shadowing, Fresnel and cosines move it by the squared width.
#[test]
fn models_have_the_exponent_of_their_formula_and_none_without_a_lobe() {
    let retro = "of = { kind = \"ggx\", alpha = 0.05 }";
    for (kind, keys, want) in [
        ("ggx", "alpha = 0.02", Some([0.0, 0.01])),
        ("beckmann", "alpha = 0.05", Some([0.0, 0.02])),
        ("ward", "alpha = 0.05", Some([0.0, 0.02])),
        ("ward", "alpha = [0.02, 0.06]", Some([0.0, 0.02])),
        ("phong", "exponent = 1000", Some([0.0, 1e-6])),
        ("shifted-gamma", "", Some([0.0, 0.1])),
        ("low-abc-smooth", "b = 3000.0\nc = 1.5", Some([1.0, 0.01])),
        ("lambert", "", None),
        ("oren-nayar", "", None),
        ("sheen", "", None),
        ("retro-reflective", retro, None),
    ] {
        let found = alignment(&*model(kind, keys)).map(|found| found.q);
        assert_eq!(found.is_some(), want.is_some(), "{kind}: {found:?}");
        if let (Some(found), Some([want, most])) = (found, want) {
            near(found, want, most, (kind, keys));
        }
    }
}

#[test]
fn the_product_is_the_jacobian() {
    let pairs = test_pairs(Measure::Cosine, 2000);
    for entry in all() {
        let found = anisotropy(&entry, &pairs).unwrap();
        assert_eq!(found.pairs + found.skipped, 2000);
        assert!(found.skipped < 5, "{}: {found:?}", entry.kind);
        // Central differences of step 1e-6: 1e-10 for a coordinate of size 1, more by the
        // condition number near poles.
        assert!(found.jacobian_error_median < 1e-8, "{found:?}");
        assert!(found.condition_median >= 1.0);
    }
}

#[test]
fn spherical_stretches_have_a_closed_form() {
    // Elevations move each direction by their own angle. The difference of azimuths, with the
    // turn taken out, moves the pair by sin θ_i sin θ_o/√(sin² θ_i + sin² θ_o).
    let open = form("spherical", ISOTROPIC);
    let lengths = [FRAC_PI_2, FRAC_PI_2, 1.0];
    for (ti, to, phi) in [(0.3_f64, 0.9_f64, 1.0), (1.2, 1.1, -2.0), (0.05, 1.4, 3.0)] {
        let pair = DirectionPair::from_spherical(ti, phi, to, 0.0);
        let [si, so] = [ti.sin(), to.sin()];
        let want = si * so / si.hypot(so);
        let got = stretches(&*open, lengths, &pair).unwrap();
        for (got, want) in got.into_iter().zip([FRAC_PI_2, FRAC_PI_2, want]) {
            near(got, want, 1e-7, pair);
        }
    }
}

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
    let lambert = matte(0.5);
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
    let [a, c, stark] =
        ["half-difference", "hybrid", "stark"].map(|name| of(&*g, name, Averaging::Uniform));
    assert!(worst(&a, &c) > 0.01, "{}", worst(&a, &c));
    // J of half/difference does not depend on φ_d.
    let b = of(&*g, "half-difference", Averaging::SolidAngle);
    assert!(worst(&a, &b) < 1e-13);
    // Stark's coordinates are the squares of the hybrid ones: same curves, same azimuth.
    assert!(worst(&c, &stark) < 1e-10);
}

fn cells(n: [usize; 2], keep: impl Fn(f64, f64) -> bool, f: impl Fn(f64, f64) -> f64) -> Vec<Cell> {
    let cell = |(i, j)| {
        let [x, y] = [(i, n[0]), (j, n[1])].map(|(i, n)| (i as f64 + 0.5) / n as f64);
        let (place, weight, value) = ([i, j], 1.0 + x, f(x, y));
        keep(x, y).then_some(Cell {
            place,
            weight,
            value,
        })
    };
    product(0..n[0], 0..n[1])
        .into_iter()
        .filter_map(cell)
        .collect()
}

#[test]
fn sums_are_additive_on_any_domain() {
    // A triangle, and two parts that share no line.
    let triangle = |x: f64, y: f64| x + y < 1.0;
    let apart = |x: f64, y: f64| (x < 0.4) == (y < 0.4);
    for keep in [&triangle as &dyn Fn(f64, f64) -> bool, &apart] {
        let f = |x: f64, y: f64| x.exp() - 3.0 * y * y;
        let shares = Shares::of([30, 20], &cells([30, 20], keep, f)).unwrap();
        assert!((shares.additive - 1.0).abs() < 1e-12, "{shares:?}");
        assert!((shares.both - 1.0).abs() < 1e-12);
        assert!(shares.axis.iter().all(|s| *s > 0.01 && *s < 0.99));
    }
}

#[test]
fn a_product_on_a_box_has_the_shares_of_its_factors() {
    // v = x y with independent x and y of mean m and variance s: Var = m²s_y + m²s_x + s_x s_y.
    let n = [20, 20];
    let mut all = cells(n, |_, _| true, |x, y| x * y);
    all.iter_mut().for_each(|c| c.weight = 1.0);
    let (m, s) = (0.5, (400.0 - 1.0) / 400.0 / 12.0);
    let variance = 2.0 * m * m * s + s * s;
    let shares = Shares::of(n, &all).unwrap();
    for share in shares.axis {
        assert!((share - m * m * s / variance).abs() < 1e-13, "{share}");
    }
    assert!((shares.additive - 2.0 * m * m * s / variance).abs() < 1e-12);
}

#[test]
fn constants_have_no_shares() {
    for value in [0.0, 0.1, 1e300, 1e-300] {
        let cells = cells([9, 7], |_, _| true, |_, _| value);
        assert_eq!(Shares::of([9, 7], &cells), None, "{value}");
    }
    assert_eq!(Shares::of([3, 3], &[]), None);
}
