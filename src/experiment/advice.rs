//! Which poses, and which reconstruction, are best for materials like some.

mod choices;

pub(crate) use choices::quoted;
pub use choices::{Advice, AgainstFirst, Spread};

use super::instruments::load;
use super::moments::MomentsPlan;
use super::{Allowance, Failure, Metric, Plan, Row, Source};
use crate::acquisition::{self, MomentAim};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::instrument::{self, Machine};
use crate::reconstruct::{KRIGING, PriorFile, TRUSTED};
use crate::registry;
use crate::schedule::Pictures;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// The choices that are compared, as a config.
pub const ADVICE: &str = include_str!("../../configs/starters/advise.toml");

/// Materials of formulas as a config, for advice on a material of which no others like it are at hand.
pub const FORMULAS: &str = include_str!("../../configs/families.toml");

/// The coordinates that planners choose their poses in.
const OF_PLANNERS: &str = "half-difference";

/// Poses up to which planners are tried: more take minutes for each material.
const MOST_PLANNED: usize = 4000;

/// The planner whose poses are chosen for a moment, and the one whose are chosen for the BRDF, batch after batch.
const ADAPTIVE: &str = "adaptive";

/// Poses of a picture where there is hardly time for any.
const FEW: usize = 20;

/// How moments are compared: the diffuse part of the truth taken off both.
const OF_MOMENTS: &str = "\
    views = 10\nmax_view_deg = 81\nsplit = \"minimum\"\nestimator = { kind = \"peak-resolving\", tolerance = 2e-3 }\n";

/// Numbers of poses that are tried where a moment is to be known to a level.
const TRIED: [usize; 5] = [16, 32, 64, 128, 250];

/// Share of the materials whose error is to be below the level.
const WITHIN: f64 = 0.85;

/// What is asked.
#[derive(Clone, Debug)]
pub struct AdviceSpec {
    /// Poses, or minutes on the instrument; `None`: as many poses as `moment` needs.
    pub allowance: Option<Allowance>,
    /// A moment of slices that poses are to serve in place of the BRDF; choices are then ranked by its error.
    pub moment: Option<MomentAim>,
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
    /// Poses or minutes that choices were compared at.
    pub allowance: Allowance,
    /// True if these poses bring the error of a moment below its level for 85 % of the materials; `None` where that was not asked.
    pub is_enough: Option<bool>,
    /// Materials that were tried.
    pub tried: usize,
    /// Materials there are.
    pub all: usize,
}

/// A table with one key.
fn table_of(key: &str, value: &str) -> Table {
    Table::from_iter([(key.to_owned(), Value::from(value))])
}

/// A planner for a moment, without a stop.
fn for_moment(kind: &str, aim: MomentAim) -> Table {
    registry::with(table_of("kind", kind), "for", aim.to(0.0).to_string())
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
        let (allowance, is_enough) = match (self.allowance, self.moment) {
            (Some(allowance), _) => (allowance, None),
            (None, Some(aim)) if aim.level == 0.0 => {
                let message = format!(
                    "for = \"{aim}\": allowed is a level above 0, or a number of poses beside it"
                );
                return Err(Error::config("gonio advise", message));
            }
            (None, Some(aim)) => {
                let found = self.least(aim, &materials, &mut run)?;
                let most = TRIED[TRIED.len() - 1];
                let poses = Allowance::Poses(found.unwrap_or(most));
                (poses, Some(found.is_some()))
            }
            (None, None) => {
                let message = "allowed is a number of poses, minutes or a moment";
                return Err(Error::config("gonio advise", message));
            }
        };
        let at = Self {
            allowance: Some(allowance),
            ..self.clone()
        };
        Ok(Advised {
            is_enough,
            ..at.compared(&materials, allowance, run)?
        })
    }

    /// The least number of poses, of those that are tried, at which poses that are chosen for a moment batch after batch bring its
    /// error below its level for 85 % of the materials; `None` if the most are too few.
    fn least(
        &self,
        aim: MomentAim,
        materials: &Materials,
        run: &mut impl FnMut(&Plan) -> Result<(Vec<Row>, Vec<Failure>), Error>,
    ) -> Result<Option<usize>, Error> {
        let mut config = self.config(materials)?;
        let budgets = TRIED.map(|n| n as i64).to_vec();
        config.insert("budgets".into(), budgets.into());
        let only = |kind| vec![table_of("kind", kind)];
        config.insert("sample_set".into(), vec![for_moment(ADAPTIVE, aim)].into());
        config.insert("parametrization".into(), only(OF_PLANNERS).into());
        config.insert("reconstruction".into(), only(KRIGING).into());
        let text = toml::to_string(&config).map_err(Error::internal)?;
        let (rows, _) = run(&Plan::read(&Source::new("gonio advise", text))?)?;
        let is_enough = |budget: &usize| {
            let mine = rows.iter().filter(|r| r.budget == *budget);
            let errors = mine.filter_map(|r| self.metric().error(r));
            let within = errors.filter(|e| *e <= aim.level).count();
            within as f64 >= WITHIN * materials.tried as f64
        };
        // More readings are to be enough too.
        let enough = TRIED.iter().rev().take_while(|budget| is_enough(budget));
        Ok(enough.last().copied())
    }

    /// The error that choices are ranked by.
    pub fn metric(&self) -> Metric {
        self.moment.map_or(self.by, |aim| {
            let [band, of] = aim.position();
            Metric::Moment(band, of)
        })
    }

    /// What is allowed, in words.
    fn allowed(&self) -> String {
        self.allowance.map_or(String::new(), |a| a.to_string())
    }

    /// Poses, if that is what is allowed.
    fn poses(&self) -> Option<usize> {
        self.allowance.and_then(Allowance::count)
    }

    fn compared(
        &self,
        materials: &Materials,
        allowance: Allowance,
        mut run: impl FnMut(&Plan) -> Result<(Vec<Row>, Vec<Failure>), Error>,
    ) -> Result<Advised, Error> {
        let mut rows: Vec<Row> = Vec::new();
        let (mut plans, mut failures): (Vec<Plan>, Vec<Failure>) = (Vec::new(), Vec::new());
        for planners in [false, true] {
            let Some(plan) = self.plan(materials, planners)? else {
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
            allowance,
            is_enough: None,
            tried: materials.tried,
            all: materials.all,
        })
    }

    /// The experiment of planners, or of sample sets; `None` if there are none for so many poses. The built-in prior is
    /// left out where it was made of what is tried.
    fn plan(&self, materials: &Materials, planners: bool) -> Result<Option<Plan>, Error> {
        let of = |prior: Option<&Path>| self.plan_with(materials, planners, prior);
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

    /// [`plan`](Self::plan) with this prior.
    fn plan_with(
        &self,
        materials: &Materials,
        planners: bool,
        prior: Option<&Path>,
    ) -> Result<Option<Plan>, Error> {
        let mut config = self.config(materials)?;
        let most = self.poses().unwrap_or(0);
        match self.allowance {
            Some(Allowance::Minutes(minutes)) => {
                config.insert("budgets".into(), Value::Array(Vec::new()));
                config.insert("minutes".into(), vec![minutes].into())
            }
            _ => config.insert("budgets".into(), vec![most as i64].into()),
        };
        let kind = |table: &Value| {
            let kind = table.get("kind").and_then(Value::as_str);
            kind.unwrap_or_default().to_owned()
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
            planners && read.is_ok_and(|planner| most <= planner.most().min(MOST_PLANNED))
        };
        let is_empty = retain("sample_set", &|table| {
            // Of moments, which take a while, what is best for the BRDF beside what is chosen for them.
            let serves = self.moment.is_none() || [ADAPTIVE, "sobol"].contains(&&*kind(table));
            serves && suits(table)
        });
        retain("parametrization", &|table| {
            !planners || kind(table) == OF_PLANNERS
        });
        retain("reconstruction", &|table| {
            let up_to = table.get("up_to").and_then(Value::as_integer);
            let few = up_to.is_none_or(|up_to| most as i64 <= up_to);
            let kind = kind(table);
            // Those that need no grid, which is left out where poses are for a moment.
            let suits = self.moment.is_none() || [KRIGING, "thin-plate"].contains(&&*kind);
            few && suits && (!planners || kind == KRIGING)
        });
        if is_empty {
            return Ok(None);
        }
        if let (Some(aim), true) = (self.moment, planners) {
            let of_moment = [ADAPTIVE, "a-optimal"].map(|kind| Value::from(for_moment(kind, aim)));
            if let Some(Value::Array(list)) = config.get_mut("sample_set") {
                list.extend(of_moment.into_iter().filter(suits));
            }
        }
        if let Some(prior) = prior {
            self.add_prior(&mut config, planners, &prior.to_string_lossy());
        }
        let text = toml::to_string(&config).map_err(Error::internal)?;
        Plan::read(&Source::new("gonio advise", text)).map(Some)
    }

    /// The config of the materials, the instrument and the errors that are asked for, with all choices.
    fn config(&self, materials: &Materials) -> Result<Table, Error> {
        let mut config: Table = ADVICE.parse().map_err(Error::internal)?;
        config.remove("material");
        config.extend(materials.keys.clone());
        config.insert("seeds".into(), vec![self.seed].into());
        if let Some(name) = &self.instrument {
            let preset = instrument::presets().iter().any(|p| p.name == name);
            let key = if preset { "preset" } else { "file" };
            config.insert("instrument".into(), vec![table_of(key, name)].into());
            let machine = Machine::new(&load(name)?).map_err(Error::internal)?;
            if let Some(stop) = machine.stop_angle() {
                let mut pictures = table_of("kind", "pictures");
                pictures.insert(
                    "stop".into(),
                    Value::try_from(stop).map_err(Error::internal)?,
                );
                // A picture that the budget holds, or a small one where there is hardly time for any.
                let nodes = match self.allowance {
                    Some(Allowance::Minutes(minutes)) if minutes < 2.0 => FEW,
                    _ => self.poses().unwrap_or(Pictures::NODES).min(Pictures::NODES),
                };
                pictures.insert("nodes".into(), (nodes as i64).into());
                if let Some(Value::Array(list)) = config.get_mut("sample_set") {
                    list.push(pictures.into());
                }
            }
        }
        if self.moment.is_some() {
            config.insert("quantities".into(), vec!["moments"].into());
            let moments: Table = OF_MOMENTS.parse().map_err(Error::internal)?;
            config.insert("moments".into(), moments.into());
        }
        Ok(config)
    }

    /// Adds planners and reconstructions with a prior of other materials.
    fn add_prior(&self, config: &mut Table, planners: bool, prior: &str) {
        let mut add = |key: &str, mut table: Table| {
            table.insert("prior".into(), prior.into());
            if let Some(Value::Array(list)) = config.get_mut(key) {
                list.push(table.into());
            }
        };
        if planners {
            add("sample_set", table_of("kind", ADAPTIVE));
            if let Some(aim) = self.moment {
                add("sample_set", for_moment(ADAPTIVE, aim));
            }
        }
        // Beyond it is left out; how many a time allows for is not known yet.
        if self.poses().is_none_or(|n| n <= TRUSTED) {
            add("reconstruction", table_of("kind", KRIGING));
        }
    }
}
