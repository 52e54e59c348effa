//! Routes of planners that learn: each material has its own.

use super::super::choices::{Allowance, MAX_BUDGET};
use super::super::observer::{ScheduleKey, Stop, timed};
use super::{NoRoute, Route, Router, Tour};
use crate::acquisition::{self, Planner, Task};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::instrument::{Bench, Ideal, Instrument, Order};
use crate::measurement::Measurement;
use crate::schedule::{Itinerary, Pose, Schedule};
use std::sync::Arc;

/// An acquisition before its first reading: what all materials share.
pub(in super::super) struct Acquisition<'a> {
    planner: &'a dyn Planner,
    task: Task<'static>,
    /// Longest time, s.
    most_seconds: f64,
    bench: Option<(Arc<Bench>, Order)>,
    /// True if the machine has to reach every pose.
    limits: bool,
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
    ) -> Result<Result<Acquisition<'a>, NoRoute>, Stop> {
        let planner = &*key.sample_set.set;
        let form = key.coordinates.form(key.symmetry);
        let form = form.map_err(|e| Error::Internal(format!("a warp that was checked: {e}")))?;
        let (budget, most_seconds) = match key.allowance {
            Allowance::Poses(n) | Allowance::Readings(n) => (n, f64::INFINITY),
            Allowance::Minutes(minutes) => (planner.most().min(MAX_BUDGET), 60.0 * minutes),
        };
        let limits = key.instrument.is_some_and(|i| i.use_of.limits);
        let bench = key.instrument.map(|i| {
            let (_, bench) = self.bench(i, limits, key.seed)?;
            Ok::<_, Error>((bench, i.use_of.order))
        });
        let mut begun = Acquisition {
            planner,
            task: Task {
                form,
                budget,
                seed: key.seed,
                machine: None,
            },
            most_seconds,
            bench: bench.transpose()?,
            limits,
            first: Vec::new(),
            seconds: 0.0,
        };
        let nothing = acquisition::nothing(&begun.task);
        let (first, seconds) = timed(|| begun.further(&nothing));
        self.seconds += seconds;
        begun.seconds = seconds;
        match first {
            Ok(poses) => begun.first = poses.unwrap_or_default(),
            Err(reason) => return Ok(Err(reason)),
        }
        Ok(Ok(begun))
    }
}

impl Acquisition<'_> {
    fn schedule(&self, poses: Vec<Pose>) -> Arc<Schedule> {
        let label = self.planner.label();
        Arc::new(acquisition::scheduled(&self.task, label, poses))
    }

    fn further(&self, so_far: &Measurement) -> Result<Option<Vec<Pose>>, NoRoute> {
        let machine = self.bench.as_ref().filter(|_| self.limits);
        let task = Task {
            machine: machine.map(|(bench, _)| bench.machine()),
            ..self.task.clone()
        };
        Ok(acquisition::further(self.planner, &task, so_far)?)
    }

    /// The poses that a BRDF leads to, and the tour through them.
    pub fn route(&self, brdf: &dyn Brdf) -> Result<Route, NoRoute> {
        let (found, seconds) = timed(|| match &self.bench {
            None => self.without_machine(brdf).map(|schedule| (schedule, None)),
            Some((bench, order)) => self.on_machine(brdf, bench, *order),
        });
        let (schedule, itinerary) = found?;
        let tour = self.bench.as_ref().zip(itinerary);
        Ok(Route {
            budget: match self.most_seconds < f64::INFINITY {
                true => schedule.poses.len(),
                false => self.task.budget,
            },
            schedule,
            tour: tour.map(|((bench, _), itinerary)| Tour {
                bench: Arc::clone(bench),
                itinerary: Arc::new(itinerary),
            }),
            whole: None,
            seconds: self.seconds + seconds,
            is_new: false,
        })
    }

    fn without_machine(&self, brdf: &dyn Brdf) -> Result<Arc<Schedule>, NoRoute> {
        let mut so_far = Ideal.measure(brdf, &self.schedule(self.first.clone()));
        while let Some(poses) = self.further(&so_far)? {
            so_far = Ideal.measure(brdf, &self.schedule(poses));
        }
        Ok(so_far.schedule)
    }

    fn on_machine(
        &self,
        brdf: &dyn Brdf,
        bench: &Bench,
        order: Order,
    ) -> Result<(Arc<Schedule>, Option<Itinerary>), NoRoute> {
        let mut so_far = acquisition::nothing(&self.task);
        let mut itinerary = bench.plan_of(&so_far.schedule, &[], order);
        let mut poses = self.first.clone();
        loop {
            let before = so_far.schedule.poses.len();
            let all = self.schedule(poses.clone());
            let with = |n: usize| {
                let numbers: Vec<u32> = (before as u32..(before + n) as u32).collect();
                bench.plan_further(&all, itinerary.clone(), &numbers, order)
            };
            let (kept, extended) = self.in_time(poses.len() - before, with);
            if kept == 0 {
                break;
            }
            poses.truncate(before + kept);
            let schedule = self.schedule(poses);
            let fresh = Itinerary {
                visits: extended.visits[itinerary.visits.len()..].to_vec(),
                ..extended.clone()
            };
            let session = bench.session(&fresh, self.task.seed);
            let taken = session.measure(brdf, &schedule);
            so_far = taken.after(&so_far);
            itinerary = extended;
            let is_last = before + kept < all.poses.len();
            match self.further(&so_far)?.filter(|_| !is_last) {
                Some(further) => poses = further,
                None => break,
            }
        }
        match so_far.schedule.poses.is_empty() {
            true => Err(NoRoute::TooFew(Allowance::Minutes(
                self.most_seconds / 60.0,
            ))),
            false => Ok((so_far.schedule, Some(itinerary))),
        }
    }

    /// The largest number of poses, up to `most`, whose itinerary ends in time, and that itinerary.
    fn in_time(&self, most: usize, with: impl Fn(usize) -> Itinerary) -> (usize, Itinerary) {
        let (mut fits, mut exceeds) = (0, most + 1);
        let mut best = with(most);
        if best.seconds() <= self.most_seconds {
            return (most, best);
        }
        exceeds -= 1;
        while exceeds - fits > 1 {
            let half = fits + (exceeds - fits) / 2;
            let tried = with(half);
            match tried.seconds() <= self.most_seconds {
                true => (fits, best) = (half, tried),
                false => exceeds = half,
            }
        }
        (fits, best)
    }
}
