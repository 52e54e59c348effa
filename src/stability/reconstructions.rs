//! Reconstructions of black, constant, spiked and mirror-like materials from few readings in grids, points, sheets and
//! lines.

use super::cases::{self, Case, examples, pairs};
use super::{Check, Extent, Family, Finding, Law, ROUNDING, Test};
use crate::brdf::Brdf;
use crate::brdf::testing::made;
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument::{Ideal, Instrument};
use crate::metrics;
use crate::parametrization::{self, Parametrization};
use crate::reconstruct::{self, EPSILON, Reconstruct};
use crate::schedule::{Grid, SampleSet, Schedule, SobolSet};
use std::f64::consts::PI;
use std::sync::Arc;

pub(super) const FAMILY: Family = Family {
    name: "reconstructions",
    summary: "of 1, 2, 3 and more readings in grids, points, sheets and lines: finite, and a constant is one",
    checks,
};

const FINITE: Law = Law::strict("finite and not negative, or refused with a reason");

/// A value is a logarithm between: its rounding, and one for each reading that has a weight.
const CONSTANT: Law = Law::bounded("readings that are equal", "1/sr", 16.0);

/// A material by name; those that are constant have a value.
type Material = (&'static str, Option<f64>, fn(&DirectionPair) -> Option<f64>);

/// A material of a function, black below the horizon.
fn material(of: fn(&DirectionPair) -> Option<f64>) -> impl Brdf {
    made(Symmetry::FULL, move |pair| {
        Some([of(pair)? * f64::from(u8::from(pair.is_above_horizon()))])
    })
}

const MATERIALS: [Material; 7] = [
    ("black", Some(0.0), |_| Some(0.0)),
    ("constant 1e-30", Some(1e-30), |_| Some(1e-30)),
    ("constant 1", Some(1.0), |_| Some(1.0)),
    ("constant 1e12", Some(1e12), |_| Some(1e12)),
    ("bright at the mirror", None, |pair| {
        let is_near = pair.half().truncate().length() < 0.02;
        Some(if is_near { 1e12 } else { 1e-30 })
    }),
    ("steps of 42 decades", None, |pair| {
        let steep = (40.0 * pair.omega_i.cos_theta()) as i32 % 3;
        Some([1e-30, 1.0, 1e12][steep as usize])
    }),
    ("half of it missing", None, |pair| {
        (pair.separation() > 0.8).then_some(0.25)
    }),
];

const LAYOUTS: [&str; 5] = ["grid", "points", "sheets", "line", "mirror"];

fn schedule(layout: &str, form: &Arc<dyn Parametrization>, budget: usize) -> Option<Schedule> {
    let pair = |[ti, pi, to, po]: [f64; 4]| DirectionPair::from_spherical(ti, pi, to, po);
    let share = |k: usize| (k as f64 + 0.5) / budget as f64;
    let pairs = (0..budget).map(|k| match layout {
        "sheets" => {
            let turn = 2.4 * k as f64;
            pair([[0.1, 0.6, 1.1][k % 3], 0.0, 1.4 * share(k).sqrt(), turn])
        }
        "line" => pair([0.6, 0.0, 1.5 * share(k), PI]),
        // All within a micro-radian of one mirror pair.
        _ => pair([0.6, 0.0, 0.6 + 1e-6 * share(k), PI]),
    });
    match layout {
        "grid" => Grid::default().plan(form, budget, 1).ok(),
        "points" => SobolSet {}.plan(form, budget, 1).ok(),
        _ => Some(Schedule::of_pairs(Arc::clone(form), pairs)),
    }
}

fn checks(extent: Extent) -> Vec<Check> {
    let tests: [Test<dyn Reconstruct>; 2] = [
        (FINITE, |method, extent, watch| {
            reconstruct(method, false, extent, watch);
        }),
        (CONSTANT, |method, extent, watch| {
            reconstruct(method, true, extent, watch);
        }),
    ];
    let checks = examples(reconstruct::all()).flat_map(|example| {
        // A fit has the constants of its model, and a prior those of its materials.
        let has_constants = ["components", "fit"].contains(&example.kind);
        let is_free = !has_constants && example.member.prior().is_none();
        let tests = &tests[..1 + usize::from(is_free)];
        Check::each(example.name, example.member, extent, tests)
    });
    checks.collect()
}

fn reconstruct(method: &dyn Reconstruct, is_constant: bool, extent: Extent, watch: &mut Finding) {
    let cases = extent.subset(pairs(), 4);
    let all: Vec<DirectionPair> = cases.iter().map(|case| case.pair).collect();
    // What is below the horizon is black, whatever is known.
    let below = DirectionPair::from_spherical(1.7, 0.3, 0.3, 0.1);
    let kinds = ["half-difference", "spherical", "orthographic", "hybrid"];
    let entries = parametrization::all();
    let kinds = entries.iter().filter(|e| kinds.contains(&e.kind));
    let forms: Vec<_> = kinds.map(|e| (e.kind, e.form(Symmetry::FULL))).collect();
    let fits = |layout: &&str| method.needs_grid() == (*layout == "grid");
    let materials = MATERIALS.into_iter();
    let mut combinations = Vec::new();
    for material in materials.filter(|(_, constant, _)| !is_constant || constant.is_some()) {
        for form in &forms {
            for layout in LAYOUTS.into_iter().filter(fits) {
                for budget in [1, 2, 3, 60, 400] {
                    combinations.push((material, form, layout, budget));
                }
            }
        }
    }
    // A step that meets every layout and budget.
    for ((what, constant, of), (kind, form), layout, budget) in extent.subset(combinations, 13) {
        let Some(schedule) = schedule(layout, form, budget) else {
            continue;
        };
        let measured = Ideal.measure(&material(of), &Arc::new(schedule));
        let at = format!("{what}, {budget} in a {layout}, {kind}");
        let constant = constant.filter(|_| is_constant);
        let copy = method.reconstruct(&measured);
        if constant.is_none() {
            match &copy {
                Ok(copy) => {
                    let is_black = copy.luminance(&below) == Some(0.0);
                    watch.holds(is_black, &format_args!("{at}, below the horizon"));
                }
                Err(reason) => watch.holds(!reason.to_string().is_empty(), &at),
            }
        }
        let Ok(copy) = copy else {
            continue;
        };
        let values = metrics::evaluate(&*copy, &all).luminance;
        watch.spent(all.len());
        for (Case { name, .. }, value) in cases.iter().zip(values) {
            let Some(constant) = constant else {
                watch.is_reflectance(value, &format_args!("{at}: {value:e} at {name}"));
                continue;
            };
            let size = constant + EPSILON;
            let conditioning =
                ROUNDING * size * (1.0 + size.ln().abs()) * (1.0 + measured.readings() as f64);
            let error = (value - constant).abs();
            watch.see(error, conditioning, &format_args!("{at}, {name}"));
        }
    }
}

/// The materials of this family, by name.
pub(super) fn materials() -> Vec<(&'static str, Box<dyn Brdf>)> {
    let made = |(name, _, of): Material| (name, Box::new(material(of)) as Box<dyn Brdf>);
    let mut all: Vec<_> = MATERIALS.into_iter().map(made).collect();
    let mirror = cases::material("kind = \"ggx\"\nalpha = 1e-6");
    all.extend(mirror.map(|mirror| ("mirror 1e-6", mirror)));
    all
}
