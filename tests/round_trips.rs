//! Pair → coordinates → pair, for every parametrization, warp and symmetry.
#![cfg(feature = "experiments")]

mod common;

use common::{edge_pairs, polar, random_pair, symmetries, warps};
use gonio::geometry::{Direction, DirectionPair, Symmetry, distance};
use gonio::parametrization::{self, AxisKind, Parametrization, WarpSpec};
use gonio::sampling::Random;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// The error a round trip may have.
fn allowed(p: &dyn Parametrization, pair: &DirectionPair) -> f64 {
    let lowest = pair.omega_i.cos_theta().min(pair.omega_o.cos_theta());
    let [high, anywhere] = p.facts().round_trip;
    if lowest > 1e-3 { high } else { anywhere }
}

/// Round-trip error, checking ranges and canonical form on the way.
fn round_trip(p: &dyn Parametrization, pair: &DirectionPair, what: &str) -> f64 {
    let c = p.forward(pair);
    for (axis, c) in p.axes().iter().zip(c) {
        // Azimuths may round past an end, which names the same place; past the end of a radial
        // axis there is nothing.
        let slack = match axis.kind {
            AxisKind::Radial | AxisKind::Straight => 0.0,
            AxisKind::Periodic | AxisKind::Mirrored => 1e-15 * axis.range[1],
        };
        assert!(
            c >= axis.range[0] - slack && c <= axis.range[1] + slack,
            "{} {}: {c} outside {:?} for {what}",
            p.name(),
            axis.symbol,
            axis.range
        );
    }
    let Some(back) = p.inverse(&c) else {
        panic!("{} has no inverse at {c:?} for {what}", p.name());
    };
    let error = distance(pair, &back, p.symmetry());
    assert!(
        !error.is_nan(),
        "{} gives NaN at {c:?} for {what}",
        p.name()
    );
    error
}

#[test]
fn edge_pairs_come_back_under_every_symmetry() {
    for entry in parametrization::all() {
        let mut worst = 0.0f64;
        for symmetry in symmetries() {
            let p = entry.form(symmetry);
            for (name, pair) in edge_pairs() {
                let error = round_trip(&*p, &pair, &name);
                let allowed = allowed(&*p, &pair);
                assert!(
                    error <= allowed,
                    "{} {symmetry:?} {name}: {error:e}",
                    entry.kind
                );
                worst = worst.max(error);
            }
        }
        println!("{:16} edge table: worst {worst:.1e} rad", entry.kind);
    }
}

#[test]
fn random_pairs_come_back_under_every_symmetry_and_warp() {
    let random = Random::new(2);
    for (p, warp) in forms(&symmetries()) {
        for i in 0..2_000 {
            let pair = random_pair(&random, i);
            let error = round_trip(&*p, &pair, "random");
            // A warp rounds once more: a few ulp of the warped coordinate, times dx/du ≤ 2 x_max.
            let allowed = 4.0 * allowed(&*p, &pair);
            assert!(
                error <= allowed,
                "{} {warp:?} {:?} {pair:?}: {error:e}",
                p.name(),
                p.symmetry()
            );
        }
    }
}

/// One direction on the horizon and the other just above it, both on the same side: the back vector is upright and as
/// long as the half vector is high, so that rounding alone decides whether both are above the horizon. A rounding of
/// the coordinates, which moves h_z² by 2⁻⁵², moves the pair by that over the height; no root of it may be left.
#[test]
fn upright_back_vectors_at_the_horizon_keep_their_digits() {
    let random = Random::new(6);
    for name in ["hybrid", "stark"] {
        let entry = parametrization::find(name).unwrap();
        for symmetry in [Symmetry::NONE, Symmetry::FULL] {
            let p = entry.form(symmetry);
            for height in [1e-6, 1e-5, 1e-4, 1e-3] {
                for i in 0..1_000 {
                    let [azimuth, low, ..]: [f64; 4] = random.point(i);
                    let phi = TAU * azimuth;
                    let omega_i = Direction::from_spherical(FRAC_PI_2 - 1e-12 * low, phi);
                    let omega_o = Direction::from_spherical(FRAC_PI_2 - height, phi);
                    let pair = DirectionPair::new(omega_i, omega_o);
                    let error = round_trip(&*p, &pair, "upright");
                    let allowed = 16.0 * f64::EPSILON / height;
                    assert!(error <= allowed, "{name} {pair:?}: {error:e} > {allowed:e}");
                }
            }
        }
    }
}

/// Directions just above the horizon, nearly opposite: h vanishes, and lengths that are 1 on paper
/// may round to more.
#[test]
fn opposed_grazing_pairs_come_back() {
    let random = Random::new(5);
    let forms = forms(&[Symmetry::NONE, Symmetry::FULL]);
    for (e, separation) in (6..=14).flat_map(|e| (0..=16).map(move |s| (e, s))) {
        for i in 0..100 {
            let u: [f64; 4] = random.point(i);
            let epsilon = 10f64.powi(-e);
            let [a, b] = [u[0], u[1]].map(|u| FRAC_PI_2 - epsilon * (0.5 + u));
            // From opposite to at right angles, a fifth of a decade to a decade apart.
            let turn = FRAC_PI_2 * 10f64.powi(-separation) * (0.8 + 0.2 * u[2]);
            let phi = TAU * u[3];
            let pair = DirectionPair::from_spherical(a, phi, b, phi + PI - turn);
            for (p, warp) in &forms {
                let error = round_trip(&**p, &pair, &format!("{epsilon:e} {turn:e} {warp:?}"));
                // A warp rounds once more.
                let allowed = allowed(&**p, &pair) * if warp.is_some() { 4.0 } else { 1.0 };
                assert!(
                    error <= allowed,
                    "{} {warp:?} {:?} {epsilon:e} {turn:e}: {error:e}",
                    p.name(),
                    p.symmetry()
                );
            }
        }
    }
}

/// Every parametrization under the symmetries, plain and with every warp an axis can have.
fn forms(symmetries: &[Symmetry]) -> Vec<(Arc<dyn Parametrization>, Option<WarpSpec>)> {
    let mut forms = Vec::new();
    for entry in parametrization::all() {
        for &symmetry in symmetries {
            forms.push((entry.form(symmetry), None));
            for warp in warps() {
                for axis in entry.axes(symmetry) {
                    let warps = BTreeMap::from([(axis.symbol.to_owned(), warp)]);
                    if let Ok(p) = entry.warped(symmetry, &warps) {
                        forms.push((p, Some(warp)));
                    }
                }
            }
        }
    }
    forms
}

/// Bits of what is there: NaN is equal to itself, and −0 is not 0.
fn bits<const N: usize>(numbers: [f64; N]) -> [u64; N] {
    numbers.map(f64::to_bits)
}

#[test]
fn batches_of_any_length_are_their_pairs_to_the_bit() {
    let mut pairs: Vec<_> = edge_pairs().into_iter().map(|(_, pair)| pair).collect();
    pairs.extend((0..1000).map(|i| random_pair(&Random::new(3), i)));
    let directions = |pair: DirectionPair| {
        let [i, o] = [pair.omega_i, pair.omega_o].map(|d| bits(d.vector().to_array()));
        [i, o]
    };
    for (p, _) in forms(&symmetries()) {
        for length in [1, 7, 8, 63, 64, 65, 500] {
            for pairs in pairs.chunks(length) {
                let mut coords = vec![[f64::NAN; 4]; pairs.len()];
                p.forward_batch(pairs, &mut coords);
                for (pair, coords) in pairs.iter().zip(&coords) {
                    assert_eq!(
                        bits(p.forward(pair)),
                        bits(*coords),
                        "{} {pair:?}",
                        p.name()
                    );
                }
                // Beyond the ends of axes, beyond any turn, and nowhere.
                for (k, c) in coords.iter_mut().enumerate() {
                    match k % 16 {
                        5 => c[2] += 1e9,
                        7 => c[0] = f64::NAN,
                        9 => c[1] *= 1.5,
                        11 => c[2] = f64::INFINITY,
                        _ => {}
                    }
                }
                let mut back = vec![None; coords.len()];
                p.inverse_batch(&coords, &mut back);
                for (coords, back) in coords.iter().zip(back) {
                    let one = p.inverse(coords).map(directions);
                    assert_eq!(one, back.map(directions), "{} {coords:?}", p.name());
                }
            }
        }
    }
}

#[test]
fn symmetric_pairs_share_their_coordinates() {
    let random = Random::new(3);
    for (p, _) in forms(&symmetries()) {
        for i in 0..500 {
            let pair = random_pair(&random, i);
            let c = p.forward(&pair);
            for image in images_of(&pair, p.symmetry(), i) {
                let d = p.forward(&image);
                for (axis, (c, d)) in p.axes().iter().zip(c.iter().zip(d)) {
                    let gap = (c - d).abs();
                    let gap = match axis.kind {
                        AxisKind::Periodic => gap.min(axis.length() - gap),
                        _ => gap,
                    };
                    // Azimuths amplify rounding by 1/sin of a radial coordinate.
                    assert!(
                        gap < 1e-6,
                        "{} {:?} {}: {c} {d}",
                        p.name(),
                        p.symmetry(),
                        axis.symbol
                    );
                }
            }
        }
    }
}

/// Pairs a symmetry calls equal to `pair`.
fn images_of(pair: &DirectionPair, symmetry: Symmetry, seed: u64) -> Vec<DirectionPair> {
    let angles = |p: &DirectionPair| {
        [
            p.omega_i.theta(),
            p.omega_i.phi(),
            p.omega_o.theta(),
            p.omega_o.phi(),
        ]
    };
    let mut images = vec![*pair];
    if symmetry.reciprocal {
        images.push(pair.swapped());
    }
    if symmetry.bilateral {
        for i in 0..images.len() {
            let [a, b, c, d] = angles(&images[i]);
            images.push(DirectionPair::from_spherical(a, -b, c, -d));
            images.push(DirectionPair::from_spherical(a, PI - b, c, PI - d));
        }
    }
    if symmetry.isotropic {
        let turn = seed as f64 * 0.7;
        for i in 0..images.len() {
            let [a, b, c, d] = angles(&images[i]);
            images.push(DirectionPair::from_spherical(a, b + turn, c, d + turn));
        }
    }
    images
}

#[test]
fn canonical_coordinates_name_the_same_configuration() {
    // Coordinates through poles and past the ends of azimuths: canonical() brings them into the
    // box, and both name one configuration. Checked on plain charts, whose formulas accept them.
    let random = Random::new(4);
    for entry in parametrization::all() {
        for symmetry in symmetries() {
            let p = entry.form(symmetry);
            for i in 0..2_000 {
                let u: [f64; 4] = random.point(i);
                let mut c = [0.0; 4];
                for (d, axis) in p.axes().iter().enumerate() {
                    c[d] = axis.range[0] + axis.length() * u[d];
                }
                let Some(pair) = p.inverse(&c) else { continue };
                for (d, axis) in p.axes().iter().enumerate() {
                    let mut moved = c;
                    match axis.kind {
                        AxisKind::Periodic => moved[d] += axis.length(),
                        AxisKind::Mirrored => moved[d] = 2.0 * axis.range[0] - moved[d],
                        AxisKind::Radial | AxisKind::Straight => continue,
                    }
                    let Some(home) = p.canonical(&moved) else {
                        panic!(
                            "{} {symmetry:?}: {moved:?} has no representative",
                            entry.kind
                        )
                    };
                    let (there, back) = (p.inverse(&moved), p.inverse(&home));
                    assert_eq!(there.is_some(), back.is_some(), "{} {moved:?}", entry.kind);
                    let (Some(there), Some(back)) = (there, back) else {
                        continue;
                    };
                    let error = distance(&there, &back, symmetry);
                    assert!(
                        error < 1e-6,
                        "{} {symmetry:?} {moved:?} {home:?}: {error}",
                        entry.kind
                    );
                }
                let home = p.canonical(&c).expect("inside the box");
                let back = p.inverse(&home).expect("the representative is physical");
                let error = distance(&pair, &back, symmetry);
                assert!(
                    error < 1e-6,
                    "{} {symmetry:?} {c:?} {home:?}: {error}",
                    entry.kind
                );
                let again = p.canonical(&home).expect("inside the box");
                for d in 0..4 {
                    assert!((again[d] - home[d]).abs() < 1e-12, "{} {c:?}", entry.kind);
                }
            }
        }
    }
}

#[test]
fn both_mirrors_fold_a_pole() {
    // Where the first radial coordinate vanishes, no first azimuth tells the mirrors apart.
    for entry in polar() {
        for reciprocal in [false, true] {
            let symmetry = Symmetry {
                reciprocal,
                ..Symmetry::ORTHOTROPIC
            };
            let p = entry.form(symmetry);
            for i in 1..10 {
                let a = f64::from(i) * 0.15;
                let at = |azimuth| p.canonical(&[0.0, 0.0, 0.3, azimuth]).unwrap();
                for image in [-a, PI - a, a - PI] {
                    for (c, d) in at(a).into_iter().zip(at(image)) {
                        assert!((c - d).abs() < 1e-15, "{} {reciprocal} {image}", entry.kind);
                    }
                }
                // At the second pole its own azimuth means nothing.
                let second = |azimuth| p.canonical(&[0.3, azimuth, 0.0, 1.0]).unwrap();
                for (c, d) in second(a).into_iter().zip(second(PI - a)) {
                    assert!((c - d).abs() < 1e-15, "{} {reciprocal}", entry.kind);
                }
                let folded = at(a);
                let error = distance(
                    &p.inverse(&[0.0, 0.0, 0.3, a]).unwrap(),
                    &p.inverse(&folded).unwrap(),
                    symmetry,
                );
                assert!(error < 1e-15, "{} {error:e}", entry.kind);
            }
        }
    }
}

#[test]
fn through_the_pole_is_the_other_side() {
    // Continuity: a small step through r = 0 is a small step on the hemisphere.
    let random = Random::new(5);
    for (p, warp) in forms(&symmetries()) {
        for i in 0..500 {
            let u: [f64; 4] = random.point(i);
            for (d, axis) in p.axes().iter().enumerate() {
                if axis.kind != AxisKind::Radial {
                    continue;
                }
                let mut c = [0.0; 4];
                for (e, a) in p.axes().iter().enumerate() {
                    c[e] = a.range[0] + a.length() * (0.1 + 0.4 * u[e]);
                }
                c[d] = 1e-6 * axis.length();
                let mut through = c;
                through[d] = -c[d];
                let Some(pair) = p.inverse(&c) else { continue };
                let home = p.canonical(&through).expect("within reach of the pole");
                let Some(there) = p.inverse(&home) else {
                    continue;
                };
                let gap = distance(&pair, &there, p.symmetry());
                // A warp's step of 1e-6 moves at most as much; a length that is the root of its
                // coordinate moves 1e-3.
                assert!(
                    gap < 5e-3,
                    "{} {warp:?} {:?} {}: {gap}",
                    p.name(),
                    p.symmetry(),
                    axis.symbol
                );
            }
        }
    }
}

#[test]
fn out_of_domain_is_none() {
    for (p, _) in forms(&symmetries()) {
        let axes = p.axes();
        let middle: Vec<f64> = axes.iter().map(|a| a.range[0] + 0.3 * a.length()).collect();
        let at = |d: usize, v: f64| {
            let mut c = [0.0; 4];
            c[..middle.len()].copy_from_slice(&middle);
            c[d] = v;
            c
        };
        for (d, axis) in axes.iter().enumerate() {
            assert!(p.inverse(&at(d, f64::NAN)).is_none(), "{} NaN", p.name());
            if axis.kind == AxisKind::Radial {
                assert!(p.inverse(&at(d, -0.1)).is_none());
                assert!(p.inverse(&at(d, axis.range[1] * 1.001)).is_none());
                assert!(p.inverse(&at(d, f64::INFINITY)).is_none());
                assert!(p.canonical(&at(d, axis.range[1] * 1.001)).is_none());
            }
        }
    }
}

#[test]
fn unphysical_corners_are_none() {
    let p = crate::common::form("half-difference", Symmetry::FULL);
    assert!(p.inverse(&[1.5, 1.5, 0.1, 0.0]).is_none());
    let p = crate::common::form("orthographic", Symmetry::FULL);
    assert!(p.inverse(&[0.9, 0.9, 0.1, 0.0]).is_none());
    let p = crate::common::form("hybrid", Symmetry::FULL);
    assert!(p.inverse(&[0.9, 0.9, 0.1, 0.0]).is_none());
    assert!(p.inverse(&[0.9, 0.4, 0.1, 0.0]).is_none());
}
