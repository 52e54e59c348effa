//! One reconstruction of one material, for pictures.

use super::choices::{Allowance, Material, Method, are_named};
use super::counts::{Stage, Work};
use super::observer::{ScheduleKey, Stop};
use super::plan::Plan;
use super::readings::Readings;
use super::route::Router;
use crate::brdf::Brdf;
use crate::error::Error;

/// A reconstruction that is drawn.
pub(crate) struct Preview {
    /// The reconstruction.
    pub brdf: Box<dyn Brdf>,
    /// Name of the method.
    pub method: String,
}

/// A material reconstructed from readings by the plan's first instrument, of the pictures' budget and uniform in the coordinates
/// at a position of the plan, by the last reconstruction that works in a schedule's own coordinates; `None` where there is none.
/// `router` keeps the schedules for other materials, and counts what is made.
pub(crate) fn preview(
    plan: &Plan,
    material: &Material,
    brdf: &dyn Brdf,
    coordinates: usize,
    router: &mut Router,
) -> Result<Option<Preview>, Error> {
    let suits = |set: usize| {
        let planned = &plan.sample_sets[set];
        let works =
            |m: &&Method| plan.suits(m, set, Some(coordinates)) && !are_named(&m.coordinates);
        let method = plan.methods.iter().rfind(works)?;
        (!planned.learns() && !planned.set.is_unguided()).then_some((set, method))
    };
    let Some((set, method)) = (0..plan.sample_sets.len()).find_map(suits) else {
        return Ok(None);
    };
    let seed = plan.seeds[0];
    let key = ScheduleKey {
        coordinates: &plan.parametrizations[coordinates],
        symmetry: material.symmetry,
        sample_set: &plan.sample_sets[set],
        allowance: Allowance::Poses(plan.pictures.budget),
        instrument: plan.instruments.first(),
        seed,
        material: None,
    };
    let route = match router.find(&key, true) {
        Ok(route) => route,
        // Too few poses for a schedule, or none that the instrument can take.
        Err(Error::Config { .. } | Error::Infeasible { .. }) => return Ok(None),
        Err(e) => return Err(e),
    };
    let readings = match Readings::take(brdf, &route, seed, &|| Ok(())) {
        Ok(readings) => readings,
        Err(Stop::Error(e)) => return Err(e),
        Err(Stop::Cancelled | Stop::Failed(_)) => return Ok(None),
    };
    let counters = &router.counters;
    readings.count(counters);
    let made = method.method.reconstruct(&readings.measured).ok();
    let interpolants = usize::from(made.is_some());
    counters.add(Stage::Reconstruct, Work::Reconstructions, interpolants);
    Ok(made.map(|brdf| Preview {
        brdf,
        method: method.name.clone(),
    }))
}
