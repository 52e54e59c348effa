//! One material after the other: the run of experiments whose records are of one material each.

use super::choices::Material;
use super::counts::Built;
use super::key::{Expected, Input, RowKey};
use super::observer::{ByProduct, EventSink, Observer, Stop, Summary};
use super::record::{Experiment, Extent, Head, Known, Record, Shard};
use crate::brdf::Channels;
use crate::error::Error;

/// An experiment whose records are of one material each, and need no other.
pub trait PerMaterial {
    type Record: Record;

    /// Data that all records of one material share, made once per material.
    type Shared;

    /// What it has in common with other experiments.
    fn head(&self) -> Head<'_>;

    /// The records of each material, in the order of results.
    fn records(&self) -> Vec<Expected>;

    /// Channels that materials are built for.
    fn channels(&self) -> Channels;

    /// Files beside those of the materials.
    fn inputs(&self) -> Vec<Input> {
        Vec::new()
    }

    /// The data that all records of a material share, or the reason why there are none.
    fn shared(
        &self,
        brdf: &Built,
        events: &mut EventSink<'_, Self::Record>,
    ) -> Result<Self::Shared, Stop>;

    /// The record at a position among those of the material, or why there is none.
    fn record(
        &self,
        place: usize,
        of: Of<'_, Self::Shared>,
        events: &mut EventSink<'_, Self::Record>,
    ) -> Result<Self::Record, Stop>;
}

/// Inputs of one record.
pub struct Of<'a, S> {
    pub material: &'a Material,
    pub material_key: &'a str,
    pub brdf: &'a Built,
    pub shared: &'a S,
    /// The key of the record.
    pub key: RowKey,
}

impl<E: PerMaterial> Experiment for E {
    type Record = <E as PerMaterial>::Record;

    fn head(&self) -> Head<'_> {
        PerMaterial::head(self)
    }

    fn of_each(&self, shard: Option<Shard>) -> (Shard, Vec<Expected>) {
        // Records of one material share what was made of it: materials are dealt out, not records.
        (shard.unwrap_or(Shard::WHOLE), self.records())
    }

    fn run(
        &self,
        extent: &Extent,
        known: &Known<<E as PerMaterial>::Record>,
        observer: &mut dyn Observer<<E as PerMaterial>::Record>,
    ) -> Result<Summary, Error> {
        let mut events = EventSink::new(observer);
        let result = materials(self, extent, known, &mut events);
        events.ended(result)
    }
}

/// Makes the records, material by material.
fn materials<E: PerMaterial>(
    plan: &E,
    extent: &Extent,
    known: &Known<<E as PerMaterial>::Record>,
    events: &mut EventSink<'_, <E as PerMaterial>::Record>,
) -> Result<(), Stop> {
    let expected = plan.expected(extent.shard);
    events.observer.begins(expected.len() as f64);
    events.summary.inputs.extend(plan.inputs());
    for (i, material) in PerMaterial::head(plan).materials.iter().enumerate() {
        let mine: Vec<&Expected> = expected.iter().filter(|e| e.material == i).collect();
        if mine.is_empty() {
            events.summary.materials.push(None);
            continue;
        }
        events.doing(&material.name)?;
        let Some(identity) = events.identified(material, mine.len())? else {
            events.advanced(mine.len() as f64)?;
            continue;
        };
        let keys: Vec<RowKey> = mine.iter().map(|e| e.key(&identity.key)).collect();
        events.summary.keys.extend_from_slice(&keys);
        let lacking = keys.iter().filter(|k| !known.contains_key(*k)).count();
        let wish = ByProduct::Material(i, material, &identity.key);
        let wanted = events.observer.requests(&wish);
        let brdf = match lacking > 0 || wanted {
            true => events.built(material, &identity, plan.channels(), lacking)?,
            false => None,
        };
        let shared = match &brdf {
            Some(brdf) if lacking > 0 => {
                let made = plan.shared(brdf, events);
                events.or_failed(made, [material.name.clone()], lacking)?
            }
            _ => None,
        };
        for (place, key) in keys.into_iter().enumerate() {
            if let Some(old) = known.get(&key) {
                events.complete(&[old.as_ref()])?;
            } else if let (Some(brdf), Some(shared)) = (&brdf, &shared) {
                let of = Of {
                    material,
                    material_key: &identity.key,
                    brdf,
                    shared,
                    key,
                };
                let made = plan.record(place, of, events);
                if let Some(record) = events.or_failed(made, [mine[place].job.clone()], 1)? {
                    events.made(std::slice::from_ref(&record))?;
                    events.complete(&[&record])?;
                }
            }
            events.advanced(1.0)?;
        }
        if let (true, Some(brdf)) = (wanted, &brdf) {
            events.loaded(material, &identity.key, brdf)?;
        }
    }
    Ok(())
}
