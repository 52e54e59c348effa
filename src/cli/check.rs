//! `gonio check`.

use super::{ConfigArgs, SeedArgs, print};
use crate::error::Error;
use crate::experiment::Plan;
use crate::geometry::Symmetry;
use clap::Args;

#[derive(Debug, Args)]
pub(super) struct Check {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    seed: SeedArgs,
}

impl Check {
    pub(super) fn run(self) -> Result<(), Error> {
        let mut source = self.config.source()?;
        self.seed.apply(&mut source)?;
        let plan = super::plan(&source)?;
        if let Some(question) = &plan.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        print(&materials(&plan))?;
        for symmetry in plan.symmetries() {
            print(&format!("\nschedules for {}\n", words(symmetry)))?;
            schedules(&plan, symmetry)?;
        }
        let names: Vec<_> = plan
            .reconstructions
            .iter()
            .map(|r| r.name.as_str())
            .collect();
        let measures: Vec<_> = plan.measures.iter().map(|m| m.name()).collect();
        print(&format!(
            "\nreconstructions: {}\nmeasures: {}, {} pairs each\nseeds: {:?}\n{} reconstructions, {} rows\n",
            names.join(", "),
            measures.join(", "),
            plan.metrics.pairs,
            plan.seeds,
            plan.jobs(),
            plan.rows()
        ))
    }
}

fn materials(plan: &Plan) -> String {
    let mut out = format!("materials: {}\n", plan.materials.len());
    let width = plan.materials.iter().map(|m| m.name.chars().count());
    let width = width.max().unwrap_or(0);
    for m in &plan.materials {
        out += &format!("  {:<width$}  {}\n", m.name, words(m.symmetry));
    }
    out
}

/// Prints the schedules of the first seed, line by line: large ones take their time.
fn schedules(plan: &Plan, symmetry: Symmetry) -> Result<(), Error> {
    let labels = plan.parametrizations.iter().map(|c| c.label().len());
    let w = labels.max().unwrap_or(0).max(15);
    let sets = plan.sample_sets.iter().map(|s| s.name.chars().count());
    let v = sets.max().unwrap_or(0).max(10);
    print(&format!(
        "  {:<w$}  {:<v$}  {:>8}  {:>8}  {:>10}  nodes\n",
        "parametrization", "sample set", "budget", "poses", "unphysical"
    ))?;
    for coordinates in &plan.parametrizations {
        let form = coordinates.form(symmetry);
        let form = form.map_err(|e| Error::Internal(format!("a warp that was checked: {e}")))?;
        for set in &plan.sample_sets {
            for &budget in &plan.budgets {
                let line = match set.set.plan(&form, budget, plan.seeds[0]) {
                    Err(e) => format!("{e}"),
                    Ok(schedule) => {
                        let shape = schedule.lattice.as_ref().map(|lattice| {
                            let shape = lattice.shape();
                            let shape: Vec<_> = shape.iter().map(usize::to_string).collect();
                            shape.join("×")
                        });
                        format!(
                            "{:>8}  {:>10.4}  {}",
                            schedule.poses.len(),
                            schedule.unphysical_share,
                            shape.unwrap_or_else(|| "scattered".into())
                        )
                    }
                };
                print(&format!(
                    "  {:<w$}  {:<v$}  {budget:>8}  {line}\n",
                    coordinates.label(),
                    set.name
                ))?;
            }
        }
    }
    Ok(())
}

fn words(symmetry: Symmetry) -> String {
    let isotropic = if symmetry.isotropic {
        "isotropic"
    } else {
        "anisotropic"
    };
    let mut words = vec![isotropic];
    words.extend(symmetry.reciprocal.then_some("reciprocal"));
    words.extend(symmetry.bilateral.then_some("bilateral"));
    words.join(", ")
}
