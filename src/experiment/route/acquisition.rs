//! Routes of planners that learn: each material has its own.

use super::super::choices::Allowance;
use super::super::observer::{ScheduleKey, Stop, timed};
use super::{NoRoute, Route, Router, Tour};
use crate::acquisition::{self, Planner, Task};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::instrument::{Bench, Instrument, Order};
use crate::parametrization::Parametrization;
use crate::schedule::{Itinerary, Pose, Schedule};
use std::sync::Arc;

/// An acquisition before its first reading: what all materials share.
pub(in super::super) struct Acquisition<'a> {
    planner: &'a dyn Planner,
    form: Arc<dyn Parametrization>,
    budget: usize,
    seed: u64,
    allowance: Allowance,
    /// The instrument, its order, and whether it has to reach every pose.
    bench: Option<(Arc<Bench>, Order, bool)>,
    /// The poses of the first batch.
    first: Vec<Pose>,
    /// Wall time of choosing them, s.
    seconds: f64,
}

impl Router {
    /// The acquisition of a key whose planner learns, or why it cannot begin.
    pub(in super::super) fn begin<'a>(
        &mut self,
        key: &ScheduleKey<'a>,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Result<Acquisition<'a>, NoRoute>, Stop> {
        let planner = &*key.sample_set.set;
        let form = key.coordinates.form(key.symmetry);
        let form = form.map_err(|e| Error::Internal(format!("a warp that was checked: {e}")))?;
        let bench = key.instrument.map(|i| {
            let limits = i.use_of.limits;
            let (_, bench) = self.bench(i, limits, key.seed)?;
            Ok::<_, Error>((bench, i.use_of.order, limits))
        });
        let mut begun = Acquisition {
            planner,
            form,
            budget: key.allowance.count().unwrap_or(planner.most()),
            seed: key.seed,
            allowance: key.allowance,
            bench: bench.transpose()?,
            first: Vec::new(),
            seconds: 0.0,
        };
        let (first, seconds) = timed(|| {
            let go_on = || !cancelled();
            let task = begun.task(&go_on, None);
            acquisition::further(planner, &task, &acquisition::nothing(&task))
        });
        self.seconds += seconds;
        if cancelled() {
            return Err(Stop::Cancelled);
        }
        begun.seconds = seconds;
        match first {
            Ok(poses) => begun.first = poses.unwrap_or_default(),
            Err(reason) => return Ok(Err(reason.into())),
        }
        Ok(Ok(begun))
    }
}

/// Poses in the order of their choice and, of an instrument, its way through them.
type Way = (Arc<Schedule>, Option<Itinerary>);

impl Acquisition<'_> {
    /// Wall time of what all materials share, s.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    fn task<'t>(&'t self, go_on: &'t dyn Fn() -> bool, truth: Option<&'t dyn Brdf>) -> Task<'t> {
        let bench = self.bench.as_ref().filter(|(_, _, limits)| *limits);
        Task {
            form: Arc::clone(&self.form),
            budget: self.budget,
            seed: self.seed,
            machine: bench.map(|(bench, ..)| bench.machine()),
            go_on,
            truth,
        }
    }

    /// The poses that a BRDF leads to, and the tour through them.
    pub fn route(
        &self,
        brdf: &dyn Brdf,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Result<Route, NoRoute>, Stop> {
        let (found, seconds) = timed(|| match &self.bench {
            None => self.without_machine(brdf, cancelled),
            Some((bench, order, _)) => self.on_machine(brdf, (bench, *order), cancelled),
        });
        if cancelled() {
            return Err(Stop::Cancelled);
        }
        let (schedule, itinerary) = match found {
            Ok(found) => found,
            Err(reason) => return Ok(Err(reason)),
        };
        let tour = self.bench.as_ref().zip(itinerary);
        Ok(Ok(Route {
            budget: self.allowance.count().unwrap_or(schedule.poses.len()),
            schedule,
            tour: tour.map(|((bench, ..), itinerary)| Tour {
                bench: Arc::clone(bench),
                itinerary: Arc::new(itinerary),
            }),
            whole: None,
            seconds: self.seconds + seconds,
            is_new: true,
        }))
    }

    fn without_machine(
        &self,
        brdf: &dyn Brdf,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Way, NoRoute> {
        let go_on = || !cancelled();
        let task = self.task(&go_on, Some(brdf));
        let taken = acquisition::acquire_from(self.planner, &task, brdf, self.first.clone())?;
        Ok((taken.schedule, None))
    }

    fn on_machine(
        &self,
        brdf: &dyn Brdf,
        (bench, order): (&Bench, Order),
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Way, NoRoute> {
        let go_on = || !cancelled();
        let task = self.task(&go_on, Some(brdf));
        let schedule = |poses| Arc::new(acquisition::scheduled(&task, self.planner.label(), poses));
        let mut so_far = acquisition::nothing(&task);
        let mut itinerary = bench.plan_of(&so_far.schedule, &[], order);
        let mut poses = self.first.clone();
        while go_on() {
            let before = so_far.schedule.poses.len();
            let asked = poses.len() - before;
            let all = schedule(poses.clone());
            let with = |n: usize| {
                let numbers: Vec<u32> = (before as u32..(before + n) as u32).collect();
                bench.plan_further(&all, itinerary.clone(), &numbers, order)
            };
            let (kept, extended) = self.in_time(asked, with);
            if kept == 0 {
                break;
            }
            poses.truncate(before + kept);
            let fresh = Itinerary {
                visits: extended.visits[itinerary.visits.len()..].to_vec(),
                ..extended.clone()
            };
            let session = bench.session(&fresh, self.seed);
            let taken = session.measure(brdf, &schedule(poses));
            so_far = taken.after(&so_far);
            itinerary = extended;
            if kept < asked {
                break;
            }
            match acquisition::further(self.planner, &task, &so_far)? {
                Some(further) => poses = further,
                None => break,
            }
        }
        match so_far.schedule.poses.is_empty() {
            true => Err(NoRoute::TooFew(self.allowance)),
            false => Ok((so_far.schedule, Some(itinerary))),
        }
    }

    /// The largest number of poses, up to `most`, whose itinerary ends in time, and that itinerary.
    fn in_time(&self, most: usize, with: impl Fn(usize) -> Itinerary) -> (usize, Itinerary) {
        let limit = match self.allowance {
            Allowance::Minutes(minutes) => 60.0 * minutes,
            Allowance::Poses(_) | Allowance::Readings(_) => f64::INFINITY,
        };
        let mut best = with(most);
        if best.seconds() <= limit {
            return (most, best);
        }
        let (mut fits, mut exceeds) = (0, most);
        while exceeds - fits > 1 {
            let half = fits + (exceeds - fits) / 2;
            let tried = with(half);
            match tried.seconds() <= limit {
                true => (fits, best) = (half, tried),
                false => exceeds = half,
            }
        }
        (fits, best)
    }
}
