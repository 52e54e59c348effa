//! What members of a plan know of other materials, none of which is tested.

use super::checks::{Place, each_once};
use super::choices::Material;
use super::key::{self, Input};
use crate::error::Error;
use crate::reconstruct::PriorFile;
use std::path::Path;

/// The files of priors, each once.
pub(super) fn inputs<'a>(priors: impl Iterator<Item = &'a PriorFile>) -> Vec<Input> {
    let files = priors.filter_map(PriorFile::file).map(Path::to_owned);
    key::hash(&each_once(files)).unwrap_or_default()
}

/// Refuses priors that cannot be read or were made of a tested material. Each comes with the place of its member.
pub(super) fn check<'a>(
    tested: &[Material],
    priors: impl Iterator<Item = (Place<'a>, Option<&'a PriorFile>)>,
) -> Result<(), Error> {
    let mut contents = Vec::new();
    for (place, prior) in priors.filter_map(|(place, prior)| Some((place, prior?))) {
        let at = place.key("prior");
        let known = prior.load();
        let known = known.map_err(|e| at.error(format!("{place}.{e}")))?;
        if contents.is_empty() {
            contents = tested.iter().map(key::content).collect::<Result<_, _>>()?;
        }
        for (material, content) in tested.iter().zip(&contents) {
            let found = known.materials().iter().find(|m| m.content == *content);
            if let Some(trained) = found {
                let predicate = format!(
                    "= {:?} was made of {:?}, which is the tested material {:?}; allowed: one that was made \
                     of others (gonio train --except {})",
                    prior.path(),
                    trained.name,
                    material.name,
                    trained.name
                );
                return Err(at.problem(predicate));
            }
        }
    }
    Ok(())
}
