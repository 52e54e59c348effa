//! Planning: from a schedule to an itinerary.

use super::Bench;
use crate::instrument::motion::Stop;
use crate::instrument::tour::Order;
use crate::schedule::{Itinerary, Positions, Schedule, Unreachable};
use rayon::prelude::*;

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
        let (stops, mut unreachable) = self.placed(schedule, poses);
        let positions: Vec<Positions> = stops.iter().map(|s| s.1).collect();
        let here = before.visits.last().map(|last| last.positions);
        let here = here.unwrap_or(*self.motion.rest());
        let tour = order.tour(self.motion.travel(), &here, &positions);
        let stops: Vec<Stop> = tour.into_iter().map(|i| stops[i as usize]).collect();
        unreachable.splice(0..0, before.unreachable);
        Itinerary {
            visits: self.motion.timed(schedule, before.visits, &stops),
            unreachable,
            ..before
        }
    }

    /// [`plan`](Self::plan) for the poses with these numbers, in this order.
    pub fn plan_given(&self, schedule: &Schedule, poses: &[u32]) -> Itinerary {
        let (stops, unreachable) = self.placed(schedule, poses);
        Itinerary {
            visits: self.motion.timed(schedule, Vec::new(), &stops),
            unreachable,
            ..self.unvisited("given")
        }
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
