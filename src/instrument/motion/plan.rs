//! From a schedule to an itinerary.

use super::super::machine::Machine;
use super::super::spec::InstrumentSpec;
use super::super::tour::Order;
use super::{AxisMotion, Motion, Stop, Travel};
use crate::schedule::{Itinerary, MAX_AXES, Positions, Schedule, Unreachable};
use rayon::prelude::*;

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
        let turn_freely = schedule.parametrization.symmetry().isotropic;
        let placed: Vec<Result<Positions, Unreachable>> = schedule
            .poses
            .par_iter()
            .map(|pose| machine.place(&pose.pair, turn_freely))
            .collect();
        let mut stops: Vec<Stop> = Vec::with_capacity(placed.len());
        let mut unreachable = Vec::new();
        for (number, placed) in (0..).zip(placed) {
            match placed {
                Ok(positions) => stops.push((number, positions)),
                Err(reason) => unreachable.push((number, reason)),
            }
        }
        let positions: Vec<Positions> = stops.iter().map(|s| s.1).collect();
        let tour = order.tour(&self.travel, &self.rest, &positions);
        let stops: Vec<Stop> = tour.into_iter().map(|i| stops[i as usize]).collect();
        Itinerary {
            instrument: instrument.to_owned(),
            axes: machine.axes().iter().map(|a| a.name.clone()).collect(),
            order: order.name(),
            visits: self.timed(schedule, &stops),
            unreachable,
        }
    }
}
