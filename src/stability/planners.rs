//! Planners, for budgets of one pose on, on materials without information and with extreme values.

use super::cases::{Example, examples, half_difference};
use super::reconstructions::materials;
use super::{Check, Extent, Family, Finding, Law};
use crate::acquisition::{self, Planner, Task, acquire};
use crate::brdf::Brdf;
use crate::geometry::{Symmetry, distance};

pub(super) const FAMILY: Family = Family {
    name: "planners",
    summary: "budgets 1, 2, 3 … 24 on black, constant, spiked, missing and mirror-like materials",
    checks,
};

const POSES: Law =
    Law::strict("distinct poses above the horizon, no more than the budget, or a reason");

fn checks(extent: Extent) -> Vec<Check> {
    let check = |example: Example<dyn Planner>| {
        let plans = move |watch: &mut Finding| plans(&*example.member, extent, watch);
        Check::new(example.name, POSES, plans)
    };
    examples(acquisition::all()).map(check).collect()
}

fn plans(planner: &dyn Planner, extent: Extent, watch: &mut Finding) {
    let budgets: &[usize] = match extent {
        Extent::Whole => &[1, 2, 3, 24],
        Extent::Short => &[1, 12],
    };
    for (what, brdf) in extent.subset(materials(), 3) {
        for &budget in budgets {
            plan(planner, &*brdf, budget, what, watch);
        }
    }
}

fn plan(planner: &dyn Planner, brdf: &dyn Brdf, budget: usize, what: &str, watch: &mut Finding) {
    let symmetry = Symmetry::FULL;
    let task = Task {
        truth: Some(brdf),
        ..Task::plain(&half_difference(symmetry), budget, 1)
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
        let is_new = !earlier.any(|p| distance(&p.pair, &pose.pair, symmetry) < 1e-9);
        let holds = is_new && pose.pair.is_above_horizon();
        watch.holds(holds, &format_args!("{at}, pose {k}"));
    }
}
