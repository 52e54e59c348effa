//! `gonio advise`.

use super::run::{collect, note_missing, print_failures};
use super::{BrdfArgs, JsonArgs, ThreadArgs, note, print, print_json};
use crate::acquisition::MomentAim;
use crate::error::{Error, count};
use crate::experiment::{AdviceSpec, Advised, Allowance, FORMULAS, Metric, Source, Spread};
use crate::report::{Columns, error_text};
use clap::{ArgGroup, Args};
use std::path::PathBuf;

/// Compares poses and reconstructions on materials, and says which are best
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("allowance").args(["budget", "minutes"])))]
#[command(after_help = "\
The materials stand for the one that is to be measured: tables of one's own, a config, or, if none are named,
materials of formulas. Each choice measures and reconstructs them all, so that its errors are those of a run:

  gonio advise --budget 32
  gonio advise MERL --budget 64 --prior prior.gonio
  gonio advise MERL --minutes 10 --instrument rosi
  gonio advise MERL --for variance=5%

Planners are asked in half/difference coordinates. 90 % of materials are below `below`,
if they are like these and the choice had not been the best on them. Behind each of the three best stand the commands
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
    /// Number of poses [default with --for: the least of 16, 32, 64, 128 and 250 that bring 85 % of materials to the level]
    #[arg(long, value_name = "N", value_parser = super::budget, required_unless_present_any = ["minutes", "moment"])]
    budget: Option<usize>,
    /// Time on the instrument
    #[arg(long, value_name = "M", requires = "instrument", value_parser = super::minutes)]
    minutes: Option<f64>,
    /// On this instrument: a preset (see `gonio list instruments`) or a file [default: one without flaws]
    #[arg(long, value_name = "NAME|FILE")]
    instrument: Option<String>,
    /// The error that choices are ranked by: nrmse or log_relative
    #[arg(long, value_name = "METRIC", default_value = Metric::Nrmse.name(), value_parser = Metric::named)]
    by: Metric,
    /// For a moment of slices instead, to a level: variance=5%, mean_deg_40_70=1, energy (of its own level, 1 %); the diffuse
    /// part of the material is taken off
    #[arg(long = "for", value_name = "MOMENT[=LEVEL]", conflicts_with = "by")]
    moment: Option<MomentAim>,
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

impl Advise {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let materials = match &self.target {
            Some(target) => BrdfArgs::new(target.clone(), self.set, None).plan()?,
            None => super::any_plan(&Source::new("gonio advise", FORMULAS))?.into_moments(),
        };
        note_missing(&materials.missing);
        let asked = AdviceSpec {
            moment: self.moment,
            allowance: match self.minutes {
                Some(minutes) => Some(Allowance::Minutes(minutes)),
                None => self.budget.map(Allowance::Poses),
            },
            instrument: self.instrument,
            seed: self.seed,
            by: self.by,
            most: self.most.into(),
            prior: self.prior,
            built_in_prior: self.target.is_some(),
        };
        let advised = asked.advise(materials, collect)?;
        if let (Some(aim), Some(is_enough)) = (asked.moment, advised.is_enough) {
            let least = if is_enough { "" } else { "more than " };
            note(&format!(
                "gonio: {aim} for 85 % of materials: {least}{}, chosen for it batch after batch",
                advised.allowance
            ));
        }
        print_failures(&advised.failures);
        if !advised.left_out.is_empty() {
            note(&format!("gonio: left out: {}", advised.left_out.join(", ")));
        }
        if self.json.wanted() {
            return print_json(&advised.choices);
        }
        if self.target.is_none() {
            note(
                "gonio: materials of formulas stand for all; with tables like the material, advice is better",
            );
        }
        let all = count(advised.all, "material");
        let of = match advised.tried {
            tried if tried == advised.all => all,
            tried => format!("{tried} of {all}"),
        };
        print(&text(&asked, &advised, &of))
    }
}

/// The choices as a table, then their commands. `of`: the materials.
fn text(asked: &AdviceSpec, advised: &Advised, of: &str) -> String {
    let advice = &advised.choices;
    let bounds = advice
        .iter()
        .flat_map(|a| &a.nrmse)
        .any(|s| s.below.is_some());
    let bounds = match bounds {
        true => ", `below`: 90 % of materials are below",
        false => "",
    };
    let mut out = format!(
        "{}, {of}: errors under the cosine measure{bounds}\n\n",
        advised.allowance
    );
    let times = asked
        .instrument
        .as_ref()
        .map_or("", |_| "\t>poses\t>minutes");
    let of_moment = asked
        .moment
        .map_or(String::new(), |aim| format!("\t>{}\t>below", aim.column()));
    let mut columns = Columns::new(&format!(
        "\tchoice\treconstruction{of_moment}\t>nrmse\t>below\t>log_relative\t>below\t{} against the first{times}\t>s of computing",
        asked.metric().name()
    ));
    let spread = |s: &Option<Spread>| {
        let below = s.as_ref().and_then(|s| s.below);
        format!(
            "{}\t{}",
            error_text(s.as_ref().map(|s| s.mean)),
            error_text(below)
        )
    };
    for (i, a) in advice.iter().enumerate() {
        let warp = match a.warp.as_str() {
            "none" => String::new(),
            warp => format!(" {warp}"),
        };
        let against = a.against_first.as_ref().map_or(String::new(), |against| {
            let interval = against
                .interval
                .map(|[low, high]| format!(" [{low:.2}, {high:.2}]"));
            format!("{:.2}{}", against.ratio, interval.unwrap_or_default())
        });
        let times = a.minutes.map_or(String::new(), |minutes| {
            let poses = match a.poses {
                [least, most] if least == most => most.to_string(),
                [least, most] => format!("{least}–{most}"),
            };
            format!("\t{poses}\t{minutes:.1}")
        });
        columns.row(&format!(
            "{}\t{} in {}{warp}\t{}{}\t{}\t{}\t{against}{times}\t{}",
            i + 1,
            a.sample_set,
            a.parametrization,
            a.reconstruction,
            asked
                .moment
                .map_or(String::new(), |_| format!("\t{}", spread(&a.moment))),
            spread(&a.nrmse),
            spread(&a.log_relative),
            a.seconds.map_or(String::new(), |s| format!("{s:.1}")),
        ));
    }
    out += &columns.to_string();
    for (i, a) in advice.iter().enumerate() {
        out += &format!("\n{}  {}:\n", i + 1, a.sample_set);
        let (last, first) = a.commands.split_last().unwrap_or((&a.sample_set, &[]));
        for line in first.iter().chain(&a.then).chain([last]) {
            out += &format!("   {line}\n");
        }
    }
    out
}
