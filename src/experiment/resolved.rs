//! A config with every default filled in, for `config.toml` and the manifest: whoever reads it in
//! ten years need not know what the defaults were.

use super::choices::{Coordinates as SampledIn, Material, PlannedSet};
use super::config::{Config, Output, Reach, Scalars};
use super::instruments::PlannedInstrument;
use super::materials::insert_materials;
use super::moments::MomentsTable;
use super::pictures::PictureSpec;
use super::question::ReportSpec;
use super::tables::{insert_list, section, with_name};
use super::tuning::Tuning;
use crate::metrics::MetricsSpec;
use crate::reconstruct::{Coordinates, Reconstruct};
use std::sync::Arc;
use toml::Table;

/// The checked parts of a plan whose tables are written out again; all other keys are scalars.
pub(super) struct Parts<'p> {
    pub materials: &'p [Material],
    pub parametrizations: &'p [SampledIn],
    pub sample_sets: &'p [PlannedSet],
    pub reconstructions: &'p [(String, Arc<dyn Reconstruct>)],
    pub reach: &'p [Reach],
    pub coordinates: &'p [Coordinates],
    pub instruments: &'p [PlannedInstrument],
    pub metrics: &'p MetricsSpec,
    pub tuning: Option<&'p Tuning>,
    pub moments: Option<&'p MomentsTable>,
    pub band: f64,
    pub report: &'p ReportSpec,
    pub pictures: &'p PictureSpec,
    pub output: Output,
}

/// The scalars of a config, and how many of its materials were written out.
pub(super) struct Resolver {
    scalars: Scalars,
    written: usize,
}

impl Resolver {
    pub(super) fn new(config: &Config<'_>) -> Self {
        Self {
            scalars: config.scalars.clone(),
            written: config.materials.len(),
        }
    }

    /// The resolved config of these parts.
    pub(super) fn finish(&self, parts: &Parts<'_>) -> Table {
        let mut table = section(&self.scalars);
        insert_materials(&mut table, parts.materials, self.written);
        let parametrizations = parts.parametrizations.iter().map(|c| c.spec.resolved());
        insert_list(&mut table, "parametrization", parametrizations);
        let sets = parts.sample_sets.iter();
        insert_list(
            &mut table,
            "sample_set",
            sets.map(|s| with_name(s.set.resolved(), &s.name)),
        );
        let methods = parts
            .reconstructions
            .iter()
            .enumerate()
            .map(|(i, (name, m))| {
                let mut t = with_name(m.resolved(), name);
                t.extend(parts.reach.get(i).map(section).unwrap_or_default());
                t
            });
        insert_list(&mut table, "reconstruction", methods);
        let coordinates = parts.coordinates.iter().map(section);
        insert_list(&mut table, "coordinates", coordinates);
        let instruments = parts.instruments.iter().map(PlannedInstrument::resolved);
        insert_list(&mut table, "instrument", instruments);
        table.insert("metrics".into(), section(parts.metrics).into());
        if let Some(tuning) = parts.tuning {
            table.insert("tuning".into(), tuning.resolved.clone().into());
        }
        if let Some(moments) = parts.moments {
            table.insert("moments".into(), moments.resolved().into());
        }
        table.insert("band".into(), parts.band.into());
        table.insert("report".into(), section(parts.report).into());
        table.insert("pictures".into(), parts.pictures.resolved().into());
        table.insert("output".into(), section(&parts.output).into());
        table
    }
}
