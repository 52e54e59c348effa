//! What is left of a schedule when some of it was read.

use super::FORMATS;
use super::common::{mirrored, planned, random_pairs, symmetries, turned};
use glam::DVec3;
use gonio::geometry::{Direction, DirectionPair, distance};
use gonio::parametrization;
use gonio::sampling::Random;
use gonio::schedule::{Assume, Sequence, read_schedule, unvisited, write_schedule};

const TOLERANCE: f64 = 1e-3;

#[test]
fn a_reading_counts_for_the_pose_it_is_of() {
    let random = Random::new(9);
    for symmetry in symmetries() {
        for (name, kind) in [("half-difference", "grid"), ("spherical", "sobol")] {
            let form = parametrization::find(name).unwrap().form(symmetry);
            let schedule = planned(&form, kind, 150, 1);
            // Every third pose is read, a little off and as any of its images.
            let mut read = Vec::new();
            for (i, pose) in schedule.poses.iter().enumerate().step_by(3) {
                let [a, b, c, d]: [f64; 4] = random.point(i as u64);
                let aside = |d: Direction, x: f64| {
                    let moved = d.vector() + 0.3 * TOLERANCE * DVec3::new(x, 1.0 - x, 0.0);
                    Direction::from_unit(moved.normalize())
                };
                let both = (aside(pose.pair.omega_i, a), aside(pose.pair.omega_o, b));
                let mut pair = DirectionPair::new(both.0, both.1);
                if symmetry.reciprocal && c > 0.5 {
                    pair = pair.swapped();
                }
                if symmetry.bilateral && d > 0.5 {
                    pair = mirrored(&pair);
                }
                if symmetry.isotropic {
                    pair = turned(&pair, 7.0 * a);
                }
                read.push(pair);
            }
            let nearest = |pair: &DirectionPair| {
                let poses = schedule.poses.iter();
                let all = poses.map(|pose| distance(&pose.pair, pair, symmetry));
                all.fold(f64::INFINITY, f64::min)
            };
            // Readings of other places count for none.
            let own = read.len();
            let others = random_pairs(4).take(50);
            read.extend(others.filter(|p| nearest(p) > 2.0 * TOLERANCE));
            let left = unvisited(&schedule, &read, TOLERANCE);
            let numbers = 0..schedule.poses.len() as u32;
            let expected: Vec<u32> = numbers.filter(|i| i % 3 > 0).collect();
            assert_eq!(left.poses, expected, "{name} {symmetry:?}");
            assert_eq!(left.elsewhere, read.len() - own);
            // What is left is a schedule, under the same numbers.
            for format in FORMATS {
                let mut bytes = Vec::new();
                let rows = Sequence::Order(&left.poses);
                write_schedule(&schedule, rows, format, &mut bytes).unwrap();
                let text = String::from_utf8(bytes).unwrap();
                let back = read_schedule(&text, "s", &Assume::default()).unwrap();
                assert_eq!(back.order.len(), expected.len());
                for (number, &pose) in back.order.iter().zip(&expected) {
                    let back = &back.schedule.poses[*number as usize].pair;
                    assert!(super::chord(back, &schedule.poses[pose as usize].pair) < 1e-12);
                    if schedule.lattice.is_some() {
                        assert_eq!(*number, pose);
                    }
                }
            }
        }
    }
    // Of two poses within reach the nearer one is visited.
    let form = crate::common::form("spherical", symmetries()[0]);
    let mut schedule = (*planned(&form, "sobol", 2, 1)).clone();
    let at = |theta: f64| DirectionPair::from_spherical(0.5, 0.0, theta, 0.0);
    for (pose, theta) in schedule.poses.iter_mut().zip([0.7, 0.7004]) {
        pose.pair = at(theta);
    }
    let left = |thetas: &[f64]| {
        let read: Vec<_> = thetas.iter().copied().map(at).collect();
        unvisited(&schedule, &read, TOLERANCE)
    };
    assert_eq!(left(&[0.7003]).poses, [0]);
    assert!(left(&[0.7001, 0.7003]).poses.is_empty());
    assert_eq!(left(&[0.7015]).elsewhere, 1);
}
