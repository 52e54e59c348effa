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
        let no_text = |_| refused(format!("key {key} is no text; allowed: names of keys"));
        let key: String = key.extract().map_err(no_text)?;
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
        let whole = value.extract();
        let whole = whole.map_err(|_| other_type(key, value, "a whole number of 64 bits"));
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
        let item = |item: PyResult<Bound<'_, PyAny>>| value_of(key, &item?, depth + 1);
        let items = value.try_iter()?.map(item).collect::<PyResult<_>>();
        return Ok(Value::Array(items?));
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

/// Keys of a member of a family, its `kind` among them; an error if it is among `keys` too.
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
    let before = line.unwrap_or(0_usize).saturating_sub(1);
    let text = keys.to_string();
    let is_header = |line: &&str| line.starts_with('[') && line.ends_with(']');
    let header = text.lines().take(before).filter(is_header).last();
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
    let channels = match value_of("channels", value, 0)? {
        nm @ Value::Array(_) => Table::from_iter([("wavelengths_nm".into(), nm)]).into(),
        other => other,
    };
    let keys = Table::from_iter([("channels".into(), channels)]);
    let read = parsed::<ChannelKeys>("channels", keys).map(|keys| keys.channels);
    let read = read.map_err(renamed("channels.wavelengths_nm", "channels"));
    read.map_err(renamed("wavelengths_nm", "channels"))
}

/// A whole number of an argument, from `least` to `most`.
fn whole(value: &Bound<'_, PyAny>, name: &str, least: u64, most: u64) -> PyResult<u64> {
    let number = value.extract().ok().filter(|n| (least..=most).contains(n));
    number.ok_or_else(|| {
        let allowed = format!("a whole number from {least} to {most}");
        refused(ParameterError::new(name, value, allowed))
    })
}

/// Readers of arguments that are whole numbers of a range.
macro_rules! whole_numbers {
    ($($reader:ident: $argument:literal as $number:ty, $least:expr, $most:expr;)*) => {
        $(
            #[doc = concat!("The argument `", $argument, "`.")]
            pub fn $reader(value: &Bound<'_, PyAny>) -> PyResult<$number> {
                Ok(whole(value, $argument, $least, $most)? as $number)
            }
        )*
    };
}

whole_numbers! {
    batch: "batch" as usize, 1, MAX_BUDGET as u64;
    budget: "budget" as usize, 1, MAX_BUDGET as u64;
    most: "most" as usize, 1, u16::MAX.into();
    paths: "paths" as usize, 1024, 1 << 24;
    seed: "seed" as u64, 0, u64::MAX;
    // Where it becomes a key of a config.
    seed_of_config: "seed" as i64, 0, i64::MAX as u64;
}
