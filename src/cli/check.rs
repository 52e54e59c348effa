//! `gonio check`.

mod machine;

use super::output::{JsonArgs, print_json};
use super::run::experiment;
use super::{ConfigArgs, SeedArgs, print};
use crate::error::{Error, count, excerpt, one_of};
use crate::experiment::moments::MomentsPlan;
use crate::experiment::relations::RelationsPlan;
use crate::experiment::{Material, Plan, Router, ScheduleKey, Source};
use crate::geometry::Symmetry;
use crate::instrument;
use crate::report::Columns;
use clap::Args;
use machine::Described;
use serde_json::{Map, Value as Json, json};
use std::path::Path;

#[derive(Debug, Args)]
pub(super) struct Check {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    seed: SeedArgs,
    #[command(flatten)]
    json: JsonArgs,
}

impl Check {
    pub(super) fn run(self) -> Result<(), Error> {
        let mut source = source(&self.config)?;
        if is_instrument(&source)? {
            let read = instrument::read_table(source.table()?);
            let spec = read.map_err(|e| source.error(e))?;
            let seed = self.seed.seed.unwrap_or(1);
            let described = Described::new(&spec, seed)?;
            return match self.json.wanted() {
                true => print_json(&described),
                false => print(&described.text()),
            };
        }
        self.seed.apply(&mut source)?;
        experiment(&source)?.check(self.json.wanted())
    }
}

/// A plan that can describe its run.
pub(super) trait Checked {
    /// Prints the description, as JSON or for people.
    fn check(&self, json: bool) -> Result<(), Error>;
}

impl Checked for MomentsPlan {
    fn check(&self, json: bool) -> Result<(), Error> {
        match json {
            true => print_json(&profiles_sheet(self)),
            false => profiles(self),
        }
    }
}

impl Checked for RelationsPlan {
    fn check(&self, json: bool) -> Result<(), Error> {
        match json {
            true => print_json(&relations_sheet(self)),
            false => relations(self),
        }
    }
}

impl Checked for Plan {
    fn check(&self, json: bool) -> Result<(), Error> {
        let mut told = Told {
            json,
            sheet: Map::new(),
        };
        let infeasible = acquisition(self, &mut told)?;
        if json {
            print_json(&told.sheet)?;
        }
        infeasible.map_or(Ok(()), Err)
    }
}

/// A description: printed as it is found, or kept to be printed as JSON.
struct Told {
    json: bool,
    sheet: Map<String, Json>,
}

impl Told {
    /// Text for people.
    fn text(&self, text: &str) -> Result<(), Error> {
        match self.json {
            true => Ok(()),
            false => print(text),
        }
    }

    /// A fact for programs.
    fn fact(&mut self, name: &str, value: impl Into<Json>) {
        self.sheet.insert(name.into(), value.into());
    }

    /// A row of a table for programs.
    fn row(&mut self, table: &str, row: Json) {
        let rows = self.sheet.entry(table).or_insert(Json::Array(Vec::new()));
        if let Some(rows) = rows.as_array_mut() {
            rows.push(row);
        }
    }
}

/// Describes an acquisition; also returns the first plan that an instrument cannot carry out.
fn acquisition(plan: &Plan, told: &mut Told) -> Result<Option<Error>, Error> {
    if let Some(question) = &plan.question {
        told.text(&format!("{}\n\n", question.trim()))?;
    }
    told.sheet = materials_sheet(&plan.question, &plan.materials, &plan.missing);
    told.text(&materials(&plan.materials, &plan.missing))?;
    // Those of readings and minutes are found for each instrument, see below.
    let known = plan
        .symmetries()
        .into_iter()
        .filter(|_| !plan.budgets.is_empty());
    for symmetry in known {
        told.text(&format!("\nschedules for {}\n", words(symmetry)))?;
        schedules(plan, symmetry, told)?;
    }
    if let Some(table) = &plan.moments {
        let (spec, estimator) = (&table.spec, table.estimator.label());
        told.fact(
            "moments",
            json!({
                "views": spec.views,
                "max_view_deg": spec.max_view_deg,
                "order": spec.order.get(),
                "estimator": estimator,
            }),
        );
        told.text(&format!(
            "\nmoments: {} up to {}°, to order {}, by {estimator}; one profile a material and a reconstruction\n",
            count(spec.views, "view"),
            spec.max_view_deg,
            spec.order.get(),
        ))?;
        let values = VALUES * spec.views as f64;
        for method in &plan.methods {
            let most = plan.budgets.iter().max().copied().unwrap_or_default();
            let most = method.up_to.map_or(most, |up_to| most.min(up_to));
            let minutes = values * method.method.value_seconds(most) / 60.0;
            if minutes > 1.0 {
                told.text(&format!(
                    "  slow: some {minutes:.0} min of one core for each material by {} at {}, as each value takes {:.0} µs\n",
                    method.label(),
                    count(most, "reading"),
                    1e6 * method.method.value_seconds(most),
                ))?;
            }
        }
    }
    let names = plan.methods.iter().map(|m| {
        let most = m.up_to.map_or(String::new(), |n| format!(" up to {n}"));
        m.label() + &most
    });
    let names: Vec<_> = names.collect();
    let measures: Vec<_> = plan.measures.iter().map(|m| m.name()).collect();
    let infeasible = match plan.instruments.is_empty() {
        true => None,
        false => ways(plan, told)?,
    };
    told.text(&format!(
        "\nreconstructions: {}\nmeasures: {}, at {} or more, up to {}, until standard errors are below {} %\nseeds: {:?}\n{}, {}, {}\n",
        names.join(", "),
        measures.join(", "),
        count(plan.metrics.pairs, "pair"),
        plan.metrics.max_pairs.max(plan.metrics.pairs),
        100.0 * plan.metrics.tolerance,
        plan.seeds,
        count(plan.units().len(), "schedule"),
        count(plan.jobs(), "reconstruction"),
        count(plan.rows(), "row"),
    ))?;
    told.fact("reconstructions", names);
    told.fact("measures", measures);
    told.fact("pairs", plan.metrics.pairs);
    told.fact("max_pairs", plan.metrics.max_pairs);
    told.fact("tolerance", plan.metrics.tolerance);
    told.fact("seeds", plan.seeds.clone());
    told.fact("schedule_count", plan.units().len());
    told.fact("reconstruction_count", plan.jobs());
    told.fact("row_count", plan.rows());
    Ok(infeasible)
}

/// The file, or the preset of that name where there is no such file.
fn source(args: &ConfigArgs) -> Result<Source, Error> {
    let named = |preset: &instrument::Preset| args.config.as_os_str() == preset.name;
    match instrument::presets().into_iter().find(named) {
        Some(preset) if !args.config.exists() => args.apply(Source::new(preset.name, preset.text)),
        _ if is_name(&args.config) => {
            let presets = instrument::presets();
            let names = one_of(
                &args.config.to_string_lossy(),
                presets.iter().map(|preset| preset.name),
            );
            let message =
                format!("there is no such file; allowed: a config, or an instrument: {names}");
            let name = args.config.display().to_string();
            Err(Error::config(excerpt(&name), message))
        }
        _ => args.source(),
    }
}

/// True of what can only be the name of an instrument.
fn is_name(config: &Path) -> bool {
    config.extension().is_none() && config.components().count() == 1 && !config.exists()
}

/// True of a file with keys that only instruments have, and none that only experiments have.
fn is_instrument(source: &Source) -> Result<bool, Error> {
    let table = source.table()?;
    let has = |key: &str| table.get_ref().contains_key(key);
    let experiment = ["experiment", "question", "material", "sample_set"];
    Ok(["class", "axis"].into_iter().any(has) && !experiment.into_iter().any(has))
}

/// Prints the plan of an experiment of kind `moments`.
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
         {}, {}\n",
        plan.groups().join(", "),
        channels.join(", "),
        spec.views,
        spec.max_view_deg,
        spec.order.get(),
        plan.moments.estimator.label(),
        count(profiles, "profile"),
        count(profiles * spec.views, "row"),
    ))
}

fn profiles_sheet(plan: &MomentsPlan) -> Map<String, Json> {
    let mut sheet = materials_sheet(&plan.question, &plan.materials, &plan.missing);
    let spec = &plan.moments.spec;
    let channels: Vec<_> = spec.channels.iter().map(|c| c.name()).collect();
    let profiles = plan.materials.len() * channels.len();
    let facts: [(&str, Json); 8] = [
        ("groups", plan.groups().into()),
        ("channels", channels.into()),
        ("views", spec.views.into()),
        ("max_view_deg", spec.max_view_deg.into()),
        ("order", spec.order.get().into()),
        ("estimator", plan.moments.estimator.label().into()),
        ("profile_count", profiles.into()),
        ("row_count", (profiles * spec.views).into()),
    ];
    sheet.extend(facts.map(|(name, value)| (name.to_owned(), value)));
    sheet
}

/// Prints the plan of an experiment of kind `relations`.
fn relations(plan: &RelationsPlan) -> Result<(), Error> {
    profiles(&plan.base)?;
    let lights: Vec<_> = plan.lightings.iter().map(|l| l.name.as_str()).collect();
    let along: Vec<_> = plan.along.iter().map(|a| a.name()).collect();
    let each = plan.views.len() * along.len();
    print(&format!(
        "\nlightings: {}\nviews: {}, along {}, window {}°\n{}\n",
        lights.join(", "),
        plan.views.len(),
        along.join(" and "),
        plan.spec.window_deg,
        count(plan.base.materials.len() * lights.len() * each, "relation"),
    ))
}

fn relations_sheet(plan: &RelationsPlan) -> Map<String, Json> {
    let mut sheet = profiles_sheet(&plan.base);
    let lights: Vec<_> = plan.lightings.iter().map(|l| l.name.as_str()).collect();
    let along: Vec<_> = plan.along.iter().map(|a| a.name()).collect();
    let each = plan.views.len() * along.len();
    let relations = plan.base.materials.len() * lights.len() * each;
    let facts: [(&str, Json); 4] = [
        ("lightings", lights.into()),
        ("along", along.into()),
        ("window_deg", plan.spec.window_deg.into()),
        ("relation_count", relations.into()),
    ];
    sheet.extend(facts.map(|(name, value)| (name.to_owned(), value)));
    sheet
}

/// What every plan has.
fn materials_sheet(
    question: &Option<String>,
    materials: &[Material],
    missing: &[String],
) -> Map<String, Json> {
    let materials = materials.iter().map(|m| {
        let Symmetry {
            isotropic,
            reciprocal,
            bilateral,
        } = m.symmetry;
        json!({
            "name": m.name,
            "isotropic": isotropic,
            "reciprocal": reciprocal,
            "bilateral": bilateral,
        })
    });
    let materials: Vec<Json> = materials.collect();
    let facts: [(&str, Json); 3] = [
        ("question", json!(question)),
        ("materials", materials.into()),
        ("missing", missing.into()),
    ];
    facts
        .map(|(name, value)| (name.to_owned(), value))
        .into_iter()
        .collect()
}

fn materials(materials: &[Material], missing: &[String]) -> String {
    let mut columns = Columns::new(&format!("materials: {}", materials.len()));
    for m in materials {
        columns.row(&format!("  {}\t{}", m.name, words(m.symmetry)));
    }
    let mut out = columns.to_string();
    if !missing.is_empty() {
        out += &format!("not in materials_dir: {}\n", missing.join(", "));
    }
    out
}

/// Values of a reconstruction that the moments of a view are integrated from, about.
const VALUES: f64 = 4.5e4;

/// What there is to tell of the poses of a planner that learns.
const FROM_READINGS: &str = "chosen from readings";

/// Prints the schedules of the first seed, line by line: large ones take their time.
fn schedules(plan: &Plan, symmetry: Symmetry, told: &mut Told) -> Result<(), Error> {
    let labels = plan.parametrizations.iter().map(|c| c.label().len());
    let w = labels.max().unwrap_or(0).max(15);
    let sets = plan.sample_sets.iter().map(|s| s.name.chars().count());
    let v = sets.max().unwrap_or(0).max(10);
    told.text(&format!(
        "  {:<w$}  {:<v$}  {:>8}  {:>8}  {:>10}  nodes\n",
        "parametrization", "sample set", "budget", "poses", "unphysical"
    ))?;
    for coordinates in &plan.parametrizations {
        let form = coordinates.form(symmetry);
        let form = form.map_err(|e| Error::Internal(format!("a warp that was checked: {e}")))?;
        for set in &plan.sample_sets {
            for &budget in &plan.budgets {
                let mut row = json!({
                    "symmetry": words(symmetry),
                    "parametrization": coordinates.label(),
                    "sample_set": set.name,
                    "budget": budget,
                });
                let planned = (!set.learns()).then(|| set.set.plan(&form, budget, plan.seeds[0]));
                let line = match planned {
                    None => FROM_READINGS.into(),
                    Some(Err(e)) => {
                        row["problem"] = e.to_string().into();
                        format!("{e}")
                    }
                    Some(Ok(schedule)) => {
                        row["poses"] = schedule.poses.len().into();
                        row["unphysical_share"] = schedule.unphysical_share.into();
                        let lattice = schedule.lattice.as_ref();
                        row["nodes"] = json!(lattice.map(|lattice| lattice.shape().to_vec()));
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
                told.row("schedules", row);
                told.text(&format!(
                    "  {:<w$}  {:<v$}  {budget:>8}  {line}\n",
                    coordinates.label(),
                    set.name
                ))?;
            }
        }
    }
    Ok(())
}

/// Prints every instrument's time and reach for the schedules of the first seed.
///
/// Returns the first plan that one cannot carry out.
fn ways(plan: &Plan, told: &mut Told) -> Result<Option<Error>, Error> {
    let mut infeasible = None;
    let mut router = Router::default();
    let labels = plan.parametrizations.iter().map(|c| c.label().len());
    let w = labels.max().unwrap_or(0).max(15);
    let sets = plan.sample_sets.iter().map(|s| s.name.chars().count());
    let v = sets.max().unwrap_or(0).max(10);
    for instrument in &plan.instruments {
        let order = instrument.use_of.order.name();
        told.text(&format!(
            "\n{} visits the poses in the order {order}\n  {:<w$}  {:<v$}  {:>13}  {:>8}  {:>7}  {:>9}  out of reach\n",
            instrument.name,
            "parametrization",
            "sample set",
            "allowed",
            "budget",
            "reach",
            "minutes"
        ))?;
        for symmetry in plan.symmetries() {
            for coordinates in &plan.parametrizations {
                for sample_set in &plan.sample_sets {
                    for allowance in plan.allowances() {
                        let key = ScheduleKey {
                            coordinates,
                            symmetry,
                            sample_set,
                            allowance,
                            instrument: Some(instrument),
                            seed: plan.seeds[0],
                            material: None,
                        };
                        let mut row = json!({
                            "instrument": instrument.name,
                            "order": order,
                            "symmetry": words(symmetry),
                            "parametrization": coordinates.label(),
                            "sample_set": sample_set.name,
                            "allowed": allowance.to_string(),
                        });
                        let line = match router.find(&key) {
                            Err(_) if sample_set.learns() => FROM_READINGS.into(),
                            Err(e) => {
                                let line = e.to_string();
                                row["problem"] = line.clone().into();
                                infeasible.get_or_insert(e);
                                line
                            }
                            Ok(route) => route.itinerary().map_or(String::new(), |i| {
                                let reach = 100.0 * i.reachable();
                                let minutes = i.seconds() / 60.0;
                                row["budget"] = route.budget.into();
                                row["reachable_percent"] = reach.into();
                                row["minutes"] = minutes.into();
                                row["out_of_reach"] = i.reasons_text().into();
                                format!(
                                    "{:>8}  {reach:>6.1}%  {minutes:>9.1}  {}",
                                    route.budget,
                                    i.reasons_text()
                                )
                            }),
                        };
                        let allowed = allowance.to_string();
                        let line = format!(
                            "  {:<w$}  {:<v$}  {allowed:>13}  {}\n",
                            coordinates.label(),
                            sample_set.name,
                            line.trim_end()
                        );
                        told.row("visits", row);
                        told.text(&line)?;
                    }
                }
            }
        }
    }
    Ok(infeasible)
}

pub(super) fn words(symmetry: Symmetry) -> String {
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
