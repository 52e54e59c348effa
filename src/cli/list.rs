//! `gonio list`: what a config can name, straight from the registries.

use super::print;
use crate::brdf;
use crate::error::Error;
use crate::experiment::{Kind, Row};
use crate::geometry::Symmetry;
use crate::lighting;
use crate::metrics::Measure;
use crate::moments;
use crate::parametrization::{self, WarpName};
use crate::reconstruct;
use crate::registry::{self, Entry};
use crate::schedule;
use clap::{Args, ValueEnum};

#[derive(Debug, Args)]
pub(super) struct List {
    /// One family; all if left out
    family: Option<Family>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Family {
    Experiments,
    Materials,
    Parametrizations,
    Warps,
    SampleSets,
    Reconstructions,
    Measures,
    Estimators,
    Lightings,
    Columns,
}

impl List {
    pub(super) fn run(self) -> Result<(), Error> {
        let families = Family::value_variants().iter();
        for (i, &family) in families
            .filter(|&&f| self.family.is_none_or(|only| only == f))
            .enumerate()
        {
            let gap = if i > 0 { "\n" } else { "" };
            print(&format!("{gap}{}", section(family)))?;
        }
        Ok(())
    }
}

fn section(family: Family) -> String {
    match family {
        Family::Experiments => {
            let lines = Kind::ALL.iter().map(|k| line(k.name(), k.summary()));
            titled("experiments: experiment = …", lines)
        }
        Family::Estimators => {
            let title = "estimators of moments: estimator = { kind = … } in [moments]";
            entries(title, &moments::all(), |estimator| estimator.resolved())
        }
        Family::Lightings => {
            let title = "lightings: [[lighting]] with kind = … of relations, [lighting] of moments";
            entries(title, &lighting::all(), |light| light.resolved())
        }
        Family::Materials => {
            let title = "materials: [[material]] with kind = …";
            entries(title, &brdf::all(), |spec| spec.resolved())
        }
        Family::SampleSets => {
            let title = "sample sets: [[sample_set]] with kind = …";
            entries(title, &schedule::all(), |set| set.resolved())
        }
        Family::Reconstructions => {
            let title = "reconstructions: [[reconstruction]] with kind = …";
            entries(title, &reconstruct::all(), |method| method.resolved())
        }
        Family::Parametrizations => {
            let all = parametrization::all();
            let lines = all.iter().map(|e| {
                let axes = |symmetry| {
                    let axes = e.axes(symmetry);
                    let symbols: Vec<_> = axes.iter().map(|a| a.symbol).collect();
                    symbols.join(", ")
                };
                format!(
                    "{}\n{:20}isotropic: {}; anisotropic: {}",
                    line(e.name, e.summary),
                    "",
                    axes(Symmetry::FULL),
                    axes(Symmetry::NONE)
                )
            });
            titled("parametrizations: [[parametrization]] with kind = …", lines)
        }
        Family::Warps => {
            let lines = WarpName::ALL.iter().map(|w| line(w.name(), w.summary()));
            let title = "warps: warp = { AXIS = … } in a [[parametrization]]";
            titled(title, lines)
        }
        Family::Measures => {
            let lines = Measure::ALL.iter().map(|m| line(m.name(), summary(*m)));
            titled("measures: measures = [ … ]", lines)
        }
        Family::Columns => {
            let lines = Row::COLUMNS
                .iter()
                .map(|(name, meaning)| format!("  {name:<22} {meaning}"));
            titled("columns: of results.csv and results.jsonl", lines)
        }
    }
}

/// The members of a registry, each with the keys of its examples.
fn entries<T: ?Sized>(
    title: &str,
    all: &[Entry<T>],
    resolved: impl Fn(Box<T>) -> toml::Table,
) -> String {
    let lines = all.iter().map(|entry| {
        let mut text = line(entry.kind, entry.summary);
        for example in entry.examples {
            // The laws read every example, so that each of them reads.
            let Ok(member) = registry::read_text(entry, example) else {
                continue;
            };
            let mut keys = resolved(member);
            keys.remove("kind");
            let keys = keys.iter().map(|(k, v)| format!("{k} = {v}"));
            let keys: Vec<_> = keys.collect();
            if !keys.is_empty() {
                text += &format!("\n{:20}{}", "", keys.join(", "));
            }
        }
        text
    });
    titled(title, lines)
}

fn titled(title: &str, lines: impl Iterator<Item = String>) -> String {
    let lines: String = lines.map(|line| line + "\n").collect();
    format!("{title}\n{lines}")
}

fn line(name: &str, summary: &str) -> String {
    format!("  {name:<16}  {summary}")
}

fn summary(measure: Measure) -> &'static str {
    match measure {
        Measure::Cosine => "both directions cosine-distributed",
        Measure::Lobe => {
            "half of that, half about the mirror direction: half vectors from GGX, alpha 0.3, 0.1, 0.03, 0.01"
        }
    }
}
