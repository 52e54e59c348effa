use crate::common::{near, product};
use gonio::instrument::{AxisMotion, Travel};
use gonio::sampling::Random;
use gonio::schedule::Positions;
use std::f64::consts::{PI, TAU};

fn axis(speed: f64, acceleration: f64) -> AxisMotion {
    AxisMotion {
        speed,
        acceleration,
        wraps: false,
    }
}

fn wrapping(speed: f64, acceleration: f64) -> AxisMotion {
    AxisMotion {
        wraps: true,
        ..axis(speed, acceleration)
    }
}

fn one(speed: f64, acceleration: f64) -> Travel {
    Travel::new(&[axis(speed, acceleration)])
}

fn at(x: f64) -> Positions {
    [x, 0.0, 0.0, 0.0]
}

/// Integrates the motion itself: full acceleration as long as there is room to brake. The error
/// is a few steps of time, and the last creep.
fn integrated(distance: f64, speed: f64, acceleration: f64, dt: f64) -> f64 {
    let (mut x, mut v, mut t) = (0.0, 0.0, 0.0);
    while x < distance {
        let braking = v * v / (2.0 * acceleration);
        if distance - x <= braking {
            // From here to rest: v = √(2 a s) all the way.
            return t + (2.0 * (distance - x) / acceleration).sqrt();
        }
        let faster = (v + acceleration * dt).min(speed);
        x += 0.5 * (v + faster) * dt;
        v = faster;
        t += dt;
    }
    t
}

#[test]
fn a_move_takes_as_long_as_its_integrated_profile() {
    for (v, a) in [(0.5, 1.0), (2.0, 0.3), (0.1, 5.0)] {
        // From far inside the triangle to far outside, and the knee itself.
        for share in [0.01, 0.3, 0.99, 1.0, 1.01, 3.0, 50.0] {
            let d = share * v * v / a;
            let t = one(v, a).seconds(&at(0.0), &at(d));
            // First order in the step: its error falls with it.
            for dt in [1e-4, 1e-5].map(|s| s * t) {
                near(t, integrated(d, v, a, dt), 4.0 * dt, (v, a, d));
            }
        }
    }
}

#[test]
fn without_a_limit_only_the_other_counts() {
    for d in [1e-6, 0.1, 3.0] {
        let seconds = |travel: Travel| travel.seconds(&at(0.0), &at(d));
        let least = 2.0 * (d / 2.0).sqrt();
        near(seconds(one(f64::INFINITY, 2.0)) / least, 1.0, 1e-15, d);
        near(seconds(one(0.5, f64::INFINITY)) / (d / 0.5), 1.0, 1e-15, d);
        // Both limits are approached from above.
        assert!(seconds(one(1e6, 2.0)) >= least * (1.0 - 1e-15));
    }
    for travel in [one(f64::INFINITY, 2.0), one(0.5, f64::INFINITY)] {
        assert_eq!(travel.seconds(&at(0.3), &at(0.3)), 0.0);
    }
}

#[test]
fn travel_is_a_metric_and_grows_with_distance() {
    let travel = Travel::new(&[axis(0.5, 1.0), wrapping(0.3, 2.0), axis(1.0, 0.2)]);
    let random = Random::new(4);
    for i in 0..3000 {
        let x: [f64; 9] = random.point(i);
        let [p, q, r] = [0, 3, 6].map(|k| {
            let x = |j: usize| (x[k + j] - 0.5) * TAU;
            [x(0), x(1), x(2), 0.0]
        });
        let [pq, qr, pr] = [(&p, &q), (&q, &r), (&p, &r)].map(|(a, b)| travel.seconds(a, b));
        assert_eq!(pq, travel.seconds(&q, &p));
        assert_eq!(travel.seconds(&p, &p), 0.0);
        assert!(pr <= (pq + qr) * (1.0 + 1e-15), "{p:?} {q:?} {r:?}");
        // The slowest axis counts, and nothing else.
        let alone = |j: usize| {
            let mut only = p;
            only[j] = q[j];
            travel.seconds(&p, &only)
        };
        assert_eq!(pq, (0..4).map(alone).fold(0.0, f64::max));
    }
    let seconds = |k: i32| one(0.5, 1.0).seconds(&at(0.0), &at(1e-3 * f64::from(k)));
    assert!((1..4000).all(|k| seconds(k) > seconds(k - 1)));
}

#[test]
fn an_axis_that_wraps_takes_the_shorter_way() {
    let wraps = Travel::new(&[wrapping(0.5, 1.0)]);
    let straight = one(0.5, 1.0);
    for (k, l) in product(-20..=20, -20..=20) {
        let [a, b] = [k, l].map(|k| PI * f64::from(k) / 20.0);
        let ways = [-TAU, 0.0, TAU].map(|turn| straight.seconds(&at(a), &at(b + turn)));
        let shortest = ways.into_iter().fold(f64::INFINITY, f64::min);
        // The root makes 2e-8 s of a rounding of 1e-16 rad near 0.
        near(wraps.seconds(&at(a), &at(b)), shortest, 1e-7, (k, l));
        let way = wraps.way(0, &at(a), &at(b));
        assert!(way.abs() <= PI + 1e-12);
        let turns = (a + way - b) / TAU;
        near(turns, turns.round(), 1e-12, (k, l));
    }
}

mod plan {
    use crate::common::{form, planned};
    use gonio::geometry::Symmetry;
    use gonio::instrument::{Bench, Machine, Motion, Order, Parts, Stop, presets, read};

    #[test]
    fn every_pose_is_visited_or_has_a_reason() {
        for preset in presets() {
            let spec = read(preset.text).unwrap();
            // Poses of a picture share its stop and its time, as tests of instruments hold.
            if spec.picture.is_some() {
                continue;
            }
            let machine = Machine::new(&spec).unwrap();
            let motion = Motion::new(&spec, &machine);
            let bench = Bench::new(&spec, Parts::ALL, 1).unwrap();
            for symmetry in [Symmetry::FULL, Symmetry::NONE] {
                let form = form("half-difference", symmetry);
                let schedule = planned(&form, "random", 300, 2);
                let place = |pose: u32| {
                    let pair = &schedule.poses[pose as usize].pair;
                    machine.place(pair, symmetry.isotropic)
                };
                for order in Order::ALL {
                    let plan = bench.plan(&schedule, order);
                    let visits = plan.visits.iter().map(|v| (v.pose, Ok(v.positions)));
                    let left = plan.unreachable.iter();
                    let left = left.map(|(pose, why)| (*pose, Err(*why)));
                    let mut all: Vec<_> = visits.chain(left).collect();
                    all.sort_by_key(|(pose, _)| *pose);
                    assert!(all.iter().map(|(pose, _)| *pose).eq(0..300));
                    assert!(all.iter().all(|(pose, placed)| place(*pose) == *placed));
                    assert_eq!(plan.order, order.name());
                    assert_eq!(plan.axes.len(), machine.axes().len());
                    let stops = plan.visits.iter().map(|v| (v.pose, v.positions));
                    let path: Vec<Stop> = stops.collect();
                    assert_eq!(motion.timed(&schedule, Vec::new(), &path), plan.visits);
                }
            }
        }
    }
}
