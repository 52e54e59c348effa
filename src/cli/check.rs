//! `gonio check`.

use super::{ConfigArgs, SeedArgs, print};
use crate::error::Error;
use crate::experiment::moments::MomentsPlan;
use crate::experiment::relations::RelationsPlan;
use crate::experiment::{Kind, Material, Plan};
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
        match Kind::of(&source)? {
            Kind::Acquisition => {}
            Kind::Moments => return profiles(&MomentsPlan::read(&source)?),
            Kind::Relations => return relations(&RelationsPlan::read(&source)?),
        }
        let plan = super::plan(&source)?;
        if let Some(question) = &plan.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        print(&materials(&plan.materials, &plan.missing))?;
        for symmetry in plan.symmetries() {
            print(&format!("\nschedules for {}\n", words(symmetry)))?;
            schedules(&plan, symmetry)?;
        }
        if let Some(table) = &plan.moments {
            print(&format!(
                "\nmoments: {} views up to {}°, to order {}, by {}; one profile a material and a reconstruction\n",
                table.spec.views,
                table.spec.max_view_deg,
                table.spec.order.get(),
                table.estimator.label(),
            ))?;
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

/// What an experiment of kind `moments` would do.
fn profiles(plan: &MomentsPlan) -> Result<(), Error> {
    if let Some(question) = &plan.question {
        print(&format!("{}\n\n", question.trim()))?;
    }
    print(&materials(&plan.materials, &plan.missing))?;
    let spec = &plan.moments.spec;
    let channels: Vec<_> = spec.channels.iter().map(|c| c.name()).collect();
    let profiles = plan.materials.len() * channels.len();
    print(&format!(
        "\ngroups: {}\nchannels: {}\nviews: {} up to {}°, moments to order {}\nestimator: {}\n\
         {profiles} profiles, {} rows\n",
        plan.groups().join(", "),
        channels.join(", "),
        spec.views,
        spec.max_view_deg,
        spec.order.get(),
        plan.moments.estimator.label(),
        profiles * spec.views,
    ))
}

/// What an experiment of kind `relations` would do.
fn relations(plan: &RelationsPlan) -> Result<(), Error> {
    profiles(&plan.base)?;
    let lights: Vec<_> = plan.lightings.iter().map(|l| l.name.as_str()).collect();
    let along: Vec<_> = plan.along.iter().map(|a| a.name()).collect();
    let each = plan.views.len() * along.len();
    print(&format!(
        "\nlightings: {}\nviews: {}, along {}, window {}°\n{} relations\n",
        lights.join(", "),
        plan.views.len(),
        along.join(" and "),
        plan.spec.window_deg,
        plan.base.materials.len() * lights.len() * each,
    ))
}

fn materials(materials: &[Material], missing: &[String]) -> String {
    let mut out = format!("materials: {}\n", materials.len());
    let names = materials.iter().map(|m| m.name.chars().count());
    let width = names.max().unwrap_or(0);
    for m in materials {
        out += &format!("  {:<width$}  {}\n", m.name, words(m.symmetry));
    }
    if !missing.is_empty() {
        out += &format!("not in materials_dir: {}\n", missing.join(", "));
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
