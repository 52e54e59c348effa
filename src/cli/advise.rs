//! `gonio advise`.

mod told;

use super::brdf_args::BrdfArgs;
use super::check::words;
use super::collect::Collect;
use super::output::{JsonArgs, print_json};
use super::run::{tell_inputs, tell_missing};
use super::talk::{note, say};
use super::{ThreadArgs, print};
use crate::acquisition;
use crate::error::{Error, ParameterError, count, one_of};
use crate::experiment::moments::MomentsPlan;
use crate::experiment::{Allowance, Experiment, Extent, Failure, Known, Metric, Plan, Row, Source};
use crate::geometry::Symmetry;
use crate::instrument;
use crate::reconstruct::{PriorFile, TRUSTED};
use crate::registry;
use clap::{ArgGroup, Args};
use std::path::{Path, PathBuf};
use told::Asked;
use toml::{Table, Value};

/// The choices that are compared, as a config.
pub(super) const CONFIG: &str = include_str!("../../configs/starters/advise.toml");

/// Materials of formulas, where no others are given.
const FORMULAS: &str = include_str!("../../configs/families.toml");

/// The coordinates that planners choose their poses in.
const OF_PLANNERS: &str = "half-difference";

/// The reconstruction that planners' poses are followed by.
const KRIGING: &str = "kriging";

/// Compares poses and reconstructions on materials, and says which are best
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("allowance").required(true).args(["budget", "minutes"])))]
#[command(after_help = "\
The materials stand for the one that is to be measured: tables of one's own, a config, or, if none are named,
materials of formulas. Each choice measures and reconstructs them all, so that its errors are those of a run:

  gonio advise --budget 32
  gonio advise MERL --budget 64 --prior prior.gonio
  gonio advise MERL --minutes 10 --instrument rosi

Planners are asked in half/difference coordinates. `below` is what a further material is below nine times of ten,
if it is like these and the choice had not been the best on them. Behind each of the three best stand the commands
that make its schedule; if the best choose poses from readings, the third does not. What is compared, as a config to
change and to run: `gonio init advise`.")]
pub(super) struct Advise {
    /// Materials: a config (*.toml), a folder of MERL tables, a table or a kind of material [default:
    /// materials of formulas]
    #[arg(value_name = "CONFIG|DIR|BRDF")]
    target: Option<String>,
    /// Override a key of the config, or set one of the material (alpha=0.1)
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "target")]
    set: Vec<String>,
    /// A prior of other materials, of `gonio train`; the built-in one is tried on materials that are named
    #[arg(long, value_name = "FILE")]
    prior: Option<PathBuf>,
    /// Number of poses
    #[arg(long, value_name = "N", value_parser = super::budget)]
    budget: Option<usize>,
    /// Time on the instrument
    #[arg(long, value_name = "M", requires = "instrument", value_parser = super::minutes)]
    minutes: Option<f64>,
    /// On this instrument: a preset (see `gonio list instruments`) or a file [default: one without flaws]
    #[arg(long, value_name = "NAME|FILE")]
    instrument: Option<String>,
    /// The error that choices are ranked by: nrmse or log_relative
    #[arg(long, value_name = "METRIC", default_value = Metric::Nrmse.name(), value_parser = metric)]
    by: Metric,
    /// Materials that are tried, at most: spread evenly over those that are named
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u16).range(1..))]
    most: u16,
    /// Seed of poses and noise
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(i64).range(0..))]
    seed: i64,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

fn metric(name: &str) -> Result<Metric, ParameterError> {
    let found = Metric::ALL.into_iter().find(|m| m.name() == name);
    let names = Metric::ALL.map(Metric::name);
    found.ok_or_else(|| ParameterError::new("metric", name, one_of(name, names)))
}

/// The keys of a config that name materials.
struct Materials {
    keys: Table,
    chosen: usize,
    all: usize,
    /// What all of them have.
    symmetry: Symmetry,
}

impl Advise {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let materials = self.materials()?;
        let mut rows: Vec<Row> = Vec::new();
        let (mut plans, mut reasons): (Vec<Plan>, Vec<Failure>) = (Vec::new(), Vec::new());
        for planners in [false, true] {
            let Some(plan) = self.plan(&materials, planners)? else {
                continue;
            };
            let mut collected = Collect::<Row>::new();
            let summary = plan.run(&Extent::default(), &Known::default(), &mut collected)?;
            tell_inputs(&summary);
            plans.push(plan);
            let (made, failures) = collected.end();
            rows.extend(made);
            for failure in failures {
                let is_new = !reasons.iter().any(|known| known.reason == failure.reason);
                reasons.extend(is_new.then_some(failure));
            }
        }
        let rows: Vec<&Row> = rows.iter().collect();
        let asked = Asked {
            allowance: self.allowance(),
            instrument: self.instrument.as_deref(),
            seed: self.seed,
            by: self.by,
            symmetry: materials.symmetry,
        };
        let (advice, left_out) = asked.ranked(&rows, &plans);
        if advice.is_empty() {
            let why = reasons.first().map(|failure| failure.reason.clone());
            let exact = format!("no choice leaves an error: {}", left_out.join(", "));
            return Err(Error::infeasible("gonio advise", why.unwrap_or(exact)));
        }
        for Failure { job, reason, .. } in &reasons {
            say(&format!("gonio: {job}: {reason}"));
        }
        if !left_out.is_empty() {
            note(&format!("gonio: left out: {}", left_out.join(", ")));
        }
        if self.json.wanted() {
            return print_json(&advice);
        }
        if self.target.is_none() {
            note(
                "gonio: materials of formulas stand for all; with tables like the material, advice is better",
            );
        }
        let of = match materials.chosen {
            chosen if chosen == materials.all => count(chosen, "material"),
            chosen => format!("{chosen} of {}", count(materials.all, "material")),
        };
        print(&asked.text(&advice, &of))
    }

    fn allowance(&self) -> Allowance {
        match (self.budget, self.minutes) {
            (_, Some(minutes)) => Allowance::Minutes(minutes),
            // The command line has one of both.
            (budget, None) => Allowance::Poses(budget.unwrap_or(1)),
        }
    }

    /// The experiment of planners, or of sample sets; `None` if there are none for so many poses. The built-in prior is
    /// left out where it was made of what is tried.
    fn plan(&self, materials: &Materials, planners: bool) -> Result<Option<Plan>, Error> {
        let of = |prior: Option<&Path>| {
            let source = self.source(materials, planners, prior)?;
            source.map(|source| Plan::read(&source)).transpose()
        };
        let built_in = PriorFile::default();
        match (&self.prior, &self.target) {
            (Some(path), _) => of(Some(path)),
            (None, Some(_)) => of(Some(built_in.path())).or_else(|_| of(None)),
            (None, None) => of(None),
        }
    }

    /// The materials that are tried.
    fn materials(&self) -> Result<Materials, Error> {
        let plan: MomentsPlan = match &self.target {
            Some(target) => {
                let of = BrdfArgs::new(target.clone(), self.set.clone(), None);
                of.plan(&of.source()?)?
            }
            None => super::any_plan(&Source::new("gonio advise", FORMULAS))?.into_moments(),
        };
        tell_missing(&plan.missing);
        let all = plan.materials.len();
        let chosen = all.min(self.most.into());
        let name = |i: usize| plan.materials[i * all / chosen].name.clone();
        let mut names: Vec<String> = (0..chosen).map(name).collect();
        let mut tried = plan.materials.iter().filter(|m| names.contains(&m.name));
        let symmetry = tried.next().map_or(Symmetry::FULL, |m| m.symmetry);
        if let Some(other) = tried.find(|m| m.symmetry != symmetry) {
            let message = format!(
                "{} is {}, {} is {}; allowed: materials of the same symmetries, which have the same schedules",
                names[0],
                words(symmetry),
                other.name,
                words(other.symmetry)
            );
            return Err(Error::config("gonio advise", message));
        }
        let mut keys = plan.resolved;
        keys.retain(|key, _| ["channels", "material", "materials_dir", "merl"].contains(&key));
        if let Some(Value::Array(list)) = keys.get_mut("material") {
            let name = |table: &Value| Some(table.get("name")?.as_str()?.to_owned());
            list.retain(|table| name(table).is_some_and(|name| names.contains(&name)));
            let written: Vec<String> = list.iter().filter_map(name).collect();
            names.retain(|name| !written.contains(name));
        }
        if names.is_empty() {
            keys.retain(|key, _| !["materials_dir", "merl"].contains(&key));
        } else {
            keys.insert("only".into(), names.into());
        }
        Ok(Materials {
            keys,
            chosen,
            all,
            symmetry,
        })
    }

    /// The config of what is compared: of planners, or of sample sets; `None` if there are none for so many poses.
    fn source(
        &self,
        materials: &Materials,
        planners: bool,
        prior: Option<&Path>,
    ) -> Result<Option<Source>, Error> {
        let internal = |e: &dyn std::fmt::Display| Error::Internal(e.to_string());
        let mut config: Table = CONFIG.parse().map_err(|e| internal(&e))?;
        config.remove("material");
        config.extend(materials.keys.clone());
        config.insert("seeds".into(), vec![self.seed].into());
        let most = self.budget.unwrap_or(0);
        match self.minutes {
            Some(minutes) => {
                config.insert("budgets".into(), Value::Array(Vec::new()));
                config.insert("minutes".into(), vec![minutes].into())
            }
            None => config.insert("budgets".into(), vec![most as i64].into()),
        };
        if let Some(name) = &self.instrument {
            let preset = instrument::presets().iter().any(|p| p.name == name);
            let key = if preset { "preset" } else { "file" };
            let table = Table::from_iter([(key.to_owned(), Value::from(name.as_str()))]);
            config.insert("instrument".into(), vec![table].into());
        }
        let kind = |table: &Value| {
            table
                .get("kind")
                .and_then(Value::as_str)
                .unwrap_or_default()
                .to_owned()
        };
        let all = acquisition::all();
        let mut retain = |key: &str, is_kept: &dyn Fn(&Value) -> bool| match config.get_mut(key) {
            Some(Value::Array(list)) => {
                list.retain(|table| is_kept(table));
                list.is_empty()
            }
            _ => true,
        };
        let suits = |table: &Value| {
            let kind = kind(table);
            let Some(planner) = all.iter().find(|e| e.kind == kind) else {
                return !planners;
            };
            let read = registry::read_text(planner, "");
            planners && read.is_ok_and(|planner| most <= planner.most())
        };
        let is_empty = retain("sample_set", &suits);
        retain("parametrization", &|table| {
            !planners || kind(table) == OF_PLANNERS
        });
        retain("reconstruction", &|table| {
            let up_to = table.get("up_to").and_then(Value::as_integer);
            let few = up_to.is_none_or(|up_to| most as i64 <= up_to);
            few && (!planners || kind(table) == KRIGING)
        });
        if is_empty {
            return Ok(None);
        }
        if let Some(prior) = prior {
            self.add_prior(&mut config, planners, &prior.to_string_lossy());
        }
        let text = toml::to_string(&config).map_err(|e| internal(&e))?;
        Ok(Some(Source::new("gonio advise", text)))
    }

    /// Adds what knows of other materials.
    fn add_prior(&self, config: &mut Table, planners: bool, prior: &str) {
        let mut add = |key: &str, kind: &str| {
            let keys = [("kind", kind), ("prior", prior)];
            let table = keys.map(|(key, value)| (key.to_owned(), Value::from(value)));
            if let Some(Value::Array(list)) = config.get_mut(key) {
                list.push(Table::from_iter(table).into());
            }
        };
        if planners {
            add("sample_set", "adaptive");
        }
        // Beyond it is left out; how many a time allows for is not known yet.
        if self.budget.is_none_or(|budget| budget <= TRUSTED) {
            add("reconstruction", KRIGING);
        }
    }
}
