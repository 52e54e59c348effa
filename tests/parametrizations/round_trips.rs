//! Pair → coordinates → pair, for every parametrization, warp and symmetry.

use super::common::{
    edge_pairs, images, lowest, near, polar, product, random_pairs, symmetries, turned,
};
use super::{at, forms};
use gonio::geometry::{Direction, DirectionPair, Symmetry, distance};
use gonio::parametrization::{self, AxisKind, Parametrization};
use gonio::sampling::Random;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Asserts that a pair comes back from its coordinates within a bound, and that these are in their ranges.
fn assert_comes_back(p: &dyn Parametrization, pair: &DirectionPair, what: &str, allowed: f64) {
    let c = p.forward(pair);
    let form = format_args!("{} {} {:?}", p.name(), p.warp_name(), p.symmetry());
    for (axis, c) in p.axes().iter().zip(c) {
        // Azimuths may round past an end, which names the same place; past the end of a radial
        // axis there is nothing.
        let slack = match axis.kind {
            AxisKind::Radial | AxisKind::Straight => 0.0,
            AxisKind::Periodic | AxisKind::Mirrored => 1e-15 * axis.range[1],
        };
        let inside = c >= axis.range[0] - slack && c <= axis.range[1] + slack;
        assert!(inside, "{form} {}: {c} for {what}", axis.symbol);
    }
    let back = p.inverse(&c);
    let back = back.unwrap_or_else(|| panic!("{form} has no inverse at {c:?} for {what}"));
    let error = distance(pair, &back, p.symmetry());
    assert!(
        error <= allowed,
        "{form} {what} {pair:?}: {error:e} > {allowed:e}"
    );
}

/// The error that a round trip may have. A warp rounds once more: a few ulp of the warped coordinate, times
/// dx/du ≤ 2 x_max.
fn allowed(p: &dyn Parametrization, pair: &DirectionPair) -> f64 {
    let [high, anywhere] = p.facts().round_trip;
    let warp = if p.warp_name() == "none" { 1.0 } else { 4.0 };
    warp * if lowest(pair) > 1e-3 { high } else { anywhere }
}

#[test]
fn edge_and_random_pairs_come_back_under_every_symmetry_and_warp() {
    let random = random_pairs(2).map(|pair| ("random".to_owned(), pair));
    let mut pairs: Vec<_> = random.take(2_000).collect();
    pairs.extend(edge_pairs());
    for (p, (what, pair)) in product(symmetries().into_iter().flat_map(forms), &pairs) {
        assert_comes_back(&*p, pair, what, allowed(&*p, pair));
    }
}

/// One direction on the horizon and the other just above it, both on the same side: the back vector is upright and as
/// long as the half vector is high, so that rounding alone decides whether both are above the horizon. A rounding of
/// the coordinates, which moves h_z² by 2⁻⁵², moves the pair by that over the height; no root of it may be left.
#[test]
fn upright_back_vectors_at_the_horizon_keep_their_digits() {
    let random = Random::new(6);
    let symmetries = [Symmetry::NONE, Symmetry::FULL];
    for (name, symmetry) in product(["hybrid", "stark"], symmetries) {
        let p = crate::common::form(name, symmetry);
        for (height, i) in product([1e-6, 1e-5, 1e-4, 1e-3], 0..1_000) {
            let [azimuth, low, ..]: [f64; 4] = random.point(i);
            let phi = TAU * azimuth;
            let omega_i = Direction::from_spherical(FRAC_PI_2 - 1e-12 * low, phi);
            let omega_o = Direction::from_spherical(FRAC_PI_2 - height, phi);
            let pair = DirectionPair::new(omega_i, omega_o);
            assert_comes_back(&*p, &pair, "upright", 16.0 * f64::EPSILON / height);
        }
    }
}

/// Bits of what is there: NaN is equal to itself, and −0 is not 0.
fn bits<const N: usize>(numbers: [f64; N]) -> [u64; N] {
    numbers.map(f64::to_bits)
}

#[test]
fn batches_of_any_length_are_their_pairs_to_the_bit() {
    let mut pairs: Vec<_> = edge_pairs().into_iter().map(|(_, pair)| pair).collect();
    pairs.extend(random_pairs(3).take(1000));
    let directions = |pair: DirectionPair| {
        let [i, o] = [pair.omega_i, pair.omega_o].map(|d| bits(d.vector().to_array()));
        [i, o]
    };
    for p in symmetries().into_iter().flat_map(forms) {
        for length in [1, 7, 8, 63, 64, 65, 500] {
            for pairs in pairs.chunks(length) {
                let mut coords = vec![[f64::NAN; 4]; pairs.len()];
                p.forward_batch(pairs, &mut coords);
                for (pair, coords) in pairs.iter().zip(&coords) {
                    let one = bits(p.forward(pair));
                    assert_eq!(one, bits(*coords), "{} {pair:?}", p.name());
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
    for p in symmetries().into_iter().flat_map(forms) {
        for (i, pair) in random_pairs(3).take(500).enumerate() {
            let c = p.forward(&pair);
            for image in images_of(&pair, p.symmetry(), 0.7 * i as f64) {
                let d = p.forward(&image);
                for (axis, (c, d)) in p.axes().iter().zip(c.iter().zip(d)) {
                    let gap = (c - d).abs();
                    let gap = match axis.kind {
                        AxisKind::Periodic => gap.min(axis.length() - gap),
                        _ => gap,
                    };
                    // Azimuths amplify rounding by 1/sin of a radial coordinate.
                    near(gap, 0.0, 1e-6, (c, d, p.name(), p.symmetry(), axis.symbol));
                }
            }
        }
    }
}

/// Pairs that a symmetry calls equal to `pair`, with a turn where turns are in it.
fn images_of(pair: &DirectionPair, symmetry: Symmetry, turn: f64) -> Vec<DirectionPair> {
    let mut images = images(pair, symmetry);
    if symmetry.isotropic {
        images.extend(images.clone().iter().map(|p| turned(p, turn)));
    }
    images
}

#[test]
fn canonical_coordinates_name_the_same_configuration() {
    // Coordinates through poles and past the ends of azimuths: canonical() brings them into the
    // box, and both name one configuration. Checked on plain charts, whose formulas accept them.
    let random = Random::new(4);
    for (entry, symmetry) in product(parametrization::all(), symmetries()) {
        let p = entry.form(symmetry);
        for i in 0..2_000 {
            let c = at(&*p, random.point(i));
            let Some(pair) = p.inverse(&c) else { continue };
            for (d, axis) in p.axes().iter().enumerate() {
                let mut moved = c;
                match axis.kind {
                    AxisKind::Periodic => moved[d] += axis.length(),
                    AxisKind::Mirrored => moved[d] = 2.0 * axis.range[0] - moved[d],
                    AxisKind::Radial => {
                        moved[d] = axis.range[1] * 1.001;
                        assert_eq!(p.canonical(&moved), None, "{} {moved:?}", entry.kind);
                        continue;
                    }
                    AxisKind::Straight => continue,
                }
                let what = (entry.kind, symmetry, moved);
                let home = p.canonical(&moved);
                let home = home.unwrap_or_else(|| panic!("{what:?}"));
                let (there, back) = (p.inverse(&moved), p.inverse(&home));
                assert_eq!(there.is_some(), back.is_some(), "{what:?}");
                if let (Some(there), Some(back)) = (there, back) {
                    near(distance(&there, &back, symmetry), 0.0, 1e-6, what);
                }
            }
            let home = p.canonical(&c).expect("inside the box");
            let back = p.inverse(&home).expect("the representative is physical");
            let error = distance(&pair, &back, symmetry);
            near(error, 0.0, 1e-6, (symmetry, c, home, entry.kind));
            let again = p.canonical(&home).expect("inside the box");
            for d in 0..4 {
                assert!((again[d] - home[d]).abs() < 1e-12, "{} {c:?}", entry.kind);
            }
        }
    }
}

#[test]
fn both_mirrors_fold_a_pole() {
    // Where the first radial coordinate is 0 its azimuth is undefined, and both mirrors fold the second one.
    for (entry, reciprocal) in product(polar(), [false, true]) {
        let mut symmetry = Symmetry::ORTHOTROPIC;
        symmetry.reciprocal = reciprocal;
        let p = entry.form(symmetry);
        for i in 1..10 {
            let a = f64::from(i) * 0.15;
            let at = |azimuth| p.canonical(&[0.0, 0.0, 0.3, azimuth]).unwrap();
            for image in [-a, PI - a, a - PI] {
                for (c, d) in at(a).into_iter().zip(at(image)) {
                    near(c, d, 1e-15, (entry.kind, reciprocal, image));
                }
            }
            // At the second pole its own azimuth means nothing.
            let second = |azimuth| p.canonical(&[0.3, azimuth, 0.0, 1.0]).unwrap();
            for (c, d) in second(a).into_iter().zip(second(PI - a)) {
                near(c, d, 1e-15, (entry.kind, reciprocal));
            }
            let folded = at(a);
            let [a, b] = [[0.0, 0.0, 0.3, a], folded].map(|c| p.inverse(&c).unwrap());
            near(distance(&a, &b, symmetry), 0.0, 1e-15, entry.kind);
        }
    }
}

#[test]
fn through_the_pole_is_the_other_side() {
    // Continuity: a small step through r = 0 is a small step on the hemisphere.
    let random = Random::new(5);
    for (p, i) in product(symmetries().into_iter().flat_map(forms), 0..500) {
        let u: [f64; 4] = random.point(i);
        for (d, axis) in p.axes().iter().enumerate() {
            if axis.kind != AxisKind::Radial {
                continue;
            }
            let mut c = at(&*p, u.map(|u| 0.1 + 0.4 * u));
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
            let what = (p.name(), p.warp_name(), p.symmetry(), axis.symbol);
            near(gap, 0.0, 5e-3, what);
        }
    }
}
