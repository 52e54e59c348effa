//! The plan of an acquisition: the choices of a config put together, checked and named.
//!
//! Everything that can be refused without measuring is refused here, so that a mistake costs a
//! second and not an hour. No table is loaded; headers and lengths of files are read.

use super::checks::{Place, distinct, each_once, name_all, refuse_empty};
use super::choices::{
    Allowance, Coordinates, DEFAULT, Material, Method, NONE, OWN, PlannedSet, Reach, UsedIn,
};
use super::config::{
    Config, Output, check_metrics, check_output, check_quantities, checked_numbers, of_instruments,
};
use super::instruments::{self, PlannedInstrument};
use super::kind::{Kind, QuantityGroup};
use super::materials::{self, insert_materials};
use super::moments::MomentsTable;
use super::pictures::PictureSpec;
use super::priors;
use super::question::{Factor, ReportSpec};
use super::source::Source;
use super::tables::{insert_list, section};
use super::training::TuningTable;
use crate::brdf::Channels;
use crate::error::{Error, excerpt, one_of};
use crate::geometry::Symmetry;
use crate::metrics::{Measure, MetricsSpec};
use crate::parametrization::{self, ParametrizationSpec};
use crate::reconstruct::{self, Reconstruct};
use crate::registry::with;
use std::sync::Arc;

/// Configurations of a schedule that is tried out, and of one for sets whose least is more; if one works, every larger budget does.
const PROBE_BUDGET: [usize; 2] = [64, 1_000_000];

/// A reconstruction with its name, and where it is used.
type Reconstruction = (String, Arc<dyn Reconstruct>, Reach);

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
    /// What folds the poses of sample sets that depend on no parametrization: the first of them.
    pub unguided: Coordinates,
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
    /// Reads a config, puts it together and checks it.
    ///
    /// # Errors
    /// [`Error::Config`] if it is no TOML, or has keys or values that are not allowed or do not fit each other,
    /// [`Error::Data`] for files that cannot be used.
    pub fn read(source: &Source) -> Result<Self, Error> {
        Self::new(Config::read(source)?)
    }

    /// As [`read`](Self::read); sample sets without a reconstruction and reconstructions without a sample set are allowed.
    pub(crate) fn read_parts(source: &Source) -> Result<Self, Error> {
        Self::of_parts(Config::read(source)?)
    }

    /// Puts a config together and checks it.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn new(config: Config<'_>) -> Result<Self, Error> {
        let source = config.source;
        let plan = Self::of_parts(config)?;
        plan.check_use(source)?;
        Ok(plan)
    }

    fn of_parts(config: Config<'_>) -> Result<Self, Error> {
        let source = config.source;
        let (seeds, budgets, readings) = checked_numbers(&config)?;
        let at = source.place("measures");
        refuse_empty(&at, &config.scalars.measures)?;
        distinct(&at, &config.scalars.measures, |m| m.name())?;
        check_metrics(&config)?;
        check_output(&config)?;
        check_quantities(&config)?;
        let written = (section(&config.scalars), config.materials.len());
        let scalars = config.scalars;
        let groups = scalars.quantities.unwrap_or_default();
        let asked_for = |group| groups.contains(&group);
        let (materials, missing) = materials::gather(
            source,
            config.materials,
            scalars.materials_dir.as_deref(),
            scalars.only.as_deref(),
            config.merl,
            &scalars.channels,
        )?;
        let instruments = instruments::gather(source, config.instruments, &materials)?;
        let of_sets = source.place("sample_set");
        let (sets, reach): (Vec<_>, Vec<Reach>) = config.sample_sets.into_iter().unzip();
        let sets = name_all(&of_sets, sets, |s| s.label())?;
        let mut sample_sets = Vec::with_capacity(sets.len());
        for (i, ((name, set), reach)) in sets.into_iter().zip(reach).enumerate() {
            let machines = instruments.iter().map(|i| &*i.name);
            sample_sets.push(PlannedSet {
                on: positions(&of_sets.index(i).key("on"), &reach, "instrument", machines)?,
                name,
                set,
                tuning: None,
                reach,
            });
        }
        let of_methods = source.place("reconstruction");
        let (reconstructions, reach): (Vec<_>, Vec<Reach>) =
            config.reconstructions.into_iter().unzip();
        let reconstructions = name_all(&of_methods, reconstructions, |r| r.label())?;
        let with_reach = |((name, method), reach)| (name, Arc::from(method), reach);
        let reconstructions = reconstructions.into_iter().zip(reach).map(with_reach);
        let reconstructions: Vec<Reconstruction> = reconstructions.collect();
        let symmetries = each_once(materials.iter().map(|m| m.symmetry));
        let parametrizations = parametrizations(source, config.parametrizations, &symmetries)?;
        let mut plan = Self {
            kind: scalars.experiment,
            question: scalars.question,
            channels: scalars.channels,
            seeds,
            budgets,
            readings,
            minutes: scalars.minutes,
            measures: scalars.measures,
            metrics: config.metrics,
            albedo: asked_for(QuantityGroup::Albedo),
            uncertainty: asked_for(QuantityGroup::Uncertainty),
            expected: asked_for(QuantityGroup::Expected),
            moments: asked_for(QuantityGroup::Moments).then(|| config.moments.unwrap_or_default()),
            materials,
            missing,
            unguided: parametrizations[0].unguided(),
            parametrizations,
            sample_sets,
            methods: Vec::new(),
            instruments,
            band: config.band,
            report: config.report,
            pictures: config.pictures,
            output: config.output,
            resolved: toml::Table::new(),
        };
        plan.check_sample_sets(source)?;
        let first = reconstructions.first().map(|(_, method, _)| method);
        plan.tune(source, config.tuning, first)?;
        plan.check_coordinates(source, &config.coordinates)?;
        plan.resolved = plan.resolved(written, &reconstructions, &config.coordinates);
        for (i, reconstruction) in reconstructions.iter().enumerate() {
            let at = of_methods.index(i);
            let methods = plan.methods(&at, reconstruction, &config.coordinates)?;
            plan.methods.extend(methods);
        }
        plan.check_report(source)?;
        let sets = plan.sample_sets.iter().enumerate();
        let sets = sets.map(|(i, set)| (of_sets.index(i), set.set.prior()));
        let methods = reconstructions.iter().enumerate();
        let methods = methods.map(|(i, (_, method, _))| (of_methods.index(i), method.prior()));
        priors::check(&plan.materials, sets.chain(methods))?;
        Ok(plan)
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

    /// Checks the keys of sample sets against the axes of every parametrization, and the smallest budget against both.
    fn check_sample_sets(&self, source: &Source) -> Result<(), Error> {
        let budgets = self.budgets.iter().copied().enumerate();
        let (smallest, budget) = budgets.min_by_key(|b| b.1).unwrap_or((0, PROBE_BUDGET[1]));
        for (i, planned) in self.sample_sets.iter().enumerate() {
            let at = source.place("sample_set").index(i);
            for (key, list) in [("budgets", &self.budgets), ("readings", &self.readings)] {
                let most = planned.set.most();
                // Larger budgets than `up_to` are left out.
                if let Some(n) = list
                    .iter()
                    .position(|n| *n > most && *n <= planned.reach.largest())
                {
                    return Err(source.place(key).index(n).problem(format_args!(
                        "= {}: {at} \"{}\" chooses at most {most} poses; allowed: fewer, or up_to = {most} there",
                        list[n], planned.name
                    )));
                }
            }
            for coordinates in &self.parametrizations {
                for symmetry in self.symmetries() {
                    let form = coordinates.checked_form(symmetry)?;
                    planned.set.check(form.axes()).map_err(|e| {
                        let with = format!(" in {} coordinates", coordinates.label());
                        at.key(&e.key).error(format!("{e}{with}"))
                    })?;
                    // Poses that are chosen for a reconstruction take seconds, and some are found whatever the budget is.
                    if planned.set.assumes().is_some() {
                        continue;
                    }
                    let own: Vec<f64> = form.axes().iter().map(|a| a.density).collect();
                    let probes = PROBE_BUDGET.map(|probe| probe.min(budget).min(planned.most()));
                    let probed = |probe: usize| match planned.set.tuned(&own) {
                        Some(untuned) => untuned.plan(&form, probe, self.seeds[0]),
                        None => planned.set.plan(&form, probe, self.seeds[0]),
                    };
                    let probed = probed(probes[0]).or_else(|_| probed(probes[1]));
                    probed.map_err(|e| match self.budgets.is_empty() {
                        true => at.error(e),
                        false => source.place("budgets").index(smallest).error(e),
                    })?;
                }
            }
        }
        Ok(())
    }

    /// Gives every set whose ratio is to be tuned what it is tuned on, with the first reconstruction.
    fn tune(
        &mut self,
        source: &Source,
        table: Option<TuningTable>,
        method: Option<&Arc<dyn Reconstruct>>,
    ) -> Result<(), Error> {
        let wanted = |s: &PlannedSet| s.set.tuned(&[]).is_some();
        let first = self.sample_sets.iter().position(wanted);
        let (set, table, method) = match (first, table, method) {
            (Some(set), Some(table), Some(method)) => (set, table, method),
            (Some(set), ..) => {
                let at = source.place("sample_set").index(set).key("ratio");
                return Err(at.problem(
                    "= \"tuned\" lacks what it is tuned on; allowed: with [tuning] and its materials",
                ));
            }
            (None, Some(_), _) => {
                return Err(source.place("tuning").problem(
                    "is never used; allowed: with a [[sample_set]] of ratio = \"tuned\"",
                ));
            }
            (None, None, _) => return Ok(()),
        };
        if let Some(key) = of_instruments(&self.readings, &self.minutes) {
            let set = source.place("sample_set").index(set);
            let problem = format!("do not go with the tuned ratio of {set}; allowed: budgets");
            return Err(source.place(key).problem(problem));
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
            let at = source.place("coordinates").index(i);
            if parametrization::find(&c.kind).is_none() {
                let all = parametrization::all();
                let kinds = all.iter().map(|e| e.kind).chain([OWN]);
                return Err(at.key("kind").refused(&c.kind, one_of(&c.kind, kinds)));
            }
            for symmetry in self.symmetries() {
                c.form(symmetry).map_err(|e| {
                    let key = e.key.trim_start_matches("coordinates.");
                    at.key(key).error(&e)
                })?;
            }
        }
        Ok(())
    }

    /// Methods of one reconstruction, one for each of its coordinates.
    fn methods(
        &self,
        at: &Place<'_>,
        (name, method, reach): &Reconstruction,
        coordinates: &[reconstruct::Coordinates],
    ) -> Result<Vec<Method>, Error> {
        method.check().map_err(|e| at.key(&e.key).error(e))?;
        let sets = self.sample_sets.iter().map(|s| &*s.name);
        let on = positions(&at.key("on"), reach, "sample set", sets)?;
        let used = |used_in, coordinates: String, method: &Arc<dyn Reconstruct>| Method {
            name: name.clone(),
            coordinates,
            method: Arc::clone(method),
            up_to: reach.up_to.map(|n| n.unsigned_abs() as usize),
            on: on.clone(),
            used_in,
        };
        if let Some(given) = method.coordinates() {
            return Ok(vec![used(UsedIn::All, given.label(), method)]);
        }
        let mut methods = Vec::new();
        let named = match method.needs_grid() || coordinates.is_empty() {
            true => vec![None],
            false => coordinates.iter().map(Some).collect(),
        };
        for c in named {
            let Some(c) = c.filter(|c| c.kind != OWN) else {
                let own = self.in_own(method, c.is_some(), coordinates);
                methods.extend(own.into_iter().map(|(at, label, m)| used(at, label, &m)));
                continue;
            };
            let within = method.within(c).ok_or_else(|| {
                at.problem(format_args!(
                    "\"{name}\" has no choice of coordinates; allowed: own, not {}",
                    c.label()
                ))
            })?;
            methods.push(used(UsedIn::All, c.label(), &within));
        }
        Ok(methods)
    }

    /// A method in the coordinates of each schedule, if it is `asked` for; on sets of no parametrization in all not `named` beside.
    fn in_own(
        &self,
        method: &Arc<dyn Reconstruct>,
        asked: bool,
        named: &[reconstruct::Coordinates],
    ) -> Vec<(UsedIn, String, Arc<dyn Reconstruct>)> {
        let of_schedules = method.takes_those_of_schedules();
        let within = |c: &Coordinates| {
            let c = c.of_reconstructions();
            Some((c.label(), method.within(&c)?))
        };
        let within: Vec<_> = self.parametrizations.iter().filter_map(within).collect();
        if within.is_empty() || !(of_schedules || asked) {
            let label = if of_schedules { OWN } else { DEFAULT };
            return vec![(UsedIn::All, label.into(), Arc::clone(method))];
        }
        let mut own = Vec::new();
        if of_schedules {
            own.push((UsedIn::Guided, OWN.into(), Arc::clone(method)));
        }
        let unguided = self.sample_sets.iter().any(|s| s.set.is_unguided());
        for (i, (label, method)) in within.into_iter().enumerate() {
            if !of_schedules {
                own.push((UsedIn::Only(i), OWN.into(), Arc::clone(&method)));
            }
            if unguided && !named.iter().any(|c| c.label() == label) {
                own.push((UsedIn::Unguided, label, method));
            }
        }
        own
    }

    /// Checks that every reconstruction has a schedule, and every schedule a reconstruction.
    fn check_use(&self, source: &Source) -> Result<(), Error> {
        let units = self.units();
        let names = each_once(self.methods.iter().map(|m| &m.name));
        for (i, name) in names.into_iter().enumerate() {
            let mine = |m: &usize| self.methods[*m].name == *name;
            if !units.iter().any(|u| self.methods_on(u).iter().any(mine)) {
                let at = source.place("reconstruction").index(i);
                return Err(at.problem(format_args!(
                    "\"{name}\" is never used; allowed: an up_to that a budget stays within, and a \
                     grid for what needs one"
                )));
            }
        }
        for (i, set) in self.sample_sets.iter().enumerate() {
            let mut mine = units.iter().filter(|u| u.sample_set == i);
            if mine.all(|u| self.methods_on(u).is_empty()) {
                let at = source.place("sample_set").index(i);
                if !units.iter().any(|u| u.sample_set == i) {
                    return Err(at.key("up_to").problem(format_args!(
                        "= {}: \"{}\" is used at no budget; allowed: at least the least of them",
                        set.most(),
                        set.name
                    )));
                }
                return Err(at.problem(format_args!(
                    "\"{}\" has no reconstruction; allowed: one that works on it",
                    set.name
                )));
            }
        }
        Ok(())
    }

    /// The config with every default filled in; `written`: the keys that are no tables, and the number of materials with a table.
    fn resolved(
        &self,
        written: (toml::Table, usize),
        reconstructions: &[Reconstruction],
        coordinates: &[reconstruct::Coordinates],
    ) -> toml::Table {
        let (mut table, materials) = written;
        insert_materials(&mut table, &self.materials, materials);
        let parametrizations = self.parametrizations.iter().map(|c| c.spec.resolved());
        insert_list(&mut table, "parametrization", parametrizations);
        let sets = self.sample_sets.iter();
        let sets = sets.map(|s| {
            let mut keys = with(s.set.resolved(), "name", &*s.name);
            keys.extend(section(&s.reach));
            keys
        });
        insert_list(&mut table, "sample_set", sets);
        let methods = reconstructions.iter().map(|(name, method, reach)| {
            let mut keys = with(method.resolved(), "name", name.as_str());
            keys.extend(section(reach));
            keys
        });
        insert_list(&mut table, "reconstruction", methods);
        insert_list(&mut table, "coordinates", coordinates.iter().map(section));
        let instruments = self.instruments.iter().map(PlannedInstrument::resolved);
        insert_list(&mut table, "instrument", instruments);
        table.insert("metrics".into(), section(&self.metrics).into());
        if let Some(tuning) = self.sample_sets.iter().find_map(|s| s.tuning.as_ref()) {
            table.insert("tuning".into(), tuning.resolved.clone().into());
        }
        if let Some(moments) = &self.moments {
            table.insert("moments".into(), moments.resolved().into());
        }
        table.insert("band".into(), self.band.into());
        table.insert("report".into(), section(&self.report).into());
        table.insert("pictures".into(), self.pictures.resolved().into());
        table.insert("output".into(), section(&self.output).into());
        table
    }

    /// Checks that the names in `[report]` are names of the plan.
    fn check_report(&self, source: &Source) -> Result<(), Error> {
        let factor = self.report.factor;
        let levels: Vec<&str> = match factor {
            Factor::Parametrization => {
                let unguided = self.sample_sets.iter().filter(|s| s.set.is_unguided());
                let all = self.parametrizations.iter().map(|c| c.name());
                all.chain(unguided.map(|_| NONE)).collect()
            }
            Factor::Warp => self.parametrizations.iter().map(|c| &*c.warp).collect(),
            Factor::SampleSet => self.sample_sets.iter().map(|s| &*s.name).collect(),
            Factor::Instrument => self.instruments.iter().map(|i| &*i.name).collect(),
            Factor::Reconstruction => self.methods.iter().map(|m| &*m.name).collect(),
            Factor::Coordinates => self.methods.iter().map(|m| &*m.coordinates).collect(),
        };
        self.report.check(source, &levels)
    }
}

/// The parametrizations of a config, each checked for materials of all symmetries.
fn parametrizations(
    source: &Source,
    specs: Vec<ParametrizationSpec>,
    symmetries: &[Symmetry],
) -> Result<Vec<Coordinates>, Error> {
    let at = source.place("parametrization");
    refuse_empty(&at, &specs)?;
    let mut list: Vec<Coordinates> = Vec::new();
    for (i, spec) in specs.into_iter().enumerate() {
        let at = at.index(i);
        let mut coordinates = Coordinates {
            kind: spec.kind,
            spec,
            warp: String::new(),
        };
        for &symmetry in symmetries {
            let form = coordinates.form(symmetry).map_err(|e| {
                let warp = coordinates.spec.warps.get(&e.axis).map(|w| w.name());
                let warp = warp.unwrap_or_default();
                let at = at.key("warp").key(&e.axis);
                at.problem(format_args!("= \"{warp}\": {}", e.problem))
            })?;
            coordinates.warp = form.warp_name();
        }
        if list.iter().any(|c| c.label() == coordinates.label()) {
            return Err(at.problem(format_args!(
                "= \"{}\" is there twice; allowed: each parametrization with the same warps once",
                coordinates.label()
            )));
        }
        list.push(coordinates);
    }
    Ok(list)
}

/// Positions, among all names, of those that `on` has.
fn positions<'a>(
    at: &Place<'_>,
    reach: &Reach,
    what: &str,
    names: impl Iterator<Item = &'a str> + Clone,
) -> Result<Vec<usize>, Error> {
    let place = |name: &String| {
        let found = names.clone().position(|n| n == name);
        found.ok_or_else(|| {
            at.problem(format_args!(
                "= \"{}\" is no {what} of this config; allowed: {}",
                excerpt(name),
                one_of(name, names.clone())
            ))
        })
    };
    reach.on.iter().map(place).collect()
}
