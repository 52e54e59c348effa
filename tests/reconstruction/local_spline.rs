//! The local thin-plate spline against the textbook: neighbours by brute force, the full saddle
//! system by LU.

use super::common::{ISOTROPIC, images, product, random_pairs};
use super::{form, grid, material, measure, method, smooth, smooth_material, value};
use gonio::brdf::Brdf;
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::measurement::Measurement;
use gonio::parametrization::{Layout, Parametrization};
use gonio::schedule::{Centring, SampleSet, SobolSet};
use nalgebra::{DMatrix, DVector};

/// Points of the embedding as plain vectors.
type Point = Vec<f64>;

fn distance(a: &Point, b: &Point) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

/// The embedding, in the unfolded coordinates of a pair.
fn embed(unfolded: &dyn Parametrization, pair: &DirectionPair, through_pole: bool) -> Point {
    let c = unfolded.forward(pair);
    let axes = unfolded.axes();
    let side = if through_pole { -1.0 } else { 1.0 };
    if axes.len() == 3 {
        let (u1, u2) = (1.5 * c[0] / axes[0].range[1], c[1] / axes[1].range[1]);
        return vec![side * u1, side * u2 * c[2].cos(), side * u2 * c[2].sin()];
    }
    let (u1, u2) = (1.5 * c[0] / axes[0].range[1], c[2] / axes[2].range[1]);
    // phi_d turns with phi_h.
    let is_nested = unfolded.facts().layout == Layout::Nested;
    let b = c[3] + if is_nested { c[1] } else { 0.0 };
    vec![u1 * c[1].cos(), u1 * c[1].sin(), u2 * b.cos(), u2 * b.sin()]
}

/// Every reading, with its mirror images, and in 3-D each of them beyond the pole too.
fn points(m: &Measurement, unfolded: &dyn Parametrization) -> Vec<(Point, f64)> {
    let symmetry = m.schedule.parametrization.symmetry();
    let mut points = Vec::new();
    for (i, pose) in m.schedule.poses.iter().enumerate() {
        let mut own: Vec<Point> = Vec::new();
        for (image, through_pole) in product(&images(&pose.pair, symmetry), [false, true]) {
            if through_pole && !symmetry.isotropic {
                continue;
            }
            let x = embed(unfolded, image, through_pole);
            // Turning an isotropic sample changes nothing.
            if own.iter().all(|y| distance(&x, y) > 1e-6) {
                own.push(x);
            }
        }
        let y = m.value(i).unwrap()[0];
        points.extend(own.into_iter().map(|x| (x, y)));
    }
    points
}

/// Value at `x` of the thin-plate spline through `data`: the full saddle system.
fn thin_plate(data: &[(Point, f64)], x: &Point) -> f64 {
    let n = data.len();
    let d = x.len();
    let phi = |r: f64| if r > 0.0 { r * r * r.ln() } else { 0.0 };
    // In units of the neighbourhood, which the spline does not depend on.
    let size = data.iter().map(|p| distance(&p.0, x)).fold(0.0, f64::max);
    let place = |(p, _): &(Point, f64)| p.iter().zip(x).map(|(p, x)| (p - x) / size).collect();
    let local: Vec<Point> = data.iter().map(place).collect();
    let linear = |p: &Point, j: usize| if j == 0 { 1.0 } else { p[j - 1] };
    let system = DMatrix::from_fn(n + d + 1, n + d + 1, |i, j| match (i < n, j < n) {
        (true, true) => phi(distance(&local[i], &local[j])),
        (true, false) => linear(&local[i], j - n),
        (false, true) => linear(&local[j], i - n),
        (false, false) => 0.0,
    });
    let y = DVector::from_fn(n + d + 1, |i, _| if i < n { data[i].1 } else { 0.0 });
    let c = system.lu().solve(&y).expect("they span the space");
    let origin = vec![0.0; d];
    let kernel = |i: usize| c[i] * phi(distance(&local[i], &origin));
    (0..n).map(kernel).sum::<f64>() + c[n]
}

#[test]
fn values_are_those_of_the_full_system() {
    for (name, symmetry, budget) in [
        ("half-difference", Symmetry::FULL, 1000),
        ("half-difference", ISOTROPIC, 1000),
        ("hybrid", Symmetry::FULL, 1000),
        ("half-difference", Symmetry::ORTHOTROPIC, 1000),
        ("half-difference", Symmetry::NONE, 3000),
        ("hybrid", Symmetry::ORTHOTROPIC, 1000),
    ] {
        let form = form(name, symmetry);
        let m = measure(&smooth_material(symmetry), &form, &SobolSet {}, budget);
        let spline = method("thin-plate", "values = \"linear\"");
        let brdf = spline.reconstruct(&m).unwrap();
        let isotropic = symmetry.isotropic;
        let unfolded = super::form(name, if isotropic { ISOTROPIC } else { Symmetry::NONE });
        let points = points(&m, &*unfolded);
        let mut worst = 0.0f64;
        for pair in random_pairs(5).take(40) {
            // The representative that the folded form looks at.
            let home = form.inverse(&form.forward(&pair)).unwrap();
            let x = embed(&*unfolded, &home, false);
            let mut near = points.clone();
            near.sort_by(|a, b| distance(&a.0, &x).total_cmp(&distance(&b.0, &x)));
            near.truncate(30);
            let expected = thin_plate(&near, &x);
            worst = worst.max((value(&*brdf, &pair) - expected).abs());
        }
        // Measured 1e-15: the weights are well conditioned even where the system is not.
        assert!(worst < 1e-12, "{name} {symmetry:?}: {worst:e}");
    }
}

#[test]
fn neighbours_in_a_line_or_a_plane_are_enough() {
    let form = form("half-difference", Symmetry::FULL);
    let truth = material(Symmetry::FULL, |pair| smooth(Symmetry::FULL, pair));
    for (ratio, budget) in [
        ([1000.0, 1.0, 1.0], 30),
        ([1.0, 1000.0, 1.0], 30),
        ([1.0, 1.0, 1000.0], 30),
        ([1000.0, 1000.0, 1.0], 900),
        ([1000.0, 1.0, 1000.0], 900),
        ([1.0, 1000.0, 1000.0], 900),
        ([4.0, 4.0, 1.0], 4000),
    ] {
        let grid = grid(&ratio, &[Centring::Cell; 3]);
        let m = measure(&truth, &form, &grid, budget);
        let brdf = method("thin-plate", "").reconstruct(&m).unwrap();
        for (pose, reading) in m.schedule.poses.iter().zip(&m.values) {
            let error = (value(&*brdf, &pose.pair) / reading - 1.0).abs();
            assert!(error < 1e-9, "{ratio:?} {:?}: {error:e}", pose.coords);
        }
        for pair in random_pairs(6).take(500) {
            let f = value(&*brdf, &pair);
            // The readings are in [0.2, 2]; far from all of them a slope may carry on.
            assert!((0.05..8.0).contains(&f), "{ratio:?} {pair:?}: {f}");
        }
    }
}

#[test]
fn few_readings_and_many_neighbours_are_fine() {
    let form = form("half-difference", Symmetry::FULL);
    let truth = smooth_material(Symmetry::FULL);
    for budget in [6, 7, 10, 20] {
        let m = measure(&truth, &form, &SobolSet {} as &dyn SampleSet, budget);
        let spline = method("thin-plate", "neighbours = 256");
        let brdf = spline.reconstruct(&m).unwrap();
        let mean = m.values.iter().sum::<f64>() / m.values.len() as f64;
        let mut errors = [0.0; 2];
        for pair in random_pairs(7).take(300) {
            let f = truth.luminance(&pair).unwrap();
            errors[0] += (value(&*brdf, &pair) / f - 1.0).abs() / 300.0;
            errors[1] += (mean / f - 1.0).abs() / 300.0;
        }
        assert!(errors[0] < errors[1], "{budget}: {errors:?}");
    }
}
