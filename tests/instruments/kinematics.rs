//! Forward and inverse kinematics of every class.

use super::{distance, machines, specs, turned_onto};
use crate::common::{cosine_pairs, edge_pairs, near, product};
use glam::DVec3;
use gonio::geometry::{Direction, DirectionPair};
use gonio::instrument::Machine;
use gonio::sampling::Random;
use gonio::schedule::{MAX_AXES, Positions, Unreachable};
use std::f64::consts::{PI, TAU};

/// Two dozen roundings of numbers up to π make 1e-14; a hundredfold of that is no physical angle.
const EXACT: f64 = 1e-12;

/// How far the pair that the positions make is from the one that was asked for.
fn error(machine: &Machine, pair: &DirectionPair, free: bool, positions: &Positions) -> f64 {
    let made = machine.forward(positions);
    if free || machine.class().isotropic_only {
        distance(&turned_onto(&made, pair), pair)
    } else {
        distance(&made, pair)
    }
}

/// The worst error over the four solutions of the class, the first of which is the place of a machine without limits.
fn worst(machine: &Machine, pair: &DirectionPair) -> f64 {
    let mut worst: f64 = 0.0;
    for free in [false, true] {
        let (mut solutions, mut first) = (0, None);
        (machine.class().inverse)(pair, free, &mut |positions| {
            solutions += 1;
            first.get_or_insert(positions);
            worst = worst.max(error(machine, pair, free, &positions));
            for p in positions {
                assert!(p > -PI && p <= PI, "{positions:?}");
            }
        });
        assert_eq!(solutions, 4);
        assert_eq!(machine.place(pair, free).ok(), first, "{pair:?}");
    }
    worst
}

/// Pairs anywhere, of the edge table, and of directions that differ by rounding only, across and along: the back vector has none.
fn pairs() -> Vec<DirectionPair> {
    let mut pairs: Vec<_> = edge_pairs().into_iter().map(|(_, pair)| pair).collect();
    for DirectionPair { omega_i: omega, .. } in cosine_pairs(10).take(100) {
        let longer = Direction::from_unit(omega.vector() * (1.0 + f64::EPSILON));
        let beside = omega.vector() + f64::EPSILON * DVec3::new(1.0, -1.0, 0.5);
        for other in [omega, longer, Direction::from_unit(beside)] {
            let pair = DirectionPair::new(omega, other);
            pairs.extend([pair, pair.swapped()]);
        }
    }
    pairs.extend(cosine_pairs(11).take(20_000));
    pairs
}

#[test]
fn every_solution_makes_the_pair() {
    let pairs = pairs();
    for machine in machines() {
        let machine = machine.without_limits();
        let (name, axes) = (machine.class().name, machine.axes().len());
        let random = Random::new(13);
        // Any positions: below the horizon too, where the chain is the same.
        let of_positions = (0..20_000).map(|i| {
            let mut positions = random.point(i).map(|u: f64| TAU * (u - 0.5));
            positions[axes..].fill(0.0);
            machine.forward(&positions)
        });
        for pair in pairs.iter().copied().chain(of_positions) {
            near(worst(&machine, &pair), 0.0, EXACT, (name, pair));
        }
    }
}

#[test]
fn places_within_limits_make_the_pair() {
    for (machine, spec) in machines().iter().zip(specs()) {
        let name = machine.class().name;
        let mut largest = 0.0_f64;
        let cases = cosine_pairs(12).zip([false, true].into_iter().cycle());
        let placed = cases.filter_map(|(pair, free)| {
            let positions = machine.place(&pair, free).ok()?;
            Some((pair, free, positions))
        });
        for (pair, free, positions) in placed.take(100_000) {
            largest = largest.max(error(machine, &pair, free, &positions));
            for (j, p) in positions.iter().enumerate() {
                let range = spec
                    .axis
                    .get(j)
                    .map_or([0.0; 2], |a| [a.min_deg, a.max_deg]);
                let [least, most] = range.map(f64::to_radians);
                assert!((least..=most).contains(p), "{name}: {positions:?}");
            }
            let limits = &spec.limits;
            assert!(pair.omega_i.theta().to_degrees() <= limits.theta_i_max_deg);
            assert!(pair.omega_o.theta().to_degrees() <= limits.theta_o_max_deg);
            assert!(pair.separation().to_degrees() >= limits.separation_min_deg);
        }
        assert!(largest < EXACT, "{name}: {largest:e}");
    }
}

/// The chain written out for one class, with nothing of the library but its vectors: the test of
/// the forward direction itself.
#[test]
fn the_chain_agrees_with_rotations_by_hand() {
    let about_x = |a: f64, [x, y, z]: [f64; 3]| {
        let (s, c) = a.sin_cos();
        [x, c * y - s * z, s * y + c * z]
    };
    // By the same rotation of turned coordinates.
    let about_y = |a: f64, [x, y, z]: [f64; 3]| {
        let [y, z, x] = about_x(a, [y, z, x]);
        [x, y, z]
    };
    let about_z = |a: f64, [x, y, z]: [f64; 3]| {
        let [z, x, y] = about_x(a, [z, x, y]);
        [x, y, z]
    };
    let z = [0.0, 0.0, 1.0];
    let random = Random::new(14);
    for (machine, i) in product(&machines(), 0..1000) {
        let u: [f64; MAX_AXES] = random.point(i);
        let q = u.map(|u| TAU * (u - 0.5));
        // Light and sensor in the lab, then back into the sample's frame.
        let (light, sensor) = match machine.class().name {
            "fixed-detector-3-axis" => {
                let back = |v| about_x(-q[2], about_y(-q[1], v));
                (back(about_y(q[0], z)), back(z))
            }
            "fixed-source-4-axis" => {
                let back = |v| about_z(-q[1], about_y(-q[0], v));
                (back(z), back(about_y(q[2], about_x(q[3], z))))
            }
            "dual-arm-turntable" => {
                let back = |v| about_z(-q[0], v);
                let sensor = about_y(q[2], about_x(q[3], z));
                (back(about_y(q[1], z)), back(sensor))
            }
            "robot-sample" => {
                let back = |v| about_z(-q[3], about_x(-q[2], about_y(-q[1], v)));
                (back(z), back(about_y(q[0], z)))
            }
            other => panic!("{other} is not in this test"),
        };
        let made = machine.forward(&q);
        for (found, expected) in [(made.omega_i, light), (made.omega_o, sensor)] {
            for (f, e) in found.vector().to_array().into_iter().zip(expected) {
                assert!((f - e).abs() < 1e-14, "{}", machine.class().name);
            }
        }
    }
}

#[test]
fn at_zero_everything_looks_along_the_normal() {
    for machine in machines() {
        let pair = machine.forward(&[0.0; MAX_AXES]);
        assert_eq!(pair, DirectionPair::from_spherical(0.0, 0.0, 0.0, 0.0));
        let machine = machine.without_limits();
        for free in [false, true] {
            assert_eq!(machine.place(&pair, free), Ok([0.0; MAX_AXES]));
        }
    }
}

#[test]
fn what_turns_the_sample_rests_for_isotropic_materials() {
    for machine in machines() {
        let machine = machine.without_limits();
        let resting = match machine.class().name {
            "fixed-detector-3-axis" => continue,
            "fixed-source-4-axis" => 1,
            "dual-arm-turntable" => 0,
            "robot-sample" => 3,
            other => panic!("{other} is not in this test"),
        };
        let mut moved = 0;
        for pair in cosine_pairs(15).take(1000) {
            let mut rests = |p: Positions| assert_eq!(p[resting], 0.0);
            (machine.class().inverse)(&pair, true, &mut rests);
            let p = machine.place(&pair, false).unwrap();
            moved += usize::from(p[resting].abs() > 0.01);
        }
        assert!(moved > 900, "{}: {moved}", machine.class().name);
    }
}

#[test]
fn the_cornell_arm_stands_at_twice_the_difference_angle() {
    let mut spec = specs().remove(0);
    let free = Machine::new(&spec).unwrap().without_limits();
    assert_eq!(free.class().name, "fixed-detector-3-axis");
    for pair in cosine_pairs(16).take(10_000) {
        let arm = free.place(&pair, true).unwrap()[0];
        let theta_d = pair.back().length().atan2(pair.half().length());
        // Both are atan2 of the same lengths up to two roundings of numbers below π.
        near(arm, 2.0 * theta_d, 1e-15, pair);
    }
    // An arm that cannot come closer than 20 degrees: theta_d is 10 degrees or more, exactly.
    spec.axis[0].min_deg = 20.0;
    spec.limits.separation_min_deg = 0.0;
    let machine = Machine::new(&spec).unwrap();
    let (mut near, mut far) = (0, 0);
    for pair in cosine_pairs(16).take(10_000) {
        let steep = pair.omega_i.theta().max(pair.omega_o.theta());
        if steep.to_degrees() > 86.0 {
            continue;
        }
        let placed = machine.place(&pair, true);
        if pair.separation().to_degrees() < 20.0 {
            near += 1;
            assert_eq!(placed, Err(Unreachable::AxisRange(0)));
        } else {
            far += 1;
            assert!(placed.is_ok(), "{pair:?}: {placed:?}");
        }
    }
    assert!(near > 200 && far > 8000, "{near} {far}");
}
