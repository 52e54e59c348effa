//! What leaves along paths is what values integrate to: two ways that share the surface alone, one by where light goes, one by what
//! facets send to the sensor.

use super::cosine_pair;
use gonio::brdf::{CLASSES, Part, SplitBrdf};
use gonio::sampling::Random;
use std::f64::consts::PI;

/// Compares the light of each class along `paths` paths with that of values at `pairs` pairs, within 4 standard errors; these are
/// at most `resolved` of the light, along paths and at pairs.
pub fn assert_paths_bring_what_values_promise(
    brdf: &dyn SplitBrdf,
    [paths, pairs]: [usize; 2],
    resolved: [f64; 2],
) {
    let mut along = [[0.0; 2]; CLASSES];
    // By reciprocity as much goes from steep to grazing as back.
    let mut ways = [[0.0; 2]; 2];
    let add = |[sum, square]: &mut [f64; 2], value: f64| {
        *sum += value;
        *square += value * value;
    };
    for block in 0..16 {
        brdf.paths(block, paths / 16, &mut |path| {
            assert!(path.pair.is_above_horizon() && path.order > 0);
            add(
                &mut along[Part::from_order(path.order).classes().start],
                path.light,
            );
            match [path.pair.omega_i, path.pair.omega_o].map(|o| o.cos_theta() > 0.7) {
                [true, false] => add(&mut ways[0], path.light),
                [false, true] => add(&mut ways[1], path.light),
                _ => {}
            }
        });
    }
    // Both directions as their cosines: density cos cos/π², so the mean of π² f is the integral, and of π f the share.
    let mut values = [[0.0; 2]; CLASSES];
    let random = Random::new(11);
    for i in 0..pairs as u64 {
        let split = brdf.split(&cosine_pair(&random, i));
        for (sums, value) in values.iter_mut().zip(&split.value) {
            add(sums, PI * value[0]);
        }
    }
    let mean = |[sum, square]: [f64; 2], n: usize| {
        let n = n as f64;
        let mean = sum / n;
        (mean, ((square / n - mean * mean) / n).sqrt())
    };
    let [(there, e_there), (back, e_back)] = ways.map(|way| mean(way, paths));
    let bound = 4.0 * e_there.hypot(e_back);
    assert!((there - back).abs() < bound, "{there}, {back} ± {bound}");
    for class in 0..CLASSES {
        let (a, e_a) = mean(along[class], paths);
        let (b, e_b) = mean(values[class], pairs);
        let told = format!("{class}: {a} ± {e_a}, {b} ± {e_b}");
        assert!((a - b).abs() < 4.0 * e_a.hypot(e_b), "{told}");
        assert!(e_a < resolved[0] * a && e_b < resolved[1] * b, "{told}");
    }
}
