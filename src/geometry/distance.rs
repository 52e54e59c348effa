//! Pairs that a symmetry calls equal, and how far two configurations are apart.

use super::{DirectionPair, Symmetry, angle_between};
use glam::DVec3;

/// The pairs that are one configuration with this one, but for turns of the sample; itself first.
pub fn images(pair: &DirectionPair, symmetry: Symmetry) -> Vec<DirectionPair> {
    let mut images = vec![*pair];
    if symmetry.reciprocal {
        images.push(pair.swapped());
    }
    let mirrors: &[DVec3] = match (symmetry.bilateral, symmetry.isotropic) {
        (false, _) => &[],
        (true, true) => &[DVec3::new(1.0, -1.0, 1.0)],
        (true, false) => &[
            DVec3::new(1.0, -1.0, 1.0),
            DVec3::new(-1.0, 1.0, 1.0),
            DVec3::new(-1.0, -1.0, 1.0),
        ],
    };
    for i in 0..images.len() {
        for &mirror in mirrors {
            images.push(images[i].map(|v| v * mirror));
        }
    }
    images
}

/// Distance (rad) of two configurations: the larger angle between their directions, the smallest over everything that
/// the symmetry calls equal.
pub fn distance(a: &DirectionPair, b: &DirectionPair, symmetry: Symmetry) -> f64 {
    let plain = |b: &DirectionPair| {
        let [light, sensor] = [(a.omega_i, b.omega_i), (a.omega_o, b.omega_o)]
            .map(|(a, b)| angle_between(a.vector(), b.vector()));
        light.max(sensor)
    };
    let mut least = f64::INFINITY;
    for image in images(b, symmetry) {
        if !symmetry.isotropic {
            least = least.min(plain(&image));
            continue;
        }
        // The sample is turned so that one of the directions, or the half vectors, have the same azimuth.
        for of in [
            |p: &DirectionPair| p.omega_i.vector(),
            |p: &DirectionPair| p.omega_o.vector(),
            |p: &DirectionPair| p.half(),
        ] {
            least = least.min(plain(&turned_to(&image, of(&image), of(a))));
        }
    }
    least
}

/// The pair turned about n so that the azimuth of `from` becomes that of `to`.
fn turned_to(pair: &DirectionPair, from: DVec3, to: DVec3) -> DirectionPair {
    let (f, t) = (from.truncate(), to.truncate());
    let norm = f.length() * t.length();
    if norm == 0.0 {
        return *pair;
    }
    let (c, s) = (f.dot(t) / norm, f.perp_dot(t) / norm);
    let scale = c.hypot(s);
    let (c, s) = (c / scale, s / scale);
    pair.map(|v| DVec3::new(c * v.x - s * v.y, s * v.x + c * v.y, v.z))
}
