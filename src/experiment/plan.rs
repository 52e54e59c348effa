//! The plan of an acquisition: the choices of a config put together, checked and named.
//!
//! Everything that can be refused without measuring is refused here, so that a mistake costs a
//! second and not an hour. No table is loaded; headers and lengths of files are read.

use super::checks::{below, distinct, each_once, name_all, refuse_empty, refused};
use super::choices::{Allowance, Coordinates, Material, Method, OWN, PlannedSet};
use super::config::{Config, Output, Reach, Written};
use super::instruments::{self, PlannedInstrument};
use super::keypath::KeyPath;
use super::kind::{Kind, QuantityGroup};
use super::materials::{self, Origins};
use super::moments::MomentsTable;
use super::pictures::PictureSpec;
use super::priors;
use super::question::{Factor, ReportSpec};
use super::source::Source;
use super::tables::section;
use super::training::TuningTable;
use super::validate::{Numbers, check_metrics, check_output, check_quantities};
use crate::brdf::Channels;
use crate::error::{Error, excerpt, one_of};
use crate::geometry::Symmetry;
use crate::metrics::{Measure, MetricsSpec};
use crate::parametrization::{self, ParametrizationSpec};
use crate::reconstruct::{self, Reconstruct};
use std::sync::Arc;

/// Configurations of the smallest schedule that is tried out; every larger budget works if this
/// one does.
const PROBE_BUDGET: usize = 64;

/// An experiment that can be run.
pub struct Plan {
    /// Kind of the experiment: its defaults and the tables it prints.
    pub kind: Kind,
    /// The question it asks.
    pub question: Option<String>,
    /// Channels that are measured.
    pub channels: Channels,
    /// Seeds of the sample sets.
    pub seeds: Vec<u64>,
    /// Numbers of distinct configurations a schedule may have.
    pub budgets: Vec<usize>,
    /// Numbers of poses of a schedule that its instrument can take.
    pub readings: Vec<usize>,
    /// Times a schedule may take on an instrument, minutes.
    pub minutes: Vec<f64>,
    /// Distributions of the test pairs.
    pub measures: Vec<Measure>,
    /// Number, range and seed of the test pairs.
    pub metrics: MetricsSpec,
    /// True if directional albedos are compared.
    pub albedo: bool,
    /// True if it is counted how much is within the uncertainty of the readings.
    pub uncertainty: bool,
    /// True if reconstructions are asked which errors they expect of themselves.
    pub expected: bool,
    /// Moments that are compared, and their estimator; `None` if they are not compared.
    pub moments: Option<MomentsTable>,
    /// The materials.
    pub materials: Vec<Material>,
    /// Names of the config's `only` that its folder of materials does not have.
    pub missing: Vec<String>,
    /// The parametrizations.
    pub parametrizations: Vec<Coordinates>,
    /// The sample sets.
    pub sample_sets: Vec<PlannedSet>,
    /// The reconstructions, each in each of its coordinates.
    pub methods: Vec<Method>,
    /// The instruments; none: the ideal one.
    pub instruments: Vec<PlannedInstrument>,
    /// The largest ratio of errors that counts as no difference.
    pub band: f64,
    /// Factor, reference and challenger of the report.
    pub report: ReportSpec,
    /// Pictures that are drawn of each material.
    pub pictures: PictureSpec,
    /// Files that are written beside the results.
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
    pub(crate) fn new(config: Config<'_>) -> Result<Self, Error> {
        let source = config.source;
        let numbers = Numbers::of(&config)?;
        distinct(source, "measures", &config.scalars.measures, |m| m.name())?;
        check_metrics(&config)?;
        check_output(&config)?;
        let wanted = check_quantities(&config)?;
        let written = (section(&config.scalars), config.materials.len());
        let groups = config.scalars.quantities.clone().unwrap_or_default();
        let scalars = config.scalars;
        if let Some(only) = &scalars.only {
            distinct(source, "only", only, String::clone)?;
        }
        let origins = Origins {
            tables: config.materials,
            dir: scalars.materials_dir.as_deref(),
            only: scalars.only.as_deref(),
            merl: config.merl,
        };
        let (materials, missing) = materials::gather(source, origins, &scalars.channels)?;
        let instruments = instruments::gather(source, config.instruments, &materials)?;
        let sample_sets = name_all(source, "sample_set", config.sample_sets, |s| s.label())?;
        let reconstructions = name_all(source, "reconstruction", config.reconstructions, |r| {
            r.label()
        })?;
        let reconstructions: Vec<(String, Arc<dyn Reconstruct>)> = reconstructions
            .into_iter()
            .map(|(name, method)| (name, Arc::from(method)))
            .collect();
        let mut plan = Self {
            kind: scalars.experiment,
            question: scalars.question,
            channels: scalars.channels,
            seeds: numbers.seeds,
            budgets: numbers.budgets,
            readings: numbers.readings,
            minutes: scalars.minutes,
            measures: scalars.measures,
            metrics: config.metrics,
            albedo: groups.contains(&QuantityGroup::Albedo),
            uncertainty: groups.contains(&QuantityGroup::Uncertainty),
            expected: groups.contains(&QuantityGroup::Expected),
            moments: wanted.then(|| config.moments.unwrap_or_default()),
            materials,
            missing,
            parametrizations: Vec::new(),
            sample_sets: sample_sets
                .into_iter()
                .map(|(name, set)| PlannedSet {
                    name,
                    set,
                    tuning: None,
                })
                .collect(),
            methods: Vec::new(),
            instruments,
            band: config.band,
            report: config.report,
            pictures: config.pictures,
            output: config.output,
            resolved: toml::Table::new(),
        };
        plan.parametrizations = plan.coordinates(source, config.parametrizations)?;
        plan.check_sample_sets(source)?;
        let first = reconstructions.first().map(|(_, method)| method);
        plan.tune(source, config.tuning, first)?;
        plan.check_coordinates(source, &config.coordinates)?;
        let written = Written {
            scalars: written.0,
            materials: written.1,
            reconstructions: &reconstructions,
            reach: &config.reach,
            coordinates: &config.coordinates,
        };
        plan.resolved = plan.resolved(written);
        for (i, (name, method)) in reconstructions.iter().enumerate() {
            let reach = config.reach.get(i).cloned().unwrap_or_default();
            let methods = plan.methods(source, i, name, method, &reach, &config.coordinates)?;
            plan.methods.extend(methods);
        }
        plan.check_use(source)?;
        plan.check_report(source)?;
        let sets = plan.sample_sets.iter().enumerate().map(|(i, set)| {
            let place = KeyPath::of("sample_set").index(i);
            (place, set.set.prior())
        });
        let methods = reconstructions.iter().enumerate().map(|(i, (_, method))| {
            let place = KeyPath::of("reconstruction").index(i);
            (place, method.prior())
        });
        priors::check(source, &plan.materials, sets.chain(methods))?;
        Ok(plan)
    }

    /// Reads a config and puts it together.
    ///
    /// # Errors
    /// If the config is no TOML, has a key or value that is not allowed, or its keys contradict each other.
    pub fn read(source: &Source) -> Result<Self, Error> {
        Self::new(Config::read(source)?)
    }

    /// The symmetries that schedules fold, each once, in the order of the materials.
    pub fn symmetries(&self) -> Vec<Symmetry> {
        each_once(self.materials.iter().map(|m| m.symmetry))
    }

    /// All allowances: budgets, then readings, then times.
    pub(crate) fn allowances(&self) -> Vec<Allowance> {
        let budgets = self.budgets.iter().copied().map(Allowance::Poses);
        let readings = self.readings.iter().copied().map(Allowance::Readings);
        let minutes = self.minutes.iter().copied().map(Allowance::Minutes);
        budgets.chain(readings).chain(minutes).collect()
    }

    /// True if reconstructions are needed as BRDFs of their own, and not only at the test pairs.
    pub(super) fn needs_brdfs(&self) -> bool {
        self.moments.is_some() || self.output.slices
    }

    fn coordinates(
        &self,
        source: &Source,
        specs: Vec<ParametrizationSpec>,
    ) -> Result<Vec<Coordinates>, Error> {
        refuse_empty(source, "parametrization", &specs)?;
        let mut list: Vec<Coordinates> = Vec::new();
        for (i, spec) in specs.into_iter().enumerate() {
            let path = KeyPath::of("parametrization").index(i);
            let mut coordinates = Coordinates {
                spec,
                warp: String::new(),
            };
            for symmetry in self.symmetries() {
                let form = coordinates.form(symmetry).map_err(|e| {
                    let path = path.key("warp").key(&e.axis);
                    let warp = coordinates.spec.warps.get(&e.axis).map(|w| w.name());
                    let warp = warp.unwrap_or_default();
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

    /// Checks the keys of sample sets against the axes of every parametrization, and the smallest
    /// budget against both.
    fn check_sample_sets(&self, source: &Source) -> Result<(), Error> {
        let budgets = self.budgets.iter().copied().enumerate();
        let (smallest, budget) = budgets.min_by_key(|b| b.1).unwrap_or((0, PROBE_BUDGET));
        let probe = budget.min(PROBE_BUDGET);
        for (i, planned) in self.sample_sets.iter().enumerate() {
            let path = KeyPath::of("sample_set").index(i);
            for (key, list) in [("budgets", &self.budgets), ("readings", &self.readings)] {
                let most = planned.set.most();
                if let Some(n) = list.iter().position(|n| *n > most) {
                    let (at, name) = (KeyPath::of(key).index(n), &planned.name);
                    let message = format!(
                        "{at} = {}: {path} \"{name}\" chooses at most {most} poses; allowed: fewer",
                        list[n]
                    );
                    return Err(source.error_at(&at, message));
                }
            }
            for coordinates in &self.parametrizations {
                for symmetry in self.symmetries() {
                    let form = coordinates.checked_form(symmetry)?;
                    planned.set.check(form.axes()).map_err(|e| {
                        let with = format!(" in {} coordinates", coordinates.label());
                        source.error_at(&below(&path, &e.key), format!("{e}{with}"))
                    })?;
                    let own: Vec<f64> = form.axes().iter().map(|a| a.density).collect();
                    let probed = match planned.set.tuned(&own) {
                        Some(untuned) => untuned.plan(&form, probe, self.seeds[0]),
                        None => planned.set.plan(&form, probe, self.seeds[0]),
                    };
                    probed
                        .map_err(|e| source.error_at(&KeyPath::of("budgets").index(smallest), e))?;
                }
            }
        }
        Ok(())
    }

    /// Gives every set whose ratio is to be tuned what it is tuned on, with the first
    /// reconstruction.
    fn tune(
        &mut self,
        source: &Source,
        table: Option<TuningTable>,
        method: Option<&Arc<dyn Reconstruct>>,
    ) -> Result<(), Error> {
        let wanted = |s: &PlannedSet| s.set.tuned(&[]).is_some();
        let first = self.sample_sets.iter().position(wanted);
        let refuse =
            |path: KeyPath, problem: &str| Err(source.error_at(&path, format!("{path} {problem}")));
        let (set, table, method) = match (first, table, method) {
            (Some(set), Some(table), Some(method)) => (set, table, method),
            (Some(set), ..) => {
                let path = KeyPath::of("sample_set").index(set).key("ratio");
                return refuse(
                    path,
                    "= \"tuned\" lacks what it is tuned on; allowed: with [tuning] and its materials",
                );
            }
            (None, Some(_), _) => {
                let path = KeyPath::of("tuning");
                return refuse(
                    path,
                    "is never used; allowed: with a [[sample_set]] of ratio = \"tuned\"",
                );
            }
            (None, None, _) => return Ok(()),
        };
        for (key, used) in [
            ("readings", !self.readings.is_empty()),
            ("minutes", !self.minutes.is_empty()),
        ] {
            if used {
                let set = KeyPath::of("sample_set").index(set);
                let problem = format!("do not go with the tuned ratio of {set}; allowed: budgets");
                return refuse(KeyPath::of(key), &problem);
            }
        }
        let method = Arc::clone(method);
        let tuning = table.plan(source, &self.materials, &self.metrics, method)?;
        let tuning = Arc::new(tuning);
        for set in self.sample_sets.iter_mut().filter(|s| wanted(s)) {
            set.tuning = Some(Arc::clone(&tuning));
        }
        Ok(())
    }

    fn check_coordinates(
        &self,
        source: &Source,
        coordinates: &[reconstruct::Coordinates],
    ) -> Result<(), Error> {
        for (i, c) in coordinates.iter().enumerate().filter(|c| c.1.kind != OWN) {
            if parametrization::find(&c.kind).is_none() {
                let path = KeyPath::of("coordinates").index(i).key("kind");
                let all = parametrization::all();
                let kinds = all.iter().map(|e| e.kind).chain([OWN]);
                let allowed = one_of(&c.kind, kinds);
                return Err(refused(source, &path, &c.kind, allowed));
            }
            for symmetry in self.symmetries() {
                c.form(symmetry).map_err(|e| {
                    let path = KeyPath::of("coordinates").index(i);
                    let key = e.key.trim_start_matches("coordinates.").to_owned();
                    source.error_at(&below(&path, &key), e)
                })?;
            }
        }
        Ok(())
    }

    /// Methods of one reconstruction, one for each of its coordinates.
    fn methods(
        &self,
        source: &Source,
        i: usize,
        name: &str,
        method: &Arc<dyn Reconstruct>,
        reach: &Reach,
        coordinates: &[reconstruct::Coordinates],
    ) -> Result<Vec<Method>, Error> {
        let path = KeyPath::of("reconstruction").index(i);
        method
            .check()
            .map_err(|e| source.error_at(&below(&path, &e.key), e))?;
        let on = self.on(source, &path, reach)?;
        let labelled = |coordinates: String, method: Arc<dyn Reconstruct>| Method {
            name: name.to_owned(),
            coordinates,
            method,
            up_to: reach.up_to.map(|n| n.unsigned_abs() as usize),
            on,
        };
        match method.coordinates() {
            Some(own) => Ok(vec![labelled(own.label(), Arc::clone(method))]),
            None if method.needs_grid() || coordinates.is_empty() => {
                Ok(vec![labelled(OWN.into(), Arc::clone(method))])
            }
            None => {
                let each = coordinates.iter().map(|c| {
                    if c.kind == OWN {
                        return Ok(labelled(c.label(), Arc::clone(method)));
                    }
                    let method = method.within(c).ok_or_else(|| {
                        let message = format!(
                            "{path} \"{name}\" has no choice of coordinates; allowed: own, not {}",
                            c.label()
                        );
                        source.error_at(&path, message)
                    })?;
                    Ok(labelled(c.label(), method))
                });
                each.collect()
            }
        }
    }

    /// Position of the sample set that `on` names.
    fn on(&self, source: &Source, path: &KeyPath, reach: &Reach) -> Result<Option<usize>, Error> {
        let Some(name) = &reach.on else {
            return Ok(None);
        };
        let found = self.sample_sets.iter().position(|s| s.name == *name);
        if found.is_none() {
            let path = path.key("on");
            let message = format!(
                "{path} = \"{}\" is no sample set of this config; allowed: {}",
                excerpt(name),
                one_of(name, self.sample_sets.iter().map(|s| &s.name))
            );
            return Err(source.error_at(&path, message));
        }
        Ok(found)
    }

    /// Checks that every reconstruction has a schedule, and every schedule a reconstruction.
    fn check_use(&self, source: &Source) -> Result<(), Error> {
        let units = self.units();
        let names = each_once(self.methods.iter().map(|m| &m.name));
        for (i, name) in names.into_iter().enumerate() {
            let mine = |m: &usize| self.methods[*m].name == *name;
            if !units.iter().any(|u| self.methods_on(u).iter().any(mine)) {
                let path = KeyPath::of("reconstruction").index(i);
                let message = format!(
                    "{path} \"{name}\" is never used; allowed: an up_to that a budget stays \
                     within, and a grid for what needs one"
                );
                return Err(source.error_at(&path, message));
            }
        }
        for (i, set) in self.sample_sets.iter().enumerate() {
            let mut mine = units.iter().filter(|u| u.sample_set == i);
            if mine.all(|u| self.methods_on(u).is_empty()) {
                let path = KeyPath::of("sample_set").index(i);
                let message = format!(
                    "{path} \"{}\" has no reconstruction; allowed: one that works on it",
                    set.name
                );
                return Err(source.error_at(&path, message));
            }
        }
        Ok(())
    }
}

impl Plan {
    /// Checks that the names in `[report]` are names of the plan.
    fn check_report(&self, source: &Source) -> Result<(), Error> {
        let factor = self.report.factor;
        let levels: Vec<&str> = match factor {
            Factor::Parametrization => self.parametrizations.iter().map(|c| c.name()).collect(),
            Factor::Warp => self.parametrizations.iter().map(|c| &*c.warp).collect(),
            Factor::SampleSet => self.sample_sets.iter().map(|s| &*s.name).collect(),
            Factor::Instrument => self.instruments.iter().map(|i| &*i.name).collect(),
            Factor::Reconstruction => self.methods.iter().map(|m| &*m.name).collect(),
            Factor::Coordinates => self.methods.iter().map(|m| &*m.coordinates).collect(),
        };
        self.report.check(source, &levels)
    }
}
