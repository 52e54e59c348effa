//! What a study would do, without doing it.

use super::key::{self, Identity};
use super::plan::{Shard, StudyMethod, StudyPlan};
use super::row::RowKey;
use super::run::{describe, schedule_key};
use crate::error::Error;

/// A reconstruction of a material, for lists.
#[derive(Clone, Debug)]
pub struct StudyJob {
    /// Material, schedule and reconstruction.
    pub name: String,
    /// One a measure.
    pub keys: Vec<RowKey>,
}

/// Every job of a study or of a part of it, in the order of results. Reads the files of materials.
///
/// # Errors
/// [`Error::Data`] if a file cannot be read.
pub fn jobs(plan: &StudyPlan, shard: Option<Shard>) -> Result<Vec<StudyJob>, Error> {
    let units = plan.shard(shard);
    let common = &plan.plan;
    let mut jobs = Vec::new();
    for material in &common.materials {
        let identity = Identity::of(material).map_err(|e| Error::data(&material.name, e))?;
        for unit in &units {
            let text = describe(&schedule_key(plan, unit, material.symmetry));
            for method in plan.methods_on(unit) {
                let hash = key::of_job(plan, unit, method);
                let measures = common.measures.iter();
                let StudyMethod {
                    name, coordinates, ..
                } = &plan.methods[method];
                jobs.push(StudyJob {
                    name: format!("{}, {text}, {name} in {coordinates}", material.name),
                    keys: measures
                        .map(|&m| key::of_row(&identity.key, &hash, m))
                        .collect(),
                });
            }
        }
    }
    Ok(jobs)
}
