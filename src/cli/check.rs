//! `gonio check`.

mod machine;

use super::{ConfigArgs, JsonArgs, SeedArgs, any_plan, doubt, listed, print, print_json, say};
use crate::brdf::BuildError;
use crate::error::{Error, count, excerpt, one_of};
use crate::experiment::moments::MomentsPlan;
use crate::experiment::relations::RelationsPlan;
use crate::experiment::{
    Allowance, AnyPlan, Experiment, Head, Material, POSES_A_MINUTE, Plan, Router, Source, Unit,
};
use crate::formats::of_file;
use crate::geometry::Symmetry;
use crate::instrument;
use crate::report::Columns;
use clap::Args;
use indicatif::HumanDuration;
use machine::described;
use serde_json::{Map, Value as Json, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

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
            let (text, object) = described(&spec, seed)?;
            return self.json.print(&object, |_| text);
        }
        self.seed.apply(&mut source)?;
        let plan = any_plan(&source)?;
        let json = self.json.wanted();
        let sheet = Map::new();
        let mut description = Description { json, sheet };
        let infeasible = match &plan {
            AnyPlan::Acquisition(plan) => description.acquisition(plan)?,
            AnyPlan::Moments(plan) => description.moments(plan).map(|()| None)?,
            AnyPlan::Relations(plan) => description.relations(plan).map(|()| None)?,
        };
        if json {
            print_json(&description.sheet)?;
        }
        infeasible.map_or(Ok(()), Err)?;
        // What is wrong with other materials is said before there is a plan.
        let is_table = |file: &PathBuf| of_file(file).is_some_and(|f| f.table.read.is_some());
        let has_table = |m: &&Material| m.spec.tables().files.iter().any(is_table);
        let mut first = None;
        for material in plan.materials().iter().filter(has_table) {
            let built = material.spec.widest_channels();
            match built.and_then(|channels| material.spec.build(channels)) {
                Ok(brdf) => doubt(material, &*brdf),
                Err(BuildError::Data { path, message }) => {
                    let message = format!("{message}; its jobs fail, the others run");
                    let error = Error::data(path, message);
                    match &first {
                        None => first = Some(error),
                        Some(_) => say(&format!("gonio: {error}")),
                    }
                }
                Err(_) => {}
            }
        }
        first.map_or(Ok(()), Err)
    }
}

/// A description: printed as it is found, or kept to be printed as JSON.
struct Description {
    json: bool,
    sheet: Map<String, Json>,
}

impl Description {
    /// Moment profiles.
    fn moments(&mut self, plan: &MomentsPlan) -> Result<(), Error> {
        self.head(plan.head())?;
        let (spec, estimator) = (&plan.moments.spec, plan.moments.estimator.label());
        let (views, max_view_deg, order) = (spec.views, spec.max_view_deg, spec.order.get());
        let groups = plan.groups();
        let channels: Vec<_> = spec.channels.iter().map(|c| c.name()).collect();
        let profiles = plan.materials.len() * channels.len();
        let rows = profiles * views;
        self.text(&format!(
            "\ngroups: {}\nchannels: {}\nviews: {views} up to {max_view_deg}°, moments to order {order}\n\
             estimator: {estimator}\n{}, {}\n",
            groups.join(", "),
            channels.join(", "),
            count(profiles, "profile"),
            count(rows, "row"),
        ))?;
        self.facts(json!({
            "groups": groups, "channels": channels, "views": views, "max_view_deg": max_view_deg,
            "order": order, "estimator": estimator, "profile_count": profiles, "row_count": rows,
        }));
        Ok(())
    }

    /// Moments of reflected light.
    fn relations(&mut self, plan: &RelationsPlan) -> Result<(), Error> {
        self.moments(&plan.base)?;
        let lights: Vec<_> = plan.lightings.iter().map(|l| l.name.as_str()).collect();
        let along: Vec<_> = plan.along.iter().map(|a| a.name()).collect();
        let windows: Vec<f64> = plan.specs.iter().map(|s| s.window_deg).collect();
        let each = plan.views.len() * along.len() * windows.len();
        let relations = plan.base.materials.len() * lights.len() * each;
        self.text(&format!(
            "\nlightings: {}\nviews: {}, along {}, window {}°\n{}\n",
            lights.join(", "),
            plan.views.len(),
            along.join(" and "),
            listed(&windows),
            count(relations, "relation"),
        ))?;
        self.facts(json!({
            "lightings": lights, "along": along,
            "window_deg": windows, "relation_count": relations,
        }));
        Ok(())
    }

    /// An acquisition; also returns the first plan that an instrument cannot carry out.
    fn acquisition(&mut self, plan: &Plan) -> Result<Option<Error>, Error> {
        self.head(plan.head())?;
        let most = |n: usize| format!(" up to {n}");
        let names = plan.methods.iter();
        let names = names.map(|m| m.label() + &m.up_to.map(most).unwrap_or_default());
        let names: Vec<_> = names.collect();
        let measures: Vec<_> = plan.measures.iter().map(|m| m.name()).collect();
        let used = plan.used_units();
        let jobs = used.iter().map(|unit| unit.1.len()).sum::<usize>() * plan.materials.len();
        self.text(&format!(
            "\nreconstructions: {}\nmeasures: {}, at {} or more, up to {}, until standard errors are below {} %\nseeds: {:?}\n{}, {}, {}\n",
            names.join(", "),
            measures.join(", "),
            count(plan.metrics.pairs, "pair"),
            plan.metrics.max_pairs.max(plan.metrics.pairs),
            100.0 * plan.metrics.tolerance,
            plan.seeds,
            count(used.len(), "schedule"),
            count(jobs, "reconstruction"),
            count(jobs * plan.measures.len(), "row"),
        ))?;
        let metrics = &plan.metrics;
        self.facts(json!({
            "reconstructions": names, "measures": measures, "pairs": metrics.pairs,
            "max_pairs": metrics.max_pairs, "tolerance": metrics.tolerance, "seeds": plan.seeds,
            "schedule_count": used.len(), "reconstruction_count": jobs,
            "row_count": jobs * plan.measures.len(),
        }));
        self.time(plan, plan.seconds_by_method(&used))?;
        if let Some(table) = &plan.moments {
            let (spec, estimator) = (&table.spec, table.estimator.label());
            let (max_view_deg, order) = (spec.max_view_deg, spec.order.get());
            let views = count(spec.views, "view");
            self.text(&format!(
                "moments: {views} up to {max_view_deg}°, to order {order}, by {estimator}; one profile a material and a reconstruction\n"
            ))?;
            self.facts(json!({"moments": {
                "views": spec.views, "max_view_deg": max_view_deg,
                "order": order, "estimator": estimator,
            }}));
        }
        // Those of readings and minutes are found for each instrument, see below.
        let known = plan.symmetries().into_iter();
        for symmetry in known.filter(|_| !plan.budgets.is_empty()) {
            self.text(&format!("\nschedules for {symmetry}\n"))?;
            schedules(plan, &used, symmetry, self)?;
        }
        ways(plan, self)
    }

    /// The time of reconstructions, and the method that takes most of it.
    fn time(&mut self, plan: &Plan, times: Vec<f64>) -> Result<(), Error> {
        let all: f64 = times.iter().sum();
        self.facts(json!({"core_seconds": all}));
        let cores = rayon::current_num_threads();
        let mut text = format!(
            "to reconstruct and compare: about {} on {}, within a factor of three",
            HumanDuration(Duration::from_secs_f64((all / cores as f64).max(1.0))),
            count(cores, "core"),
        );
        if !plan.minutes.is_empty() {
            text += &format!(", if the instrument takes {POSES_A_MINUTE} poses a minute");
        }
        let times = times.iter().zip(&plan.methods);
        if let Some((seconds, method)) = times.max_by(|a, b| a.0.total_cmp(b.0))
            && *seconds > 0.5 * all
            && plan.methods.len() > 1
        {
            let percent = 100.0 * seconds / all;
            text += &format!(", {percent:.0} % of it by {}", method.label());
        }
        if plan.sample_sets.iter().any(|set| set.learns()) {
            text += "; to choose poses from readings comes on top";
        }
        self.text(&(text + "\n"))
    }

    /// Text for people.
    fn text(&self, text: &str) -> Result<(), Error> {
        match self.json {
            true => Ok(()),
            false => print(text),
        }
    }

    /// Facts for programs, an object.
    fn facts(&mut self, facts: Json) {
        if let Json::Object(facts) = facts {
            self.sheet.extend(facts);
        }
    }

    /// The question and the materials, which every plan has.
    fn head(&mut self, head: Head<'_>) -> Result<(), Error> {
        if let Some(question) = head.question {
            self.text(&format!("{}\n\n", question.trim()))?;
        }
        let mut columns = Columns::new(&format!("materials: {}", head.materials.len()));
        self.facts(json!({"question": head.question, "materials": []}));
        for m in head.materials {
            columns.row(&format!("  {}\t{}", m.name, m.symmetry));
            let row = json!({
                "name": m.name,
                "isotropic": m.symmetry.isotropic,
                "reciprocal": m.symmetry.reciprocal,
                "bilateral": m.symmetry.bilateral,
            });
            self.row("materials", row);
        }
        self.facts(json!({"missing": head.missing}));
        let mut out = columns.to_string();
        if !head.missing.is_empty() {
            out += &format!("not in materials_dir: {}\n", head.missing.join(", "));
        }
        self.text(&out)
    }

    /// A row of a table for programs.
    fn row(&mut self, table: &str, row: Json) {
        let rows = self.sheet.entry(table).or_insert(Json::Array(Vec::new()));
        if let Some(rows) = rows.as_array_mut() {
            rows.push(row);
        }
    }
}

/// The file, or the preset of that name where there is no such file.
fn source(args: &ConfigArgs) -> Result<Source, Error> {
    let (presets, name) = (instrument::presets(), args.config.to_string_lossy());
    match presets.iter().find(|preset| preset.name == name) {
        Some(preset) if !args.config.exists() => args.apply(Source::new(preset.name, preset.text)),
        _ if is_name(&args.config) => {
            let names = one_of(&name, presets.iter().map(|preset| preset.name));
            let message = "there is no such file; allowed: a config, or an instrument";
            Err(Error::config(excerpt(&name), format!("{message}: {names}")))
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

/// What a table has in the place of the poses of a planner that learns.
const FROM_READINGS: &str = "chosen from readings";

/// Widths of the columns of coordinates and of sample sets.
fn widths(plan: &Plan) -> [usize; 2] {
    let labels = plan.parametrizations.iter().map(|c| c.label().len());
    let sets = plan.sample_sets.iter().map(|s| s.name.chars().count());
    [labels.fold(15, usize::max), sets.fold(10, usize::max)]
}

/// Prints the schedules of the first seed that are reconstructed from, line by line: large ones take their time.
fn schedules(
    plan: &Plan,
    units: &[(Unit, Vec<usize>)],
    symmetry: Symmetry,
    description: &mut Description,
) -> Result<(), Error> {
    let [w, v] = widths(plan);
    description.text(&format!(
        "  {:<w$}  {:<v$}  {:>8}  {:>8}  {:>10}  nodes\n",
        "parametrization", "sample set", "budget", "poses", "unphysical"
    ))?;
    let units = units.iter().map(|(unit, _)| unit);
    let first = plan.instruments.first().map(|_| 0);
    for unit in units.filter(|u| u.seed == plan.seeds[0] && u.instrument == first) {
        let Allowance::Poses(budget) = unit.allowance else {
            continue;
        };
        let key = plan.schedule_key(unit, symmetry);
        let (coordinates, set) = (key.uniform_in(), key.sample_set);
        let mut row = json!({
            "symmetry": symmetry.to_string(),
            "parametrization": coordinates,
            "sample_set": set.name,
            "budget": budget,
        });
        let form = key.coordinates.checked_form(symmetry)?;
        let planned = (!set.learns()).then(|| set.set.plan(&form, budget, unit.seed));
        let line = match planned {
            None => FROM_READINGS.into(),
            Some(Err(e)) => {
                row["problem"] = e.to_string().into();
                e.to_string()
            }
            Some(Ok(schedule)) => {
                row["poses"] = schedule.poses.len().into();
                row["unphysical_share"] = schedule.unphysical_share.into();
                let shape = schedule.lattice.as_ref().map(|l| l.shape().to_vec());
                row["nodes"] = json!(shape);
                let shape = shape.map(|shape| listed(shape).replace(", ", "×"));
                let shape = shape.unwrap_or("scattered".into());
                let (poses, unphysical) = (schedule.poses.len(), schedule.unphysical_share);
                format!("{poses:>8}  {unphysical:>10.4}  {shape}")
            }
        };
        description.row("schedules", row);
        let set = &set.name;
        let line = format!("  {coordinates:<w$}  {set:<v$}  {budget:>8}  {line}\n");
        description.text(&line)?;
    }
    Ok(())
}

/// Prints every instrument's time and reach for the schedules of the first seed.
///
/// Returns the first plan that one cannot carry out.
fn ways(plan: &Plan, description: &mut Description) -> Result<Option<Error>, Error> {
    let mut infeasible = None;
    let mut router = Router::default();
    let [w, v] = widths(plan);
    for (i, instrument) in plan.instruments.iter().enumerate() {
        let order = instrument.use_of.order.name();
        description.text(&format!(
            "\n{} visits the poses in the order {order}\n  {:<w$}  {:<v$}  {:>13}  {:>8}  {:>7}  {:>9}  out of reach\n",
            instrument.name,
            "parametrization",
            "sample set",
            "allowed",
            "budget",
            "reach",
            "minutes"
        ))?;
        let units = plan.units().into_iter();
        let units = units.filter(|u| u.instrument == Some(i) && u.seed == plan.seeds[0]);
        for symmetry in plan.symmetries() {
            for unit in units.clone() {
                let key = plan.schedule_key(&unit, symmetry);
                let (coordinates, set) = (key.uniform_in(), key.sample_set);
                let allowed = unit.allowance.to_string();
                let mut row = json!({
                    "instrument": instrument.name,
                    "order": order,
                    "symmetry": symmetry.to_string(),
                    "parametrization": coordinates,
                    "sample_set": set.name,
                    "allowed": allowed,
                });
                let line = match router.find(&key, false) {
                    Err(_) if set.learns() => FROM_READINGS.into(),
                    Err(e) => {
                        let line = e.to_string();
                        row["problem"] = line.clone().into();
                        infeasible.get_or_insert(e);
                        line
                    }
                    Ok(route) => route.itinerary().map_or(String::new(), |i| {
                        let (reach, minutes) = (100.0 * i.reachable(), i.seconds() / 60.0);
                        let (budget, reasons) = (route.budget, i.reasons_text());
                        let line = format!("{budget:>8}  {reach:>6.1}%  {minutes:>9.1}  {reasons}");
                        row["budget"] = budget.into();
                        row["reachable_percent"] = reach.into();
                        row["minutes"] = minutes.into();
                        row["out_of_reach"] = reasons.into();
                        line
                    }),
                };
                description.row("visits", row);
                let (set, line) = (&set.name, line.trim_end());
                let line = format!("  {coordinates:<w$}  {set:<v$}  {allowed:>13}  {line}\n");
                description.text(&line)?;
            }
        }
    }
    Ok(infeasible)
}
