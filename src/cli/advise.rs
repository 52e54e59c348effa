//! `gonio advise`.

use super::brdf_args::BrdfArgs;
use super::collect::Collect;
use super::output::{JsonArgs, print_json};
use super::run::tell_inputs;
use super::talk::{note, say};
use super::{ThreadArgs, print};
use crate::acquisition;
use crate::error::{Error, ParameterError, count, one_of};
use crate::experiment::moments::MomentsPlan;
use crate::experiment::{
    Allowance, Cell, Choice, Experiment, Extent, Failure, Findings, Known, Line, Metric, Plan,
    PlannedSet, ReportSpec, Row, Source,
};
use crate::instrument;
use crate::metrics::Measure;
use crate::reconstruct::TRUSTED;
use crate::registry;
use crate::report::{Columns, error};
use crate::statistics::{BAND, geometric_mean, upper_quantile};
use clap::{ArgGroup, Args};
use serde::Serialize;
use std::path::PathBuf;
use toml::{Table, Value};

/// The choices that are compared, as a config.
pub(super) const CONFIG: &str = include_str!("../../configs/starters/advise.toml");

/// Materials of formulas, where no others are given.
const FORMULAS: &str = include_str!("../../configs/families.toml");

/// The coordinates that planners choose their poses in.
const OF_PLANNERS: &str = "half-difference";

/// The reconstruction that planners' poses are followed by.
const KRIGING: &str = "kriging";

/// Lines that are printed: the best, the last of them a list that no reading changes, if all others are none.
const LINES: usize = 3;

/// What the share of further materials is whose errors are below the stated bound.
const BELOW: f64 = 0.9;

/// Compares poses and reconstructions on materials, and says which are best
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("allowance").required(true).args(["budget", "minutes"])))]
#[command(after_help = "\
The materials stand for the one that is to be measured: tables of one's own, a config, or, if none are named,
materials of formulas. Each choice measures and reconstructs them all, so that its errors are those of a run:

  gonio advise --budget 32
  gonio advise MERL --budget 64 --prior prior.gonio
  gonio advise MERL --minutes 10 --instrument rosi

Planners are asked in half/difference coordinates. Behind each of the three best stand the commands that
make its schedule. What is compared, as a config to change and to run: `gonio init advise`.")]
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
    let names = || Metric::ALL.map(Metric::name);
    let found = Metric::ALL.into_iter().find(|m| m.name() == name);
    found.ok_or_else(|| ParameterError::new("metric", name, one_of(name, names())))
}

/// An error over materials.
#[derive(Serialize)]
struct Spread {
    /// The geometric mean.
    mean: f64,
    /// What nine of ten further materials are below; `None` if too few were tried.
    below: Option<f64>,
}

/// A choice, and what it leaves.
#[derive(Serialize)]
struct Advice {
    parametrization: String,
    warp: String,
    sample_set: String,
    reconstruction: String,
    nrmse: Option<Spread>,
    log_relative: Option<Spread>,
    /// Geometric mean of its error over that of the first, and a 95 % interval of it over materials.
    against_first: Option<(f64, Option<[f64; 2]>)>,
    /// Poses that were visited, at least and at most.
    poses: [usize; 2],
    /// True if each material has other poses, by its readings.
    learns: bool,
    /// Time on the instrument, minutes.
    minutes: Option<f64>,
    /// Wall time of computing a material, s.
    seconds: f64,
    /// What makes the schedule and the BRDF.
    commands: Vec<String>,
}

/// The keys of a config that name materials.
struct Materials {
    keys: Table,
    chosen: usize,
    all: usize,
}

impl Advise {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let materials = self.materials()?;
        let mut rows: Vec<Row> = Vec::new();
        let (mut plans, mut reasons): (Vec<Plan>, Vec<Failure>) = (Vec::new(), Vec::new());
        for planners in [false, true] {
            let Some(source) = self.source(&materials, planners)? else {
                continue;
            };
            let mut collected = Collect::<Row>::new();
            let plan = Plan::read(&source)?;
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
        let advice = self.ranked(&rows, &plans);
        if advice.is_empty() {
            let why = reasons.first().map(|failure| failure.reason.clone());
            let why = why.unwrap_or_else(|| "no choice leaves an error".into());
            return Err(Error::infeasible("gonio advise", why));
        }
        for Failure { job, reason, .. } in &reasons {
            say(&format!("gonio: {job}: {reason}"));
        }
        if self.json.wanted() {
            return print_json(&advice);
        }
        if self.target.is_none() {
            note(
                "gonio: materials of formulas stand for all; with tables like the material, advice is better",
            );
        }
        print(&self.text(&advice, &materials))
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
        let all = plan.materials.len();
        let chosen = all.min(self.most.into());
        let name = |i: usize| plan.materials[i * all / chosen].name.clone();
        let mut names: Vec<String> = (0..chosen).map(name).collect();
        let mut keys = plan.resolved;
        keys.retain(|key, _| ["channels", "material", "materials_dir", "merl"].contains(&key));
        if let Some(Value::Array(list)) = keys.get_mut("material") {
            let place = |t: &Value| {
                let name = t.get("name").and_then(Value::as_str);
                names.iter().position(|n| Some(n.as_str()) == name)
            };
            list.retain(|table| place(table).is_some());
            let written: Vec<usize> = list.iter().filter_map(place).collect();
            let mut at = 0..;
            names.retain(|_| !at.next().is_some_and(|i| written.contains(&i)));
        }
        if names.is_empty() {
            keys.retain(|key, _| !["materials_dir", "merl"].contains(&key));
        } else {
            keys.insert("only".into(), names.into());
        }
        Ok(Materials { keys, chosen, all })
    }

    /// The config of what is compared: of planners, or of sample sets; `None` if there are none for so many poses.
    fn source(&self, materials: &Materials, planners: bool) -> Result<Option<Source>, Error> {
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
        self.add_prior(&mut config, planners);
        let text = toml::to_string(&config).map_err(|e| internal(&e))?;
        Ok(Some(Source::new("gonio advise", text)))
    }

    /// Adds what knows of other materials, if any does.
    fn add_prior(&self, config: &mut Table, planners: bool) {
        let prior = match (&self.prior, &self.target) {
            (Some(path), _) => path.to_string_lossy(),
            (None, Some(_)) => "built-in".into(),
            (None, None) => return,
        };
        let mut add = |key: &str, kind: &str| {
            let keys = [("kind", kind), ("prior", &prior)];
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

    /// The best choices, each set of poses with its best reconstruction, the best first.
    fn ranked(&self, rows: &[&Row], plans: &[Plan]) -> Vec<Advice> {
        let findings = Findings::asked(rows, BAND, &ReportSpec::default());
        let ranking = findings.ranking(self.by, Measure::Cosine.name(), None);
        let lines = ranking.map_or(&[][..], |ranking| &ranking.lines);
        let of = |line: &Line| Some((line.choice.clone(), line.cells.first().copied()??));
        let mut all: Vec<(Choice, Cell)> = lines.iter().filter_map(of).collect();
        all.retain(|(_, cell)| cell.place.is_some());
        all.sort_by_key(|(_, cell)| cell.place);
        // Each set of poses once, and of those that have come to the same poses the first.
        let (mut seen, mut errors) = (Vec::new(), Vec::new());
        all.retain(|(choice, _)| {
            let poses =
                [&choice.parametrization, &choice.warp, &choice.sample_set].map(String::clone);
            let mine = rows.iter().filter(|r| r.choice() == *choice);
            let of: Vec<Option<f64>> = mine.map(|r| r.value(Metric::Nrmse.name())).collect();
            let is_new = !seen.contains(&poses) && !errors.contains(&of);
            seen.push(poses);
            errors.push(of);
            is_new
        });
        let mut advice = all
            .iter()
            .map(|(choice, cell)| self.advice(choice, cell, rows, plans));
        let mut best: Vec<Advice> = advice.by_ref().take(LINES).collect();
        if best.iter().all(|a| a.learns)
            && let Some(fixed) = advice.find(|a| !a.learns)
        {
            best.pop();
            best.push(fixed);
        }
        best
    }

    fn advice(&self, choice: &Choice, cell: &Cell, rows: &[&Row], plans: &[Plan]) -> Advice {
        let mine = rows.iter().filter(|r| r.choice() == *choice);
        let poses = mine.clone().map(|r| r.poses);
        let poses = [poses.clone().min(), poses.max()].map(Option::unwrap_or_default);
        let spread = |metric: Metric| {
            let errors: Vec<f64> = mine
                .clone()
                .filter_map(|r| r.value(metric.name()))
                .collect();
            Some(Spread {
                mean: geometric_mean(&errors)?,
                below: upper_quantile(&errors, BELOW),
            })
        };
        let set = plans.iter().flat_map(|plan| &plan.sample_sets);
        let set = set.filter(|set| set.name == choice.sample_set).next();
        let learns = set.is_some_and(PlannedSet::learns);
        Advice {
            nrmse: spread(Metric::Nrmse),
            log_relative: spread(Metric::LogRelative),
            against_first: cell
                .against_best
                .map(|paired| (paired.ratio, paired.interval)),
            minutes: cell.instrument_seconds.map(|s| s / 60.0),
            seconds: cell.seconds,
            commands: self.commands(choice, poses, set, plans),
            parametrization: choice.parametrization.clone(),
            warp: choice.warp.clone(),
            sample_set: choice.sample_set.clone(),
            reconstruction: choice.reconstruction.clone(),
            learns,
            poses,
        }
    }

    /// What makes the schedule of a choice, and the BRDF of its readings.
    fn commands(
        &self,
        choice: &Choice,
        poses: [usize; 2],
        set: Option<&PlannedSet>,
        plans: &[Plan],
    ) -> Vec<String> {
        let keys_of = |keys: &registry::Keys| {
            let text = |key: &str| keys.get(key).and_then(Value::as_str).map(str::to_owned);
            (
                text("kind").unwrap_or_default(),
                text("prior")
                    .map(|p| format!(" --set prior={}", quoted(&p)))
                    .unwrap_or_default(),
            )
        };
        let instrument = self
            .instrument
            .as_ref()
            .map(|name| format!(" --instrument {}", quoted(name)));
        let instrument = instrument.unwrap_or_default();
        let mut commands = Vec::new();
        let is_planner = |kind: &str| acquisition::all().iter().any(|e| e.kind == kind);
        let (kind, prior) = set
            .map(|set| keys_of(&set.set.resolved()))
            .unwrap_or_default();
        if let Some(set) = set.filter(|_| is_planner(&kind)) {
            let budget = self.budget.unwrap_or(poses[1]);
            let next = |readings: &str, batch: usize, to: &str| {
                format!(
                    "gonio next {readings}--planner {kind}{prior} --batch {batch}{instrument} -o {to}"
                )
            };
            match set.set.batch(0, budget) {
                None => commands.push(next("", poses[1], "poses.csv")),
                Some(first) => {
                    commands.push(next("", first, "poses1.csv"));
                    let then = set.set.batch(first, budget).filter(|n| *n > 0);
                    commands.extend(then.map(|n| next("readings1.csv ", n, "poses2.csv")));
                }
            }
        } else {
            let warp = match choice.warp.as_str() {
                "none" => String::new(),
                warp => format!(" --warp {}", quoted(warp)),
            };
            let allowed = match (self.budget, self.minutes) {
                (_, Some(minutes)) => format!("--minutes {minutes}"),
                (budget, None) => format!("--budget {}", budget.unwrap_or_default()),
            };
            let skip = if instrument.is_empty() {
                ""
            } else {
                " --skip-unreachable"
            };
            commands.push("gonio init advise".into());
            commands.push(format!(
                "gonio schedule advise.toml --parametrization {}{warp} --sample-set {} {allowed}{instrument}{skip} -o poses.csv",
                choice.parametrization, choice.sample_set
            ));
        }
        let methods = plans.iter().flat_map(|plan| &plan.methods);
        let mut method = methods
            .filter(|m| m.name == choice.reconstruction)
            .map(|m| keys_of(&m.method.resolved()));
        let (kind, prior) = method.next().unwrap_or_default();
        commands.push(format!(
            "gonio reconstruct readings*.csv --reconstruction {kind}{prior}"
        ));
        commands
    }

    fn text(&self, advice: &[Advice], materials: &Materials) -> String {
        let allowed = match (self.budget, self.minutes) {
            (_, Some(minutes)) => Allowance::Minutes(minutes),
            (budget, None) => Allowance::Poses(budget.unwrap_or_default()),
        };
        let of = match materials.chosen {
            chosen if chosen == materials.all => count(chosen, "material"),
            chosen => format!("{chosen} of {}", count(materials.all, "material")),
        };
        let mut out = format!(
            "{allowed}, {of}: errors under the cosine measure, and what nine of ten further materials are below\n\n"
        );
        let times = if self.instrument.is_some() {
            "\t>poses\t>minutes"
        } else {
            ""
        };
        let mut columns = Columns::new(&format!(
            "\tchoice\treconstruction\t>nrmse\t>below\t>log_relative\t>below\tagainst the first{times}\t>s of computing"
        ));
        let spread = |s: &Option<Spread>| {
            let below = s.as_ref().and_then(|s| s.below);
            format!("{}\t{}", error(s.as_ref().map(|s| s.mean)), error(below))
        };
        for (i, a) in advice.iter().enumerate() {
            let warp = if a.warp == "none" {
                String::new()
            } else {
                format!(" {}", a.warp)
            };
            let against = match &a.against_first {
                None => String::new(),
                Some((ratio, None)) => format!("{ratio:.2}"),
                Some((ratio, Some([low, high]))) => format!("{ratio:.2} [{low:.2}, {high:.2}]"),
            };
            let times = a.minutes.map_or(String::new(), |minutes| {
                let [least, most] = a.poses;
                let poses = if least == most {
                    most.to_string()
                } else {
                    format!("{least}–{most}")
                };
                format!("\t{poses}\t{minutes:.1}")
            });
            columns.row(&format!(
                "{}\t{} in {}{warp}\t{}\t{}\t{}\t{against}{times}\t{:.1}",
                i + 1,
                a.sample_set,
                a.parametrization,
                a.reconstruction,
                spread(&a.nrmse),
                spread(&a.log_relative),
                a.seconds,
            ));
        }
        out += &columns.to_string();
        for (i, a) in advice.iter().enumerate() {
            let then = match a.learns && a.commands.len() > 2 {
                true => ", then with all readings so far half as many poses each time",
                false => "",
            };
            out += &format!("\n{}  {}{then}:\n", i + 1, a.sample_set);
            for command in &a.commands {
                out += &format!("   {command}\n");
            }
        }
        out
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=+,".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.into(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
