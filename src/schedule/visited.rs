//! Which poses of a schedule have a reading.

use super::Schedule;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use glam::DVec3;

/// Poses of a schedule that have no reading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unvisited {
    /// Their numbers, in the order of the schedule.
    pub poses: Vec<u32>,
    /// Readings of no pose of the schedule.
    pub elsewhere: usize,
}

/// Weight of the sensor's elevation in the sum that poses are sorted by: on a lattice few are equal.
const WEIGHT: f64 = 0.618;

/// The poses without a reading, given the pairs that were read. A reading is of the pose nearest to
/// it under the symmetries of the schedule, if light and sensor are within `tolerance` (rad) of it.
pub fn unvisited(schedule: &Schedule, read: &[DirectionPair], tolerance: f64) -> Unvisited {
    let symmetry = schedule.parametrization.symmetry();
    let key = |pair: &DirectionPair| pair.omega_i.theta() + WEIGHT * pair.omega_o.theta();
    let mut sorted: Vec<(f64, u32)> = (0..)
        .zip(&schedule.poses)
        .map(|(n, pose)| (key(&pose.pair), n))
        .collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let reach = (1.0 + WEIGHT) * tolerance;
    let mut open = vec![true; schedule.poses.len()];
    let mut elsewhere = 0;
    for pair in read {
        let mut nearest = (tolerance, None);
        for image in images(pair, symmetry) {
            let at = key(&image);
            let from = sorted.partition_point(|(k, _)| *k < at - reach);
            for &(k, n) in &sorted[from..] {
                if k > at + reach {
                    break;
                }
                let off = distance(&schedule.poses[n as usize].pair, &image, symmetry.isotropic);
                if off <= nearest.0 {
                    nearest = (off, Some(n));
                }
            }
        }
        match nearest.1 {
            Some(n) => open[n as usize] = false,
            None => elsewhere += 1,
        }
    }
    let poses = (0..).zip(open).filter(|(_, open)| *open);
    Unvisited {
        poses: poses.map(|(n, _)| n).collect(),
        elsewhere,
    }
}

/// The pairs that are the same to a material, but for turns.
fn images(pair: &DirectionPair, symmetry: Symmetry) -> Vec<DirectionPair> {
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
            let seen = |d: Direction| Direction::from_unit(d.vector() * mirror);
            let [light, sensor] = [images[i].omega_i, images[i].omega_o].map(seen);
            images.push(DirectionPair::new(light, sensor));
        }
    }
    images
}

/// The larger chord between the directions of two pairs, nearly the angle in rad; if the sample may be
/// turned, when one of them has its azimuth.
fn distance(a: &DirectionPair, b: &DirectionPair, turns: bool) -> f64 {
    let off = |angle: f64| {
        let turn = glam::DMat3::from_rotation_z(angle);
        let chord = |a: Direction, b: Direction| a.vector().distance(turn * b.vector());
        chord(a.omega_i, b.omega_i).max(chord(a.omega_o, b.omega_o))
    };
    if !turns {
        return off(0.0);
    }
    let by_light = a.omega_i.phi() - b.omega_i.phi();
    let by_sensor = a.omega_o.phi() - b.omega_o.phi();
    off(by_light).min(off(by_sensor))
}
