//! What a config means: its choices put together, checked against each other and named.
//!
//! Everything that can be refused without measuring is refused here, so that a mistake costs a
//! second and not an hour. No table is loaded; headers and lengths of files are read.

use super::checks::{
    Numbers, below, check_metrics, check_output, check_quantities, distinct, name_all, refuse_empty,
};
use super::config::{Config, Output};
use super::instruments::{self, PlannedInstrument};
use super::kind::Kind;
use super::materials::{self, Origins};
use super::moments::MomentsTable;
use super::resolved;
use super::source::{KeyPath, Source};
use crate::brdf::{BrdfSpec, Channels};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::metrics::{Measure, MetricsSpec};
use crate::parametrization::find as find_parametrization;
use crate::parametrization::{Parametrization, ParametrizationEntry, WarpError, WarpName};
use crate::reconstruct::Reconstruct;
use crate::schedule::SampleSet;
use std::collections::{BTreeMap, HashSet};
use std::fmt::{self, Display};
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

impl Material {
    /// Its kind, which it shares with the materials it is compared with.
    pub fn group(&self) -> String {
        let resolved = self.spec.resolved();
        let kind = resolved.get("kind").and_then(toml::Value::as_str);
        kind.unwrap_or_default().to_owned()
    }
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

/// How large a schedule may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allowance {
    /// So many distinct configurations, reachable or not.
    Poses(usize),
    /// As many configurations as have at most so many that its instrument can take.
    Readings(usize),
    /// As many configurations as its instrument visits in this time.
    Minutes(f64),
}

impl fmt::Display for Allowance {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Allowance::Poses(n) => write!(f, "{n} poses"),
            Allowance::Readings(n) => write!(f, "{n} readings"),
            Allowance::Minutes(m) => write!(f, "{m} minutes"),
        }
    }
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
    /// Numbers of poses of a schedule that its instrument can take.
    pub readings: Vec<usize>,
    /// Times a schedule may take on an instrument.
    pub minutes: Vec<f64>,
    /// Distributions of the test pairs.
    pub measures: Vec<Measure>,
    /// Which test pairs.
    pub metrics: MetricsSpec,
    /// How moments are compared, if they are.
    pub moments: Option<MomentsTable>,
    /// The materials.
    pub materials: Vec<Material>,
    /// Names that the config wants of a folder that does not have them.
    pub missing: Vec<String>,
    /// The parametrizations.
    pub parametrizations: Vec<Coordinates>,
    /// The sample sets.
    pub sample_sets: Vec<PlannedSet>,
    /// The reconstructions.
    pub reconstructions: Vec<Method>,
    /// The instruments; none: the ideal one.
    pub instruments: Vec<PlannedInstrument>,
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
        let Numbers {
            seeds,
            budgets,
            readings,
        } = Numbers::of(&config)?;
        distinct(source, "measures", &config.scalars.measures, |m| m.name())?;
        check_metrics(&config)?;
        check_output(&config)?;
        let wanted = check_quantities(&config)?;
        let resolver = resolved::Resolver::new(&config);
        let Config {
            scalars,
            merl,
            materials,
            parametrizations,
            sample_sets,
            reconstructions,
            instruments,
            metrics,
            moments,
            output,
            ..
        } = config;
        if let Some(only) = &scalars.only {
            distinct(source, "only", only, String::clone)?;
        }
        let origins = Origins {
            tables: materials,
            dir: scalars.materials_dir.as_deref(),
            only: scalars.only.as_deref(),
            merl,
        };
        let (materials, missing) = materials::gather(source, origins)?;
        let instruments = instruments::gather(source, instruments, &materials)?;
        let sample_sets = name_all(source, "sample_set", sample_sets, |s| s.label())?;
        let reconstructions = name_all(source, "reconstruction", reconstructions, |r| r.label())?;
        let mut plan = Self {
            question: scalars.question,
            channels: scalars.channels,
            seeds,
            budgets,
            readings,
            minutes: scalars.minutes,
            measures: scalars.measures,
            metrics,
            moments: wanted.then(|| moments.unwrap_or_default()),
            materials,
            missing,
            parametrizations: Vec::new(),
            sample_sets: sample_sets
                .into_iter()
                .map(|(name, set)| PlannedSet { name, set })
                .collect(),
            reconstructions: reconstructions
                .into_iter()
                .map(|(name, method)| Method { name, method })
                .collect(),
            instruments,
            output,
            resolved: toml::Table::new(),
        };
        let tables = parametrizations.into_iter().map(|t| (t.name, t.warp));
        plan.parametrizations = plan.coordinates(source, tables.collect())?;
        plan.check_sample_sets(source)?;
        plan.check_reconstructions(source, scalars.experiment)?;
        plan.resolved = resolver.finish(&plan);
        Ok(plan)
    }

    /// The symmetries that schedules fold, each once, in the order of the materials.
    pub fn symmetries(&self) -> Vec<Symmetry> {
        let mut seen = HashSet::new();
        let all = self.materials.iter().map(|m| m.symmetry);
        all.filter(|&s| seen.insert(s)).collect()
    }

    /// Budgets, then readings, then times.
    pub fn allowances(&self) -> Vec<Allowance> {
        let budgets = self.budgets.iter().copied().map(Allowance::Poses);
        let readings = self.readings.iter().copied().map(Allowance::Readings);
        let minutes = self.minutes.iter().copied().map(Allowance::Minutes);
        budgets.chain(readings).chain(minutes).collect()
    }

    /// Reconstructions that a run makes.
    pub fn jobs(&self) -> usize {
        self.materials.len() * self.jobs_per_material()
    }

    /// Reconstructions that a run makes of each material.
    pub fn jobs_per_material(&self) -> usize {
        self.parametrizations.len()
            * self.sample_sets.len()
            * self.instruments.len().max(1)
            * self.allowances().len()
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

    fn check_reconstructions(&self, source: &Source, kind: Kind) -> Result<(), Error> {
        for (i, planned) in self.reconstructions.iter().enumerate() {
            let path = KeyPath::of("reconstruction").index(i);
            planned
                .method
                .check()
                .map_err(|e| source.error_at(&below(&path, &e.key), e))?;
            let scattered = self.sample_sets.iter().find(|s| !s.set.is_grid());
            // A study uses every reconstruction where it can be used.
            let everywhere = kind != Kind::Study && planned.method.needs_grid();
            if let (true, Some(scattered)) = (everywhere, scattered) {
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

fn internal(e: impl Display) -> Error {
    Error::Internal(e.to_string())
}
