//! `gonio list`: what a config can name, straight from the registries.

use super::{JsonArgs, listed, print, print_json};
use crate::acquisition;
use crate::brdf::{BrdfSpec, Channels};
use crate::error::{Error, excerpt, one_of};
use crate::experiment::{self, Kind, Row, Use};
use crate::formats;
use crate::geometry::Symmetry;
use crate::instrument::{self, InstrumentSpec, Order};
use crate::light_paths;
use crate::lighting;
use crate::metrics::Measure;
use crate::moments;
use crate::parametrization;
use crate::reconstruct;
use crate::registry::{self, Entry};
use crate::report;
use crate::schedule;
use clap::{Args, ValueEnum};
use serde::Serialize;

#[derive(Debug, Args)]
pub(super) struct List {
    /// One family; all if left out
    family: Option<Family>,
    /// One instrument: its whole file, to be edited and named in `[[instrument]] file = …`
    name: Option<String>,
    #[command(flatten)]
    json: JsonArgs,
}

/// Members of a family, under a title.
#[derive(Serialize)]
struct Section {
    family: String,
    title: String,
    members: Vec<Member>,
    /// Characters of a name, and between it and what it means.
    #[serde(skip)]
    width: [usize; 2],
}

/// A member of a family.
#[derive(Default, Serialize)]
struct Member {
    name: String,
    summary: String,
    /// Whatever else is to be known of it, a line each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    facts: Vec<String>,
    /// Keys with their values, of each example.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    keys: Vec<toml::Table>,
}

impl List {
    pub(super) fn run(self) -> Result<(), Error> {
        if let Some(name) = &self.name {
            return print(self.preset(name)?);
        }
        let families = Family::value_variants().iter();
        let chosen = families.filter(|&&f| self.family.is_none_or(|only| only == f));
        let sections: Vec<Section> = chosen.flat_map(|&f| sections(f)).collect();
        if self.json.wanted() {
            return print_json(&sections);
        }
        let texts: Vec<_> = sections.iter().map(Section::text).collect();
        print(&texts.join("\n"))
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

impl Section {
    /// Of the family that names it, unless it has a name of its own.
    fn new(family: &str, title: &str, members: impl IntoIterator<Item = Member>) -> Self {
        Self {
            family: family.into(),
            title: title.into(),
            members: members.into_iter().collect(),
            width: [16, 2],
        }
    }

    fn text(&self) -> String {
        let [width, gap] = self.width;
        let mut out = format!("{}\n", self.title);
        for member in &self.members {
            let Member { name, summary, .. } = member;
            let line = format!("  {name:<width$}{:gap$}{summary}", "");
            out += &format!("{}\n", line.trim_end());
            let keys = member.keys.iter();
            let keys = keys.map(|keys| listed(keys.iter().map(|(k, v)| format!("{k} = {v}"))));
            for line in member.facts.iter().cloned().chain(keys) {
                out += &format!("{:20}{line}\n", "");
            }
        }
        out
    }
}

impl Member {
    fn new(name: &str, summary: &str) -> Self {
        Self {
            name: name.into(),
            summary: summary.into(),
            ..Self::default()
        }
    }

    fn with_facts(mut self, facts: impl IntoIterator<Item = String>) -> Self {
        self.facts = facts.into_iter().collect();
        self
    }
}

/// Kinds of material that need no key.
pub(super) fn kinds_alone() -> Vec<String> {
    let all = experiment::materials();
    let is_alone = |entry: &&Entry<dyn BrdfSpec>| {
        registry::read_text(entry, "").is_ok_and(|spec| spec.check(&Channels::Luminance).is_ok())
    };
    let alone = all.iter().filter(is_alone);
    alone.map(|entry| entry.kind.into()).collect()
}

/// Names of the members of a family: of instruments, those of presets.
pub(super) fn names(family: Family) -> Vec<String> {
    if family == Family::Instruments {
        let presets = instrument::presets();
        return presets.iter().map(|preset| preset.name.into()).collect();
    }
    let sections = sections(family).into_iter();
    let members = sections.flat_map(|section| section.members);
    members.map(|member| member.name).collect()
}

/// The families, each with its sections.
macro_rules! families {
    ($($(#[$of:meta])* $name:ident => $sections:expr;)*) => {
        #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
        pub(super) enum Family {
            $($(#[$of])* $name,)*
        }

        fn sections(family: Family) -> Vec<Section> {
            let mut sections = match family {
                $(Family::$name => $sections,)*
            };
            let name = family.to_possible_value();
            let name = name.map_or(String::new(), |name| name.get_name().into());
            for section in sections.iter_mut().filter(|s| s.family.is_empty()) {
                section.family.clone_from(&name);
            }
            sections
        }
    };
}

families! {
    Experiments => plain(
        "experiments: experiment = …", Kind::ALL.map(|k| Member::new(k.name(), k.summary())));
    Materials => plain(
        "materials: [[material]] with kind = …", entries(&experiment::materials(), |m| m.resolved()));
    Parametrizations => plain(
        "parametrizations: [[parametrization]] with kind = …", parametrizations());
    Warps => plain(
        "warps: warp = { AXIS = NAME } in a [[parametrization]], { AXIS = { kind = NAME, … } } with keys",
        entries(&parametrization::warps(), |warp| warp.resolved()));
    SampleSets => plain(
        "sample sets: [[sample_set]] with kind = …", entries(&schedule::all(), |set| set.resolved()));
    /// Poses chosen by the information that their readings add
    Planners => plain(
        "planners: [[sample_set]] with kind = …, and gonio next",
        entries(&acquisition::all(), |planner| planner.resolved()));
    Reconstructions => plain(
        "reconstructions: [[reconstruction]] with kind = …",
        entries(&reconstruct::all(), |method| method.resolved()));
    Measures => plain(
        "measures: measures = [ … ]", Measure::ALL.map(|m| Member::new(m.name(), summary(m))));
    Estimators => plain(
        "estimators of moments: estimator = { kind = … } in [moments]",
        entries(&moments::all(), |estimator| estimator.resolved()));
    Lightings => plain(
        "lightings: [[lighting]] with kind = … of relations, [lighting] of moments",
        entries(&lighting::all(), |light| light.resolved()));
    /// Height fields, of gonio surface
    Surfaces => plain(
        "surfaces: gonio surface KIND, --set KEY=VALUE to change one of its defaults", surfaces());
    /// Facets of surfaces and of smith-multiple
    Facets => plain(
        "facets: facets = { kind = … } of smith-multiple and of surfaces",
        entries(&light_paths::facets(), |facets| facets.resolved()));
    Instruments => instruments();
    Formats => plain(
        "formats: of files, by extension or --format", formats::all().into_iter().map(format));
    Columns => columns();
}

/// The only section of a family.
fn plain(title: &str, members: impl IntoIterator<Item = Member>) -> Vec<Section> {
    vec![Section::new("", title, members)]
}

/// Surfaces with their default size and resolution: the examples of tests are small.
fn surfaces() -> Vec<Member> {
    let mut all = light_paths::surface::all();
    for entry in &mut all {
        if registry::read_text(entry, "").is_ok() {
            entry.examples = &[""];
        }
    }
    entries(&all, |surface| surface.resolved())
}

/// Parametrizations with their axes.
fn parametrizations() -> Vec<Member> {
    let all = parametrization::all();
    let mut members = entries(&all, |p| p.resolved());
    for (member, entry) in members.iter_mut().zip(&all) {
        let [isotropic, general] = [Symmetry::FULL, Symmetry::NONE]
            .map(|symmetry| listed(entry.axes(symmetry).iter().map(|axis| axis.symbol)));
        let axes = format!("isotropic: {isotropic}; anisotropic: {general}");
        member.facts.push(axes);
    }
    members
}

/// A format with its extensions and what its files hold.
fn format(format: formats::Format) -> Member {
    let endings = listed(format.extensions.iter().map(|e| format!(".{e}")));
    let fact = format!("{endings}: {}", format.holds().join(", "));
    Member::new(format.name, format.summary).with_facts([fact])
}

/// The columns of every table.
fn columns() -> Vec<Section> {
    let table = |file: &str, width, columns: &mut dyn Iterator<Item = (&str, &str)>| {
        let members = columns.map(|(name, meaning)| Member::new(name, meaning));
        let section = Section::new("", &format!("columns: of {file}"), members);
        let width = [width, 1];
        Section { width, ..section }
    };
    let times = "timings.jsonl, by the key of the row; its last line is the run";
    let mut sections = vec![
        table("results.csv and results.jsonl", 22, &mut Row::columns()),
        table(times, 22, &mut Row::times()),
    ];
    for more in report::TABLE_COLUMNS.split("\n\n") {
        let (file, columns) = more.split_once('\n').unwrap_or((more, ""));
        let mut columns = columns.lines().filter_map(|line| line.split_once(" | "));
        sections.push(table(file, 32, &mut columns));
    }
    sections
}

/// The presets in a few numbers, and the classes a file can name.
fn instruments() -> Vec<Section> {
    let presets = instrument::presets().into_iter().filter_map(|preset| {
        // The tests read every preset, so that each of them reads.
        let spec = instrument::read(preset.text).ok()?;
        let facts = [spec.class.clone(), apertures(&spec), limits(&spec)];
        let axes = spec.axis.iter().map(|axis| {
            let round = if axis.wraps { ", wraps" } else { "" };
            let (name, low, high) = (&axis.name, axis.min_deg, axis.max_deg);
            let speed = axis.speed_deg_per_s;
            format!("{name:<16} {low:>4}° to {high}°, {speed} °/s{round}")
        });
        Some(Member::new(preset.name, &spec.about).with_facts(facts.into_iter().chain(axes)))
    });
    let classes = instrument::classes();
    let required = classes.iter().map(|class| {
        let axes = class.axes;
        let facts = axes.iter().map(|axis| {
            let parent = axis.parent.map_or("base", |parent| axes[parent].role);
            let [x, y, z] = axis.vector;
            format!("{:<16} on {parent}, about [{x}, {y}, {z}]", axis.role)
        });
        let summary = class.summary.to_owned();
        Member::new(class.name, "").with_facts(std::iter::once(summary).chain(facts))
    });
    let keys = Use::KEYS.map(|(key, meaning)| Member::new(key, meaning));
    let orders = Order::ALL.map(|order| Member::new(order.name(), order.summary()));
    let title = "instruments: [[instrument]] of a config";
    let names = "instruments: presets; gonio check NAME says more, gonio list instruments NAME prints its file";
    let classes =
        "instruments: kinematic classes: class = … of an instrument file, with these [[axis]]";
    vec![
        Section::new("", title, keys),
        Section::new("orders", "instruments: order = …", orders),
        Section::new("presets", names, presets),
        Section::new("classes", classes, required),
    ]
}

pub(super) fn apertures(spec: &InstrumentSpec) -> String {
    let (light, sensor) = (spec.source.half_angle_deg, spec.detector.half_angle_deg);
    format!("half angles: light {light}°, sensor {sensor}°")
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
fn entries<T: ?Sized>(all: &[Entry<T>], resolved: impl Fn(Box<T>) -> toml::Table) -> Vec<Member> {
    let member = |entry: &Entry<T>| {
        // The laws read every example, so that each of them reads.
        let read = |example: &&str| registry::read_text(entry, example).ok();
        let examples = entry.examples.iter().filter_map(read);
        let keys = examples.map(|member| {
            let mut keys = resolved(member);
            keys.remove("kind");
            keys
        });
        Member {
            keys: keys.filter(|keys| !keys.is_empty()).collect(),
            ..Member::new(entry.kind, entry.summary)
        }
    };
    all.iter().map(member).collect()
}

fn summary(measure: Measure) -> &'static str {
    match measure {
        Measure::Cosine => "both directions cosine-distributed",
        Measure::Lobe => {
            "half of that, half about the mirror direction: half vectors from GGX, alpha 0.3, 0.1, 0.03, 0.01"
        }
        Measure::Steep => "the part of cosine with both polar angles up to 65°",
        Measure::Grazing => "the part of cosine with a polar angle above 65°",
    }
}
