//! Keys of configs from Python's keyword arguments and dictionaries, and the library's sentences.

use crate::errors::{of_keys, other_type, refused, renamed};
use crate::given::keys_of;
use crate::material::PyMaterial;
use gonio::Error;
use gonio::brdf::Channels;
use gonio::error::ParameterError;
use gonio::experiment::{MAX_BUDGET, Source};
use gonio::geometry::Symmetry;
use gonio::registry::{self, Entry};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::PathBuf;
use toml::{Table, Value};

/// Dictionaries in dictionaries, at most: as the reader of configs.
const DEEPEST: usize = 80;

/// A dictionary as keys; what is `None` is left out.
pub fn table(keys: Option<&Bound<'_, PyDict>>) -> PyResult<Table> {
    keys.map_or(Ok(Table::new()), |keys| nested(keys, 0))
}

fn nested(keys: &Bound<'_, PyDict>, depth: usize) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in keys {
        let key: String = key
            .extract()
            .map_err(|_| refused(format!("key {key} is no text; allowed: names of keys")))?;
        if !value.is_none() {
            let value = value_of(&key, &value, depth + 1)?;
            table.insert(key, value);
        }
    }
    Ok(table)
}

/// A value as a config has it. NumPy's arrays and numbers are what their `tolist` says.
fn value_of(key: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth > DEEPEST {
        return Err(refused(format!(
            "{key} is nested too deep; allowed: less than {DEEPEST} dictionaries and lists"
        )));
    }
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(value.extract()?));
    }
    if value.is_instance_of::<PyInt>() {
        let whole = value.extract::<i64>().map_err(|_| {
            refused(format!(
                "{key} = {value}: allowed is a whole number of 64 bits"
            ))
        });
        return Ok(Value::Integer(whole?));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(value.extract()?));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(Value::String(value.extract()?));
    }
    if let Ok(keys) = value.cast::<PyDict>() {
        return Ok(Value::Table(nested(keys, depth)?));
    }
    if let Ok(material) = value.cast::<PyMaterial>() {
        return Ok(Value::Table(keys_of(material.get())));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value
            .try_iter()?
            .map(|item| value_of(key, &item?, depth + 1));
        return Ok(Value::Array(items.collect::<PyResult<_>>()?));
    }
    if value.hasattr("tolist")? {
        return value_of(key, &value.call_method0("tolist")?, depth + 1);
    }
    if value.hasattr("__fspath__")? {
        let path: PathBuf = value.extract()?;
        return Ok(Value::String(path.to_string_lossy().into_owned()));
    }
    let kind = value.get_type().name()?;
    Err(refused(format!(
        "{key} is a {kind}; allowed: a number, a text, a path, a list, a dictionary or a gonio.Material"
    )))
}

/// Keys of a member of a family, its `kind` among them.
///
/// # Errors
/// If `kind` is among the keys too.
pub fn named(kind: &str, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Table> {
    let mut all = Table::from_iter([("kind".into(), kind.into())]);
    let keys = table(keys)?;
    if let Some(second) = keys.get("kind") {
        return Err(refused(format!(
            "kind = {second} beside \"{kind}\", which is the kind already; allowed: one of them"
        )));
    }
    all.extend(keys);
    Ok(all)
}

/// The text of keys. A line stands before them: that one is missing is no fault of the first.
pub fn source(what: &str, keys: &Table) -> Source {
    Source::new(what, format!("\n{keys}"))
}

/// The member of a family that these keys name, its `kind` by an argument.
pub fn read<T: ?Sized>(
    what: &str,
    argument: &str,
    family: &[Entry<T>],
    keys: Table,
) -> PyResult<Box<T>> {
    let source = source(what, &keys);
    let table = source.table().map_err(of_keys)?;
    let read = registry::read(what, family, table);
    let read = read.map_err(|e| of_keys(in_dictionary(&keys, source.error(e))));
    read.map_err(renamed("kind", argument))
}

/// A struct of keys.
pub fn parsed<S: DeserializeOwned>(what: &str, keys: Table) -> PyResult<S> {
    let source = source(what, &keys);
    let table = source.table().map_err(of_keys)?;
    registry::parse(table).map_err(|e| of_keys(in_dictionary(&keys, source.error(e))))
}

/// An error about keys, with the dictionary that they are in, which its line says, where the sentence does not begin with it.
fn in_dictionary(keys: &Table, e: Error) -> Error {
    let Error::Config { place, message } = e else {
        return e;
    };
    // A line stands before the keys.
    let line = place
        .rsplit_once(':')
        .and_then(|(_, line)| line.parse().ok());
    let text = keys.to_string();
    let lines = text
        .lines()
        .take(line.map_or(0, |line: usize| line.saturating_sub(1)));
    let header = lines
        .filter(|line| line.starts_with('[') && line.ends_with(']'))
        .last();
    let name = header.unwrap_or_default().trim_matches(['[', ']']);
    let first = name.split('.').next().unwrap_or_default();
    let path = message.strip_prefix("unknown key ").unwrap_or(&message);
    let message = match first.is_empty() || path.starts_with(first) {
        true => message,
        false => format!("{name}: {message}"),
    };
    Error::Config { place, message }
}

/// Symmetries from their names, joined by commas or in a list; `none` has none of them.
pub fn symmetry(value: &Bound<'_, PyAny>) -> PyResult<Symmetry> {
    let names: Vec<String> = match value.extract::<String>() {
        Ok(text) => text.split(',').map(|name| name.trim().to_owned()).collect(),
        Err(_) => value.extract().map_err(|_| {
            let allowed = "a text or a list of isotropic, reciprocal, bilateral, or none";
            other_type("symmetry", value, allowed)
        })?,
    };
    match names.as_slice() {
        [none] if none == "none" => Ok(Symmetry::NONE),
        names => Symmetry::named(names).map_err(refused),
    }
}

/// The key `channels` of a config.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelKeys {
    channels: Channels,
}

/// Channels: "luminance", "rgb", or wavelengths in nm.
pub fn channels(value: Option<&Bound<'_, PyAny>>) -> PyResult<Channels> {
    let Some(value) = value else {
        return Ok(Channels::Luminance);
    };
    let mut keys = Table::new();
    let channels = match value_of("channels", value, 0)? {
        nm @ Value::Array(_) => Value::Table(Table::from_iter([("wavelengths_nm".into(), nm)])),
        other => other,
    };
    keys.insert("channels".into(), channels);
    let read = parsed::<ChannelKeys>("channels", keys).map(|keys| keys.channels);
    let read = read.map_err(renamed("channels.wavelengths_nm", "channels"));
    read.map_err(renamed("wavelengths_nm", "channels"))
}

/// A whole number of an argument, from `least` to `most`.
fn whole(value: &Bound<'_, PyAny>, name: &str, least: u64, most: u64) -> PyResult<u64> {
    let number = value.extract::<u64>().ok();
    number
        .filter(|n| (least..=most).contains(n))
        .ok_or_else(|| {
            let allowed = format!("a whole number from {least} to {most}");
            refused(ParameterError::new(name, value, allowed))
        })
}

/// The argument `seed`.
pub fn seed(value: &Bound<'_, PyAny>) -> PyResult<u64> {
    whole(value, "seed", 0, u64::MAX)
}

/// The argument `budget`.
pub fn budget(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    Ok(whole(value, "budget", 1, MAX_BUDGET as u64)? as usize)
}

/// The argument `most`, a number of materials.
pub fn most(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    Ok(whole(value, "most", 1, u16::MAX.into())? as usize)
}

/// The argument `paths`, a number of light paths.
pub fn paths(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    Ok(whole(value, "paths", 1024, 1 << 24)? as usize)
}

/// The argument `seed` where it becomes a key of a config.
pub fn seed_of_config(value: &Bound<'_, PyAny>) -> PyResult<i64> {
    Ok(whole(value, "seed", 0, i64::MAX as u64)? as i64)
}

/// The argument `batch`.
pub fn batch(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    Ok(whole(value, "batch", 1, MAX_BUDGET as u64)? as usize)
}
