//! Instruments: positions of their axes at extreme pairs, and readings of extreme materials.

use super::cases::{Case, pairs, pairs_above};
use super::reconstructions::materials;
use super::{Check, Extent, Family, Law, ROUNDING, Watch, cases};
use crate::geometry::{Symmetry, distance};
use crate::instrument::{self, Bench, Ideal, Instrument, InstrumentSpec, Machine, Order, Parts};
use crate::measurement::{Measurement, Outcome};
use crate::parametrization;
use crate::schedule::{Pose, Schedule};
use std::sync::Arc;

pub(super) const FAMILY: Family = Family {
    name: "instruments",
    summary: "axes that make the pair, readings of extreme materials with their uncertainties, itineraries in order",
    checks,
};

/// Four rotations, each of numbers up to π, there and back.
const AXES: Law = Law {
    name: "positions make the pair",
    unit: "rad",
    allowed: 64.0,
};
const READINGS: Law = Law::strict("finite readings with uncertainties, or a reason");
const IDEAL: Law = Law::strict("the ideal reading is the BRDF, to the bit");
const TIMES: Law = Law::strict("each reachable pose visited once, in the order of the clock");

fn specs() -> Vec<(&'static str, InstrumentSpec)> {
    let read =
        |preset: instrument::Preset| Some((preset.name, instrument::read(preset.text).ok()?));
    instrument::presets().into_iter().filter_map(read).collect()
}

/// The extreme pairs as a schedule.
fn schedule(cases: &[Case], symmetry: Symmetry) -> Option<Arc<Schedule>> {
    let form = parametrization::find("half-difference")?.form(symmetry);
    let pose = |case: &Case| Pose {
        coords: form.forward(&case.pair),
        pair: case.pair,
    };
    Some(Arc::new(Schedule {
        sample_set: "extremes".into(),
        poses: cases.iter().map(pose).collect(),
        lattice: None,
        unphysical_share: 0.0,
        assumes: None,
        parametrization: form,
    }))
}

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = vec![Check::new("ideal", IDEAL, move |watch| {
        ideal(extent, watch)
    })];
    for (name, spec) in specs() {
        let spec = Arc::new(spec);
        let of = Arc::clone(&spec);
        checks.push(Check::new(name, AXES, move |watch| {
            axes(&of, extent, watch)
        }));
        let of = Arc::clone(&spec);
        checks.push(Check::new(name, TIMES, move |watch| {
            times(&of, extent, watch)
        }));
        checks.push(Check::new(name, READINGS, move |watch| {
            readings(&spec, extent, watch)
        }));
    }
    checks
}

fn ideal(extent: Extent, watch: &mut Watch) {
    let cases = extent.of(pairs(), 2);
    let Some(schedule) = schedule(&cases, Symmetry::FULL) else {
        return;
    };
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

fn axes(spec: &InstrumentSpec, extent: Extent, watch: &mut Watch) {
    let Ok(machine) = Machine::new(spec) else {
        return;
    };
    let machine = machine.without_limits();
    let only_isotropic = machine.class().isotropic_only();
    for Case { name, pair } in extent.of(pairs(), 3) {
        for free in [false, true] {
            watch.spent(1);
            let Ok(positions) = machine.place(&pair, free) else {
                watch.holds(false, &name);
                continue;
            };
            let symmetry = Symmetry {
                isotropic: free || only_isotropic,
                ..Symmetry::NONE
            };
            let made = machine.forward(&positions);
            watch.see(distance(&made, &pair, symmetry), ROUNDING, &name);
        }
    }
}

fn times(spec: &InstrumentSpec, extent: Extent, watch: &mut Watch) {
    let (Ok(bench), Some(schedule)) = (
        Bench::new(spec, Parts::ALL, 1),
        schedule(&extent.of(pairs(), 3), Symmetry::FULL),
    ) else {
        return;
    };
    for order in Order::ALL {
        let itinerary = bench.plan(&schedule, order);
        let mut visited: Vec<u32> = itinerary.visits.iter().map(|v| v.pose).collect();
        let ordered = itinerary
            .visits
            .windows(2)
            .all(|w| w[0].at_seconds <= w[1].at_seconds);
        watch.holds(ordered, &format_args!("{}", order.name()));
        visited.extend(itinerary.unreachable.iter().map(|(pose, _)| *pose));
        visited.sort_unstable();
        let all: Vec<u32> = (0..schedule.poses.len() as u32).collect();
        watch.holds(visited == all, &format_args!("{}", order.name()));
        watch.spent(all.len());
    }
}

fn readings(spec: &InstrumentSpec, extent: Extent, watch: &mut Watch) {
    // Below a tenth of a degree no arm goes.
    let cases = extent.of(pairs_above(2e-3), 6);
    let (Ok(bench), Some(schedule)) = (
        Bench::new(spec, Parts::ALL, 1),
        schedule(&cases, Symmetry::FULL),
    ) else {
        return;
    };
    let itinerary = bench.plan(&schedule, Order::Sorted);
    let session = bench.session(&itinerary, 1);
    let mut all = materials();
    all.extend(cases::material("kind = \"ggx\"\nalpha = 1e-2").map(|brdf| ("ggx 1e-2", brdf)));
    for (what, brdf) in extent.of(all, 2) {
        let measured: Measurement = session.measure(&*brdf, &schedule);
        watch.spent(cases.len());
        for (k, case) in cases.iter().enumerate() {
            let finite = match (measured.outcomes[k], &measured.details) {
                (Outcome::Reading, Some(details)) => {
                    let uncertain = [details.type_a[k], details.type_b[k]];
                    measured.values[k].is_finite()
                        && uncertain.iter().all(|u| (0.0..=f64::MAX).contains(u))
                }
                (Outcome::Reading, None) => false,
                _ => true,
            };
            watch.holds(finite, &format_args!("{what}, {}", case.name));
        }
    }
}
