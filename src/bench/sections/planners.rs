//! Planners and sample sets over their budget.

use super::truths::{self, DIAGRAMS, ERRORS, Pairs, SEED, Truth, text};
use crate::acquisition::{self, Planner, Task, further, nothing, once, scheduled};
use crate::bench::{Column, Ladder, Rung, Section, Settings, Watch};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::instrument::{Ideal, Instrument};
use crate::parametrization::usual_form;
use crate::reconstruct::{self, Kriging, Reconstruct};
use crate::registry::read_text;
use crate::schedule;
use std::rc::Rc;
use std::sync::Arc;

/// Choosing alone: neither reading nor reconstructing is timed.
pub(super) const SECTION: Section = Section {
    name: "planners",
    summary: "planners and sample sets, over the budget; kriging of the readings",
    names: &["material", "planner", "budget"],
    color: 1,
    columns: &[
        ERRORS[0],
        ERRORS[1],
        Column::exact("readings", "readings at the poses"),
    ],
    diagrams: &DIAGRAMS,
    targets: (&["nrmse", "log_relative"], &[0.3, 0.1, 0.03]),
    ladders,
};

fn ladders(settings: &Settings) -> Result<Vec<Ladder>, Error> {
    let (pairs, budgets): (_, &[usize]) = match settings.quick {
        true => (Pairs::new(1 << 11)?, &[16, 32]),
        false => (Pairs::new(1 << 13)?, &[16, 32, 64, 128]),
    };
    let mut materials = vec![truths::metal("0.1")?];
    if !settings.quick {
        materials.push(truths::metal("0.4")?);
    }
    let mut planners: Vec<(&str, Rc<dyn Planner>)> = Vec::new();
    // A set without examples is nothing without a file of poses.
    let sets = schedule::all().into_iter();
    for entry in sets.filter(|entry| !entry.examples.is_empty()) {
        let set = read_text(&entry, "").map_err(Error::internal)?;
        // A picture has more poses than the smallest budget.
        if set
            .plan(&usual_form(Symmetry::FULL), budgets[0], SEED)
            .is_err()
        {
            continue;
        }
        planners.push((entry.kind, once(set).into()));
    }
    for entry in acquisition::all() {
        let planner = read_text(&entry, "").map_err(Error::internal)?;
        planners.push((entry.kind, planner.into()));
    }
    let mut ladders = Vec::new();
    for (material, brdf) in materials {
        let truth = Truth::new(brdf, &pairs);
        for (name, planner) in &planners {
            let rungs = budgets.iter().map(|n| rung(&truth, planner, *n));
            ladders.push(Ladder::new([&material, *name], rungs));
        }
    }
    Ok(ladders)
}

fn rung(truth: &Rc<Truth>, planner: &Rc<dyn Planner>, budget: usize) -> Rung {
    let (brdf, planner) = (Rc::clone(&truth.brdf), Rc::clone(planner));
    let pass = move |watch: &Watch| {
        let task = Task {
            truth: Some(&*brdf),
            ..Task::plain(&usual_form(Symmetry::FULL), budget, SEED)
        };
        let mut so_far = nothing(&task);
        reconstruct::forget_searches();
        while let Some(poses) = further(&*planner, &task, &so_far).map_err(text)? {
            let schedule = Arc::new(scheduled(&task, &*planner, poses));
            so_far = watch.aside(|| Ideal.measure(&*brdf, &schedule));
        }
        Ok(so_far)
    };
    let truth = Rc::clone(truth);
    let work = budget as f64;
    Rung::new(budget.to_string(), work, pass, move |measured| {
        let copy = Kriging::default().reconstruct(&measured).map_err(text)?;
        let values = truth.set.evaluate(&*copy);
        Ok(truth.judged(&values, &[measured.readings() as f64]))
    })
}
