//! What each method reproduces exactly: the readings, constants, and the polynomials of its order.

use super::common::{
    ISOTROPIC, Level, at, edge_pairs, levels, near, product, random_pairs, symmetries,
};
use super::symmetric::moved;
use super::{
    errors_on_nodes, form, forms, grid, material, measure, method, missed, sets, smooth_material,
    some_symmetries, value, walk,
};
use gonio::brdf::Brdf;
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::measurement::Measurement;
use gonio::parametrization::Coords;
use gonio::sampling::Random;
use gonio::schedule::Centring;
use std::sync::Arc;

levels! {
    readings_and_symmetries_are_reproduced: "thorough: every method in every coordinates";
}

/// Smooth materials have their readings back, and values that their symmetries say are equal.
fn readings_and_symmetries_are_reproduced(level: Level) {
    let truth = |s| Box::new(smooth_material(s)) as _;
    let symmetries = level.of(some_symmetries(), symmetries());
    let readings = level.of(120, 300);
    walk(
        level,
        &symmetries,
        truth,
        readings,
        |what, method, m, brdf| {
            for (pose, reading, error) in errors_on_nodes(m, brdf) {
                // Measured 4e-12: thin-plate, where a reading and its image beyond the pole nearly touch.
                let allowed = missed(method, m).max(1e-10) * reading;
                assert!(error < allowed, "{what} {:?}: {error:e}", pose.coords);
            }
            let symmetry = brdf.symmetry();
            for (i, pair) in random_pairs(2).take(40).enumerate() {
                let f = value(brdf, &pair);
                let [turned, swapped, mirrored] = moved(&pair, 0.1 * i as f64);
                // The other mirror plane: turned by π, then mirrored.
                let across = moved(&moved(&pair, std::f64::consts::PI)[0], 0.0)[2];
                for (image, declared) in [
                    (turned, symmetry.isotropic),
                    (swapped, symmetry.reciprocal),
                    (mirrored, symmetry.bilateral),
                    (across, symmetry.bilateral && !symmetry.isotropic),
                ] {
                    let g = value(brdf, &image);
                    let equal = (f - g).abs() <= 1e-9 * f.max(1.0);
                    assert!(equal || !declared, "{what} {pair:?} {image:?}: {f} {g}");
                }
            }
        },
    );
}

/// The largest error of a linear-valued reconstruction over coordinates at shares `lo` to `hi` of
/// every axis.
fn error_inside(
    m: &Measurement,
    kind: &str,
    f: impl Fn(&Coords) -> f64,
    [lo, hi]: [f64; 2],
) -> f64 {
    let brdf = method(kind, "values = \"linear\"").reconstruct(m).unwrap();
    let form = &m.schedule.parametrization;
    let random = Random::new(3);
    let mut worst = 0.0f64;
    for i in 0..500 {
        let c = at(&**form, random.point(i).map(|u| lo + (hi - lo) * u));
        let pair = form.inverse(&c).expect("all are physical");
        worst = worst.max((value(&*brdf, &pair) - f(&c)).abs());
    }
    worst
}

/// Readings of a function of the coordinates, all of whose grid nodes are physical.
fn function_of_coordinates(
    symmetry: Symmetry,
    ratio: &[f64],
    budget: usize,
    f: impl Fn(&Coords) -> f64 + Send + Sync,
) -> Measurement {
    let form = form("spherical", symmetry);
    let truth = material(symmetry, |pair| f(&form.forward(pair)));
    let grid = grid(ratio, &vec![Centring::Cell; ratio.len()]);
    measure(&truth, &form, &grid, budget)
}

#[test]
fn multilinear_reproduces_multilinear_functions_of_the_coordinates() {
    let three = |c: &Coords| 5.0 + c[0] - 0.7 * c[1] + 0.3 * c[2] + 0.4 * c[0] * c[1] * c[2];
    let four = |c: &Coords| 9.0 + c[0] - c[1] * c[2] + 0.3 * c[3] + 0.1 * c.iter().product::<f64>();
    type Function = fn(&Coords) -> f64;
    let cases: [(Symmetry, &[f64], Function); 2] = [
        (ISOTROPIC, &[1.0, 1.0, 2.0], three),
        (Symmetry::NONE, &[1.0; 4], four),
    ];
    for (symmetry, ratio, f) in cases {
        let m = function_of_coordinates(symmetry, ratio, 2000, f);
        // Between the outermost nodes, half a cell from the ends. A few ulp of 5, times 8 terms.
        let shape = m.schedule.lattice.as_ref().unwrap().shape();
        let end = 0.5 / *shape.iter().min().unwrap() as f64;
        let error = error_inside(&m, "multilinear", f, [end, 1.0 - end]);
        assert!(error < 1e-13, "{symmetry:?}: {error:e}");
    }
}

#[test]
fn cubic_reproduces_cubics_away_from_the_ends() {
    // What the ends of an axis do fades by 0.27 a node: 0.27^17 = 2e-10 after 0.35 of 50 nodes.
    let cubic = |x: f64| 3.0 + x - 2.0 * x * x + 0.8 * x * x * x;
    let product = move |c: &Coords| cubic(c[0]) * cubic(c[1]);
    let m = function_of_coordinates(ISOTROPIC, &[10.0, 10.0, 1.0], 12_000, product);
    let error = error_inside(&m, "cubic", product, [0.35, 0.65]);
    let quartic = move |c: &Coords| product(c) + c[0].powi(4);
    let m = function_of_coordinates(ISOTROPIC, &[10.0, 10.0, 1.0], 12_000, quartic);
    let larger = error_inside(&m, "cubic", quartic, [0.35, 0.65]);
    // Measured 1e-12, and 6e-8 = 24 h⁴/384 for x⁴.
    assert!(error < 1e-11, "{error:e}");
    assert!(larger > 1e-8, "{larger:e}");
}

#[test]
fn nearest_returns_readings_only() {
    let mut pairs: Vec<_> = edge_pairs().into_iter().map(|(_, p)| p).collect();
    pairs.retain(DirectionPair::is_above_horizon);
    pairs.extend(random_pairs(6).take(300));
    for form in forms(&some_symmetries()) {
        let truth = smooth_material(form.symmetry());
        for set in sets() {
            let m = measure(&truth, &form, &*set, 300);
            let brdf = method("nearest", "").reconstruct(&m).unwrap();
            for pair in &pairs {
                let f = value(&*brdf, pair);
                assert!(m.values.contains(&f), "{} {pair:?}: {f}", form.name());
            }
        }
    }
}

#[test]
fn scattered_methods_work_in_other_coordinates_than_the_schedule() {
    let truth: Arc<dyn Brdf> = Arc::new(smooth_material(Symmetry::FULL));
    for (name, set) in product(["spherical", "half-difference", "hybrid"], &sets()) {
        let m = measure(&*truth, &form(name, Symmetry::FULL), &**set, 4000);
        let warped = "\"hybrid\", warp = { h_bar = \"square-root\", k = \"arcsine\" }";
        let coordinates = [warped, "\"half-difference\"", "\"spherical\""];
        // Mean relative errors, measured at most 9.2e-3, 7.2e-3 and 1.6e-3.
        let kinds = ["nearest", "inverse-distance", "thin-plate"].into_iter();
        let kinds = kinds.zip([0.015, 0.012, 0.003]);
        for (coordinates, (kind, allowed)) in product(coordinates, kinds) {
            let text = format!("coordinates = {{ kind = {coordinates} }}");
            let brdf = method(kind, &text).reconstruct(&m).unwrap();
            let errors = random_pairs(7).take(300).map(|pair| {
                let f = truth.luminance(&pair).unwrap();
                (value(&*brdf, &pair) / f - 1.0).abs()
            });
            let mean = errors.sum::<f64>() / 300.0;
            assert!(mean < allowed, "{kind} of {name} in {coordinates}: {mean}");
            for (pose, reading) in m.schedule.poses.iter().zip(&m.values) {
                let ratio = value(&*brdf, &pose.pair) / reading;
                near(ratio, 1.0, 1e-7, (kind, name, coordinates));
            }
        }
    }
}
