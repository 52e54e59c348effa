//! Planning: from a schedule to an itinerary.

use super::super::machine::Machine;
use super::super::spec::InstrumentSpec;
use super::super::tour::Order;
use super::{AxisMotion, Motion, Stop, Travel};
use crate::schedule::{Itinerary, MAX_AXES, Positions, Schedule, Unreachable};
use rayon::prelude::*;

/// Name of the order of a path that the caller gave.
const GIVEN: &str = "given";

/// Positions of the machine for these poses, and the unreachable poses with their reasons.
fn placed(
    machine: &Machine,
    schedule: &Schedule,
    poses: &[u32],
) -> (Vec<Stop>, Vec<(u32, Unreachable)>) {
    let turn_freely = schedule.parametrization.symmetry().isotropic;
    let place = |&n: &u32| machine.place(&schedule.poses[n as usize].pair, turn_freely);
    let placed: Vec<Result<Positions, Unreachable>> = poses.par_iter().map(place).collect();
    let mut stops = Vec::with_capacity(placed.len());
    let mut unreachable = Vec::new();
    for (&number, placed) in poses.iter().zip(placed) {
        match placed {
            Ok(positions) => stops.push((number, positions)),
            Err(reason) => unreachable.push((number, reason)),
        }
    }
    (stops, unreachable)
}

fn names(machine: &Machine) -> Vec<String> {
    machine.axes().iter().map(|a| a.name.clone()).collect()
}

impl Motion {
    /// The motion of an instrument.
    pub fn new(spec: &InstrumentSpec, machine: &Machine) -> Self {
        let mut rest = [0.0; MAX_AXES];
        let mut axes = Vec::with_capacity(MAX_AXES);
        for (axis, rest) in machine.axes().iter().zip(&mut rest) {
            *rest = 0.0_f64.max(axis.range[0]).min(axis.range[1]);
            axes.push(AxisMotion {
                speed: axis.speed,
                acceleration: axis.acceleration,
                wraps: axis.wraps,
            });
        }
        let travel = Travel::new(&axes);
        Self::of_parts(
            travel,
            rest,
            &spec.timing,
            &spec.detector,
            &spec.calibration,
        )
    }

    /// Places every pose of a schedule, puts those that can be reached in order, and times them.
    /// A pose may be turned about the normal if the schedule takes the material to be isotropic.
    pub fn itinerary(
        &self,
        machine: &Machine,
        instrument: &str,
        schedule: &Schedule,
        order: Order,
    ) -> Itinerary {
        let all: Vec<u32> = (0..schedule.poses.len() as u32).collect();
        self.itinerary_of(machine, instrument, schedule, &all, order)
    }

    /// [`itinerary`](Self::itinerary) of the poses with these numbers.
    pub fn itinerary_of(
        &self,
        machine: &Machine,
        instrument: &str,
        schedule: &Schedule,
        poses: &[u32],
        order: Order,
    ) -> Itinerary {
        let none = Itinerary {
            instrument: instrument.to_owned(),
            axes: names(machine),
            order: order.name(),
            visits: Vec::new(),
            unreachable: Vec::new(),
        };
        self.further(machine, schedule, none, poses, order)
    }

    /// An itinerary that goes on, after its last visit, to the poses with these numbers, put in order.
    pub fn further(
        &self,
        machine: &Machine,
        schedule: &Schedule,
        before: Itinerary,
        poses: &[u32],
        order: Order,
    ) -> Itinerary {
        let (stops, mut unreachable) = placed(machine, schedule, poses);
        let positions: Vec<Positions> = stops.iter().map(|s| s.1).collect();
        let here = before
            .visits
            .last()
            .map_or(self.rest, |last| last.positions);
        let tour = order.tour(&self.travel, &here, &positions);
        let stops: Vec<Stop> = tour.into_iter().map(|i| stops[i as usize]).collect();
        unreachable.splice(0..0, before.unreachable);
        Itinerary {
            visits: self.timed(schedule, before.visits, &stops),
            unreachable,
            ..before
        }
    }

    /// [`itinerary`](Self::itinerary) of the poses with these numbers, in this order.
    pub fn given(
        &self,
        machine: &Machine,
        instrument: &str,
        schedule: &Schedule,
        poses: &[u32],
    ) -> Itinerary {
        let (stops, unreachable) = placed(machine, schedule, poses);
        Itinerary {
            instrument: instrument.to_owned(),
            axes: names(machine),
            order: GIVEN,
            visits: self.timed(schedule, Vec::new(), &stops),
            unreachable,
        }
    }
}
