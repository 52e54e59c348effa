//! `[tuning]`: the materials that ratios of grids are tuned on, none of which is tested.

use super::choices::Material;
use super::key::{self, Part};
use super::materials::{MaterialTable, material, written_out};
use super::source::Source;
use super::tables::{insert_list, section, take_list};
use super::tuning::{Memory, Tuning, suits_folding};
use crate::brdf::Channels;
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::metrics::{self, Measure, MetricsSpec};
use crate::reconstruct::Reconstruct;
use crate::registry::{self, ReadError, Table, keys};
use std::sync::Arc;

keys! {
    /// The keys of `[tuning]` that are no materials.
    #[derive(PartialEq)]
    pub struct TuningKeys {
        /// Distribution of the pairs at which reconstructions are compared with the truth.
        measure: Measure = Measure::Lobe;
        /// Number of these pairs.
        pairs: usize = 4000;
    }
}

/// `[tuning]` of a config.
#[derive(Debug)]
pub struct TuningTable {
    keys: TuningKeys,
    materials: Vec<MaterialTable>,
}

impl TuningTable {
    pub(super) fn read(mut table: Table<'_>) -> Result<Self, ReadError> {
        let materials = take_list(&mut table, "materials", material)?;
        Ok(Self {
            keys: registry::parse(table)?,
            materials: materials.unwrap_or_default(),
        })
    }

    /// Hashes the training materials; refuses one that is tested too, and a tested symmetry that none has.
    pub(super) fn plan(
        self,
        source: &Source,
        tested: &[Material],
        metrics: &MetricsSpec,
        method: Arc<dyn Reconstruct>,
    ) -> Result<Tuning, Error> {
        let Self { keys, materials } = self;
        let at = source.place("tuning");
        let metrics = MetricsSpec {
            pairs: keys.pairs,
            ..metrics.clone()
        };
        let pairs = metrics::test_pairs(keys.measure, &metrics)
            .map_err(|e| at.key("pairs").error(format!("{at}.{e}")))?;
        let at = at.key("materials");
        let mut part = Part::new();
        for text in [section(&keys).to_string(), section(&metrics).to_string()] {
            part.feed(&text);
        }
        part.feed_member(method.resolved(), method.prior());
        let contents: Result<Vec<_>, _> = tested.iter().map(key::content).collect();
        let contents = contents?;
        let mut training = Vec::new();
        for (i, table) in materials.into_iter().enumerate() {
            let at = at.index(i);
            let material = table.checked(&at, &Channels::Luminance)?;
            let content = key::content(&material)?;
            if let Some(place) = contents.iter().position(|c| *c == content) {
                let predicate = format!(
                    "= {:?} is the tested material {:?}; allowed: materials that are not tested",
                    material.name, tested[place].name
                );
                return Err(at.problem(predicate));
            }
            part.feed(&key::pathless(&*material.spec).to_string());
            part.feed(&content);
            part.feed(&section(&material.symmetry).to_string());
            training.push(material);
        }
        let own: Vec<Symmetry> = training.iter().map(|t| t.symmetry).collect();
        let suits = |m: &Material| own.iter().any(|own| suits_folding(*own, m.symmetry));
        if let Some(Material { name, .. }) = tested.iter().find(|m| !suits(m)) {
            return Err(at.problem(format_args!(
                "has none with the symmetries of {name:?}; allowed: at least one"
            )));
        }
        let mut resolved = section(&keys);
        insert_list(&mut resolved, "materials", training.iter().map(written_out));
        Ok(Tuning {
            resolved,
            materials: training,
            method,
            pairs,
            key: part.finish().to_hex().to_string(),
            memory: Memory::default(),
        })
    }
}
