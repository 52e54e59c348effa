//! Instruments: positions of their axes at extreme pairs, and readings of extreme materials.

use super::cases::{self, Case, pairs, pairs_above, schedule_of};
use super::reconstructions::materials;
use super::{Check, Extent, Family, Finding, Law, ROUNDING, Test};
use crate::geometry::{Symmetry, distance};
use crate::instrument::{self, Bench, Ideal, Instrument, InstrumentSpec, Machine, Order, Parts};
use crate::measurement::Outcome;

pub(super) const FAMILY: Family = Family {
    name: "instruments",
    summary: "axes that make the pair, readings of extreme materials with their uncertainties, itineraries in order",
    checks,
};

/// Four rotations, each of numbers up to π, there and back.
const AXES: Law = Law::bounded("positions make the pair", "rad", 64.0);
const READINGS: Law = Law::strict("finite readings with uncertainties, or a reason");
const IDEAL: Law = Law::strict("the ideal reading is the BRDF, to the bit");
const TIMES: Law = Law::strict("each reachable pose visited once, in the order of the clock");

fn checks(extent: Extent) -> Vec<Check> {
    let of_ideal = move |watch: &mut Finding| ideal(extent, watch);
    let mut checks = vec![Check::new("ideal", IDEAL, of_ideal)];
    let tests: [Test<InstrumentSpec>; 3] = [(AXES, axes), (TIMES, times), (READINGS, readings)];
    for preset in instrument::presets() {
        // The tests read every preset, so that each of them reads.
        if let Ok(spec) = instrument::read(preset.text) {
            checks.extend(Check::each(preset.name, spec, extent, &tests));
        }
    }
    checks
}

fn ideal(extent: Extent, watch: &mut Finding) {
    let cases = extent.subset(pairs(), 2);
    let schedule = schedule_of(&cases, Symmetry::FULL);
    for (what, brdf) in materials() {
        let measured = Ideal.measure(&*brdf, &schedule);
        watch.spent(2 * cases.len());
        for (k, case) in cases.iter().enumerate() {
            let read = measured.value(k).map(|v| v[0].to_bits());
            let direct = brdf.luminance(&case.pair).map(f64::to_bits);
            watch.holds(read == direct, &format_args!("{what}, {}", case.name));
        }
    }
}

fn axes(spec: &InstrumentSpec, extent: Extent, watch: &mut Finding) {
    let Ok(machine) = Machine::new(spec) else {
        return;
    };
    let machine = machine.without_limits();
    let only_isotropic = machine.class().isotropic_only;
    for Case { name, pair } in extent.subset(pairs(), 3) {
        for free in [false, true] {
            watch.spent(1);
            let Ok(positions) = machine.place(&pair, free) else {
                watch.holds(false, &name);
                continue;
            };
            let symmetry = Symmetry::NONE.with_isotropy(free || only_isotropic);
            let made = machine.forward(&positions);
            watch.see(distance(&made, &pair, symmetry), ROUNDING, &name);
        }
    }
}

fn times(spec: &InstrumentSpec, extent: Extent, watch: &mut Finding) {
    let schedule = schedule_of(&extent.subset(pairs(), 3), Symmetry::FULL);
    let Ok(bench) = Bench::new(spec, Parts::ALL, 1) else {
        return;
    };
    for order in Order::ALL {
        let itinerary = bench.plan(&schedule, order);
        let mut visited: Vec<u32> = itinerary.visits.iter().map(|v| v.pose).collect();
        let ordered = itinerary.visits.is_sorted_by_key(|v| v.at_seconds);
        watch.holds(ordered, &order.name());
        visited.extend(itinerary.unreachable.iter().map(|(pose, _)| *pose));
        visited.sort_unstable();
        let all: Vec<u32> = (0..schedule.poses.len() as u32).collect();
        watch.holds(visited == all, &order.name());
        watch.spent(all.len());
    }
}

fn readings(spec: &InstrumentSpec, extent: Extent, watch: &mut Finding) {
    // Below a tenth of a degree no arm goes.
    let cases = extent.subset(pairs_above(2e-3), 6);
    let schedule = schedule_of(&cases, Symmetry::FULL);
    let Ok(bench) = Bench::new(spec, Parts::ALL, 1) else {
        return;
    };
    let itinerary = bench.plan(&schedule, Order::Sorted);
    let session = bench.session(&itinerary, 1);
    let mut all = materials();
    all.extend(cases::material("kind = \"ggx\"\nalpha = 1e-2").map(|brdf| ("ggx 1e-2", brdf)));
    for (what, brdf) in extent.subset(all, 2) {
        let measured = session.measure(&*brdf, &schedule);
        watch.spent(cases.len());
        for (k, case) in cases.iter().enumerate() {
            let is_fine = measured.outcomes[k] != Outcome::Reading
                || measured.details.as_ref().is_some_and(|details| {
                    let mut uncertain = [details.type_a[k], details.type_b[k]].into_iter();
                    measured.values[k].is_finite()
                        && uncertain.all(|u| (0.0..=f64::MAX).contains(&u))
                });
            watch.holds(is_fine, &format_args!("{what}, {}", case.name));
        }
    }
}
