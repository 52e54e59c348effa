use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{AxisMotion, Order, Travel};
use gonio::numeric::wrap_angle;
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
    let form = crate::common::form("half-difference", Symmetry::NONE);
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
