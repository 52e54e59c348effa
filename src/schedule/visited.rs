//! Which poses of a schedule have a reading.

use super::Schedule;
use crate::geometry::{DirectionPair, Symmetry, distance, images};

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
    // Images are looked up one by one; the sample still turns.
    let turns = Symmetry {
        isotropic: symmetry.isotropic,
        ..Symmetry::NONE
    };
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
                let off = distance(&schedule.poses[n as usize].pair, &image, turns);
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
