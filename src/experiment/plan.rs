//! What a config means: its choices put together, checked against each other and named.
//!
//! Everything that can be refused without measuring is refused here, so that a mistake costs a
//! second and not an hour. No table is loaded; headers and lengths of files are read.

use super::config::{Config, Named, Output};
use super::materials;
use super::resolved;
use super::source::{KeyPath, Source};
use crate::brdf::{BrdfSpec, Channels};
use crate::error::{Error, ParameterError};
use crate::geometry::Symmetry;
use crate::metrics::{self, Measure, MetricsSpec};
use crate::parametrization::find as find_parametrization;
use crate::parametrization::{Parametrization, ParametrizationEntry, WarpError, WarpName};
use crate::reconstruct::Reconstruct;
use crate::schedule::SampleSet;
use std::collections::{BTreeMap, HashSet};
use std::fmt::Display;
use std::sync::Arc;

/// The largest budget: a gigabyte of poses. More is a misprint.
pub const MAX_BUDGET: usize = 10_000_000;

/// Configurations of the smallest schedule that is tried out; every larger budget works if this
/// one does.
const PROBE_BUDGET: usize = 64;

/// A material to be measured.
#[derive(Debug)]
pub struct Material {
    /// Its name in results, unique in its plan.
    pub name: String,
    /// How to build it.
    pub spec: Box<dyn BrdfSpec>,
    /// The symmetries its schedules fold.
    pub symmetry: Symmetry,
}

/// A parametrization with its warps.
pub struct Coordinates {
    entry: ParametrizationEntry,
    /// Warps by axis symbol.
    pub warps: BTreeMap<String, WarpName>,
    /// The warps as results name them, `none` if there are none.
    pub warp: String,
}

impl Coordinates {
    /// Name of the parametrization.
    pub fn name(&self) -> &'static str {
        self.entry.name
    }

    /// Name with warps, for lists: `half-difference theta_h:square-root`.
    pub fn label(&self) -> String {
        if self.warps.is_empty() {
            self.name().into()
        } else {
            format!("{} {}", self.name(), self.warp)
        }
    }

    /// The form for a material of these symmetries.
    ///
    /// # Errors
    /// If a warp does not fit an axis; not for the symmetries of the plan's materials.
    pub fn form(&self, symmetry: Symmetry) -> Result<Arc<dyn Parametrization>, WarpError> {
        self.entry.warped(symmetry, &self.warps)
    }
}

/// A sample set with its name in results, unique in its plan.
#[derive(Debug)]
pub struct PlannedSet {
    /// The name.
    pub name: String,
    /// The set.
    pub set: Box<dyn SampleSet>,
}

/// A reconstruction with its name in results, unique in its plan.
#[derive(Debug)]
pub struct Method {
    /// The name.
    pub name: String,
    /// The method.
    pub method: Box<dyn Reconstruct>,
}

/// An experiment that can be run.
pub struct Plan {
    /// What it asks.
    pub question: Option<String>,
    /// What is measured.
    pub channels: Channels,
    /// Seeds of the sample sets.
    pub seeds: Vec<u64>,
    /// Numbers of distinct configurations a schedule may have.
    pub budgets: Vec<usize>,
    /// Distributions of the test pairs.
    pub measures: Vec<Measure>,
    /// Which test pairs.
    pub metrics: MetricsSpec,
    /// The materials.
    pub materials: Vec<Material>,
    /// The parametrizations.
    pub parametrizations: Vec<Coordinates>,
    /// The sample sets.
    pub sample_sets: Vec<PlannedSet>,
    /// The reconstructions.
    pub reconstructions: Vec<Method>,
    /// What is written beside the results.
    pub output: Output,
    /// The config with every default filled in; reading it gives this plan again.
    pub resolved: toml::Table,
}

impl Plan {
    /// Puts a config together and checks it.
    ///
    /// # Errors
    /// [`Error::Config`] for values that are not allowed or do not fit each other, [`Error::Data`]
    /// for files that cannot be used.
    pub fn new(config: Config<'_>) -> Result<Self, Error> {
        let source = config.source;
        let (seeds, budgets) = numbers(&config)?;
        distinct(source, "measures", &config.scalars.measures, |m| m.name())?;
        check_metrics(&config)?;
        check_output(&config)?;
        let resolver = resolved::Resolver::new(&config);
        let Config {
            scalars,
            merl,
            materials,
            parametrizations,
            sample_sets,
            reconstructions,
            metrics,
            output,
            ..
        } = config;
        let dir = scalars.materials_dir.as_deref();
        let materials = materials::gather(source, materials, dir, merl)?;
        let sample_sets = name_all(source, "sample_set", sample_sets, |s| s.label())?;
        let reconstructions = name_all(source, "reconstruction", reconstructions, |r| r.label())?;
        let mut plan = Self {
            question: scalars.question,
            channels: scalars.channels,
            seeds,
            budgets,
            measures: scalars.measures,
            metrics,
            materials,
            parametrizations: Vec::new(),
            sample_sets: sample_sets
                .into_iter()
                .map(|(name, set)| PlannedSet { name, set })
                .collect(),
            reconstructions: reconstructions
                .into_iter()
                .map(|(name, method)| Method { name, method })
                .collect(),
            output,
            resolved: toml::Table::new(),
        };
        let tables = parametrizations.into_iter().map(|t| (t.name, t.warp));
        plan.parametrizations = plan.coordinates(source, tables.collect())?;
        plan.check_sample_sets(source)?;
        plan.check_reconstructions(source)?;
        plan.resolved = resolver.finish(&plan);
        Ok(plan)
    }

    /// The symmetries that schedules fold, each once, in the order of the materials.
    pub fn symmetries(&self) -> Vec<Symmetry> {
        let mut seen = HashSet::new();
        let all = self.materials.iter().map(|m| m.symmetry);
        all.filter(|&s| seen.insert(s)).collect()
    }

    /// Reconstructions that a run makes.
    pub fn jobs(&self) -> usize {
        self.materials.len() * self.jobs_per_material()
    }

    /// Reconstructions that a run makes of each material.
    pub fn jobs_per_material(&self) -> usize {
        self.parametrizations.len()
            * self.sample_sets.len()
            * self.budgets.len()
            * self.seeds.len()
            * self.reconstructions.len()
    }

    /// Rows of results of a complete run.
    pub fn rows(&self) -> usize {
        self.jobs() * self.measures.len()
    }

    fn coordinates(
        &self,
        source: &Source,
        tables: Vec<(&'static str, BTreeMap<String, WarpName>)>,
    ) -> Result<Vec<Coordinates>, Error> {
        refuse_empty(source, "parametrization", &tables)?;
        let mut list: Vec<Coordinates> = Vec::new();
        for (i, (name, warps)) in tables.into_iter().enumerate() {
            let path = KeyPath::of("parametrization").index(i);
            let Some(entry) = find_parametrization(name) else {
                return Err(Error::Internal(format!("{name} was found before")));
            };
            let mut coordinates = Coordinates {
                entry,
                warps,
                warp: String::new(),
            };
            for symmetry in self.symmetries() {
                let form = coordinates.form(symmetry).map_err(|e| {
                    let path = path.key("warp").key(&e.axis);
                    let warp = coordinates.warps.get(&e.axis).map_or("", |w| w.name());
                    let message = format!("{path} = \"{warp}\": {}", e.problem);
                    source.error_at(&path, message)
                })?;
                coordinates.warp = form.warp_name();
            }
            if list.iter().any(|c| c.label() == coordinates.label()) {
                return Err(source.error_at(
                    &path,
                    format!(
                        "{path} = \"{}\" is there twice; allowed: each parametrization with the \
                         same warps once",
                        coordinates.label()
                    ),
                ));
            }
            list.push(coordinates);
        }
        Ok(list)
    }

    /// Keys against the axes of every parametrization, and the smallest budget against both.
    fn check_sample_sets(&self, source: &Source) -> Result<(), Error> {
        let budgets = self.budgets.iter().copied().enumerate();
        let (smallest, budget) = budgets.min_by_key(|b| b.1).unwrap_or((0, PROBE_BUDGET));
        let probe = budget.min(PROBE_BUDGET);
        for (i, planned) in self.sample_sets.iter().enumerate() {
            let path = KeyPath::of("sample_set").index(i);
            for coordinates in &self.parametrizations {
                for symmetry in self.symmetries() {
                    let form = coordinates.form(symmetry).map_err(internal)?;
                    planned.set.check(form.axes()).map_err(|e| {
                        let with = format!(" in {} coordinates", coordinates.label());
                        source.error_at(&below(&path, &e.key), format!("{e}{with}"))
                    })?;
                    planned
                        .set
                        .plan(&form, probe, self.seeds[0])
                        .map_err(|e| source.error_at(&KeyPath::of("budgets").index(smallest), e))?;
                }
            }
        }
        Ok(())
    }

    fn check_reconstructions(&self, source: &Source) -> Result<(), Error> {
        for (i, planned) in self.reconstructions.iter().enumerate() {
            let path = KeyPath::of("reconstruction").index(i);
            planned
                .method
                .check()
                .map_err(|e| source.error_at(&below(&path, &e.key), e))?;
            let scattered = self.sample_sets.iter().find(|s| !s.set.is_grid());
            if let (true, Some(scattered)) = (planned.method.needs_grid(), scattered) {
                return Err(source.error_at(
                    &path,
                    format!(
                        "{path} \"{}\" needs readings on a grid, and sample_set \"{}\" is none; \
                         allowed: a grid, or a reconstruction from scattered readings",
                        planned.name, scattered.name
                    ),
                ));
            }
        }
        Ok(())
    }
}

/// The path of a parameter, whose key may be dotted, in the table at `base`.
pub(super) fn below(base: &KeyPath, key: &str) -> KeyPath {
    key.split('.')
        .fold(base.clone(), |path, part| path.key(part))
}

fn internal(e: impl Display) -> Error {
    Error::Internal(e.to_string())
}

/// Seeds and budgets: in range, each once, at least one.
fn numbers(config: &Config<'_>) -> Result<(Vec<u64>, Vec<usize>), Error> {
    let source = config.source;
    let convert = |key: &str, i: usize, value: i64, max: i64, min: i64| {
        if (min..=max).contains(&value) {
            return Ok(value);
        }
        let path = KeyPath::of(key).index(i);
        let allowed = format!("a whole number from {min} to {max}");
        Err(source.error_at(&path, ParameterError::new(path.to_string(), value, allowed)))
    };
    let mut seeds = Vec::new();
    for (i, &seed) in config.scalars.seeds.iter().enumerate() {
        seeds.push(convert("seeds", i, seed, i64::MAX, 0)?.unsigned_abs());
    }
    let mut budgets = Vec::new();
    for (i, &budget) in config.scalars.budgets.iter().enumerate() {
        // In range of usize by its limit.
        budgets.push(convert("budgets", i, budget, MAX_BUDGET as i64, 1)? as usize);
    }
    distinct(source, "seeds", &seeds, u64::to_string)?;
    distinct(source, "budgets", &budgets, usize::to_string)?;
    Ok((seeds, budgets))
}

/// Refuses an empty list and one that names something twice.
fn distinct<T, S: Display + Eq + std::hash::Hash>(
    source: &Source,
    key: &str,
    list: &[T],
    show: impl Fn(&T) -> S,
) -> Result<(), Error> {
    refuse_empty(source, key, list)?;
    let mut seen = HashSet::new();
    for (i, item) in list.iter().enumerate() {
        if !seen.insert(show(item)) {
            let path = KeyPath::of(key).index(i);
            let message = format!("{path} = {} is there twice; allowed: once", show(item));
            return Err(source.error_at(&path, message));
        }
    }
    Ok(())
}

/// Refuses an empty list.
pub(super) fn refuse_empty<T>(source: &Source, key: &str, list: &[T]) -> Result<(), Error> {
    if list.is_empty() {
        let message = format!("{key} = []: allowed is at least one");
        return Err(source.error_at(&KeyPath::of(key), message));
    }
    Ok(())
}

fn check_metrics(config: &Config<'_>) -> Result<(), Error> {
    let base = KeyPath::of("metrics");
    let refuse = |e: ParameterError| {
        // Keys that only fail together are listed with commas; the first one is a place.
        let first = e.key.split(',').next().unwrap_or(&e.key).to_owned();
        config
            .source
            .error_at(&below(&base, &first), format!("metrics.{e}"))
    };
    config.metrics.check().map_err(refuse)?;
    // A window that keeps next to nothing shows in the first few pairs.
    let few = MetricsSpec {
        pairs: config.metrics.pairs.min(16),
        ..config.metrics.clone()
    };
    for &measure in &config.scalars.measures {
        metrics::test_pairs(measure, &few).map_err(refuse)?;
    }
    Ok(())
}

fn check_output(config: &Config<'_>) -> Result<(), Error> {
    if config.output.slices && cfg!(not(feature = "exr")) {
        let path = KeyPath::of("output").key("slices");
        let allowed = "false in this build, which has no OpenEXR; true in one with the feature exr";
        let e = ParameterError::new(path.to_string(), true, allowed);
        return Err(config.source.error_at(&path, e));
    }
    Ok(())
}

/// Gives every choice its name, written or made from its keys.
fn name_all<T: ?Sized>(
    source: &Source,
    key: &str,
    list: Vec<Named<T>>,
    label: impl Fn(&T) -> String,
) -> Result<Vec<(String, Box<T>)>, Error> {
    refuse_empty(source, key, &list)?;
    let mut names = Names::default();
    let mut out = Vec::with_capacity(list.len());
    for (i, Named { name, choice }) in list.into_iter().enumerate() {
        let name = name.unwrap_or_else(|| label(&choice));
        names.take(source, &KeyPath::of(key).index(i), &name)?;
        out.push((name, choice));
    }
    Ok(out)
}

/// Names that are taken.
#[derive(Default)]
pub(super) struct Names(HashSet<String>);

impl Names {
    /// Takes a name for the table at `path`.
    pub(super) fn take(
        &mut self,
        source: &Source,
        path: &KeyPath,
        name: &str,
    ) -> Result<(), Error> {
        let place = path.key("name");
        if name.trim().is_empty() || name.chars().any(char::is_control) {
            let allowed = "a text that is not blank and has no control characters";
            let e = ParameterError::new(place.to_string(), format!("{name:?}"), allowed);
            return Err(source.error_at(&place, e));
        }
        if !self.0.insert(name.to_owned()) {
            let message = format!(
                "{place} = {name:?} is taken; allowed: names that differ, e.g. name = \"{name}-2\""
            );
            return Err(source.error_at(&place, message));
        }
        Ok(())
    }
}
