use crate::common::{form, near, planned};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{AxisMotion, Order, Travel};
use gonio::numeric::wrap_angle;
use gonio::sampling::Random;
use gonio::schedule::Positions;

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
    let stops = tour.iter().map(|i| &positions[*i as usize]);
    let from = std::iter::once(&REST).chain(stops.clone());
    from.zip(stops).map(|(a, b)| travel.seconds(a, b)).sum()
}

/// The tour of an order, in which every position is once.
fn tour(order: Order, travel: &Travel, positions: &[Positions]) -> Vec<u32> {
    let tour = order.tour(travel, &REST, positions);
    let mut sorted = tour.clone();
    sorted.sort_unstable();
    assert!(sorted.into_iter().eq(0..positions.len() as u32));
    tour
}

/// How long each order travels.
fn all_orders(travel: &Travel, positions: &[Positions]) -> [f64; 4] {
    Order::ALL.map(|order| seconds(travel, positions, &tour(order, travel, positions)))
}

/// Sets of `n` random positions: of three axes and of four.
fn sets(n: usize, seed: u64) -> [(Travel, Vec<Positions>); 2] {
    [
        (travel(&THREE), random(n, seed, three)),
        (travel(&FOUR), random(n, seed, four)),
    ]
}

/// Positions of random pairs that are uniform in half/difference coordinates.
fn random(n: usize, seed: u64, place: fn(&DirectionPair) -> Positions) -> Vec<Positions> {
    let form = form("half-difference", Symmetry::NONE);
    let schedule = planned(&form, "random", n, seed);
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
    for (travel, positions) in (1..=3).flat_map(|seed| sets(1024, seed)) {
        let [random, rows, nearest, best] = all_orders(&travel, &positions);
        assert!(best <= 0.25 * random, "{best} of {random}");
        assert!(best <= nearest && nearest <= rows && rows <= random);
    }
}

#[test]
fn more_work_never_travels_longer() {
    for n in [2, 3, 4, 5, 9, 17, 40, 150] {
        for (travel, positions) in (0..12).flat_map(|seed| sets(n, seed)) {
            let again = |order| tour(order, &travel, &positions);
            assert_eq!(Order::ALL.map(again), Order::ALL.map(again));
            let [random, rows, nearest, best] = all_orders(&travel, &positions);
            assert!(best <= nearest * (1.0 + 1e-12), "{n}");
            assert!(best <= rows.min(random) * (1.0 + 1e-12), "{n}");
            // The nearest neighbour can be unlucky with few poses, not with many.
            assert!(n < 40 || nearest <= random, "{n}");
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
        for (travel, positions) in (0..10).flat_map(|seed| sets(n, seed)) {
            let best = shortest(&travel, &positions);
            let tour = tour(Order::TwoOpt, &travel, &positions);
            let found = seconds(&travel, &positions, &tour);
            assert!(found >= best * (1.0 - 1e-12));
            assert!(found <= 1.03 * best, "{n}: {found} {best}");
            exact += usize::from(found <= best * (1.0 + 1e-12));
            all += 1;
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
fn rows_run_back_and_forth() {
    // A lattice finer than the rows: every position is shared, so that every row is a sweep.
    let (rows, columns) = (12, 30);
    let slow = AxisMotion {
        speed: 0.1,
        acceleration: 1.0,
        wraps: false,
    };
    let travel = Travel::new(&[AxisMotion { speed: 0.5, ..slow }, slow]);
    let place = |i: usize| {
        let (row, column) = (i / columns, i % columns);
        [0.03 * column as f64, 0.02 * row as f64, 0.0, 0.0]
    };
    let places = shuffled(rows * columns, 7).into_iter();
    let positions: Vec<Positions> = places.map(place).collect();
    let tour = Order::Sorted.tour(&travel, &REST, &positions);
    for (k, &i) in tour.iter().enumerate() {
        let (row, column) = (k / columns, k % columns);
        let back = row % 2 == 1;
        let column = if back { columns - 1 - column } else { column };
        let [x, y, ..] = positions[i as usize];
        near(x, 0.03 * column as f64, 1e-12, k);
        near(y, 0.02 * row as f64, 1e-12, k);
    }
    // Positions of their own are cut into rows of 5°, and within one the quick axis runs one way,
    // the other way in the next.
    let mut positions = random(500, 1, three);
    positions.iter_mut().for_each(|p| p[2] = 0.0);
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
    let place = |i: usize| {
        let [x] = noise.point(i as u64);
        let mut p = centres[i % 20];
        match i % 3 {
            0 => {}
            1 => p[0] += 1e-15 * x,
            _ => p[1] += 1e-3 * x,
        }
        p
    };
    let positions: Vec<Positions> = (0..800).map(place).collect();
    for order in [Order::NearestNeighbour, Order::TwoOpt] {
        let tour = tour(order, &travel, &positions);
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
