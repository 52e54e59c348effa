//! Planners, for budgets of one pose on, on materials that tell them nothing or too much.

use super::reconstructions::materials;
use super::{Check, Extent, Family, Law, Watch};
use crate::acquisition::{self, Planner, Task, acquire};
use crate::brdf::Brdf;
use crate::geometry::{Symmetry, distance};
use crate::parametrization;
use crate::registry;
use std::sync::Arc;

pub(super) const FAMILY: Family = Family {
    name: "planners",
    summary: "budgets 1, 2, 3 … 24 on black, constant, spiked, missing and mirror-like materials",
    checks,
};

const POSES: Law =
    Law::strict("distinct poses above the horizon, no more than the budget, or a reason");

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = Vec::new();
    for entry in acquisition::all() {
        for text in entry.examples {
            let Ok(planner) = registry::read_text(&entry, text) else {
                continue;
            };
            let planner: Arc<dyn Planner> = Arc::from(planner);
            let name = match text.is_empty() {
                true => entry.kind.to_owned(),
                false => format!("{} {}", entry.kind, text.replace('\n', ", ")),
            };
            checks.push(Check::new(name, POSES, move |watch| {
                for (what, brdf) in extent.of(materials(), 3) {
                    let budgets: &[usize] = match extent {
                        Extent::Whole => &[1, 2, 3, 24],
                        Extent::Short => &[1, 12],
                    };
                    for &budget in budgets {
                        plan(&*planner, &*brdf, budget, what, watch);
                    }
                }
            }));
        }
    }
    checks
}

fn plan(planner: &dyn Planner, brdf: &dyn Brdf, budget: usize, what: &str, watch: &mut Watch) {
    let Some(entry) = parametrization::find("half-difference") else {
        return;
    };
    let symmetry = Symmetry::FULL;
    let task = Task {
        form: entry.form(symmetry),
        budget,
        seed: 1,
        machine: None,
        go_on: &|| true,
        truth: Some(brdf),
    };
    let at = format!("{what}, {budget}");
    let measured = match acquire(planner, &task, brdf) {
        Ok(measured) => measured,
        Err(reason) => {
            watch.holds(!reason.to_string().is_empty(), &at);
            return;
        }
    };
    let poses = &measured.schedule.poses;
    watch.spent(poses.len());
    watch.holds(!poses.is_empty() && poses.len() <= budget, &at);
    for (k, pose) in poses.iter().enumerate() {
        let mut earlier = poses[..k].iter();
        let new = !earlier.any(|p| distance(&p.pair, &pose.pair, symmetry) < 1e-9);
        watch.holds(
            new && pose.pair.is_above_horizon(),
            &format_args!("{at}, pose {k}"),
        );
    }
}
