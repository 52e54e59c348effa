//! One reconstruction of one material, for pictures.

use super::plan::{OWN, StudyPlan};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::plan::Material;
use crate::instrument::{Ideal, Instrument};
use std::sync::Arc;

/// A reconstruction that is drawn.
pub struct Sketch {
    /// The reconstruction.
    pub brdf: Box<dyn Brdf>,
    /// Name of the method.
    pub method: String,
}

/// A material reconstructed from the readings of the pictures' budget, uniform in the coordinates
/// at a position of the plan, by the last reconstruction that works in a schedule's own coordinates.
/// `None` where there is no such reconstruction or schedule.
///
/// # Errors
/// [`Error::Internal`] for coordinates that were checked.
pub fn sketch(
    plan: &StudyPlan,
    material: &Material,
    brdf: &dyn Brdf,
    coordinates: usize,
) -> Result<Option<Sketch>, Error> {
    let common = &plan.plan;
    let suits = |set: usize| {
        let grid = common.sample_sets[set].set.is_grid();
        let mut methods = plan.methods.iter();
        let mut found = None;
        for m in methods.by_ref() {
            let here = m.on.is_none_or(|on| on == set) && (grid || !m.method.needs_grid());
            if here && m.coordinates == OWN {
                found = Some((set, m));
            }
        }
        found
    };
    let Some((set, method)) = (0..common.sample_sets.len()).find_map(suits) else {
        return Ok(None);
    };
    let form = common.parametrizations[coordinates].form(material.symmetry);
    let form = form.map_err(|e| Error::Internal(e.to_string()))?;
    let set = &common.sample_sets[set].set;
    let Ok(schedule) = set.plan(&form, plan.pictures.budget, common.seeds[0]) else {
        return Ok(None);
    };
    let measured = Ideal.measure(brdf, &Arc::new(schedule));
    let made = method.method.reconstruct(&measured).ok();
    Ok(made.map(|brdf| Sketch {
        brdf,
        method: method.name.clone(),
    }))
}
