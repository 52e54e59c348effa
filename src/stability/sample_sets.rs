//! Sample sets in every parametrization, for budgets of one pose to a million.

use super::cases::{self, SYMMETRIES};
use super::{Check, Extent, Family, Finding, Law};
use crate::geometry::distance;
use crate::parametrization::Parametrization;
use crate::registry;
use crate::schedule::{self, SampleSet};
use std::collections::HashSet;
use std::sync::Arc;

pub(super) const FAMILY: Family = Family {
    name: "sample-sets",
    summary: "budgets 1, 2, 3 … 10⁶: at most so many, distinct, above the horizon, at their coordinates",
    checks,
};

const POSES: Law =
    Law::strict("distinct poses above the horizon, at their coordinates, no more than the budget");

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = Vec::new();
    for entry in schedule::all() {
        for example in cases::examples(vec![entry]) {
            let set: Arc<dyn SampleSet> = Arc::from(example.member);
            for (what, symmetry) in [SYMMETRIES[1], SYMMETRIES[3]] {
                for (name, form) in extent.subset(cases::forms(symmetry), 4) {
                    // A ratio is of three axes or of four.
                    if set.check(form.axes()).is_err() {
                        continue;
                    }
                    let set = Arc::clone(&set);
                    let member = format!("{}, {name} ({what})", set.label());
                    checks.push(Check::new(member, POSES, move |watch| {
                        poses(&*set, &form, &BUDGETS, watch);
                    }));
                }
            }
        }
        // The largest budget, once for each set.
        let plain = cases::forms(SYMMETRIES[1].1).into_iter().nth(1);
        // Those without an example need a file.
        let example = entry.examples.first();
        let set = example.and_then(|text| registry::read_text(&entry, text).ok());
        if let (Extent::Whole, Some((name, form)), Some(set)) = (extent, plain, set) {
            let member = format!("{}, {name}, a million", set.label());
            checks.push(Check::new(member, POSES, move |watch| {
                poses(&*set, &form, &[1_000_000], watch);
            }));
        }
    }
    checks
}

const BUDGETS: [usize; 5] = [1, 2, 3, 17, 1000];

fn poses(
    set: &dyn SampleSet,
    form: &Arc<dyn Parametrization>,
    budgets: &[usize],
    watch: &mut Finding,
) {
    for &budget in budgets {
        for seed in [0, u64::MAX] {
            // A budget that is too small for a set is refused by name.
            let schedule = match set.plan(form, budget, seed) {
                Ok(schedule) => schedule,
                Err(refused) => {
                    let named = refused.to_string().contains(&budget.to_string());
                    watch.holds(named, &refused);
                    continue;
                }
            };
            let poses = &schedule.poses;
            watch.spent(poses.len());
            let fits = !poses.is_empty() && poses.len() <= budget;
            watch.holds(fits, &format_args!("{} poses of {budget}", poses.len()));
            let bits = |x: &f64| x.to_bits();
            let mut seen = HashSet::new();
            for pose in poses {
                let mut axes = form.axes().iter().zip(&pose.coords);
                let inside = axes.all(|(axis, c)| (axis.range[0]..=axis.range[1]).contains(c));
                let there = form.inverse(&pose.coords);
                let off = there.map(|pair| distance(&pair, &pose.pair, form.symmetry()));
                let new = seen.insert(pose.coords.each_ref().map(bits));
                // Directions that were given are those of their coordinates to rounding.
                let there = off.is_some_and(|off| off <= form.facts().round_trip[1]);
                let holds = inside && there && new && pose.pair.is_above_horizon();
                watch.holds(holds, &format_args!("{:?} of {budget}", pose.coords));
            }
        }
    }
}
