//! `gonio list`: what a config can name, straight from the registries.

use super::print;
use crate::brdf;
use crate::error::{Error, excerpt, one_of};
use crate::experiment::{Kind, Row, Use};
use crate::formats;
use crate::geometry::Symmetry;
use crate::instrument::{self, InstrumentSpec, Order};
use crate::lighting;
use crate::metrics::Measure;
use crate::moments;
use crate::parametrization;
use crate::reconstruct;
use crate::registry::{self, Entry};
use crate::schedule;
use clap::{Args, ValueEnum};

#[derive(Debug, Args)]
pub(super) struct List {
    /// One family; all if left out
    family: Option<Family>,
    /// One instrument: its whole file, to be edited and named in `[[instrument]] file = …`
    name: Option<String>,
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
    Instruments,
    Formats,
    Columns,
}

/// A file and its columns with their meaning; groups of like columns share a line.
type Columns = (&'static str, &'static [(&'static str, &'static str)]);

/// The tables of the other kinds of experiments.
const MORE_COLUMNS: [Columns; 5] = [
    (
        "ranking.csv",
        &[
            (
                "metric, measure, truth",
                "which ranking; truth is empty for all of them",
            ),
            ("materials", "materials of that truth"),
            (
                "parametrization, …, allowed",
                "which choice, as in results.csv",
            ),
            ("place", "among the choices that have all materials, from 1"),
            ("mean", "geometric mean of the error over materials"),
            (
                "ratio_to_best, _low, _high",
                "ratio to the best choice with its 95 % bootstrap interval over materials",
            ),
            (
                "p",
                "Wilcoxon signed-rank test against the best, adjusted for the number of choices (Holm)",
            ),
            (
                "wins, losses, ties",
                "materials on which it is better or worse than the best by more than the band",
            ),
            ("verdict", "against the best"),
            (
                "readings, compute_seconds, instrument_seconds",
                "geometric means over materials",
            ),
            (
                "order, order_low, order_high",
                "slope of ln error on ln readings over the budgets, with its 95 % interval over materials",
            ),
        ],
    ),
    (
        "profiles.csv (also of gonio moments)",
        &[
            ("material, channel, theta_o_deg", "which slice"),
            (
                "energy",
                "rad²/sr: the integral of f_r over theta and phi, no cosine",
            ),
            (
                "mean_10, mean_01",
                "mean direction along theta and phi, rad",
            ),
            ("covariance_20, _11, _02", "central, rad²"),
            ("skewness_30, _21, _12, _03", "standardised by sigma"),
            (
                "kurtosis_40, …, _04",
                "excess: less that of a normal distribution of the same correlation",
            ),
            (
                "*_uncertainty",
                "standard deviation (random estimators) or error bound, in the same unit",
            ),
            (
                "missing_share",
                "share of the square (theta, phi) without data",
            ),
            (
                "clamped_share",
                "share of it that was below the diffuse part",
            ),
            ("evaluations", "values of the BRDF that were looked at"),
            (
                "unresolved",
                "why the uncertainties are not to be trusted; empty if they are",
            ),
        ],
    ),
    (
        "fits.csv: averages and counts are over the fitted views",
        &[
            ("diffuse", "what was subtracted before, 1/sr"),
            (
                "energy_base, ramp_height",
                "rad²/sr; ramp_slope: per rad of theta_o",
            ),
            (
                "knot_0_deg, knot_1_deg",
                "where the ramp starts and ends; *_at_bound: at an end of the fitted views",
            ),
            (
                "energy_*, mean_*, variance_*",
                "mean absolute and root mean square errors: rad²/sr, rad, rad²",
            ),
            (
                "mean_slope",
                "of the mean over theta_o: −1 mirror, 0 Lambertian",
            ),
            ("average_variance", "(sigma_theta² + sigma_phi²)/2, rad²"),
            ("skewness_30, kurtosis_40", "averages"),
            (
                "horizon_*",
                "share of a profile's course that a cut by the horizon explains; empty without course",
            ),
        ],
    ),
    (
        "correlations.csv: over the materials of a group",
        &[
            (
                "between",
                "orders: of the first channel; channels: of one quantity",
            ),
            ("pearson, spearman", "of the averages of both quantities"),
            ("materials", "that have both"),
        ],
    ),
    (
        "relations.csv",
        &[
            (
                "slice_*, slope",
                "moments of the slice at theta_o, and how its mean moves with the view",
            ),
            (
                "rendered_*",
                "windowed moments of reflected radiance: radiance × rad, rad, rad²",
            ),
            (
                "printed_*, corrected_*, windowed_*",
                "the same as each form predicts it",
            ),
            (
                "*_error",
                "relative to the rendered value; of means in rendered standard deviations",
            ),
            ("cut_share", "share of the window beyond the horizon"),
        ],
    ),
];

impl List {
    pub(super) fn run(self) -> Result<(), Error> {
        if let Some(name) = &self.name {
            return print(self.preset(name)?);
        }
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

    /// The file of an instrument.
    fn preset(&self, name: &str) -> Result<&'static str, Error> {
        if self.family != Some(Family::Instruments) {
            let message = "only instruments are printed one by one; allowed: instruments NAME";
            return Err(Error::config(excerpt(name), message));
        }
        let presets = instrument::presets();
        let found = presets.iter().find(|preset| preset.name == name);
        found.map(|preset| preset.text).ok_or_else(|| {
            let allowed = one_of(name, presets.iter().map(|preset| preset.name));
            let message = format!("this is no instrument; allowed: {allowed}");
            Error::config(excerpt(name), message)
        })
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
        Family::Instruments => instruments(),
        Family::Formats => {
            let lines = formats::all().into_iter().map(|format| {
                let endings = format.extensions.iter().map(|e| format!(".{e}"));
                let endings: Vec<_> = endings.collect();
                let (endings, holds) = (endings.join(", "), format.holds().join(", "));
                let line = line(format.name, format.summary);
                format!("{line}\n{:20}{endings}: {holds}", "")
            });
            titled("formats: of files, by extension or --format", lines)
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
            let axes = |entry: &Entry<_>| {
                let of = |symmetry| {
                    let axes = entry.axes(symmetry);
                    let symbols: Vec<_> = axes.iter().map(|a| a.symbol).collect();
                    symbols.join(", ")
                };
                let (isotropic, general) = (of(Symmetry::FULL), of(Symmetry::NONE));
                Some(format!("isotropic: {isotropic}; anisotropic: {general}"))
            };
            let title = "parametrizations: [[parametrization]] with kind = …";
            members(title, &parametrization::all(), axes, |p| p.resolved())
        }
        Family::Warps => {
            let title = "warps: warp = { AXIS = NAME } in a [[parametrization]], { AXIS = { kind = NAME, … } } with keys";
            entries(title, &parametrization::warps(), |warp| warp.resolved())
        }
        Family::Measures => {
            let lines = Measure::ALL.iter().map(|m| line(m.name(), summary(*m)));
            titled("measures: measures = [ … ]", lines)
        }
        Family::Columns => {
            let lines = Row::columns().map(|(name, meaning)| format!("  {name:<22} {meaning}"));
            let others = MORE_COLUMNS.iter().map(|(file, columns)| {
                let lines = columns
                    .iter()
                    .map(|(name, meaning)| format!("  {name:<32} {meaning}"));
                format!("\n{}", titled(&format!("columns: of {file}"), lines))
            });
            titled("columns: of results.csv and results.jsonl", lines) + &others.collect::<String>()
        }
    }
}

/// The presets in their most telling numbers, and the classes a file can name.
fn instruments() -> String {
    let presets = instrument::presets().into_iter().filter_map(|preset| {
        // The tests read every preset, so that each of them reads.
        let spec = instrument::read(preset.text).ok()?;
        let mut text = line(preset.name, &spec.about);
        let facts = [spec.class.clone(), apertures(&spec), limits(&spec)];
        let axes = spec.axis.iter().map(|axis| {
            let round = if axis.wraps { ", wraps" } else { "" };
            format!(
                "{:<16} {:>4}° to {}°, {} °/s{round}",
                axis.name, axis.min_deg, axis.max_deg, axis.speed_deg_per_s
            )
        });
        for fact in facts.into_iter().chain(axes) {
            text += &format!("\n{:20}{fact}", "");
        }
        Some(text)
    });
    let classes = instrument::classes();
    let required = classes.iter().map(|class| {
        let axes = class.axes();
        let mut text = format!("  {}\n{:20}{}", class.name(), "", class.summary());
        for axis in axes {
            let parent = axis.parent.map_or("base", |parent| axes[parent].role);
            let [x, y, z] = axis.vector;
            text += &format!(
                "\n{:20}{:<16} on {parent}, about [{x}, {y}, {z}]",
                "", axis.role
            );
        }
        text
    });
    let keys = Use::KEYS.map(|(key, meaning)| line(key, meaning));
    let orders = Order::ALL.map(|order| line(order.name(), order.summary()));
    let title = "instruments: [[instrument]] of a config";
    let names = "instruments: presets; gonio check NAME says more, gonio list instruments NAME prints its file";
    let classes =
        "instruments: kinematic classes: class = … of an instrument file, with these [[axis]]";
    [
        titled(title, keys.into_iter()),
        titled("instruments: order = …", orders.into_iter()),
        titled(names, presets),
        titled(classes, required),
    ]
    .join("\n")
}

/// The apertures of an instrument.
pub(super) fn apertures(spec: &InstrumentSpec) -> String {
    format!(
        "half angles: light {}°, sensor {}°",
        spec.source.half_angle_deg, spec.detector.half_angle_deg
    )
}

/// Text with the limits of an instrument beside the ranges of its axes.
pub(super) fn limits(spec: &InstrumentSpec) -> String {
    let limits = &spec.limits;
    let mut text = format!(
        "limits: theta_i {}°, theta_o {}°, separation at least {}°",
        limits.theta_i_max_deg, limits.theta_o_max_deg, limits.separation_min_deg
    );
    for pair in &limits.collision {
        let [a, b] = &pair.between;
        text += &format!(", {a} and {b} at least {}°", pair.angle_min_deg);
    }
    text
}

/// The members of a registry, each with the keys of its examples.
fn entries<T: ?Sized>(
    title: &str,
    all: &[Entry<T>],
    resolved: impl Fn(Box<T>) -> toml::Table,
) -> String {
    members(title, all, |_| None, resolved)
}

/// The same with a fact of each.
fn members<T: ?Sized>(
    title: &str,
    all: &[Entry<T>],
    fact: impl Fn(&Entry<T>) -> Option<String>,
    resolved: impl Fn(Box<T>) -> toml::Table,
) -> String {
    let lines = all.iter().map(|entry| {
        let mut text = line(entry.kind, entry.summary);
        if let Some(fact) = fact(entry) {
            text += &format!("\n{:20}{fact}", "");
        }
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
