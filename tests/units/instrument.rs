#[cfg(feature = "experiments")]
mod motion {
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
            assert!(
                one(1e6, 2.0).seconds(&at(0.0), &at(d)) >= 2.0 * (d / 2.0).sqrt() * (1.0 - 1e-15)
            );
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
        use gonio::instrument::{Machine, Motion, Order, Stop, presets, read};
        use gonio::parametrization;
        use gonio::schedule::{Itinerary, RandomSet, SampleSet, Schedule};

        fn schedule(n: usize, symmetry: Symmetry, seed: u64) -> Schedule {
            let form = parametrization::find("half-difference")
                .unwrap()
                .form(symmetry);
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
                for symmetry in [Symmetry::FULL, Symmetry::NONE] {
                    let schedule = schedule(300, symmetry, 2);
                    let mut best = f64::INFINITY;
                    for order in Order::ALL.into_iter().rev() {
                        let plan = motion.itinerary(&machine, preset.name, &schedule, order);
                        let seen = plan.visits.iter().map(|v| v.pose);
                        let mut seen: Vec<u32> =
                            seen.chain(plan.unreachable.iter().map(|u| u.0)).collect();
                        seen.sort_unstable();
                        assert!(seen.into_iter().eq(0..300));
                        for visit in &plan.visits {
                            let pair = &schedule.poses[visit.pose as usize].pair;
                            assert_eq!(
                                machine.place(pair, symmetry.isotropic),
                                Ok(visit.positions)
                            );
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

        #[test]
        fn three_and_four_axes_travel_a_quarter() {
            for (name, symmetry) in [("cornell", Symmetry::FULL), ("rosi", Symmetry::NONE)] {
                let preset = presets().into_iter().find(|p| p.name == name).unwrap();
                let spec = read(preset.text).unwrap();
                let machine = Machine::new(&spec).unwrap();
                let motion = Motion::new(&spec, &machine);
                for seed in 1..=3 {
                    let schedule = schedule(1024, symmetry, seed);
                    let [random, best] = [Order::AsGenerated, Order::TwoOpt].map(|order| {
                        let plan = motion.itinerary(&machine, name, &schedule, order);
                        travelled(&motion, &plan)
                    });
                    assert!(best <= 0.25 * random, "{name} {seed}: {best} of {random}");
                }
            }
        }
    }
}

mod tour {
    use gonio::geometry::{DirectionPair, Symmetry};
    use gonio::instrument::{AxisMotion, Order, Travel};
    use gonio::numeric::wrap_angle;
    use gonio::parametrization;
    use gonio::sampling::Random;
    use gonio::schedule::{Positions, RandomSet, SampleSet};
    use std::f64::consts::{PI, TAU};

    const REST: Positions = [0.0; 4];

    /// Axes of 30°/s and 60°/s².
    fn travel(wraps: &[bool]) -> Travel {
        let axis = |&wraps: &bool| AxisMotion {
            speed: 30_f64.to_radians(),
            acceleration: 60_f64.to_radians(),
            wraps,
        };
        Travel::new(&wraps.iter().map(axis).collect::<Vec<_>>())
    }

    fn seconds(travel: &Travel, positions: &[Positions], tour: &[u32]) -> f64 {
        let mut here = &REST;
        let mut sum = 0.0;
        for &i in tour {
            sum += travel.seconds(here, &positions[i as usize]);
            here = &positions[i as usize];
        }
        sum
    }

    fn assert_permutation(tour: &[u32], n: usize) {
        let mut sorted = tour.to_vec();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..n as u32));
    }

    /// Positions of random pairs that are uniform in half/difference coordinates.
    fn random(n: usize, seed: u64, place: fn(&DirectionPair) -> Positions) -> Vec<Positions> {
        let form = parametrization::find("half-difference")
            .unwrap()
            .form(Symmetry::NONE);
        let schedule = RandomSet {}.plan(&form, n, seed).unwrap();
        schedule.poses.iter().map(|p| place(&p.pair)).collect()
    }

    /// Three axes: elevations of light and sensor, azimuth between them.
    fn three(pair: &DirectionPair) -> Positions {
        let (i, o) = (pair.omega_i, pair.omega_o);
        [i.theta(), o.theta(), wrap_angle(o.phi() - i.phi()), 0.0]
    }

    /// Four axes: both directions.
    fn four(pair: &DirectionPair) -> Positions {
        let (i, o) = (pair.omega_i, pair.omega_o);
        [i.theta(), i.phi(), o.theta(), o.phi()]
    }

    const THREE: [bool; 3] = [false, false, true];

    const FOUR: [bool; 4] = [false, true, false, true];

    #[test]
    fn the_best_order_quarters_the_travel() {
        type Place = fn(&DirectionPair) -> Positions;
        let sets: [(&[bool], Place); 2] = [(&THREE, three), (&FOUR, four)];
        for (wraps, place) in sets {
            let travel = travel(wraps);
            for seed in 1..=3 {
                let positions = random(1024, seed, place);
                let [random, rows, nearest, best] = Order::ALL.map(|order| {
                    let tour = order.tour(&travel, &REST, &positions);
                    assert_permutation(&tour, positions.len());
                    seconds(&travel, &positions, &tour)
                });
                assert!(best <= 0.25 * random, "{seed}: {best} of {random}");
                assert!(best <= nearest && nearest <= rows && rows <= random);
            }
        }
    }

    #[test]
    fn more_work_never_travels_longer() {
        for n in [2, 3, 4, 5, 9, 17, 40, 150] {
            for seed in 0..12 {
                for (wraps, positions) in [
                    (&THREE[..], random(n, seed, three)),
                    (&FOUR[..], random(n, seed, four)),
                ] {
                    let travel = travel(wraps);
                    let [random, rows, nearest, best] = Order::ALL.map(|order| {
                        let tour = order.tour(&travel, &REST, &positions);
                        assert_permutation(&tour, n);
                        assert_eq!(tour, order.tour(&travel, &REST, &positions));
                        seconds(&travel, &positions, &tour)
                    });
                    assert!(best <= nearest * (1.0 + 1e-12), "{n} {seed}");
                    assert!(best <= rows.min(random) * (1.0 + 1e-12), "{n} {seed}");
                    // The nearest neighbour can be unlucky with few poses, not with many.
                    assert!(n < 40 || nearest <= random, "{n} {seed}");
                }
            }
        }
    }

    /// The shortest of all paths, by trying every one.
    fn shortest(travel: &Travel, positions: &[Positions]) -> f64 {
        fn rest(travel: &Travel, here: &Positions, left: &mut Vec<Positions>) -> f64 {
            let mut best = if left.is_empty() { 0.0 } else { f64::INFINITY };
            for k in 0..left.len() {
                let next = left.swap_remove(k);
                best = best.min(travel.seconds(here, &next) + rest(travel, &next, left));
                left.push(next);
                let last = left.len() - 1;
                left.swap(k, last);
            }
            best
        }
        rest(travel, &REST, &mut positions.to_vec())
    }

    #[test]
    fn small_sets_are_solved_nearly_exactly() {
        let (mut exact, mut all) = (0, 0);
        for n in 1..=8 {
            for seed in 0..10 {
                for (wraps, positions) in [
                    (&THREE[..], random(n, seed, three)),
                    (&FOUR[..], random(n, seed, four)),
                ] {
                    let travel = travel(wraps);
                    let best = shortest(&travel, &positions);
                    let tour = Order::TwoOpt.tour(&travel, &REST, &positions);
                    let found = seconds(&travel, &positions, &tour);
                    assert!(found >= best * (1.0 - 1e-12));
                    assert!(found <= 1.03 * best, "{n} {seed}: {found} {best}");
                    exact += usize::from(found <= best * (1.0 + 1e-12));
                    all += 1;
                }
            }
        }
        // With so few poses almost every path of no detour is the shortest.
        assert!(10 * exact >= 9 * all, "{exact} of {all}");
    }

    /// Numbers 0..n, shuffled.
    fn shuffled(n: usize, seed: u64) -> Vec<usize> {
        let random = Random::new(seed);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| {
            let [x, y] = [a, b].map(|i| random.point::<1>(i as u64)[0]);
            x.total_cmp(&y)
        });
        order
    }

    #[test]
    fn points_on_a_line_are_visited_from_end_to_end() {
        for n in [2, 3, 10, 101, 1000] {
            let travel = travel(&THREE);
            let step = 1.5 / n as f64;
            // From rest at one end. The other axes follow, or stand still.
            for slope in [0.0, 0.7] {
                let places = shuffled(n, 5);
                let point = |&i: &usize| {
                    let x = step * (i + 1) as f64;
                    [x, slope * x, 0.0, 0.0]
                };
                let positions: Vec<Positions> = places.iter().map(point).collect();
                for order in [Order::Sorted, Order::NearestNeighbour, Order::TwoOpt] {
                    if order == Order::Sorted && slope > 0.0 {
                        continue;
                    }
                    let tour = order.tour(&travel, &REST, &positions);
                    let along = tour.iter().map(|&i| places[i as usize]);
                    assert!(along.eq(0..n), "{n} {slope} {}", order.name());
                }
            }
        }
    }

    #[test]
    fn a_line_through_rest_is_not_crossed_twice() {
        // The short end first, then back to the other. Going to the nearest crosses rest often.
        let travel = travel(&THREE);
        let positions: Vec<Positions> = shuffled(40, 9)
            .into_iter()
            .map(|i| [0.02 * (i as f64 - 9.3), 0.0, 0.0, 0.0])
            .collect();
        let tour = Order::TwoOpt.tour(&travel, &REST, &positions);
        let x: Vec<f64> = tour.iter().map(|&i| positions[i as usize][0]).collect();
        let turns = x.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0);
        assert!(turns.count() <= 1, "{x:?}");
    }

    #[test]
    fn a_ring_is_gone_round_once() {
        let n = 200;
        let travel = travel(&[false, true]);
        let step = TAU / n as f64;
        let positions: Vec<Positions> = shuffled(n, 2)
            .into_iter()
            .map(|i| [0.3, wrap_angle(step * i as f64 - PI), 0.0, 0.0])
            .collect();
        for order in [Order::NearestNeighbour, Order::TwoOpt] {
            let tour = order.tour(&travel, &REST, &positions);
            let found = seconds(&travel, &positions, &tour);
            // To the ring, then every step but one.
            let to = travel.seconds(&REST, &[0.3, 0.0, 0.0, 0.0]);
            let one = travel.seconds(&REST, &[0.0, step, 0.0, 0.0]);
            let best = to + (n - 1) as f64 * one;
            assert!((found - best).abs() < 1e-9 * best, "{found} {best}");
        }
    }

    #[test]
    fn rows_run_back_and_forth() {
        // A lattice finer than the rows: every position is shared, so that every row is a sweep.
        let (rows, columns) = (12, 30);
        let slow = AxisMotion {
            speed: 0.1,
            acceleration: 1.0,
            wraps: false,
        };
        let travel = Travel::new(&[AxisMotion { speed: 0.5, ..slow }, slow]);
        let positions: Vec<Positions> = shuffled(rows * columns, 7)
            .into_iter()
            .map(|i| {
                let (row, column) = (i / columns, i % columns);
                [0.03 * column as f64, 0.02 * row as f64, 0.0, 0.0]
            })
            .collect();
        let tour = Order::Sorted.tour(&travel, &REST, &positions);
        for (k, &i) in tour.iter().enumerate() {
            let (row, column) = (k / columns, k % columns);
            let column = if row % 2 == 0 {
                column
            } else {
                columns - 1 - column
            };
            let [x, y, ..] = positions[i as usize];
            assert!((x - 0.03 * column as f64).abs() < 1e-12);
            assert!((y - 0.02 * row as f64).abs() < 1e-12);
        }
        // Positions of their own are cut into rows of 5°, and within one the quick axis runs one way,
        // the other way in the next.
        let positions: Vec<Positions> = (random(500, 1, three).iter())
            .map(|p| [p[0], p[1], 0.0, 0.0])
            .collect();
        let tour = Order::Sorted.tour(&travel, &REST, &positions);
        let low = positions.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        let row = |i: u32| ((positions[i as usize][1] - low) / 5_f64.to_radians()) as i32;
        let mut forwards = true;
        for w in tour.windows(2) {
            let [a, b] = [w[0], w[1]].map(|i| positions[i as usize][0]);
            if row(w[0]) == row(w[1]) {
                assert_eq!(b > a, forwards);
            } else {
                assert_eq!(row(w[1]), row(w[0]) + 1, "500 poses leave no row empty");
                forwards = !forwards;
            }
        }
    }

    #[test]
    fn clusters_and_duplicates_are_visited_one_after_the_other() {
        let travel = travel(&THREE);
        let centres = random(20, 1, three);
        // Forty poses in each, some the same, some a rounding apart, within a thousandth of a rad.
        let noise = Random::new(6);
        let positions: Vec<Positions> = (0..800)
            .map(|i| {
                let [x] = noise.point(i as u64);
                let mut p = centres[i % 20];
                match i % 3 {
                    0 => {}
                    1 => p[0] += 1e-15 * x,
                    _ => p[1] += 1e-3 * x,
                }
                p
            })
            .collect();
        for order in [Order::NearestNeighbour, Order::TwoOpt] {
            let tour = order.tour(&travel, &REST, &positions);
            assert_permutation(&tour, positions.len());
            let leaves = tour.windows(2).filter(|w| w[0] % 20 != w[1] % 20).count();
            assert_eq!(leaves, 19, "{}", order.name());
        }
        // All the same: by number, at once.
        let same = vec![centres[3]; 50_000];
        for order in Order::ALL {
            let tour = order.tour(&travel, &REST, &same);
            assert!(tour.into_iter().eq(0..50_000), "{}", order.name());
        }
    }

    #[test]
    fn none_and_one_are_paths_too() {
        for order in Order::ALL {
            assert!(order.tour(&travel(&FOUR), &REST, &[]).is_empty());
            let one = [[0.1, 0.2, 0.3, 0.4]];
            assert_eq!(order.tour(&travel(&FOUR), &REST, &one), [0]);
        }
    }

    #[test]
    fn a_lattice_is_walked_step_by_step() {
        // A path over a lattice of 8³ with no step longer than one: 511 steps and the way to it.
        let travel = travel(&[false, false, false]);
        let step = 0.05;
        let positions: Vec<Positions> = shuffled(512, 3)
            .into_iter()
            .map(|i| [i / 64, i / 8 % 8, i % 8, 0].map(|k| step * k as f64))
            .collect();
        let one = travel.seconds(&REST, &[step, 0.0, 0.0, 0.0]);
        let tour = Order::TwoOpt.tour(&travel, &REST, &positions);
        let found = seconds(&travel, &positions, &tour);
        assert!(found <= 1.01 * 511.0 * one, "{found} {}", 511.0 * one);
    }

    #[test]
    fn names_are_those_of_configs() {
        for order in Order::ALL {
            let text = serde_json::to_string(&order).unwrap();
            assert_eq!(text, format!("\"{}\"", order.name()));
            assert!(!order.summary().is_empty());
        }
        assert_eq!(Order::default(), Order::TwoOpt);
    }
}

mod ideal {
    use crate::common::made;
    use gonio::brdf::{Channels, Presence};
    use gonio::geometry::Symmetry;
    use gonio::instrument::{Ideal, Instrument};
    use gonio::schedule::Schedule;
    use gonio::{brdf, parametrization, registry, schedule};
    use std::sync::Arc;

    fn poses() -> Arc<Schedule> {
        let hybrid = parametrization::find("hybrid").unwrap();
        let sets = schedule::all();
        let sobol = sets.iter().find(|e| e.kind == "sobol").unwrap();
        let sobol = registry::read_text(sobol, "").unwrap();
        // More poses than one parallel task holds.
        let form = hybrid.form(Symmetry::FULL);
        Arc::new(sobol.plan(&form, 2 * 1024 + 7, 3).unwrap())
    }

    #[test]
    fn the_ideal_reading_is_the_brdf_bit_for_bit() {
        let poses = poses();
        for channels in [Channels::Luminance, Channels::Rgb] {
            let n = channels.count();
            for entry in brdf::all() {
                for text in entry.examples {
                    let spec = registry::read_text(&entry, text).unwrap();
                    let brdf = spec.build(channels.clone()).unwrap();
                    let measurement = Ideal.measure(&*brdf, &poses);
                    for (i, pose) in poses.poses.iter().enumerate() {
                        let mut direct = [0.0; 3];
                        let presence = brdf.eval(&pose.pair, &mut direct[..n]);
                        match measurement.value(i) {
                            Some(value) => {
                                assert_eq!(presence, Presence::Present);
                                assert_eq!(value, &direct[..n], "{} {text}", entry.kind);
                            }
                            None => assert_eq!(presence, Presence::Missing),
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn missing_data_is_reported_and_counted() {
        // Half a hemisphere without data.
        let holed = made(Symmetry::FULL, |pair| {
            (pair.separation() >= 1.0).then_some([0.25])
        });
        let poses = poses();
        let measurement = Ideal.measure(&holed, &poses);
        let near = |p: &&schedule::Pose| p.pair.separation() < 1.0;
        let missing = poses.poses.iter().filter(near).count();
        assert!(missing > 100);
        assert_eq!(measurement.no_data(), missing);
        assert_eq!(measurement.readings(), poses.poses.len() - missing);
    }
}
