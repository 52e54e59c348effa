//! Coordinates, warps and reconstructions over their budget.

use super::truths::{self, DIAGRAMS, ERRORS, Pairs, Truth, text};
use crate::bench::{Column, Ladder, Rung, Section, Settings, Watch};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::instrument::{Ideal, Instrument};
use crate::parametrization::Parametrization;
use crate::reconstruct::{self, Reconstruct};
use crate::registry;
use crate::validation::coordinates;
use std::rc::Rc;
use std::sync::Arc;

/// Planning, reconstructing and evaluating; grids for the methods that need one, else Sobol points.
pub(super) const SECTION: Section = Section {
    name: "reconstructions",
    summary: "coordinates, warps and reconstructions, over the budget of readings",
    names: &[
        "material",
        "parametrization",
        "warp",
        "reconstruction",
        "budget",
    ],
    color: 3,
    columns: &[
        ERRORS[0],
        ERRORS[1],
        Column::exact("readings", "readings of the schedule"),
    ],
    diagrams: &DIAGRAMS,
    targets: (&["nrmse", "log_relative"], &[0.1, 0.03, 0.01, 3e-3]),
    ladders,
};

/// Coordinates of a quick bench.
const FEW: [&str; 3] = ["half-difference", "hybrid", "spherical"];

fn ladders(settings: &Settings) -> Result<Vec<Ladder>, Error> {
    let (pairs, budgets, of_system): (_, &[usize], _) = match settings.quick {
        true => (Pairs::new(1 << 11)?, &[125, 500], 125),
        false => (Pairs::new(1 << 13)?, &[250, 1000, 4000, 16_000], 1000),
    };
    let mut materials = vec![truths::metal("0.4")?, truths::metal("0.1")?];
    if !settings.quick || settings.merl.is_some() {
        materials.push(truths::table(settings)?);
    }
    let mut ladders = Vec::new();
    for (material, brdf) in materials {
        let truth = Truth::new(brdf, &pairs);
        for (names, form) in forms(settings.quick) {
            for entry in reconstruct::all() {
                let method = registry::read_text(&entry, "");
                let method: Rc<dyn Reconstruct> = method.map_err(Error::internal)?.into();
                // Of all readings at once few can be taken.
                let most = match method.weighs_readings() {
                    true => of_system,
                    false => usize::MAX,
                };
                let budgets = budgets.iter().filter(|b| **b <= most);
                let rungs = budgets.map(|n| rung(&truth, &form, &method, *n));
                let [parametrization, warp] = &names;
                let names = [&material, parametrization, warp, entry.kind];
                ladders.push(Ladder::new(names, rungs));
            }
        }
    }
    Ok(ladders)
}

/// Coordinates with names of them and of their warp: as they are, and with nodes crowded at the first pole.
fn forms(quick: bool) -> Vec<([String; 2], Arc<dyn Parametrization>)> {
    let mut all = coordinates(Symmetry::FULL);
    all.retain(|of| !quick || FEW.contains(&&*of.kind));
    let named = all.into_iter().filter_map(|of| {
        let form = of.form(Symmetry::FULL).ok()?;
        let warp = of.warp.values().next();
        let warp = warp.map_or("none".into(), |warp| warp.name());
        Some(([of.kind, warp], form))
    });
    named.collect()
}

fn rung(
    truth: &Rc<Truth>,
    form: &Arc<dyn Parametrization>,
    method: &Rc<dyn Reconstruct>,
    budget: usize,
) -> Rung {
    let judge_by = Rc::clone(truth);
    let (truth, form, method) = (Rc::clone(truth), Arc::clone(form), Rc::clone(method));
    let [readings, pairs] = [budget, truth.set.count()].map(|n| n as f64);
    // A reading about as much as a look-up; but of all readings at once, a system of them and all of them for each pair.
    let work = match method.weighs_readings() {
        true => readings.powi(3) / 50.0 + readings * pairs,
        false => readings + pairs,
    };
    let pass = move |watch: &Watch| {
        let schedule = truths::planned(&*method, &form, budget)?;
        let measured = watch.aside(|| Ideal.measure(&*truth.brdf, &schedule));
        reconstruct::forget_searches();
        let copy = method.reconstruct(&measured).map_err(text)?;
        Ok((truth.set.evaluate(&*copy), measured.readings()))
    };
    Rung::new(budget.to_string(), work, pass, move |(values, readings)| {
        Ok(judge_by.judged(&values, &[readings as f64]))
    })
}
