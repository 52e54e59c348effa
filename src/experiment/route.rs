//! Routes: the schedule that a key asks for and an instrument's tour through it. Tours are
//! made once and kept while materials, seeds and allowances share them.

mod acquisition;
mod cache;
mod search;

use super::choices::Allowance;
use super::counts::{Counters, Spent, Stage, Work};
use super::instruments::PlannedInstrument;
use super::observer::{GoOn, ScheduleKey, Stop};
use super::tuning::Wanted;
use crate::acquisition::Task;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::instrument::{Bench, InstrumentSpec, Order, Parts};
use crate::measurement::Measurement;
use crate::schedule::{Itinerary, Schedule};
use acquisition::Course;
use cache::Cache;
use search::largest_within;
use std::collections::HashMap;
use std::sync::Arc;

/// Poses of a schedule beyond which, if none is reachable, no larger one is tried.
const HOPELESS: usize = 4096;

/// A schedule that was found for a [`ScheduleKey`], and how its instrument goes through it.
#[derive(Clone)]
pub(crate) struct Route {
    /// Distinct configurations it may have: those allowed, or the most that need at most the allowed readings or minutes.
    pub budget: usize,
    /// The schedule.
    pub schedule: Arc<Schedule>,
    /// The tour of the instrument; `None` of the ideal one.
    pub(super) tour: Option<Tour>,
    /// The tour without limits, if some pose is out of reach and the instrument asks what that costs.
    pub(super) whole: Option<Tour>,
    /// Wall time of making schedule and tours; routes that share them share it.
    pub(super) spent: Spent,
    /// True the first time that this key is asked for.
    pub(super) is_new: bool,
}

impl Route {
    /// The visits of the instrument; `None` of the ideal one.
    pub(crate) fn itinerary(&self) -> Option<&Itinerary> {
        self.tour.as_ref().map(|tour| &*tour.itinerary)
    }
}

/// An instrument and its visits to the poses of a schedule.
#[derive(Clone)]
pub(super) struct Tour {
    bench: Arc<Bench>,
    pub itinerary: Arc<Itinerary>,
}

impl Tour {
    /// The readings of a BRDF along the tour; the noise depends on the seed.
    pub(crate) fn measure(
        &self,
        brdf: &dyn Brdf,
        schedule: &Arc<Schedule>,
        seed: u64,
        go_on: GoOn<'_>,
    ) -> Result<Measurement, Stop> {
        let session = self.bench.session(&self.itinerary, seed);
        let measured = session.measure_while(brdf, schedule, &mut || go_on().is_ok());
        measured.ok_or(Stop::Cancelled)
    }
}

/// Coordinates, their symmetries and a sample set, by names that are unique in a plan.
#[derive(Clone, PartialEq, Eq, Hash)]
struct SetKey {
    coordinates: String,
    symmetry: Symmetry,
    sample_set: String,
}

impl SetKey {
    fn new(key: &ScheduleKey<'_>) -> Self {
        Self {
            coordinates: key.coordinates.label(),
            symmetry: key.symmetry,
            sample_set: key.sample_set.name.clone(),
        }
    }
}

/// Everything that determines order and times of visits, as the errors of a single machine do not.
#[derive(PartialEq, Eq, Hash)]
struct TourKey {
    poses: blake3::Hash,
    /// Position of the specification in `Router::specs`.
    spec: usize,
    limits: bool,
    order: Order,
}

/// Makes routes and keeps what they share.
#[derive(Default)]
pub(crate) struct Router {
    /// Where schedules and tours are counted.
    pub(super) counters: Counters,
    /// Budgets found, by set, name of the instrument, allowance and seed.
    budgets: HashMap<(SetKey, Option<String>, String, u64), usize>,
    /// Schedules, by set, budget and, if they matter, seed and name of the instrument.
    schedules: Cache<(SetKey, usize, Option<u64>, Option<String>), Schedule>,
    tours: Cache<TourKey, Itinerary>,
    /// Specifications of the instruments so far, each once.
    specs: Vec<InstrumentSpec>,
    /// Machines, by number of the specification, simulated parts and seed of the realisation.
    benches: HashMap<(usize, Parts, u64), Arc<Bench>>,
    /// The set of the last route; what is kept for it alone is dropped when another one comes.
    current: Option<SetKey>,
    /// How far acquisitions went that smaller budgets broke off, by set, material and seed; of one set.
    courses: HashMap<(SetKey, String, u64), Course>,
}

impl Router {
    /// A router that counts what it makes.
    pub(crate) fn counting(counters: &Counters) -> Self {
        Self {
            counters: counters.clone(),
            ..Self::default()
        }
    }

    /// The route of a key, or an [`Error::Infeasible`] if no schedule fits or no pose is reachable; `again`: it is asked for later.
    pub(crate) fn find(&mut self, key: &ScheduleKey<'_>, again: bool) -> Result<Route, Error> {
        match self.route(key, false, again, &|| Ok(())) {
            Ok(route) => Ok(route),
            Err(Stop::Failed(why)) if key.instrument.is_none() => {
                Err(Error::config("budgets", why))
            }
            Err(Stop::Failed(why)) => Err(Error::infeasible("schedule", why)),
            Err(Stop::Error(e)) => Err(e),
            Err(Stop::Cancelled) => Err(Error::Internal("nobody cancels this".into())),
        }
    }

    /// The route of a key, or why there is none. `holes`: also the tour without limits if some pose is out of reach and the
    /// instrument asks what that costs; `again`: a later material asks for it too.
    pub(super) fn route(
        &mut self,
        key: &ScheduleKey<'_>,
        holes: bool,
        again: bool,
        go_on: GoOn<'_>,
    ) -> Result<Route, Stop> {
        if key.sample_set.learns() {
            return Err(Stop::Failed(format!(
                "{} chooses its poses from readings; allowed: gonio next, poses before the first reading",
                key.sample_set.name
            )));
        }
        let set = SetKey::new(key);
        if self.current.as_ref() != Some(&set) {
            self.schedules.drop_unasked();
            self.tours.drop_unasked();
            self.current = Some(set.clone());
        }
        let name = key.instrument.map(|i| i.name.clone());
        let asked = (set, name, key.allowance.to_string(), key.seed);
        let known = self.budgets.get(&asked).copied();
        let budget = match known {
            Some(budget) => budget,
            None => {
                let budget = self.budget(key, go_on)?;
                *self.budgets.entry(asked).or_insert(budget)
            }
        };
        let (schedule, mut spent) = self.schedule(key, budget, again, go_on)?;
        let (mut tour, mut whole) = (None, None);
        if let Some(instrument) = key.instrument {
            let order = instrument.use_of.order;
            let mut go = |limits| {
                let (tour, own) =
                    self.tour(instrument, key.seed, &schedule, (limits, order), again)?;
                spent = spent + own;
                Ok::<_, Error>(tour)
            };
            let within = go(instrument.use_of.limits)?;
            if within.itinerary.visits.is_empty() {
                return Err(Stop::Failed(nothing(&within.itinerary)));
            }
            let holes = holes && instrument.use_of.holes;
            if holes && !within.itinerary.unreachable.is_empty() {
                whole = Some(go(false)?);
            }
            tour = Some(within);
        }
        Ok(Route {
            budget,
            schedule,
            tour,
            whole,
            spent,
            is_new: known.is_none(),
        })
    }

    /// The budget of an allowance: the largest whose schedule has at most so many reachable poses, or takes at most so long.
    fn budget(&mut self, key: &ScheduleKey<'_>, go_on: GoOn<'_>) -> Result<usize, Stop> {
        // Whether a pose is reachable does not depend on the order.
        let (most, order) = match key.allowance {
            Allowance::Poses(budget) => return Ok(budget),
            Allowance::Readings(n) => (n as f64, Some(Order::AsGenerated)),
            Allowance::Minutes(m) => (60.0 * m, None),
        };
        let mut refusal = None;
        let found = largest_within(most, |budget| {
            go_on()?;
            if budget > key.sample_set.most() {
                return Ok(f64::INFINITY);
            }
            let schedule = match self.schedule(key, budget, false, go_on) {
                Ok((schedule, _)) => schedule,
                // A schedule that is too small to be made takes no time; a larger one will.
                Err(Stop::Failed(reason)) => {
                    refusal = Some(reason);
                    return Ok(0.0);
                }
                Err(stop) => return Err(stop),
            };
            let Some(instrument) = key.instrument else {
                return Ok(schedule.poses.len() as f64);
            };
            let limits = instrument.use_of.limits;
            let order = order.unwrap_or(instrument.use_of.order);
            let (tour, _) = self.tour(instrument, key.seed, &schedule, (limits, order), false)?;
            let visits = tour.itinerary.visits.len();
            if visits == 0 && budget >= HOPELESS {
                refusal = Some(nothing(&tour.itinerary));
                return Ok(f64::INFINITY);
            }
            Ok(match key.allowance {
                Allowance::Minutes(_) => tour.itinerary.seconds(),
                _ => visits as f64,
            })
        })?;
        found.ok_or_else(|| Stop::Failed(refusal.unwrap_or_else(|| too_few(key.allowance))))
    }

    /// The schedule of a budget and its wall time, s; or the reason why there is none.
    fn schedule(
        &mut self,
        key: &ScheduleKey<'_>,
        budget: usize,
        again: bool,
        go_on: GoOn<'_>,
    ) -> Result<(Arc<Schedule>, Spent), Stop> {
        let set = &*key.sample_set.set;
        let seed = set.is_random().then_some(key.seed);
        let instrument = key.instrument;
        let instrument = instrument.filter(|i| i.use_of.limits && set.depends_on_instrument());
        let name = instrument.map(|i| i.name.clone());
        let asked = (SetKey::new(key), budget, seed, name);
        if let Some(known) = self.schedules.get(&asked, again) {
            return Ok(known);
        }
        let form = key.coordinates.checked_form(key.symmetry)?;
        let mut tuned_set = None;
        if let Some(tuning) = &key.sample_set.tuning {
            let grid = Wanted {
                parametrization: key.coordinates.name().into(),
                warp: key.coordinates.warp.clone(),
                sample_set: key.sample_set.name.clone(),
                symmetry: key.symmetry,
                budget,
            };
            let find = || tuning.find(grid, set, &form, (&self.counters, go_on));
            let (found, _) = self.counters.timed(Stage::Plan, find);
            tuned_set = set.tuned(&found?.ratio);
        }
        let bench = instrument.map(|i| self.bench(i, true, key.seed));
        let bench = bench.transpose()?;
        let goes_on = || go_on().is_ok();
        let task = Task {
            form,
            budget,
            seed: key.seed,
            machine: bench.as_ref().map(|(_, bench)| bench.machine()),
            go_on: &goes_on,
            truth: None,
        };
        let (planned, spent) = self.counters.repeated(Stage::Plan, |_| match &tuned_set {
            Some(tuned) => tuned.plan(&task.form, budget, key.seed),
            None => set.design(&task),
        });
        go_on()?;
        let schedule = planned.map_err(Stop::failed)?;
        self.counters.add(Stage::Plan, Work::Schedules, 1);
        let poses = schedule.poses.len();
        self.counters.add(Stage::Plan, Work::Poses, poses);
        Ok(self.schedules.keep(asked, (schedule, spent), poses, again))
    }

    /// The tour of an instrument with or without limits in an order, and the wall time of making it.
    fn tour(
        &mut self,
        instrument: &PlannedInstrument,
        seed: u64,
        schedule: &Schedule,
        (limits, order): (bool, Order),
        again: bool,
    ) -> Result<(Tour, Spent), Error> {
        let (spec, bench) = self.bench(instrument, limits, seed)?;
        let poses = hash(schedule);
        let asked = TourKey {
            poses,
            spec,
            limits,
            order,
        };
        let (itinerary, spent) = match self.tours.get(&asked, again) {
            Some(known) => known,
            None => {
                let plan = |_: &Counters| bench.plan(schedule, order);
                let made = self.counters.repeated(Stage::Plan, plan);
                self.counters.add(Stage::Plan, Work::Tours, 1);
                self.tours.keep(asked, made, schedule.poses.len(), again)
            }
        };
        Ok((Tour { bench, itinerary }, spent))
    }

    /// The number of an instrument's specification, and its machine in a realisation, with or without limits.
    fn bench(
        &mut self,
        instrument: &PlannedInstrument,
        limits: bool,
        seed: u64,
    ) -> Result<(usize, Arc<Bench>), Error> {
        let known = self.specs.iter().position(|s| *s == instrument.spec);
        let spec = known.unwrap_or(self.specs.len());
        if known.is_none() {
            self.specs.push(instrument.spec.clone());
        }
        let parts = Parts {
            limits,
            ..instrument.use_of.parts()
        };
        let asked = (spec, parts, instrument.realisation(seed));
        if let Some(bench) = self.benches.get(&asked) {
            return Ok((spec, Arc::clone(bench)));
        }
        // The plan has built it before.
        let bench = instrument.bench(parts, seed);
        let bench = Arc::new(bench.map_err(Error::internal)?);
        self.benches.insert(asked, Arc::clone(&bench));
        Ok((spec, bench))
    }
}

/// The hash of the directions of the poses in their order, and of whether they may be turned about the normal.
fn hash(schedule: &Schedule) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let isotropic = schedule.parametrization.symmetry().isotropic;
    hasher.update(&[isotropic.into()]);
    for pose in &schedule.poses {
        for direction in [pose.pair.omega_i, pose.pair.omega_o] {
            for x in direction.vector().to_array() {
                hasher.update(&x.to_le_bytes());
            }
        }
    }
    hasher.finalize()
}

/// Why there is no route of an itinerary without visits: the reasons, counted.
fn nothing(itinerary: &Itinerary) -> String {
    format!(
        "no pose is reachable for {} ({}); allowed: another instrument or schedule",
        itinerary.instrument,
        itinerary.reasons_text()
    )
}

/// Why there is no route where the smallest schedule is beyond the allowance.
fn too_few(allowance: Allowance) -> String {
    format!("{allowance}: too short for one pose; allowed: more")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Plan, Source};
    use search::FIRST;

    /// Routes of the only set of a config, twice: for every instrument, allowance and seed.
    fn routes(text: &str) -> (Vec<Route>, Router) {
        let text = format!(
            "{text}\n[[material]]\nkind = \"lambert\"\n[[reconstruction]]\nkind = \"nearest\""
        );
        let source = Source::new("c.toml", text);
        let plan = Plan::read(&source).unwrap();
        let mut router = Router::default();
        let mut round = || {
            let routes = plan.units().into_iter().map(|unit| {
                let key = plan.schedule_key(&unit, plan.materials[0].symmetry);
                let found = router.route(&key, true, false, &|| Ok(()));
                found.unwrap_or_else(|_| panic!())
            });
            let routes: Vec<Route> = routes.collect();
            (routes, router.counters.seconds().at_stage(Stage::Plan))
        };
        let (first, seconds) = round();
        let (second, later) = round();
        assert_eq!(seconds, later, "nothing is made twice");
        for (first, second) in first.iter().zip(&second) {
            assert!(first.is_new && !second.is_new);
            assert_eq!((first.budget, first.spent), (second.budget, second.spent));
        }
        (first, router)
    }

    /// Tours made in an order.
    fn count(router: &Router, order: Order) -> usize {
        router.tours.0.keys().filter(|t| t.order == order).count()
    }

    fn share_a_tour(routes: &[Route]) -> bool {
        let tour = |r: &Route| Arc::as_ptr(&r.tour.as_ref().unwrap().itinerary);
        routes.iter().all(|r| tour(r) == tour(&routes[0]))
    }

    #[test]
    fn a_schedule_that_many_ask_for_has_one_tour() {
        // Without limits every pose is a reading, and a grid has no seed.
        let text = "seeds = [1, 2, 3]\nbudgets = [300]\nreadings = [300]\n[[sample_set]]\n\
                    kind = \"grid\"\n[[instrument]]\npreset = \"utia\"\nlimits = false\n";
        let (found, router) = routes(&format!("{text}realisation = 7"));
        assert_eq!((found.len(), count(&router, Order::TwoOpt)), (6, 1));
        assert!(share_a_tour(&found));
        assert_eq!(router.benches.len(), 1);
        // Machines of one kind, and one without noise, differ in what they read.
        let second =
            "[[instrument]]\npreset = \"utia\"\nlimits = false\nnoise = false\nname = \"b\"";
        let (found, router) = routes(&format!("{text}{second}"));
        assert_eq!((found.len(), count(&router, Order::TwoOpt)), (12, 1));
        assert!(share_a_tour(&found));
        assert_eq!(router.benches.len(), 6);
        // Points that have a seed are others.
        let (found, router) = routes(&text.replace("grid", "sobol"));
        assert_eq!((found.len(), count(&router, Order::TwoOpt)), (6, 3));
    }

    #[test]
    fn no_tour_is_planned_twice() {
        for (set, seeds) in [("grid", 1), ("random", 2)] {
            let text = format!(
                "seeds = [1, 2]\nbudgets = [200]\nreadings = [150, 151]\nminutes = [10, 11]\n\
                 [[sample_set]]\nkind = \"{set}\"\n[[instrument]]\npreset = \"cornell\""
            );
            let (found, router) = routes(&text);
            assert_eq!(found.len(), 10);
            let tours: Vec<_> = router.tours.0.values().map(|kept| &kept.made).collect();
            for (i, tour) in tours.iter().enumerate() {
                assert!(!tours[..i].contains(tour), "{set}");
            }
            // The tour of a time is one of those that were tried, which begin with the same budget.
            let mut schedules = router.schedules.0.iter();
            let first = schedules.find(|((_, budget, _, _), _)| *budget == FIRST);
            let poses = first.unwrap().1.poses;
            let tours = router.tours.0.iter().filter(|(key, kept)| {
                key.order == Order::TwoOpt && key.limits && kept.poses == poses
            });
            assert_eq!(tours.count(), seeds, "{set}");
        }
    }
}
