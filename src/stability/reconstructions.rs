//! Reconstructions of black, constant, spiked and mirror-like materials from few readings in grids, points, sheets and
//! lines.

use super::cases::{self, Case, pairs};
use super::{Check, Extent, Family, Law, ROUNDING, Watch};
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::instrument::{Ideal, Instrument};
use crate::measurement::Measurement;
use crate::parametrization::{self, Parametrization};
use crate::reconstruct::{self, EPSILON, Reconstruct};
use crate::registry;
use crate::schedule::{Grid, Pose, SampleSet, Schedule, SobolSet};
use std::sync::Arc;

pub(super) const FAMILY: Family = Family {
    name: "reconstructions",
    summary: "of 1, 2, 3 and more readings in grids, points, sheets and lines: finite, and a constant is one",
    checks,
};

const FINITE: Law = Law::strict("finite and not negative, or refused with a reason");

/// A value is a logarithm between: its rounding, and one for each reading that has a weight.
const CONSTANT: Law = Law {
    name: "readings that are equal",
    unit: "1/sr",
    allowed: 16.0,
};

/// A function of the pair as a material.
struct Made {
    symmetry: Symmetry,
    of: fn(&DirectionPair) -> Option<f64>,
}

impl Brdf for Made {
    fn channels(&self) -> &Channels {
        &Channels::Luminance
    }
    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }
    fn conserves_energy(&self) -> bool {
        false
    }
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        match (self.of)(pair) {
            Some(value) => {
                out[0] = if pair.is_above_horizon() { value } else { 0.0 };
                Presence::Present
            }
            None => {
                out[0] = 0.0;
                Presence::Missing
            }
        }
    }
}

/// A material by name; those that are constant have a value.
type Material = (&'static str, Option<f64>, fn(&DirectionPair) -> Option<f64>);

const MATERIALS: [Material; 7] = [
    ("black", Some(0.0), |_| Some(0.0)),
    ("constant 1e-30", Some(1e-30), |_| Some(1e-30)),
    ("constant 1", Some(1.0), |_| Some(1.0)),
    ("constant 1e12", Some(1e12), |_| Some(1e12)),
    ("bright at the mirror", None, |pair| {
        let h = pair.half();
        Some(if h.truncate().length() < 0.02 {
            1e12
        } else {
            1e-30
        })
    }),
    ("steps of 42 decades", None, |pair| {
        let steep = (40.0 * pair.omega_i.cos_theta()) as i32 % 3;
        Some([1e-30, 1.0, 1e12][steep as usize])
    }),
    ("half of it missing", None, |pair| {
        (pair.separation() > 0.8).then_some(0.25)
    }),
];

/// Layouts of poses.
const LAYOUTS: [&str; 5] = ["grid", "points", "sheets", "line", "mirror"];

fn schedule(layout: &str, form: &Arc<dyn Parametrization>, budget: usize) -> Option<Schedule> {
    let pair = |[ti, pi, to, po]: [f64; 4]| DirectionPair::from_spherical(ti, pi, to, po);
    let share = |k: usize| (k as f64 + 0.5) / budget as f64;
    let pairs: Vec<DirectionPair> = match layout {
        "grid" => return Grid::default().plan(form, budget, 1).ok(),
        "points" => return SobolSet {}.plan(form, budget, 1).ok(),
        "sheets" => (0..budget)
            .map(|k| {
                let turn = 2.4 * k as f64;
                pair([[0.1, 0.6, 1.1][k % 3], 0.0, 1.4 * share(k).sqrt(), turn])
            })
            .collect(),
        "line" => (0..budget)
            .map(|k| pair([0.6, 0.0, 1.5 * share(k), std::f64::consts::PI]))
            .collect(),
        // All within a micro-radian of one mirror pair.
        _ => (0..budget)
            .map(|k| pair([0.6, 0.0, 0.6 + 1e-6 * share(k), std::f64::consts::PI]))
            .collect(),
    };
    let pose = |pair: DirectionPair| Pose {
        coords: form.forward(&pair),
        pair,
    };
    Some(Schedule {
        parametrization: Arc::clone(form),
        sample_set: layout.into(),
        poses: pairs.into_iter().map(pose).collect(),
        lattice: None,
        unphysical_share: 0.0,
        assumes: None,
    })
}

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = Vec::new();
    for entry in reconstruct::all() {
        for text in entry.examples {
            let Ok(method) = registry::read_text(&entry, text) else {
                continue;
            };
            let method: Arc<dyn Reconstruct> = Arc::from(method);
            let name = match text.is_empty() {
                true => entry.kind.to_owned(),
                false => format!("{} {}", entry.kind, text.replace('\n', ", ")),
            };
            for (law, is_constant) in [(FINITE, false), (CONSTANT, true)] {
                // A fit has the constants of its model, and a prior those of its materials.
                let knows = method.prior().is_some() || entry.kind == "components";
                if is_constant && (knows || entry.kind == "fit") {
                    continue;
                }
                let method = Arc::clone(&method);
                checks.push(Check::new(&*name, law, move |watch| {
                    reconstruct(&*method, is_constant, extent, watch);
                }));
            }
        }
    }
    checks
}

fn reconstruct(method: &dyn Reconstruct, is_constant: bool, extent: Extent, watch: &mut Watch) {
    let symmetry = Symmetry::FULL;
    let pairs: Vec<Case> = extent.of(pairs(), 4);
    // What is below the horizon is black, whatever is known.
    let below = DirectionPair::new(
        Direction::from_spherical(1.7, 0.3),
        Direction::from_spherical(0.3, 0.1),
    );
    let kinds = ["half-difference", "spherical", "orthographic", "hybrid"];
    let entries = parametrization::all();
    let kinds = entries.iter().filter(|e| kinds.contains(&e.kind));
    let forms: Vec<_> = kinds.map(|e| (e.kind, e.form(symmetry))).collect();
    let mut combinations = Vec::new();
    for (material, (_, constant, _)) in MATERIALS.iter().enumerate() {
        for form in 0..forms.len() {
            for layout in LAYOUTS {
                if (is_constant && constant.is_none()) || method.needs_grid() != (layout == "grid")
                {
                    continue;
                }
                for budget in [1, 2, 3, 60, 400] {
                    combinations.push((material, form, layout, budget));
                }
            }
        }
    }
    // A step that meets every layout and budget.
    for (material, form, layout, budget) in extent.of(combinations, 13) {
        let (what, constant, of) = MATERIALS[material];
        let (kind, form) = &forms[form];
        let truth = Made { symmetry, of };
        let Some(schedule) = schedule(layout, form, budget) else {
            continue;
        };
        let measured = Ideal.measure(&truth, &Arc::new(schedule));
        let at = format!("{what}, {budget} in a {layout}, {kind}");
        match constant.filter(|_| is_constant) {
            Some(constant) => same(method, &measured, constant, &pairs, &at, watch),
            None => finite(method, &measured, &pairs, &below, &at, watch),
        }
    }
}

fn finite(
    method: &dyn Reconstruct,
    measured: &Measurement,
    pairs: &[Case],
    below: &DirectionPair,
    at: &str,
    watch: &mut Watch,
) {
    let copy = match method.reconstruct(measured) {
        Ok(copy) => copy,
        Err(reason) => {
            watch.holds(!reason.to_string().is_empty(), &at);
            return;
        }
    };
    watch.holds(
        copy.luminance(below) == Some(0.0),
        &format_args!("{at}, below the horizon"),
    );
    let all: Vec<DirectionPair> = pairs.iter().map(|case| case.pair).collect();
    let values = values(&*copy, &all);
    watch.spent(all.len());
    for (case, value) in pairs.iter().zip(values) {
        let holds = (0.0..=f64::MAX).contains(&value);
        watch.holds(holds, &format_args!("{at}: {value:e} at {}", case.name));
    }
}

fn same(
    method: &dyn Reconstruct,
    measured: &Measurement,
    constant: f64,
    pairs: &[Case],
    at: &str,
    watch: &mut Watch,
) {
    let Ok(copy) = method.reconstruct(measured) else {
        return;
    };
    let all: Vec<DirectionPair> = pairs.iter().map(|case| case.pair).collect();
    let values = values(&*copy, &all);
    watch.spent(all.len());
    let size = constant + EPSILON;
    let conditioning =
        ROUNDING * size * (1.0 + size.ln().abs()) * (1.0 + measured.readings() as f64);
    for (case, value) in pairs.iter().zip(values) {
        watch.see(
            (value - constant).abs(),
            conditioning,
            &format_args!("{at}, {}", case.name),
        );
    }
}

fn values(brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Vec<f64> {
    let mut values = vec![0.0; pairs.len()];
    let mut presence = vec![Presence::Present; pairs.len()];
    brdf.eval_batch(pairs, &mut values, &mut presence);
    values
}

/// A mirror-like material, for those who measure one.
pub(super) fn mirror() -> Option<Box<dyn Brdf>> {
    cases::material("kind = \"ggx\"\nalpha = 1e-6")
}

/// The materials of this family, by name.
pub(super) fn materials() -> Vec<(&'static str, Box<dyn Brdf>)> {
    let symmetry = Symmetry::FULL;
    let made = |(name, _, of): Material| (name, Box::new(Made { symmetry, of }) as Box<dyn Brdf>);
    let mut all: Vec<_> = MATERIALS.into_iter().map(made).collect();
    all.extend(mirror().map(|mirror| ("mirror 1e-6", mirror)));
    all
}
