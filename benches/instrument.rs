//! Planning an acquisition: tours of random poses, by order, and their times.

use super::form;
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use gonio::geometry::Symmetry;
use gonio::instrument::{Bench, InstrumentSpec, Machine, Motion, Order, Parts, presets, read};
use gonio::schedule::{Pose, Positions, RandomSet, SampleSet, Schedule};

fn preset(name: &str) -> (InstrumentSpec, Machine) {
    let presets = presets();
    let preset = presets.iter().find(|p| p.name == name).expect("a preset");
    let spec = read(preset.text).expect("an instrument");
    let machine = Machine::new(&spec).expect("a machine");
    (spec, machine)
}

/// Random poses in half/difference coordinates.
fn schedule(n: usize, symmetry: Symmetry) -> Schedule {
    let form = form("half-difference", symmetry);
    RandomSet {}.plan(&form, n, 1).expect("a schedule")
}

/// Puts the first `n` poses that the instrument reaches in order.
fn tour(bencher: Bencher, name: &str, symmetry: Symmetry, n: usize, order: Order) {
    let (spec, machine) = preset(name);
    let motion = Motion::new(&spec, &machine);
    let schedule = schedule(2 * n, symmetry);
    let place = |pose: &Pose| machine.place(&pose.pair, symmetry.isotropic);
    let places = schedule.poses.iter().flat_map(place);
    let positions: Vec<Positions> = places.take(n).collect();
    assert_eq!(positions.len(), n);
    bencher
        .counter(ItemsCount::new(n))
        .bench_local(|| order.tour(motion.travel(), &motion.after(&[]), black_box(&positions)));
}

/// Cornell: three axes, isotropic.
#[divan::bench(args = Order::ALL, consts = [1024, 16_384], max_time = 5)]
fn tour_of_three_axes<const N: usize>(bencher: Bencher, order: Order) {
    tour(bencher, "cornell", Symmetry::FULL, N, order);
}

/// ROSI: four axes.
#[divan::bench(args = Order::ALL, consts = [1024, 16_384], max_time = 5)]
fn tour_of_four_axes<const N: usize>(bencher: Bencher, order: Order) {
    tour(bencher, "rosi", Symmetry::NONE, N, order);
}

/// Placing, ordering in rows and timing 100 000 poses.
#[divan::bench(args = ["cornell", "pgii"])]
fn itinerary(bencher: Bencher, name: &str) {
    let (spec, _) = preset(name);
    let bench = Bench::new(&spec, Parts::ALL, 1).expect("an instrument");
    let schedule = schedule(100_000, Symmetry::FULL);
    bencher
        .counter(ItemsCount::new(schedule.poses.len()))
        .bench(|| bench.plan(black_box(&schedule), Order::Sorted));
}
