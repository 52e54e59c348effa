//! Slices far from the everyday: values at the ends of f64, black ones, needles, a dynamic range of
//! 1e12, and tables with outliers and holes.

use super::common::{made, merl_file, model, near, product};
use super::gaussians::{ends, truncated};
use super::{assert_within, estimate, estimators, from_raw, is_random, planar, resolving, scale};
use gonio::brdf::measured::merl::{Interpolation, Merl, MerlGrid, SCALE};
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::DirectionPair;
use gonio::moments::Component;
use gonio::parametrization::view_centered;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

/// A BRDF in luminance times a number.
fn times(brdf: &dyn Brdf, factor: f64) -> impl Brdf {
    let value = move |pair: &DirectionPair| Some([brdf.luminance(pair)? * factor]);
    made(brdf.symmetry(), value)
}

#[test]
fn the_unit_of_the_values_changes_the_energy_and_nothing_else() {
    // Enough effective samples, too few, and a lobe that no sample is in.
    for text in ["alpha = 0.3", "alpha = 0.01", "alpha = 0.001"] {
        let brdf = model("ggx", text);
        for by in estimators() {
            let want = estimate(&times(&*brdf, 1.0), 0.7, &*by, 3);
            let is_resolved = text.ends_with("0.3") || !is_random(&*by);
            assert_eq!(want.unresolved.is_none(), is_resolved, "{text}");
            // A power of two changes no digit, and so no bit of the result.
            for factor in [f64::powi(2.0, 664), f64::powi(2.0, -664)] {
                let got = estimate(&times(&*brdf, factor), 0.7, &*by, 3);
                let what = format!("{text} times {factor:e} by {}", by.label());
                for c in Component::ALL {
                    let unit = if c == Component::ENERGY { factor } else { 1.0 };
                    let [got, want] = [&got, &want].map(|s| s.moments.get(c).unwrap());
                    let scaled = [want.value * unit, want.uncertainty * unit];
                    assert_eq!([got.value, got.uncertainty], scaled, "{what}: {c}");
                }
                assert_eq!(got.unresolved, want.unresolved, "{what}");
                assert_eq!(got.evaluations, want.evaluations, "{what}");
            }
        }
    }
}

#[test]
fn black_has_no_energy_and_no_shape() {
    let black = model("lambert", "albedo = 0.0");
    for (by, theta_o) in product(&estimators(), [0.0, 0.7, 1.57]) {
        let got = estimate(&*black, theta_o, &**by, 1);
        let energy = got.moments.get(Component::ENERGY).unwrap();
        assert_eq!((energy.value, energy.uncertainty), (0.0, 0.0));
        for c in Component::ALL.into_iter().skip(1) {
            assert_eq!(got.moments.get(c), None, "{}: {c}", by.label());
        }
        assert_eq!(got.unresolved, None, "{}", by.label());
        assert_eq!((got.missing_share, got.clamped_share), (0.0, 0.0));
    }
}

/// ∫ (θ − c)^n dθ over [−π/2, π/2].
fn flat(c: f64, n: usize) -> f64 {
    let power = n as i32 + 1;
    ((FRAC_PI_2 - c).powi(power) - (-FRAC_PI_2 - c).powi(power)) / f64::from(power)
}

#[test]
fn a_lobe_a_million_million_times_its_base_keeps_both() {
    // The first holds as much energy as the base; the second has the base in its higher moments;
    // the third hides it.
    for (width, theta_o) in product([[1e-6, 1e-6], [1e-4, 1e-3], [0.1, 0.02]], [0.0, 0.7, 1.5]) {
        let f = move |[theta, phi]: [f64; 2]| {
            let (x, y) = ((theta + theta_o) / width[0], phi / width[1]);
            Some(1.0 + 1e12 * (-0.5 * (x * x + y * y)).exp())
        };
        let [a, b] = ends(-theta_o, width[0]);
        let [c, d] = ends(0.0, width[1]);
        let (x, y) = (truncated(a, b), truncated(c, d));
        let unit = |i: usize, n: usize| width[i].powi(n as i32 + 1);
        let raw = |n: usize, m: usize| {
            1e12 * x[n] * unit(0, n) * y[m] * unit(1, m) + flat(-theta_o, n) * flat(0.0, m)
        };
        let want = from_raw(raw, [-theta_o, 0.0]);
        for tolerance in [1e-3, 1e-6] {
            let got = estimate(&planar(f), theta_o, &resolving(tolerance), 1);
            let what = format!("{width:?} at {theta_o} to {tolerance:e}");
            assert_within(&what, &got, &want, 1e-12);
            assert_eq!(got.unresolved, None, "{what}");
        }
    }
}

/// A table in sr⁻¹, the same in every channel; negative: no data.
fn table(interpolation: Interpolation, value: impl Fn([usize; 3]) -> f64) -> Merl {
    let bytes = merl_file(MerlGrid::RECIPROCAL, |c, cell| value(cell) / SCALE[c]);
    let table = Merl::read(bytes.as_slice(), Channels::Luminance).unwrap();
    table.with_interpolation(interpolation)
}

/// A midpoint rule over a rectangle of the square.
struct Dense {
    /// Of the value less what `base` says, times θ^n φ^m, where there are data.
    raw: [[f64; 5]; 5],
    /// rad².
    missing: f64,
    /// Corners of all that is not the base.
    found: Option<[[f64; 2]; 2]>,
}

impl Dense {
    fn of(brdf: &dyn Brdf, theta_o: f64, [lo, hi]: [[f64; 2]; 2], n: usize, base: f64) -> Self {
        let step = [0, 1].map(|a| (hi[a] - lo[a]) / n as f64);
        let omega_o = view_centered(theta_o, 0.0);
        let row = |i: usize| {
            let theta = lo[0] + (i as f64 + 0.5) * step[0];
            let mut sums = [0.0; 5];
            let (mut missing, mut found) = (0.0, None::<[f64; 2]>);
            for j in 0..n {
                let phi = lo[1] + (j as f64 + 0.5) * step[1];
                let pair = DirectionPair::new(view_centered(theta, phi), omega_o);
                let value = brdf.luminance(&pair);
                let Some(value) = value else {
                    missing += step[0] * step[1];
                    continue;
                };
                // The base comes out of a file to an ulp or two.
                if (value - base).abs() <= 1e-12 * base {
                    continue;
                }
                found = Some([found.map_or(phi, |f| f[0]), phi]);
                let mut power = (value - base) * step[0] * step[1];
                for sum in &mut sums {
                    *sum += power;
                    power *= phi;
                }
            }
            (theta, sums, missing, found)
        };
        let rows: Vec<_> = (0..n).into_par_iter().map(row).collect();
        let mut dense = Self {
            raw: [[0.0; 5]; 5],
            missing: 0.0,
            found: None,
        };
        for (theta, sums, missing, found) in rows {
            for (k, row) in dense.raw.iter_mut().enumerate() {
                for (raw, sum) in row.iter_mut().zip(sums) {
                    *raw += sum * theta.powi(k as i32);
                }
            }
            dense.missing += missing;
            if let Some([first, last]) = found {
                let [lo, hi] = dense.found.unwrap_or([[theta, first], [theta, last]]);
                let lo = [lo[0].min(theta), lo[1].min(first)];
                dense.found = Some([lo, [hi[0].max(theta), hi[1].max(last)]]);
            }
        }
        dense
    }
}

const SQUARE: [[f64; 2]; 2] = [[-FRAC_PI_2; 2], [FRAC_PI_2; 2]];

#[test]
fn one_bright_texel_is_found_off_the_mirror_direction() {
    for interpolation in [Interpolation::Trilinear, Interpolation::Nearest] {
        // θ_h of 20° and 40°.
        for texel in [[42, 30, 120], [60, 50, 100]] {
            let value = |cell| if cell == texel { 1000.0 } else { 0.1 };
            let brdf = table(interpolation, value);
            // The view from which the slice runs through the middle of the texel, which is its node.
            let [h, d, phi] = texel.map(|i| i as f64 + 0.5);
            let theta_h = FRAC_PI_2 * (h / 90.0).powi(2);
            let [theta_d, phi_d] = [d, phi].map(f64::to_radians);
            // n·ω_o; ω_o is (−sin θ_d cos φ_d, −sin θ_d sin φ_d, cos θ_d), turned by θ_h from n to t.
            let cos = theta_h.cos() * theta_d.cos() + theta_h.sin() * theta_d.sin() * phi_d.cos();
            let theta_o = cos.acos();
            let coarse = Dense::of(&brdf, theta_o, SQUARE, 1000, 0.1);
            let [lo, hi] = coarse.found.expect("the slice runs through the texel");
            // What the coarse look overlooked is within a step of what it saw.
            let pad = PI / 500.0;
            let around = [lo.map(|x| x - pad), hi.map(|x| x + pad)];
            let dense = Dense::of(&brdf, theta_o, around, 2000, 0.1);
            let raw = |n: usize, m: usize| dense.raw[n][m] + 0.1 * flat(0.0, n) * flat(0.0, m);
            let want = from_raw(raw, [0.0; 2]);
            let got = estimate(&brdf, theta_o, &resolving(1e-3), 1);
            let what = format!("{texel:?} {interpolation:?} seen at {theta_o}");
            // It holds a good part of the energy: missing it would be seen.
            assert!(want[0] > 1.1 * 0.1 * PI * PI, "{what}: {}", want[0]);
            // Of 4e6 cells of the dense sum some 1e4 are on an edge, each off by half of itself in
            // either sense: 2e-5.
            assert_within(&what, &got, &want, 5e-5);
            assert_eq!(got.unresolved, None, "{what}");
        }
    }
}

#[test]
fn what_has_no_data_is_left_out() {
    for interpolation in [Interpolation::Trilinear, Interpolation::Nearest] {
        let brdf = table(interpolation, |[h, d, phi]| match (h, d, phi) {
            (25..60, 20..45, 30..110) => -1.0,
            _ => 0.2 + 5.0 / (4 + h) as f64,
        });
        for theta_o in [0.5, 1.1] {
            let dense = Dense::of(&brdf, theta_o, SQUARE, 2000, 0.0);
            let want = from_raw(|n, m| dense.raw[n][m], [0.0; 2]);
            let share = dense.missing / (PI * PI);
            assert!(share > 0.02, "{share}");
            // The edge of the hole is a step: 1e-4 would cost more values than are allowed.
            let mut all = estimators();
            all[2] = Box::new(resolving(1e-3));
            for by in &all {
                let got = estimate(&brdf, theta_o, &**by, 1);
                let what = format!("{interpolation:?} at {theta_o} by {}", by.label());
                assert_eq!(got.unresolved, None, "{what}");
                // Independent points count the share as coins do.
                let coins = (share * (1.0 - share) / 1e5).sqrt();
                let (sigmas, allowed) = match by.label().split('-').next().unwrap() {
                    "monte" => (6.0, 6.0 * coins),
                    "sobol" => (6.0, 1e-3),
                    _ => (1.0, 1e-3),
                };
                near(got.missing_share, share, allowed, &what);
                for c in Component::ALL {
                    let e = got.moments.get(c).unwrap();
                    let error = (e.value - want[c.index()]).abs();
                    // The edge of the hole runs through some 1e4 cells of the dense sum.
                    let allowed = sigmas * e.uncertainty + 2e-5 * scale(&got.moments, c);
                    assert!(
                        error <= allowed,
                        "{what}: {c} off by {error:e} ± {allowed:e}"
                    );
                }
            }
        }
    }
}
