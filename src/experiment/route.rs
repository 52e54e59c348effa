//! Schedules and an instrument's way through them, made once and kept while materials share them;
//! and the largest schedule that an instrument gets through in a given time, or reads so much of.

use super::instruments::PlannedInstrument;
use super::observer::ScheduleKey;
use super::plan::{Allowance, MAX_BUDGET};
use super::run::{Stop, timed};
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::instrument::{Bench, Order, Parts};
use crate::schedule::{Itinerary, Schedule};
use std::collections::HashMap;
use std::sync::Arc;

/// Poses that schedules may hold while they wait for the next material (100 bytes each); further
/// ones are planned again.
const CACHED_POSES: usize = 4_000_000;

/// A schedule of so many poses, none of which is reachable, has no larger one that is.
const HOPELESS: usize = 4096;

/// Position of the choices of a schedule and its instrument in the plan.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Place {
    pub symmetry: Symmetry,
    pub coordinates: usize,
    pub sample_set: usize,
    pub instrument: usize,
}

/// A schedule and how its instrument goes through it.
#[derive(Clone)]
pub(super) struct Route {
    pub schedule: Arc<Schedule>,
    /// None of the ideal instrument.
    pub itinerary: Option<Arc<Itinerary>>,
    /// The same without limits, if that differs and is asked for.
    pub whole: Option<Arc<Itinerary>>,
    /// Time it took to make.
    pub seconds: f64,
    /// True unless it was made for an earlier material.
    pub is_new: bool,
}

/// A schedule and how its instrument goes through it.
pub struct Routed {
    /// The schedule.
    pub schedule: Arc<Schedule>,
    /// Its visits; none of the ideal instrument.
    pub itinerary: Option<Arc<Itinerary>>,
}

/// Makes one schedule; finds the budget of the key and writes it there.
///
/// # Errors
/// [`Error::Infeasible`] if no schedule fits or no pose is reachable.
pub fn route(key: &mut ScheduleKey<'_>) -> Result<Routed, Error> {
    let place = Place {
        symmetry: key.symmetry,
        coordinates: 0,
        sample_set: 0,
        instrument: 0,
    };
    let mut router = Router {
        without_holes: true,
        ..Router::default()
    };
    match router.route(key, place, false, &|| false) {
        Ok(Ok(route)) => Ok(Routed {
            schedule: route.schedule,
            itinerary: route.itinerary,
        }),
        Ok(Err(reason)) if key.instrument.is_none() => Err(Error::config("budgets", reason)),
        Ok(Err(reason)) => Err(Error::infeasible("schedule", reason)),
        Err(Stop::Error(e)) => Err(e),
        Err(Stop::Cancelled) => Err(Error::Internal("nobody cancels this".into())),
    }
}

/// An allowance other than poses, as a key.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Asked {
    Readings(usize),
    /// The bits of the minutes.
    Minutes(u64),
}

/// What a route is of: instruments share schedules.
type ScheduleAt = (Symmetry, usize, usize, usize, u64);

/// What of a route is made.
#[derive(Clone, Copy)]
struct Way {
    /// In another order than the instrument's.
    order: Option<Order>,
    /// Also the one without limits, if the instrument wants it.
    holes: bool,
    /// A later material will ask for it.
    again: bool,
}

/// Makes routes and keeps them.
#[derive(Default)]
pub(super) struct Router {
    schedules: HashMap<ScheduleAt, (Arc<Schedule>, f64)>,
    cached_poses: usize,
    routes: HashMap<(Place, usize, u64), Route>,
    /// Budgets found, by place, seed and allowance.
    budgets: HashMap<(Place, u64, Asked), usize>,
    seconds: f64,
    /// Leaves out what only the errors of holes need.
    without_holes: bool,
}

impl Router {
    /// Time all routes took to make.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The route of a key, whose budget is found; or why there is none.
    /// `again`: a later material will ask for it.
    pub fn route(
        &mut self,
        key: &mut ScheduleKey<'_>,
        place: Place,
        again: bool,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Result<Route, String>, Stop> {
        match self.budget(key, place, cancelled)? {
            Ok(budget) => key.budget = budget,
            Err(reason) => return Ok(Err(reason)),
        }
        let known = (place, key.budget, key.seed);
        if let Some(route) = self.routes.get(&known) {
            let is_new = false;
            return Ok(Ok(Route {
                is_new,
                ..route.clone()
            }));
        }
        let way = Way {
            order: None,
            holes: !self.without_holes,
            again,
        };
        let route = match self.make(key, place, way)? {
            Ok(route) => route,
            Err(reason) => return Ok(Err(reason)),
        };
        if let Some(itinerary) = route.itinerary.as_ref().filter(|i| i.visits.is_empty()) {
            return Ok(Err(nothing(itinerary)));
        }
        if again && self.schedules.contains_key(&at(place, key)) {
            self.routes.insert(known, route.clone());
        }
        Ok(Ok(route))
    }

    /// The budget of an allowance: the largest whose schedule has at most so many reachable poses,
    /// or takes at most so long.
    fn budget(
        &mut self,
        key: &ScheduleKey<'_>,
        place: Place,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Result<usize, String>, Stop> {
        let (most, asked) = match key.allowance {
            Allowance::Poses(budget) => return Ok(Ok(budget)),
            Allowance::Readings(n) => (n as f64, Asked::Readings(n)),
            Allowance::Minutes(m) => (60.0 * m, Asked::Minutes(m.to_bits())),
        };
        let known = (place, key.seed, asked);
        if let Some(&budget) = self.budgets.get(&known) {
            return Ok(Ok(budget));
        }
        // Whether a pose is reachable does not depend on the order.
        let order = match asked {
            Asked::Readings(_) => Some(Order::AsGenerated),
            Asked::Minutes(_) => None,
        };
        let mut refusal = None;
        let found = largest_within(most, |budget| {
            if cancelled() {
                return Err(Stop::Cancelled);
            }
            let attempt = ScheduleKey { budget, ..*key };
            let way = Way {
                order,
                holes: false,
                again: false,
            };
            Ok(match self.make(&attempt, place, way)? {
                // A schedule that is too small to be made takes no time; a larger one will.
                Err(reason) => {
                    refusal = Some(reason);
                    0.0
                }
                Ok(route) => match &route.itinerary {
                    Some(itinerary) if itinerary.visits.is_empty() && budget >= HOPELESS => {
                        refusal = Some(nothing(itinerary));
                        f64::INFINITY
                    }
                    Some(itinerary) => match asked {
                        Asked::Readings(_) => itinerary.visits.len() as f64,
                        Asked::Minutes(_) => itinerary.seconds(),
                    },
                    None => route.schedule.poses.len() as f64,
                },
            })
        })?;
        let Some(budget) = found else {
            let allowance = key.allowance;
            return Ok(Err(refusal.unwrap_or_else(|| {
                format!("{allowance} are too few for one pose; allowed: more")
            })));
        };
        self.budgets.insert(known, budget);
        Ok(Ok(budget))
    }

    /// Makes a route.
    fn make(
        &mut self,
        key: &ScheduleKey<'_>,
        place: Place,
        way: Way,
    ) -> Result<Result<Route, String>, Stop> {
        let (schedule, seconds) = match self.schedule(key, place, way.again)? {
            Ok(planned) => planned,
            Err(reason) => return Ok(Err(reason)),
        };
        let mut route = Route {
            schedule,
            itinerary: None,
            whole: None,
            seconds,
            is_new: true,
        };
        let Some(instrument) = key.instrument else {
            return Ok(Ok(route));
        };
        let order = way.order.unwrap_or(instrument.use_of.order);
        let machine = bench(instrument, key.seed)?;
        let (itinerary, seconds) = timed(|| machine.plan(&route.schedule, order));
        self.seconds += seconds;
        route.seconds += seconds;
        if way.holes && instrument.use_of.holes && !itinerary.unreachable.is_empty() {
            let free = bench_without_limits(instrument, key.seed)?;
            let (whole, seconds) = timed(|| free.plan(&route.schedule, order));
            self.seconds += seconds;
            route.whole = Some(Arc::new(whole));
        }
        route.itinerary = Some(Arc::new(itinerary));
        Ok(Ok(route))
    }

    fn schedule(
        &mut self,
        key: &ScheduleKey<'_>,
        place: Place,
        again: bool,
    ) -> Result<Result<(Arc<Schedule>, f64), String>, Error> {
        if let Some(cached) = self.schedules.get(&at(place, key)) {
            return Ok(Ok(cached.clone()));
        }
        let form = match key.coordinates.form(key.symmetry) {
            Ok(form) => form,
            Err(e) => return Err(Error::Internal(format!("a warp that was checked: {e}"))),
        };
        let (planned, seconds) = timed(|| key.sample_set.set.plan(&form, key.budget, key.seed));
        self.seconds += seconds;
        let schedule = match planned {
            Ok(schedule) => Arc::new(schedule),
            Err(e) => return Ok(Err(e.to_string())),
        };
        let total = self.cached_poses + schedule.poses.len();
        if again && total <= CACHED_POSES {
            self.cached_poses = total;
            let kept = (Arc::clone(&schedule), seconds);
            self.schedules.insert(at(place, key), kept);
        }
        Ok(Ok((schedule, seconds)))
    }
}

fn at(place: Place, key: &ScheduleKey<'_>) -> ScheduleAt {
    let Place {
        symmetry,
        coordinates,
        sample_set,
        ..
    } = place;
    (symmetry, coordinates, sample_set, key.budget, key.seed)
}

/// The machine of an instrument as it is used.
pub(super) fn bench(instrument: &PlannedInstrument, seed: u64) -> Result<Bench, Error> {
    build(instrument, instrument.use_of.parts(), seed)
}

/// The same machine without limits.
pub(super) fn bench_without_limits(
    instrument: &PlannedInstrument,
    seed: u64,
) -> Result<Bench, Error> {
    let limits = false;
    let parts = instrument.use_of.parts();
    build(instrument, Parts { limits, ..parts }, seed)
}

fn build(instrument: &PlannedInstrument, parts: Parts, seed: u64) -> Result<Bench, Error> {
    // The plan has built it before.
    let bench = instrument.bench(parts, seed);
    bench.map_err(|e| Error::Internal(e.to_string()))
}

/// Why an itinerary is empty.
fn nothing(itinerary: &Itinerary) -> String {
    let name = &itinerary.instrument;
    let reasons = itinerary.reasons_text();
    format!("no pose is reachable for {name} ({reasons}); allowed: another instrument or schedule")
}

/// The search ends when the budget that fits and the one that does not are this close, relatively:
/// a grid's nodes come in larger steps.
const CLOSE: f64 = 0.005;

/// The first budget that is tried.
const FIRST: usize = 64;

/// Factors between one budget that fits and the next that is tried, as long as none was too large.
const GROWTH: (f64, f64) = (1.1, 8.0);

/// The largest budget, to half a percent, whose cost is at most `most`, found by bisection of
/// what `cost_of` reports; `None` if not even the smallest fits. Costs
/// grow with the budget, but for the steps of grids: of several budgets at the limit one is found.
pub(super) fn largest_within<E>(
    most: f64,
    mut cost_of: impl FnMut(usize) -> Result<f64, E>,
) -> Result<Option<usize>, E> {
    let (mut fits, mut exceeds) = (0, None);
    let mut budget = FIRST;
    loop {
        let cost = cost_of(budget)?;
        if cost <= most {
            fits = budget;
        } else {
            exceeds = Some(budget);
        }
        budget = match exceeds {
            None if budget == MAX_BUDGET => break,
            None => {
                let (slow, fast) = GROWTH;
                let factor = (most / cost).clamp(slow, fast);
                ((budget as f64 * factor) as usize + 1).min(MAX_BUDGET)
            }
            Some(above) => {
                let gap = above - fits;
                if gap <= 1 || (gap as f64) < CLOSE * above as f64 {
                    break;
                }
                fits + gap / 2
            }
        };
    }
    Ok((fits > 0).then_some(fits))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(seconds: f64, time: impl Fn(usize) -> f64) -> (Option<usize>, usize) {
        let mut asked = 0;
        let count = |n| {
            asked += 1;
            Ok::<_, ()>(time(n))
        };
        let best = largest_within(seconds, count).unwrap();
        (best, asked)
    }

    #[test]
    fn the_largest_budget_in_time_is_found() {
        for exponent in [0.6, 1.0, 1.3] {
            for truth in [1, 5, 63, 64, 65, 1000, 123_456, 9_999_999] {
                let time = |n: usize| (n as f64).powf(exponent);
                let seconds = time(truth) * (1.0 + 1e-12);
                let (best, asked) = found(seconds, time);
                let best = best.unwrap();
                assert!(best <= truth, "{best} of {truth}");
                assert!(
                    best as f64 >= truth as f64 * (1.0 - CLOSE) - 1.0,
                    "{best} of {truth}"
                );
                assert!(asked < 25, "{truth}: {asked}");
            }
        }
    }

    #[test]
    fn nothing_fits_no_time_and_everything_endless_time() {
        assert_eq!(found(0.5, |n| n as f64).0, None);
        assert_eq!(found(1e9, |_| 1.0).0, Some(MAX_BUDGET));
    }

    #[test]
    fn steps_do_not_lead_astray() {
        // Grids: the time is that of the next smaller cube.
        let time = |n: usize| (n as f64).cbrt().floor().powi(3);
        let (best, _) = found(1000.0, time);
        assert!(time(best.unwrap()) <= 1000.0 && best.unwrap() >= 1000);
    }
}
