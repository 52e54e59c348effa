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
                let direct = integrated(d, v, a, dt);
                assert!((t - direct).abs() < 4.0 * dt, "{v} {a} {d}: {t} {direct}");
            }
        }
    }
}

#[test]
fn without_a_limit_only_the_other_counts() {
    for d in [1e-6, 0.1, 3.0] {
        let t = one(f64::INFINITY, 2.0).seconds(&at(0.0), &at(d));
        assert!((t / (2.0 * (d / 2.0).sqrt()) - 1.0).abs() < 1e-15);
        let t = one(0.5, f64::INFINITY).seconds(&at(0.0), &at(d));
        assert!((t / (d / 0.5) - 1.0).abs() < 1e-15);
        // Both limits are approached from above.
        assert!(one(1e6, 2.0).seconds(&at(0.0), &at(d)) >= 2.0 * (d / 2.0).sqrt() * (1.0 - 1e-15));
    }
    for travel in [one(f64::INFINITY, 2.0), one(0.5, f64::INFINITY)] {
        assert_eq!(travel.seconds(&at(0.3), &at(0.3)), 0.0);
    }
}

#[test]
fn travel_is_a_metric_and_grows_with_distance() {
    let travel = Travel::new(&[
        axis(0.5, 1.0),
        AxisMotion {
            wraps: true,
            ..axis(0.3, 2.0)
        },
        axis(1.0, 0.2),
    ]);
    let random = Random::new(4);
    for i in 0..3000 {
        let x: [f64; 9] = random.point(i);
        let [p, q, r] = [0, 3, 6].map(|k| {
            let x = |j: usize| (x[k + j] - 0.5) * TAU;
            [x(0), x(1), x(2), 0.0]
        });
        let (pq, qr, pr) = (
            travel.seconds(&p, &q),
            travel.seconds(&q, &r),
            travel.seconds(&p, &r),
        );
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
    let travel = one(0.5, 1.0);
    let mut last = 0.0;
    for k in 1..4000 {
        let t = travel.seconds(&at(0.0), &at(1e-3 * f64::from(k)));
        assert!(t > last);
        last = t;
    }
}

#[test]
fn an_axis_that_wraps_takes_the_shorter_way() {
    let wraps = Travel::new(&[AxisMotion {
        wraps: true,
        ..axis(0.5, 1.0)
    }]);
    let straight = one(0.5, 1.0);
    for k in -20..=20 {
        for l in -20..=20 {
            let [a, b] = [k, l].map(|k| PI * f64::from(k) / 20.0);
            let shortest = [-TAU, 0.0, TAU]
                .map(|turn| straight.seconds(&at(a), &at(b + turn)))
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            // The root makes 2e-8 s of a rounding of 1e-16 rad near 0.
            assert!((wraps.seconds(&at(a), &at(b)) - shortest).abs() < 1e-7);
            let way = wraps.way(0, &at(a), &at(b));
            assert!(way.abs() <= PI + 1e-12);
            let landed = (a + way - b) / TAU;
            assert!((landed - landed.round()).abs() < 1e-12);
        }
    }
}

mod plan {
    use gonio::geometry::Symmetry;
    use gonio::instrument::{Bench, Machine, Motion, Order, Parts, Stop, presets, read};
    use gonio::schedule::{Itinerary, RandomSet, SampleSet, Schedule};

    fn schedule(n: usize, symmetry: Symmetry, seed: u64) -> Schedule {
        let form = crate::common::form("half-difference", symmetry);
        RandomSet {}.plan(&form, n, seed).unwrap()
    }

    fn travelled(motion: &Motion, itinerary: &Itinerary) -> f64 {
        let mut here = motion.rest();
        let mut sum = 0.0;
        for visit in &itinerary.visits {
            sum += motion.travel().seconds(here, &visit.positions);
            here = &visit.positions;
        }
        sum
    }

    #[test]
    fn every_pose_is_visited_or_has_a_reason() {
        for preset in presets() {
            let spec = read(preset.text).unwrap();
            let machine = Machine::new(&spec).unwrap();
            let motion = Motion::new(&spec, &machine);
            let bench = Bench::new(&spec, Parts::ALL, 1).unwrap();
            for symmetry in [Symmetry::FULL, Symmetry::NONE] {
                let schedule = schedule(300, symmetry, 2);
                let mut best = f64::INFINITY;
                for order in Order::ALL.into_iter().rev() {
                    let plan = bench.plan(&schedule, order);
                    let seen = plan.visits.iter().map(|v| v.pose);
                    let mut seen: Vec<u32> =
                        seen.chain(plan.unreachable.iter().map(|u| u.0)).collect();
                    seen.sort_unstable();
                    assert!(seen.into_iter().eq(0..300));
                    for visit in &plan.visits {
                        let pair = &schedule.poses[visit.pose as usize].pair;
                        assert_eq!(machine.place(pair, symmetry.isotropic), Ok(visit.positions));
                    }
                    for (pose, reason) in &plan.unreachable {
                        let pair = &schedule.poses[*pose as usize].pair;
                        assert_eq!(machine.place(pair, symmetry.isotropic), Err(*reason));
                    }
                    assert_eq!(plan.order, order.name());
                    assert_eq!(plan.axes.len(), machine.axes().len());
                    let path: Vec<Stop> =
                        plan.visits.iter().map(|v| (v.pose, v.positions)).collect();
                    assert_eq!(motion.timed(&schedule, Vec::new(), &path), plan.visits);
                    // From the best order backwards.
                    if order == Order::TwoOpt {
                        best = travelled(&motion, &plan);
                    }
                    assert!(best <= travelled(&motion, &plan) * (1.0 + 1e-12));
                }
            }
        }
    }
}
