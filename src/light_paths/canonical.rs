//! The one pair that stands for all that have the same value.

use crate::geometry::{DirectionPair, Symmetry};
use crate::sampling::{Random, RandomStream};
use glam::DVec3;

/// Steps that cosines and lengths are counted in for a key: far above rounding, far below any difference of poses.
const STEP: f64 = 1_073_741_824.0;

/// Light and sensor of the pair that stands for all of equal value, and a key of it: exchanged, and by the `symmetry` turned
/// about the normal, or mirrored at the planes of the tangent axes. Equal but for rounding gives the same key, but where
/// rounding crosses a step, some ten times in a million.
pub(super) fn canonical(pair: &DirectionPair, symmetry: Symmetry) -> ([DVec3; 2], [i64; 5]) {
    let steps = |x: f64| (x * STEP).round() as i64;
    let mut pair = pair.vectors();
    let order = |v: &DVec3| match symmetry {
        Symmetry {
            isotropic: true, ..
        } => [steps(v.z), 0, 0],
        Symmetry {
            bilateral: true, ..
        } => [steps(v.z), steps(v.x.abs()), steps(v.y.abs())],
        _ => [steps(v.z), steps(v.x), steps(v.y)],
    };
    if order(&pair[0]) > order(&pair[1]) {
        pair.swap(0, 1);
    }
    let [a, b] = pair;
    let pair = if symmetry.isotropic {
        let radius = a.x.hypot(a.y);
        match radius > 0.0 {
            true => {
                let along = (a.x * b.x + a.y * b.y) / radius;
                let across = (a.x * b.y - a.y * b.x).abs() / radius;
                [DVec3::new(radius, 0.0, a.z), DVec3::new(along, across, b.z)]
            }
            false => [a, DVec3::new(b.x.hypot(b.y), 0.0, b.z)],
        }
    } else if symmetry.bilateral {
        // Of each axis only the product of the two is left.
        let turned = |a: f64, b: f64| [a.abs(), b.abs().copysign(a * b)];
        let [x, y] = [turned(a.x, b.x), turned(a.y, b.y)];
        [DVec3::new(x[0], y[0], a.z), DVec3::new(x[1], y[1], b.z)]
    } else {
        pair
    };
    let [a, b] = pair;
    let key = [a.x, a.y, b.x, b.y, b.z].map(steps);
    (pair, key)
}

/// A number of its own for each key, almost surely.
pub(super) fn number(key: &[i64; 5]) -> u64 {
    let mut hasher = blake3::Hasher::new();
    key.iter().for_each(|k| _ = hasher.update(&k.to_le_bytes()));
    let [a, b, c, d, e, f, g, h, ..] = *hasher.finalize().as_bytes();
    u64::from_le_bytes([a, b, c, d, e, f, g, h])
}

/// The numbers of a pair of that key.
pub(super) fn stream(random: &Random, key: &[i64; 5]) -> RandomStream {
    random.stream(number(key))
}
