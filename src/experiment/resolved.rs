//! A config with every default filled in, for `config.toml` and the manifest: whoever reads it in
//! ten years need not know what the defaults were.

use super::config::{Config, Scalars};
use super::instruments::PlannedInstrument;
use super::plan::Plan;
use serde::Serialize;
use toml::{Table, Value};

/// What of a config the plan made of it no longer holds.
pub(super) struct Resolver {
    scalars: Scalars,
    written: usize,
    merl: bool,
}

impl Resolver {
    pub(super) fn new(config: &Config<'_>) -> Self {
        Self {
            scalars: config.scalars.clone(),
            written: config.materials.len(),
            merl: config.scalars.materials_dir.is_some(),
        }
    }

    /// The resolved config of a plan.
    pub(super) fn finish(&self, plan: &Plan) -> Table {
        let mut table = section(&self.scalars);
        let (written, files) = plan.materials.split_at(self.written);
        if let (true, Some(first)) = (self.merl, files.first()) {
            let mut keys = first.spec.resolved();
            keys.remove("kind");
            keys.remove("path");
            table.insert("merl".into(), keys.into());
        }
        let materials = written.iter().map(|m| {
            let mut t = named(m.spec.resolved(), &m.name);
            t.insert("symmetry".into(), section(&m.symmetry).into());
            t
        });
        insert_list(&mut table, "material", materials);
        let parametrizations = plan.parametrizations.iter().map(|c| {
            let mut t = Table::new();
            t.insert("kind".into(), c.name().into());
            if !c.warps.is_empty() {
                t.insert("warp".into(), section(&c.warps).into());
            }
            t
        });
        insert_list(&mut table, "parametrization", parametrizations);
        let sets = plan.sample_sets.iter();
        insert_list(
            &mut table,
            "sample_set",
            sets.map(|s| named(s.set.resolved(), &s.name)),
        );
        let methods = plan.reconstructions.iter();
        insert_list(
            &mut table,
            "reconstruction",
            methods.map(|m| named(m.method.resolved(), &m.name)),
        );
        let instruments = plan.instruments.iter().map(PlannedInstrument::resolved);
        insert_list(&mut table, "instrument", instruments);
        table.insert("metrics".into(), section(&plan.metrics).into());
        if let Some(moments) = &plan.moments {
            table.insert("moments".into(), moments.resolved().into());
        }
        table.insert("output".into(), section(&plan.output).into());
        table
    }
}

/// A struct of plain values as a table.
pub(super) fn section(value: &impl Serialize) -> Table {
    match Value::try_from(value) {
        Ok(Value::Table(table)) => table,
        // Structs of numbers, strings, lists and tables: serialization cannot fail on them.
        _ => Table::new(),
    }
}

pub(super) fn named(mut table: Table, name: &str) -> Table {
    table.insert("name".into(), name.into());
    table
}

pub(super) fn insert_list(table: &mut Table, key: &str, list: impl Iterator<Item = Table>) {
    let list: Vec<_> = list.map(Value::Table).collect();
    if !list.is_empty() {
        table.insert(key.into(), Value::Array(list));
    }
}
