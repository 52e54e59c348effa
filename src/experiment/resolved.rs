//! A config with every default filled in, for `config.toml` and the manifest: whoever reads it in
//! ten years need not know what the defaults were.

use super::config::Written;
use super::instruments::PlannedInstrument;
use super::materials::insert_materials;
use super::plan::Plan;
use super::tables::{insert_list, section, with_name};
use toml::Table;

impl Plan {
    /// The config of a self.
    pub(super) fn resolved(&self, written: Written<'_>) -> Table {
        let mut table = written.scalars;
        insert_materials(&mut table, &self.materials, written.materials);
        let parametrizations = self.parametrizations.iter().map(|c| c.spec.resolved());
        insert_list(&mut table, "parametrization", parametrizations);
        let sets = self.sample_sets.iter();
        let sets = sets.map(|s| with_name(s.set.resolved(), &s.name));
        insert_list(&mut table, "sample_set", sets);
        let methods = written.reconstructions.iter().enumerate();
        let methods = methods.map(|(i, (name, m))| {
            let mut t = with_name(m.resolved(), name);
            t.extend(written.reach.get(i).map(section).unwrap_or_default());
            t
        });
        insert_list(&mut table, "reconstruction", methods);
        let coordinates = written.coordinates.iter().map(section);
        insert_list(&mut table, "coordinates", coordinates);
        let instruments = self.instruments.iter().map(PlannedInstrument::resolved);
        insert_list(&mut table, "instrument", instruments);
        table.insert("metrics".into(), section(&self.metrics).into());
        let mut tunings = self.sample_sets.iter().filter_map(|s| s.tuning.as_ref());
        if let Some(tuning) = tunings.next() {
            table.insert("tuning".into(), tuning.resolved.clone().into());
        }
        if let Some(moments) = &self.moments {
            table.insert("moments".into(), moments.resolved().into());
        }
        table.insert("band".into(), self.band.into());
        table.insert("report".into(), section(&self.report).into());
        table.insert("pictures".into(), self.pictures.resolved().into());
        table.insert("output".into(), section(&self.output).into());
        table
    }
}
