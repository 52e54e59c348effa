//! The best choices, and the commands that make their schedules.

use super::{ADAPTIVE, AdviceSpec};
use crate::acquisition;
use crate::experiment::{
    Allowance, Cell, Choice, Findings, Line, Metric, Plan, PlannedSet, ReportSpec, Row,
};
use crate::geometry::Symmetry;
use crate::metrics::Measure;
use crate::registry;
use crate::statistics::{BAND, compares, geometric_mean, is_exact, upper_quantile};
use serde::Serialize;
use toml::Value;

/// Lines that are printed: the best, the last of them poses that no reading changes, if those of all others are.
const LINES: usize = 3;

/// The share of further materials whose errors are below the bound.
const BELOW: f64 = 0.9;

/// An error over materials.
#[derive(Debug, Serialize)]
pub struct Spread {
    /// The geometric mean.
    pub mean: f64,
    /// Error that 90 % of materials are below; `None` if too few were tried.
    pub below: Option<f64>,
}

/// An error over that of the first choice.
#[derive(Debug, Serialize)]
pub struct AgainstFirst {
    /// Name of the error.
    pub metric: &'static str,
    /// Geometric mean over materials.
    pub ratio: f64,
    /// A 95 % interval of it over materials; `None` if too few were tried.
    pub interval: Option<[f64; 2]>,
}

/// A choice, and what it leaves.
#[derive(Debug, Serialize)]
pub struct Advice {
    /// Name of the coordinates.
    pub parametrization: String,
    /// Their warps.
    pub warp: String,
    /// Name of the poses.
    pub sample_set: String,
    /// Name of the method.
    pub reconstruction: String,
    /// The error nrmse.
    pub nrmse: Option<Spread>,
    /// The error log_relative.
    pub log_relative: Option<Spread>,
    /// The error of the moment that is asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moment: Option<Spread>,
    /// The error of the ranking over that of the best; `None` of the best.
    pub against_first: Option<AgainstFirst>,
    /// Poses that were visited, at least and at most.
    pub poses: [usize; 2],
    /// True if each material has other poses, by its readings.
    pub learns: bool,
    /// Time on the instrument, minutes.
    pub minutes: Option<f64>,
    /// Wall time of computing a material, s.
    pub seconds: Option<f64>,
    /// What makes the schedule and the BRDF.
    pub commands: Vec<String>,
    /// How readings go on, if they do after these commands.
    pub then: Option<String>,
}

impl AdviceSpec {
    /// The best choices, each set of poses with its best reconstruction, the best first; and the materials that
    /// are left out.
    pub(super) fn ranked(
        &self,
        rows: &[&Row],
        plans: &[Plan],
        symmetry: Symmetry,
    ) -> (Vec<Advice>, Vec<String>) {
        let findings = Findings::asked(rows, BAND, &ReportSpec::default());
        let metric = self.metric();
        let measure = match metric.is_of_moments() {
            true => "",
            false => Measure::Cosine.name(),
        };
        let Some(ranking) = findings.ranking(metric, measure, None) else {
            return (Vec::new(), Vec::new());
        };
        let of = |line: &Line| Some((line.choice.clone(), line.cells.first().copied()??));
        let mut all: Vec<(Choice, Cell)> = ranking.lines.iter().filter_map(of).collect();
        all.retain(|(_, cell)| cell.place.is_some());
        all.sort_by_key(|(_, cell)| cell.place);
        // Each set of poses once, and of those with the same errors, so the same poses, the first.
        let (mut seen, mut errors) = (Vec::new(), Vec::new());
        all.retain(|(choice, _)| {
            let poses = [&choice.parametrization, &choice.warp, &choice.sample_set];
            let poses = poses.map(String::clone);
            let mine = rows.iter().filter(|r| r.choice() == *choice);
            let of: Vec<Option<f64>> = mine.map(|r| r.value(self.metric().name())).collect();
            let is_inexact = of.iter().any(|e| e.is_some_and(|e| !is_exact(e)));
            let known = seen.contains(&poses) || is_inexact && errors.contains(&of);
            seen.push(poses);
            errors.push(of);
            !known
        });
        let learns = |(choice, _): &&(Choice, Cell)| {
            planned(&choice.sample_set, plans).is_some_and(PlannedSet::learns)
        };
        let best = all.iter().take(LINES);
        // Beside poses for a moment those for the BRDF, batch after batch.
        let for_brdf = |(choice, _): &&(Choice, Cell)| choice.sample_set == ADAPTIVE;
        let fixed = match self.moment {
            Some(_) => all.iter().find(for_brdf),
            None => all.iter().find(|choice| !learns(choice)),
        };
        let fixed = fixed.filter(|_| match self.moment {
            Some(_) => !best.clone().any(|choice| for_brdf(&choice)),
            None => best.clone().all(|choice| learns(&choice)),
        });
        let kept = LINES - usize::from(fixed.is_some());
        let chosen = best.take(kept).chain(fixed).enumerate();
        let advice = chosen
            .map(|(i, (choice, cell))| self.advice(i + 1, (choice, cell), rows, (plans, symmetry)));
        (advice.collect(), ranking.scope.left_out.clone())
    }

    fn advice(
        &self,
        number: usize,
        (choice, cell): (&Choice, &Cell),
        rows: &[&Row],
        (plans, symmetry): (&[Plan], Symmetry),
    ) -> Advice {
        let mine = rows.iter().filter(|r| r.choice() == *choice);
        let poses = mine.clone().map(|r| r.poses);
        let poses = [poses.clone().min(), poses.max()].map(Option::unwrap_or_default);
        let spread = |metric: Metric| {
            let of = |r: &&Row| r.value(metric.name());
            let is_compared = |r: &&&Row| {
                let same = rows.iter().filter(|other| other.material == r.material);
                compares(same.filter_map(of))
            };
            let errors: Vec<f64> = mine.clone().filter(is_compared).filter_map(of).collect();
            Some(Spread {
                mean: geometric_mean(&errors)?,
                below: upper_quantile(&errors, BELOW),
            })
        };
        let (commands, then) = self.commands(number, choice, poses, (plans, symmetry));
        Advice {
            nrmse: spread(Metric::Nrmse),
            log_relative: spread(Metric::LogRelative),
            moment: self.moment.and_then(|_| spread(self.metric())),
            against_first: cell.against_best.map(|paired| AgainstFirst {
                metric: self.metric().name(),
                ratio: paired.ratio,
                interval: paired.interval,
            }),
            learns: planned(&choice.sample_set, plans).is_some_and(PlannedSet::learns),
            minutes: cell.instrument_seconds.map(|s| s / 60.0),
            seconds: cell.seconds,
            parametrization: choice.parametrization.clone(),
            warp: choice.warp.clone(),
            sample_set: choice.sample_set.clone(),
            reconstruction: choice.reconstruction.clone(),
            commands,
            then,
            poses,
        }
    }

    /// What makes the schedule of a choice and the BRDF of its readings, in files of its own; and how readings go on.
    fn commands(
        &self,
        number: usize,
        choice: &Choice,
        poses: [usize; 2],
        (plans, symmetry): (&[Plan], Symmetry),
    ) -> (Vec<String>, Option<String>) {
        let mut more = String::new();
        if let Some(name) = &self.instrument {
            more += &format!(" --instrument {}", quoted(name));
        }
        if self.seed != 1 {
            more += &format!(" --seed {}", self.seed);
        }
        let (mut commands, mut then) = (Vec::new(), None);
        let set = planned(&choice.sample_set, plans);
        let (kind, mut prior) = set.map(|set| keys(&set.set.resolved())).unwrap_or_default();
        let is_for_moment = set.is_some_and(|set| set.set.resolved().contains_key("for"));
        if let Some(aim) = self.moment.filter(|_| is_for_moment) {
            prior += &format!(" --for {aim}");
        }
        let is_planner = acquisition::all().iter().any(|e| e.kind == kind);
        if let Some(set) = set.filter(|_| is_planner) {
            let next = |readings: &str, batch: usize, to: &str| {
                let folded = match readings {
                    "" => symmetries(symmetry),
                    // Files say it.
                    _ => String::new(),
                };
                format!(
                    "gonio next {readings}--planner {kind}{prior}{folded} --batch {batch}{more} -o {number}-{to}"
                )
            };
            let budget = self.poses().unwrap_or(set.set.most());
            let mut instruments = plans.iter().flat_map(|plan| &plan.instruments);
            let in_pictures = instruments.any(|of| of.spec.picture.is_some());
            match set.set.batch(0, budget, in_pictures) {
                None => commands.push(next("", poses[1], "poses.csv")),
                Some(first) => {
                    commands.push(next("", first, "poses1.csv"));
                    let second = set.set.batch(first, budget, in_pictures).filter(|n| *n > 0);
                    let known = format!("{number}-readings1.csv ");
                    commands.extend(second.map(|n| next(&known, n, "poses2.csv")));
                    let asked = first + second.unwrap_or(0);
                    let third = set.set.batch(asked, budget, in_pictures).filter(|n| *n > 0);
                    then = third.map(|_| {
                        format!("then, with all readings so far, half as many poses each time, up to {}", self.allowed())
                    });
                }
            }
        } else {
            // Pictures are none of the sets of the config that is written.
            let resolved = set.map(|set| set.set.resolved());
            let stop = resolved
                .as_ref()
                .and_then(|keys| keys.get("stop")?.as_str());
            let pictures = stop.map_or_else(String::new, |stop| {
                let nodes = resolved.as_ref().and_then(|keys| keys.get("nodes")?.as_integer());
                let nodes = nodes.unwrap_or_default();
                format!(
                    " --set 'sample_set=[{{kind=\"{kind}\",stop=\"{stop}\",nodes={nodes}}}]' --set budgets=[{nodes}]"
                )
            });
            let coordinates = match choice.parametrization.as_str() {
                "none" => String::new(),
                name => format!(" --parametrization {name}"),
            };
            let warp = match choice.warp.as_str() {
                "none" => String::new(),
                warp => format!(" --warp {}", quoted(warp)),
            };
            let allowed = match self.allowance {
                Some(Allowance::Minutes(minutes)) => format!("--minutes {minutes}"),
                Some(Allowance::Poses(n) | Allowance::Readings(n)) => format!("--budget {n}"),
                None => String::new(),
            };
            let folded = match symmetry {
                Symmetry::FULL => String::new(),
                Symmetry {
                    isotropic,
                    reciprocal,
                    bilateral,
                } => format!(
                    " --set 'material=[{{kind=\"lambert\",symmetry={{isotropic={isotropic},reciprocal={reciprocal},bilateral={bilateral}}}}}]'"
                ),
            };
            let skip = self
                .instrument
                .as_ref()
                .map_or("", |_| " --skip-unreachable");
            commands.push(format!("gonio init advise -o {number}-advise.toml"));
            commands.push(format!(
                "gonio schedule {number}-advise.toml{folded}{pictures}{coordinates}{warp} --sample-set {} {allowed}{more}{skip} -o {number}-poses.csv",
                choice.sample_set
            ));
        }
        let mut methods = plans.iter().flat_map(|plan| &plan.methods);
        let method = methods.find(|m| m.name == choice.reconstruction);
        let (kind, prior) = method
            .map(|m| keys(&m.method.resolved()))
            .unwrap_or_default();
        commands.push(format!(
            "gonio reconstruct {number}-readings*.csv --reconstruction {kind}{prior}"
        ));
        (commands, then)
    }
}

/// The sample set of a name.
fn planned<'p>(name: &str, plans: &'p [Plan]) -> Option<&'p PlannedSet> {
    let mut all = plans.iter().flat_map(|plan| &plan.sample_sets);
    all.find(|set| set.name == name)
}

/// The kind of a member, and its prior as an option.
fn keys(resolved: &registry::Keys) -> (String, String) {
    let text = |key: &str| resolved.get(key).and_then(Value::as_str);
    let prior = text("prior").map(|prior| format!(" --set prior={}", quoted(prior)));
    (
        text("kind").unwrap_or_default().into(),
        prior.unwrap_or_default(),
    )
}

/// Symmetries as an option of `gonio next`, whose default are all.
fn symmetries(symmetry: Symmetry) -> String {
    match symmetry {
        Symmetry::FULL => String::new(),
        Symmetry::NONE => " --symmetry none".into(),
        some => format!(" --symmetry {}", some.names().join(",")),
    }
}

/// A word as a shell takes it.
pub(crate) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=+,".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.into(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}
