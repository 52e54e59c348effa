//! Forward and inverse kinematics of every class.

use super::{distance, machines, specs, turned_onto};
use glam::DVec3;
use gonio::geometry::{Direction, DirectionPair};
use gonio::instrument::Machine;
use gonio::sampling::{Random, cosine_hemisphere};
use gonio::schedule::{MAX_AXES, Positions, Unreachable};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

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

/// The worst error over every solution of the class; they are at least four.
fn worst(machine: &Machine, pair: &DirectionPair) -> f64 {
    let mut worst: f64 = 0.0;
    for free in [false, true] {
        let mut solutions = 0;
        machine.class().inverse(pair, free, &mut |positions| {
            solutions += 1;
            worst = worst.max(error(machine, pair, free, &positions));
            for p in positions {
                assert!(p > -PI && p <= PI, "{positions:?}");
            }
        });
        assert_eq!(solutions, 4);
    }
    worst
}

fn random_pair(random: &Random, i: u64) -> DirectionPair {
    let u: [f64; 4] = random.point(i);
    let end = |a, b| cosine_hemisphere([a, b]);
    DirectionPair::new(end(u[0], u[1]), end(u[2], u[3]))
}

/// Poses where a formula could divide by nothing.
fn degenerate() -> Vec<DirectionPair> {
    let mut pairs = vec![];
    let grazing = 89.9999_f64.to_radians();
    for phi in [0.0, 0.3, FRAC_PI_2, 2.0, PI, -1.0] {
        // Both at the normal; one at the normal; both at grazing, opposed, on each other, across.
        for (ti, to) in [
            (0.0, 0.0),
            (0.0, 0.7),
            (0.7, 0.0),
            (0.0, grazing),
            (grazing, 0.0),
        ] {
            pairs.push(DirectionPair::from_spherical(ti, phi, to, 1.1));
        }
        for theta in [grazing, FRAC_PI_2] {
            for across in [0.0, FRAC_PI_2, PI, 3.0] {
                pairs.push(DirectionPair::from_spherical(
                    theta,
                    phi,
                    theta,
                    phi + across,
                ));
            }
        }
        for e in 0..=16 {
            let d = 10_f64.powi(-e);
            for theta in [0.0, d, 1e-3, 0.4, 1.2] {
                let mirror = DirectionPair::from_spherical(theta, phi, theta, phi + PI);
                pairs.push(mirror);
                // Retro in the plane and across it, and near the mirror.
                pairs.push(DirectionPair::from_spherical(
                    theta,
                    phi,
                    theta - 0.2 * d,
                    phi,
                ));
                pairs.push(DirectionPair::from_spherical(theta, phi, theta, phi + d));
                pairs.push(DirectionPair::from_spherical(
                    theta,
                    phi,
                    theta + 0.2 * d,
                    phi + PI - d,
                ));
            }
            // Light or sensor nearly at the normal, nearly opposed at grazing.
            pairs.push(DirectionPair::from_spherical(d, phi, 0.9, 0.1));
            pairs.push(DirectionPair::from_spherical(0.9, phi, d, 0.1));
            pairs.push(DirectionPair::from_spherical(
                FRAC_PI_2,
                phi,
                FRAC_PI_2 - d,
                phi + PI,
            ));
        }
    }
    // Directions that differ by rounding only, across and along: the back vector has none.
    for i in 0..100 {
        let omega = random_pair(&Random::new(10), i).omega_i;
        let longer = Direction::from_unit(omega.vector() * (1.0 + f64::EPSILON));
        let beside = omega.vector() + f64::EPSILON * DVec3::new(1.0, -1.0, 0.5);
        for other in [omega, longer, Direction::from_unit(beside)] {
            pairs.push(DirectionPair::new(omega, other));
            pairs.push(DirectionPair::new(other, omega));
        }
    }
    pairs
}

#[test]
fn every_solution_makes_the_pair() {
    for machine in machines() {
        let machine = machine.without_limits();
        let random = Random::new(11);
        let mut largest: f64 = 0.0;
        for i in 0..100_000 {
            let pair = random_pair(&random, i);
            largest = largest.max(worst(&machine, &pair));
        }
        let name = machine.class().name;
        println!("{name}: worst error of random pairs {largest:.1e} rad");
        assert!(largest < EXACT, "{name}: {largest:e}");
    }
}

#[test]
fn degenerate_pairs_are_made_as_well() {
    let pairs = degenerate();
    for machine in machines() {
        let machine = machine.without_limits();
        let name = machine.class().name;
        let mut largest: f64 = 0.0;
        for pair in &pairs {
            let error = worst(&machine, pair);
            assert!(error < EXACT, "{name}: {error:e} for {pair:?}");
            largest = largest.max(error);
            // Without limits the preferred solution always, whatever the range of an axis.
            for free in [false, true] {
                let mut first = None;
                machine.class().inverse(pair, free, &mut |p| {
                    first.get_or_insert(p);
                });
                assert_eq!(machine.place(pair, free).ok(), first);
            }
        }
        println!(
            "{name}: worst of {} degenerate pairs {largest:.1e} rad",
            pairs.len()
        );
    }
}

#[test]
fn places_within_limits_make_the_pair() {
    for (machine, spec) in machines().iter().zip(specs()) {
        let name = machine.class().name;
        let random = Random::new(12);
        let (mut reached, mut i, mut largest) = (0, 0, 0.0_f64);
        while reached < 100_000 {
            let pair = random_pair(&random, i);
            i += 1;
            let free = i % 2 == 0;
            let Ok(positions) = machine.place(&pair, free) else {
                continue;
            };
            reached += 1;
            largest = largest.max(error(machine, &pair, free, &positions));
            for (j, p) in positions.iter().enumerate() {
                match spec.axis.get(j) {
                    Some(axis) => assert!(
                        *p >= axis.min_deg.to_radians() && *p <= axis.max_deg.to_radians(),
                        "{name}: {positions:?}"
                    ),
                    None => assert_eq!(*p, 0.0),
                }
            }
            let limits = &spec.limits;
            assert!(pair.omega_i.theta().to_degrees() <= limits.theta_i_max_deg);
            assert!(pair.omega_o.theta().to_degrees() <= limits.theta_o_max_deg);
            assert!(pair.separation().to_degrees() >= limits.separation_min_deg);
        }
        println!("{name}: {reached} of {i} pairs reached, worst error {largest:.1e} rad");
        assert!(largest < EXACT, "{name}: {largest:e}");
    }
}

#[test]
fn positions_that_come_from_a_pair_go_back_to_it() {
    for machine in machines() {
        let machine = machine.without_limits();
        let random = Random::new(13);
        let axes = machine.axes().len();
        for i in 0..20_000 {
            let u: [f64; MAX_AXES] = random.point(i);
            let mut positions = u.map(|u| TAU * (u - 0.5));
            positions[axes..].fill(0.0);
            // Any positions: below the horizon too, where the chain is the same.
            let pair = machine.forward(&positions);
            let found = machine.place(&pair, false).unwrap();
            let error = error(&machine, &pair, false, &found);
            assert!(
                error < EXACT,
                "{}: {error:e} at {positions:?}",
                machine.class().name
            );
        }
    }
}

/// The chain written out for one class, with nothing of the library but its vectors: the test of
/// the forward direction itself.
#[test]
fn the_chain_agrees_with_rotations_by_hand() {
    let sc = |a: f64| a.sin_cos();
    let about_x = |a: f64, [x, y, z]: [f64; 3]| {
        let (s, c) = sc(a);
        [x, c * y - s * z, s * y + c * z]
    };
    let about_y = |a: f64, [x, y, z]: [f64; 3]| {
        let (s, c) = sc(a);
        [c * x + s * z, y, c * z - s * x]
    };
    let about_z = |a: f64, [x, y, z]: [f64; 3]| {
        let (s, c) = sc(a);
        [c * x - s * y, s * x + c * y, z]
    };
    let z = [0.0, 0.0, 1.0];
    let random = Random::new(14);
    for machine in machines() {
        for i in 0..1000 {
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
    let random = Random::new(15);
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
        for i in 0..1000 {
            let pair = random_pair(&random, i);
            machine
                .class()
                .inverse(&pair, true, &mut |p| assert_eq!(p[resting], 0.0));
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
    let random = Random::new(16);
    for i in 0..10_000 {
        let pair = random_pair(&random, i);
        let arm = free.place(&pair, true).unwrap()[0];
        let theta_d = pair.back().length().atan2(pair.half().length());
        // Both are atan2 of the same lengths up to two roundings of numbers below π.
        assert!((arm - 2.0 * theta_d).abs() < 1e-15, "{arm} {theta_d}");
    }
    // An arm that cannot come closer than 20 degrees: theta_d is 10 degrees or more, exactly.
    spec.axis[0].min_deg = 20.0;
    spec.limits.separation_min_deg = 0.0;
    let machine = Machine::new(&spec).unwrap();
    let (mut near, mut far) = (0, 0);
    for i in 0..10_000 {
        let pair = random_pair(&random, i);
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
