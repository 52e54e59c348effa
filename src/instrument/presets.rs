//! The instruments that come with the program, and reading of instrument files.

use super::spec::InstrumentSpec;
use crate::registry::{self, ReadError, Table};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// An instrument that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Its name.
    pub name: &'static str,
    /// Text of its file, TOML.
    pub text: &'static str,
}

/// Every instrument that comes with the program: one of each kinematic class that reads a pair at a stop, and both that take pictures.
pub fn presets() -> Vec<Preset> {
    let files = [
        (
            "cornell",
            include_str!("../../configs/instruments/cornell.toml"),
        ),
        ("pgii", include_str!("../../configs/instruments/pgii.toml")),
        ("utia", include_str!("../../configs/instruments/utia.toml")),
        ("rosi", include_str!("../../configs/instruments/rosi.toml")),
        (
            "sphere-camera",
            include_str!("../../configs/instruments/sphere-camera.toml"),
        ),
        (
            "mirror-camera",
            include_str!("../../configs/instruments/mirror-camera.toml"),
        ),
    ];
    files.map(|(name, text)| Preset { name, text }).into()
}

/// Names of the axes of every preset, each once.
pub fn axis_names() -> Vec<String> {
    let specs = presets().into_iter().filter_map(|p| read(p.text).ok());
    let mut names: Vec<String> = specs.flat_map(|s| s.axis).map(|a| a.name).collect();
    names.sort();
    names.dedup();
    names
}

/// Reads and checks the text of an instrument file.
///
/// # Errors
/// As [`read_table`]; also if the text is no TOML.
pub fn read(text: &str) -> Result<InstrumentSpec, ReadError> {
    read_table(DeTable::parse(text)?)
}

/// Reads and checks an instrument.
///
/// # Errors
/// Names the key, its value and what is allowed. The place is the value's; where a default is
/// wrong or a key missing, that of the innermost table that is written.
pub fn read_table(table: Table<'_>) -> Result<InstrumentSpec, ReadError> {
    let spec: InstrumentSpec = registry::parse(table.clone())?;
    match spec.check() {
        Ok(()) => Ok(spec),
        Err(e) => Err(ReadError {
            span: place(&table, &e.key),
            message: e.to_string(),
        }),
    }
}

/// Range in the text of a path like `axis[1].min_deg`, or of its innermost table that is written.
fn place(root: &Table<'_>, path: &str) -> Option<Range<usize>> {
    let mut table = root.get_ref();
    let mut span = None;
    for step in path.split('.') {
        let (key, index) = match step.split_once('[') {
            Some((key, index)) => (key, index.trim_end_matches(']').parse().ok()),
            None => (step, None::<usize>),
        };
        let Some((written, mut value)) = table.get_key_value(key) else {
            return span;
        };
        // Of a table its header; its body may begin elsewhere.
        span = Some(match value.get_ref() {
            DeValue::Table(_) => written.span(),
            _ => value.span(),
        });
        if let (Some(index), DeValue::Array(items)) = (index, value.get_ref()) {
            let Some(item) = items.get(index) else {
                return span;
            };
            span = Some(item.span());
            value = item;
        }
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => return span,
        }
    }
    span
}
