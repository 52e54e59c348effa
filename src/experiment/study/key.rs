//! What determines a row, as a hash: the same for the same question, whoever asks it.

use super::plan::{StudyPlan, Unit};
use super::row::RowKey;
use crate::experiment::plan::Material;
use crate::experiment::run::hash;
use crate::experiment::{Input, resolved};
use crate::metrics::Measure;

/// A material's part of the keys of its rows.
pub(super) struct Identity {
    /// The hash of its keys and of the bytes of its files.
    pub key: RowKey,
    /// Its files.
    pub inputs: Vec<Input>,
}

impl Identity {
    /// Reads the files of a material.
    pub fn of(material: &Material) -> Result<Self, String> {
        let inputs = hash(&material.spec.inputs())?;
        let mut hasher = blake3::Hasher::new();
        let mut resolved = material.spec.resolved();
        forget_paths(&mut resolved);
        feed(&mut hasher, &material.name);
        feed(&mut hasher, &resolved.to_string());
        let symmetry = resolved::section(&material.symmetry);
        feed(&mut hasher, &symmetry.to_string());
        for input in &inputs {
            feed(&mut hasher, &input.blake3);
        }
        Ok(Self {
            key: short(&hasher.finalize()),
            inputs,
        })
    }
}

/// Where a file is does not matter, what is in it does: also in a material that is part of another.
fn forget_paths(table: &mut toml::Table) {
    table.remove("path");
    for (_, value) in table.iter_mut() {
        match value {
            toml::Value::Table(inner) => forget_paths(inner),
            toml::Value::Array(list) => {
                let inner = list.iter_mut().filter_map(toml::Value::as_table_mut);
                inner.for_each(forget_paths);
            }
            _ => {}
        }
    }
}

/// 64 bits: two of a million share them with a probability of 3e-8.
fn short(hash: &blake3::Hash) -> String {
    hash.to_hex()[..16].to_owned()
}

/// Texts one after the other, so that no two lists of texts are fed alike.
fn feed(hasher: &mut blake3::Hasher, text: &str) {
    hasher.update(&(text.len() as u64).to_le_bytes());
    hasher.update(text.as_bytes());
}

/// Everything but the material and the measure, hashed.
pub(super) fn of_job(plan: &StudyPlan, unit: &Unit, method: usize) -> blake3::Hash {
    let common = &plan.plan;
    let mut hasher = blake3::Hasher::new();
    feed(&mut hasher, env!("CARGO_PKG_VERSION"));
    let coordinates = &common.parametrizations[unit.coordinates];
    feed(&mut hasher, &coordinates.label());
    let set = &common.sample_sets[unit.sample_set];
    feed(&mut hasher, &set.set.resolved().to_string());
    if let Some(instrument) = unit.instrument {
        let instrument = common.instruments[instrument].resolved();
        feed(&mut hasher, &instrument.to_string());
    }
    feed(&mut hasher, &unit.allowance.to_string());
    feed(&mut hasher, &unit.seed.to_string());
    let method = &plan.methods[method];
    feed(&mut hasher, &method.method.resolved().to_string());
    feed(&mut hasher, &method.name);
    feed(&mut hasher, &set.name);
    feed(&mut hasher, &resolved::section(&common.metrics).to_string());
    hasher.finalize()
}

/// The key of a row, from that of its material.
pub(super) fn of_row(material: &str, job: &blake3::Hash, measure: Measure) -> RowKey {
    let mut hasher = blake3::Hasher::new();
    feed(&mut hasher, material);
    hasher.update(job.as_bytes());
    feed(&mut hasher, measure.name());
    short(&hasher.finalize())
}
