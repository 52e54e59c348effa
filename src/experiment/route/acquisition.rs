//! Routes of planners that learn: each material has its own.

use super::super::choices::Allowance;
use super::super::counts::{Spent, Stage, timed};
use super::super::observer::{GoOn, ScheduleKey, Stop};
use super::{Route, Router, SetKey, Tour, too_few};
use crate::acquisition::{self, Planner, Task};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::instrument::{Bench, Instrument, Order};
use crate::parametrization::Parametrization;
use crate::schedule::{Itinerary, Pose, Schedule};
use std::sync::Arc;
use std::time::Instant;

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
        go_on: GoOn<'_>,
    ) -> Result<Acquisition<'a>, Stop> {
        let planner = &*key.sample_set.set;
        let form = key.coordinates.checked_form(key.symmetry)?;
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
        let (first, seconds) = self.counters.timed(Stage::Plan, || {
            let goes_on = || go_on().is_ok();
            let task = begun.task(&goes_on, None);
            acquisition::further(planner, &task, &acquisition::nothing(&task))
        });
        go_on()?;
        begun.seconds = seconds;
        let set = SetKey::new(key);
        self.courses.retain(|(of, ..), _| *of == set);
        begun.first = first.map_err(Stop::failed)?.unwrap_or_default();
        Ok(begun)
    }

    /// How far the acquisition of a material by this key went.
    pub(crate) fn course(&mut self, key: &ScheduleKey<'_>, material: &str) -> &mut Course {
        let of = (SetKey::new(key), material.to_owned(), key.seed);
        self.courses.entry(of).or_default()
    }
}

/// How far an acquisition of a material went, without a machine. A larger budget goes on from there.
#[derive(Default)]
pub(crate) struct Course {
    poses: Vec<Pose>,
    /// After each batch that was no smaller for the budget: number of poses, and wall time of choosing them, s.
    batches: Vec<(usize, f64)>,
}

/// Poses in the order of their choice and, of an instrument, its way through them.
type Way = (Arc<Schedule>, Option<Itinerary>);

impl Acquisition<'_> {
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
    pub(crate) fn route(
        &self,
        brdf: &dyn Brdf,
        course: &mut Course,
        go_on: GoOn<'_>,
    ) -> Result<Route, Stop> {
        let mut before = 0.0;
        let (found, seconds) = timed(|| match &self.bench {
            None => self.without_machine(brdf, (course, &mut before), go_on),
            Some((bench, order, _)) => self.on_machine(brdf, (bench, *order), go_on),
        });
        go_on()?;
        let (schedule, itinerary) = found?;
        let tour = self.bench.as_ref().zip(itinerary);
        Ok(Route {
            budget: self.allowance.count().unwrap_or(schedule.poses.len()),
            schedule,
            tour: tour.map(|((bench, ..), itinerary)| Tour {
                bench: Arc::clone(bench),
                itinerary: Arc::new(itinerary),
            }),
            whole: None,
            spent: Spent::once(self.seconds + before + seconds),
            is_new: true,
        })
    }

    /// Goes on from where a smaller budget broke off; `before` is set to the wall time up to there.
    fn without_machine(
        &self,
        brdf: &dyn Brdf,
        (course, before): (&mut Course, &mut f64),
        go_on: GoOn<'_>,
    ) -> Result<Way, Stop> {
        let goes_on = || go_on().is_ok();
        let task = self.task(&goes_on, Some(brdf));
        let within = course.batches.iter().rev().find(|(n, _)| *n <= self.budget);
        let known = match within {
            Some(&(n, seconds)) => {
                *before = seconds;
                course.poses[..n].to_vec()
            }
            None => self.first.clone(),
        };
        let (before, start) = (*before, Instant::now());
        let (mut asked, mut batches) = (0, Vec::new());
        let mut count_batch = |n: usize| {
            // Those of a course end whole batches.
            let batch = self.planner.batch(asked, usize::MAX, false);
            let whole = batch.map(|batch| asked + batch);
            if within.is_some() && asked == 0 || whole == Some(n) {
                batches.push((n, before + start.elapsed().as_secs_f64()));
            }
            asked = n;
        };
        let taken = acquisition::acquire_from(self.planner, &task, brdf, known, &mut count_batch);
        let taken = taken.map_err(Stop::failed)?;
        let poses = &taken.schedule.poses;
        if self.planner.nests() && goes_on() && poses.len() > course.poses.len() {
            let last = course.batches.last().map_or(0, |batch| batch.0);
            let further = batches.into_iter().filter(|batch| batch.0 > last);
            course.batches.extend(further);
            course.poses.clone_from(poses);
        }
        Ok((taken.schedule, None))
    }

    fn on_machine(
        &self,
        brdf: &dyn Brdf,
        (bench, order): (&Bench, Order),
        go_on: GoOn<'_>,
    ) -> Result<Way, Stop> {
        let goes_on = || go_on().is_ok();
        let task = self.task(&goes_on, Some(brdf));
        let schedule = |poses| Arc::new(acquisition::scheduled(&task, self.planner, poses));
        let mut so_far = acquisition::nothing(&task);
        let mut itinerary = bench.plan_of(&so_far.schedule, &[], order);
        let mut poses = self.first.clone();
        while goes_on() {
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
            match acquisition::further(self.planner, &task, &so_far).map_err(Stop::failed)? {
                Some(further) => poses = further,
                None => break,
            }
        }
        match so_far.schedule.poses.is_empty() {
            true => Err(Stop::Failed(too_few(self.allowance))),
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
