//! Which poses, and which reconstruction, are best for materials like some.

mod choices;

pub use choices::{Advice, AgainstFirst, Spread};

use super::moments::MomentsPlan;
use super::{Allowance, Failure, Metric, Plan, Row, Source};
use crate::acquisition;
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::instrument;
use crate::reconstruct::{PriorFile, TRUSTED};
use crate::registry;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// The choices that are compared, as a config.
pub const ADVICE: &str = include_str!("../../configs/starters/advise.toml");

/// Materials of formulas as a config, for advice on a material of which no others like it are at hand.
pub const FORMULAS: &str = include_str!("../../configs/families.toml");

/// The coordinates that planners choose their poses in.
const OF_PLANNERS: &str = "half-difference";

/// The reconstruction that planners' poses are followed by.
const KRIGING: &str = "kriging";

/// What is asked.
#[derive(Debug)]
pub struct AdviceSpec {
    /// Poses, or minutes on the instrument.
    pub allowance: Allowance,
    /// A preset or a file; `None`: the instrument without flaws.
    pub instrument: Option<String>,
    /// Seed of poses and noise.
    pub seed: i64,
    /// The error that choices are ranked by.
    pub by: Metric,
    /// Materials that are tried, at most.
    pub most: usize,
    /// A prior of other materials.
    pub prior: Option<PathBuf>,
    /// True if the built-in prior is tried where no other is given and it was not made of what is tried.
    pub built_in_prior: bool,
}

/// The best choices.
#[derive(Debug)]
pub struct Advised {
    /// The best first.
    pub choices: Vec<Advice>,
    /// Materials left out of the advice.
    pub left_out: Vec<String>,
    /// Choices that failed, each reason once.
    pub failures: Vec<Failure>,
    /// Materials that were tried.
    pub tried: usize,
    /// Materials there are.
    pub all: usize,
}

/// The keys of a config that name materials.
struct Materials {
    keys: Table,
    tried: usize,
    all: usize,
    /// What all of them have.
    symmetry: Symmetry,
}

impl AdviceSpec {
    /// Compares poses and reconstructions on materials; `run` makes the rows of a plan.
    ///
    /// # Errors
    /// Materials of several symmetries; no choice that leaves an error; what reading plans and `run` return.
    pub fn advise(
        &self,
        materials: MomentsPlan,
        mut run: impl FnMut(&Plan) -> Result<(Vec<Row>, Vec<Failure>), Error>,
    ) -> Result<Advised, Error> {
        let materials = self.materials(materials)?;
        let mut rows: Vec<Row> = Vec::new();
        let (mut plans, mut failures): (Vec<Plan>, Vec<Failure>) = (Vec::new(), Vec::new());
        for planners in [false, true] {
            let Some(plan) = self.plan(&materials, planners)? else {
                continue;
            };
            let (made, failed) = run(&plan)?;
            plans.push(plan);
            rows.extend(made);
            for failure in failed {
                let is_new = !failures.iter().any(|known| known.reason == failure.reason);
                failures.extend(is_new.then_some(failure));
            }
        }
        let rows: Vec<&Row> = rows.iter().collect();
        let (choices, left_out) = self.ranked(&rows, &plans, materials.symmetry);
        if choices.is_empty() {
            let why = failures.first().map(|failure| failure.reason.clone());
            let exact = format!("no choice leaves an error: {}", left_out.join(", "));
            return Err(Error::infeasible("gonio advise", why.unwrap_or(exact)));
        }
        Ok(Advised {
            choices,
            left_out,
            failures,
            tried: materials.tried,
            all: materials.all,
        })
    }

    /// The experiment of planners, or of sample sets; `None` if there are none for so many poses. The built-in prior is
    /// left out where it was made of what is tried.
    fn plan(&self, materials: &Materials, planners: bool) -> Result<Option<Plan>, Error> {
        let of = |prior: Option<&Path>| {
            let source = self.source(materials, planners, prior)?;
            source.map(|source| Plan::read(&source)).transpose()
        };
        let built_in = PriorFile::default();
        match (&self.prior, self.built_in_prior) {
            (Some(path), _) => of(Some(path)),
            (None, true) => of(Some(built_in.path())).or_else(|_| of(None)),
            (None, false) => of(None),
        }
    }

    /// The materials that are tried.
    fn materials(&self, plan: MomentsPlan) -> Result<Materials, Error> {
        let all = plan.materials.len();
        let tried = all.min(self.most);
        let name = |i: usize| plan.materials[i * all / tried].name.clone();
        let mut names: Vec<String> = (0..tried).map(name).collect();
        let mut of_names = plan.materials.iter().filter(|m| names.contains(&m.name));
        let symmetry = of_names.next().map_or(Symmetry::FULL, |m| m.symmetry);
        if let Some(other) = of_names.find(|m| m.symmetry != symmetry) {
            let message = format!(
                "{} is {}, {} is {}; allowed: materials of the same symmetries, which have the same schedules",
                names[0], symmetry, other.name, other.symmetry
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
            tried,
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
        let mut config: Table = ADVICE.parse().map_err(Error::internal)?;
        config.remove("material");
        config.extend(materials.keys.clone());
        config.insert("seeds".into(), vec![self.seed].into());
        let most = self.allowance.count().unwrap_or(0);
        match self.allowance {
            Allowance::Minutes(minutes) => {
                config.insert("budgets".into(), Value::Array(Vec::new()));
                config.insert("minutes".into(), vec![minutes].into())
            }
            Allowance::Poses(_) | Allowance::Readings(_) => {
                config.insert("budgets".into(), vec![most as i64].into())
            }
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
        let text = toml::to_string(&config).map_err(Error::internal)?;
        Ok(Some(Source::new("gonio advise", text)))
    }

    /// Adds planners and reconstructions with a prior of other materials.
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
        if self.allowance.count().is_none_or(|n| n <= TRUSTED) {
            add("reconstruction", KRIGING);
        }
    }
}
