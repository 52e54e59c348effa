//! Planning: from a schedule to an itinerary.

use super::Bench;
use crate::instrument::motion::{STILL, Stop};
use crate::instrument::tour::Order;
use crate::schedule::{Itinerary, MAX_AXES, Positions, Schedule, Unreachable, Visit};
use rayon::prelude::*;
use std::f64::consts::TAU;

impl Bench {
    /// Its visits to the poses of a schedule, with times in s, and the unreachable poses. A pose
    /// may be turned about the normal if the schedule takes the material to be isotropic. The
    /// errors of a realisation do not matter.
    pub fn plan(&self, schedule: &Schedule, order: Order) -> Itinerary {
        let all: Vec<u32> = (0..schedule.poses.len() as u32).collect();
        self.plan_of(schedule, &all, order)
    }

    /// [`plan`](Self::plan) for the poses with these numbers.
    pub fn plan_of(&self, schedule: &Schedule, poses: &[u32], order: Order) -> Itinerary {
        self.plan_further(schedule, self.unvisited(order.name()), poses, order)
    }

    /// An itinerary that goes on, where its last visit left axes and clock, to the poses with these numbers.
    pub fn plan_further(
        &self,
        schedule: &Schedule,
        before: Itinerary,
        poses: &[u32],
        order: Order,
    ) -> Itinerary {
        let (placed, mut unreachable) = self.placed(schedule, poses);
        let (stops, pictures) = self.stops(placed);
        let positions: Vec<Positions> = stops.iter().map(|s| s.1).collect();
        let here = self.motion.after(&before.visits);
        let tour = order.tour(self.motion.travel(), &here, &positions);
        let path: Vec<Stop> = tour.iter().map(|&i| stops[i as usize]).collect();
        unreachable.splice(0..0, before.unreachable);
        let seen = before.visits.len();
        let visits = self.motion.timed(schedule, before.visits, &path);
        let pictures = pictures
            .as_ref()
            .map(|all| tour.iter().map(|&i| &all[i as usize]).collect());
        Itinerary {
            visits: with_pictures(visits, seen, pictures),
            unreachable,
            ..before
        }
    }

    /// [`plan`](Self::plan) for the poses with these numbers, in this order.
    pub fn plan_given(&self, schedule: &Schedule, poses: &[u32]) -> Itinerary {
        let (placed, unreachable) = self.placed(schedule, poses);
        let (stops, pictures) = self.stops(placed);
        let visits = self.motion.timed(schedule, Vec::new(), &stops);
        let pictures = pictures.as_ref().map(|all| all.iter().collect());
        Itinerary {
            visits: with_pictures(visits, 0, pictures),
            unreachable,
            ..self.unvisited("given")
        }
    }

    /// The stops of placed poses, in the order of their first poses: of an instrument that takes pictures each with all poses
    /// of its picture, else the poses themselves.
    fn stops(&self, placed: Vec<Stop>) -> (Vec<Stop>, Option<Vec<Vec<Stop>>>) {
        let Some(camera) = self.machine.camera() else {
            return (placed, None);
        };
        let mut groups: Vec<Vec<usize>> = vec![(0..placed.len()).collect()];
        for axis in (0..MAX_AXES).filter(|&axis| !self.machine.is_imaged(axis)) {
            let at = |i: usize| placed[i].1[axis];
            let axis = self.machine.axes().get(axis);
            let wraps = axis.is_some_and(|axis| axis.motion.wraps);
            let cut = |group| runs(group, at, camera.same_stop + STILL, wraps);
            groups = groups.into_iter().flat_map(cut).collect();
        }
        groups.iter_mut().for_each(|group| group.sort_unstable());
        groups.sort_unstable();
        let first = |group: &Vec<usize>| {
            let (pose, positions) = placed[group[0]];
            (pose, self.machine.stop(&positions))
        };
        let stops: Vec<Stop> = groups.iter().map(first).collect();
        let pictures = groups.iter().zip(&stops).map(|(group, (_, stop))| {
            let pose = |&i: &usize| {
                let (pose, own) = placed[i];
                let imaged = |axis| match self.machine.is_imaged(axis) {
                    true => own[axis],
                    false => stop[axis],
                };
                (pose, std::array::from_fn(imaged))
            };
            group.iter().map(pose).collect()
        });
        let pictures = pictures.collect();
        (stops, Some(pictures))
    }

    /// An itinerary to no pose, by the name of an order.
    fn unvisited(&self, order: &str) -> Itinerary {
        let axes = self.machine.axes().iter();
        Itinerary {
            instrument: self.spec.name.clone(),
            axes: axes.map(|a| a.name.clone()).collect(),
            order: order.into(),
            visits: Vec::new(),
            unreachable: Vec::new(),
        }
    }

    /// Positions of the machine for these poses, and the unreachable poses with their reasons.
    fn placed(&self, schedule: &Schedule, poses: &[u32]) -> (Vec<Stop>, Vec<(u32, Unreachable)>) {
        let turn_freely = schedule.parametrization.symmetry().isotropic;
        let place = |&n: &u32| {
            let pair = &schedule.poses[n as usize].pair;
            self.machine.place(pair, turn_freely)
        };
        let placed: Vec<Result<Positions, Unreachable>> = poses.par_iter().map(place).collect();
        let (mut stops, mut unreachable) = (Vec::new(), Vec::new());
        for (&number, placed) in poses.iter().zip(placed) {
            match placed {
                Ok(positions) => stops.push((number, positions)),
                Err(reason) => unreachable.push((number, reason)),
            }
        }
        (stops, unreachable)
    }
}

/// Cuts a group into runs whose places differ by no more than `width`, in ascending order; of an axis that `wraps` by whole turns too.
fn runs(
    mut group: Vec<usize>,
    at: impl Fn(usize) -> f64,
    width: f64,
    wraps: bool,
) -> Vec<Vec<usize>> {
    group.sort_unstable_by(|&a, &b| at(a).total_cmp(&at(b)).then(a.cmp(&b)));
    let mut runs: Vec<Vec<usize>> = Vec::new();
    for i in group {
        match runs.last_mut() {
            Some(run) if at(i) - at(run[0]) <= width => run.push(i),
            _ => runs.push(vec![i]),
        }
    }
    if let [first, .., last] = &runs[..]
        && wraps
        && at(first[first.len() - 1]) + TAU - at(last[0]) <= width
    {
        let last = runs.pop().unwrap_or_default();
        runs[0].extend(last);
    }
    runs
}

/// The visits to stops, those from `seen` on with all poses of their pictures: the first of them takes the time.
fn with_pictures(
    mut visits: Vec<Visit>,
    seen: usize,
    pictures: Option<Vec<&Vec<Stop>>>,
) -> Vec<Visit> {
    let Some(pictures) = pictures else {
        return visits;
    };
    let stops = visits.split_off(seen);
    for (stop, picture) in stops.into_iter().zip(pictures) {
        let further = Visit {
            move_seconds: 0.0,
            exposure_seconds: 0.0,
            seconds: 0.0,
            ..stop
        };
        visits.extend(
            picture
                .iter()
                .enumerate()
                .map(|(i, &(pose, positions))| Visit {
                    pose,
                    positions,
                    ..if i == 0 { stop } else { further }
                }),
        );
    }
    visits
}
