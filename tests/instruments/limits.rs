//! What machines cannot reach, and why.

use super::{arms, distance, specs, turned_onto};
use crate::common::{cosine_pairs, near, product};
use gonio::geometry::DirectionPair;
use gonio::instrument::{BodySpec, CollisionSpec, InstrumentSpec, Machine};
use gonio::schedule::Unreachable;
use std::f64::consts::TAU;

fn spec(name: &str) -> InstrumentSpec {
    let named = |spec: &InstrumentSpec| spec.name == name;
    specs().into_iter().find(named).unwrap()
}

fn machine(spec: &InstrumentSpec) -> Machine {
    Machine::new(spec).unwrap()
}

fn collision(a: &str, b: &str, angle_min_deg: f64) -> CollisionSpec {
    CollisionSpec {
        between: [a, b].map(str::to_owned),
        angle_min_deg,
    }
}

/// Elevations and azimuths in degrees.
fn pair(angles: [f64; 4]) -> DirectionPair {
    let [ti, pi, to, po] = angles.map(f64::to_radians);
    DirectionPair::from_spherical(ti, pi, to, po)
}

#[test]
fn the_first_reason_is_told() {
    for mut spec in specs() {
        // A range that no pair fits into, and a collision that always is one.
        spec.axis[1].wraps = false;
        [spec.axis[1].min_deg, spec.axis[1].max_deg] = [170.5, 170.6];
        let narrow = machine(&spec);
        for (angles, reason) in [
            ([88.0, 0.0, 88.0, 1.0], Unreachable::LightElevation),
            ([40.0, 0.0, 88.0, 1.0], Unreachable::SensorElevation),
            ([40.0, 0.0, 42.0, 1.0], Unreachable::Occluded),
            ([40.0, 0.0, 50.0, 90.0], Unreachable::AxisRange(1)),
        ] {
            assert_eq!(narrow.place(&pair(angles), true), Err(reason));
        }
    }
}

#[test]
fn limits_are_sharp() {
    // A limit is reached and not passed: a pair on it to rounding is taken, one a billionth of a
    // degree beyond is not. At many azimuths, so that rounding falls on either side.
    for mut spec in specs() {
        // Errors of its centre keep a picture away from the outline of a sphere.
        if let Some(picture) = &mut spec.picture {
            (picture.centre_px, picture.map_px) = (0.0, 0.0);
        }
        let machine = machine(&spec);
        let limits = &spec.limits;
        let (i, o) = (limits.theta_i_max_deg, limits.theta_o_max_deg);
        let s = limits.separation_min_deg;
        let beyond = 1e-9;
        for step in 0..360 {
            let phi = f64::from(step) * 1.017;
            let across = phi + 90.0;
            let light = ([i, phi, 20.0, across], Unreachable::LightElevation);
            let sensor = ([20.0, across, o, phi], Unreachable::SensorElevation);
            let close = ([30.0, phi, 30.0 + s, phi], Unreachable::Occluded);
            let outwards = [[1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
            let cases = [light, sensor, close].into_iter().zip(outwards);
            for ((angles, reason), [di, d_o]) in cases {
                let on = machine.place(&pair(angles), true);
                assert!(on.is_ok(), "{}: {angles:?}: {on:?}", spec.name);
                let [ti, pi, to, po] = angles;
                let past = [ti + beyond * di, pi, to + beyond * d_o, po];
                let past = machine.place(&pair(past), true);
                assert_eq!(past, Err(reason), "{}: {angles:?}", spec.name);
            }
        }
    }
}

#[test]
fn an_axis_on_its_limit_stands_on_it() {
    // The light arm of the turntable machine shows the elevation of the light.
    let mut spec = spec("utia");
    spec.axis[1].max_deg = 40.0;
    spec.axis[1].min_deg = -10.0;
    let utia = machine(&spec);
    for step in 0..360 {
        let phi = f64::from(step) * 1.017;
        for free in [false, true] {
            let on = utia.place(&pair([40.0, phi, 10.0, phi + 180.0]), free);
            let on = on.unwrap_or_else(|e| panic!("{phi}: {e:?}"));
            // On it or a rounding below, never above.
            let limit = 40_f64.to_radians();
            assert!((limit - 1e-15..=limit).contains(&on[1]));
            let past = utia.place(&pair([40.0 + 1e-9, phi, 10.0, phi + 180.0]), free);
            assert_eq!(past, Err(Unreachable::AxisRange(1)));
        }
    }
    // The other branch has the light at −θ: what the first cannot, it can, up to its own limit.
    spec.axis[1].max_deg = 5.0;
    let other = machine(&spec);
    let on = other.place(&pair([10.0, 0.0, 30.0, 180.0]), true).unwrap();
    near(on[1], -10_f64.to_radians(), 1e-15, "light");
    assert!(other.place(&pair([11.0, 0.0, 30.0, 180.0]), true).is_err());
}

#[test]
fn positions_are_taken_modulo_a_turn() {
    for base in specs() {
        // Every range moved by whole turns: the same pairs, every position by so many turns more.
        for turns in [-2.0, 1.0] {
            let mut moved = base.clone();
            for axis in &mut moved.axis {
                axis.min_deg += 360.0 * turns;
                axis.max_deg += 360.0 * turns;
            }
            let (here, there) = (machine(&base), machine(&moved));
            for (pair, free) in product(cosine_pairs(21).take(2000), [false, true]) {
                let [a, b] = [&here, &there].map(|machine| machine.place(&pair, free));
                let (Ok(a), Ok(b)) = (a, b) else {
                    assert_eq!(a, b);
                    continue;
                };
                for (j, axis) in here.axes().iter().enumerate() {
                    near(b[j] - a[j], turns * TAU, 1e-14, &axis.name);
                }
            }
        }
    }
}

#[test]
fn a_range_of_one_turn_loses_nothing() {
    // Wherever it starts: [0, 360], [-300, 60], [17, 377].
    for mut spec in arms() {
        spec.limits.separation_min_deg = 0.0;
        spec.limits.theta_i_max_deg = 90.0;
        spec.limits.theta_o_max_deg = 90.0;
        spec.limits.collision.clear();
        for start in [-180.0, 0.0, -300.0, 17.0] {
            for axis in &mut spec.axis {
                [axis.min_deg, axis.max_deg] = [start, start + 360.0];
            }
            let machine = machine(&spec);
            for pair in cosine_pairs(22).take(1000) {
                let positions = machine.place(&pair, false).unwrap();
                let made = machine.forward(&positions);
                let found = distance(&turned_onto(&made, &pair), &pair);
                near(found, 0.0, 1e-12, pair);
            }
        }
    }
}

#[test]
fn a_collision_of_light_and_sensor_is_their_separation() {
    // Two ways to say the same, one through the chain and one from the pair.
    for mut spec in arms() {
        spec.limits.collision.clear();
        spec.limits.separation_min_deg = 25.0;
        let apart = machine(&spec);
        spec.limits.separation_min_deg = 0.0;
        spec.limits
            .collision
            .push(collision("sensor", "light", 25.0));
        let colliding = machine(&spec);
        let mut close = 0;
        for pair in cosine_pairs(23).take(5000) {
            match apart.place(&pair, true) {
                Err(Unreachable::Occluded) => {
                    close += 1;
                    // A branch may fail by its range before its collision.
                    match colliding.place(&pair, true) {
                        Err(Unreachable::Collision(0) | Unreachable::AxisRange(_)) => {}
                        found => panic!("{}: {found:?}", spec.name),
                    }
                }
                other => assert_eq!(colliding.place(&pair, true), other),
            }
        }
        assert!(close > 200, "{}: {close}", spec.name);
    }
}

#[test]
fn a_body_in_the_sample_frame_bites_where_it_is() {
    // On the turntable a body turns with the sample, so that its angle to the light is known from
    // the pair alone: of a rod along the tangent, cos = ω_i·x.
    let mut spec = spec("utia");
    spec.body.push(BodySpec {
        name: "rod".into(),
        axis: "turntable".into(),
        direction: [1.0, 0.0, 0.0],
    });
    spec.limits.collision.push(collision("light", "rod", 30.0));
    let with_rod = machine(&spec);
    let (mut hit, mut missed) = (0, 0);
    for pair in cosine_pairs(24).take(10_000) {
        let steepest = pair.omega_i.theta().max(pair.omega_o.theta());
        if steepest.to_degrees() > 75.0 || pair.separation().to_degrees() < 7.5 {
            continue;
        }
        let angle = pair.omega_i.vector().x.acos().to_degrees();
        let placed = with_rod.place(&pair, false);
        if angle < 30.0 {
            hit += 1;
            assert_eq!(placed, Err(Unreachable::Collision(0)));
        } else {
            missed += 1;
            assert!(placed.is_ok(), "{placed:?}");
        }
    }
    assert!(hit > 100 && missed > 5000, "{hit} {missed}");
}

#[test]
fn another_branch_leads_round_a_collision() {
    // The robot's link stands in the beam on one branch at most: turned by π about the beam it is
    // behind the sample. With half a ring that branch is gone.
    let mut spec = spec("rosi");
    for pair in &mut spec.limits.collision {
        // Wide enough to be met often.
        pair.angle_min_deg = 40.0;
    }
    let whole = machine(&spec);
    spec.axis[0].min_deg = 0.0;
    let half = machine(&spec);
    let (mut blocked, mut mirrored) = (0, 0);
    for pair in cosine_pairs(25).take(20_000) {
        let round = whole.place(&pair, true);
        match half.place(&pair, true) {
            Err(Unreachable::Collision(_)) => {
                blocked += 1;
                mirrored += usize::from(round.is_ok_and(|p| p[0] < 0.0));
            }
            other => assert_eq!(round, other),
        }
    }
    assert!(blocked > 100, "{blocked}");
    assert_eq!(mirrored, blocked);
}
