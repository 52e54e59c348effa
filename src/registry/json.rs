//! Objects of JSON in the place of TOML tables, for a library without experiments.

use super::{Item, Part, ReadError, Shape};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::marker::PhantomData;
use std::ops::Range;

/// A JSON object.
#[derive(Clone, Debug)]
pub struct Table<'a> {
    keys: Keys,
    text: PhantomData<&'a str>,
}

/// Keys with their values.
pub type Keys = serde_json::Map<String, Value>;

/// A value of [`Keys`].
pub type Value = serde_json::Value;

impl From<serde_json::Error> for ReadError {
    fn from(e: serde_json::Error) -> Self {
        Self {
            message: e.to_string(),
            span: None,
        }
    }
}

impl Table<'_> {
    /// Its place in a text, which is not known.
    pub(crate) fn span(&self) -> Option<Range<usize>> {
        None
    }
}

impl From<Keys> for Table<'_> {
    fn from(keys: Keys) -> Self {
        Self {
            keys,
            text: PhantomData,
        }
    }
}

/// Deserializes what is left of a table into a plain struct.
pub fn parse<S: DeserializeOwned>(table: Table<'_>) -> Result<S, ReadError> {
    Ok(S::deserialize(Value::Object(table.keys))?)
}

pub(super) fn table(text: &str) -> Result<Table<'_>, ReadError> {
    let keys: Keys = serde_json::from_str(text)?;
    Ok(Table::from(keys))
}

pub(super) fn written(keys: Keys) -> String {
    Value::Object(keys).to_string()
}

/// A struct as a table, without keys that have no value; `None` if it is none.
pub(super) fn keys(of: &impl Serialize) -> Option<Keys> {
    match serde_json::to_value(of) {
        Ok(Value::Object(mut keys)) => {
            // TOML has no null.
            keys.retain(|_, value| !value.is_null());
            Some(keys)
        }
        _ => None,
    }
}

/// What numbers may be in.
pub(super) fn part(value: &mut Value) -> Part<'_> {
    match value {
        Value::Number(x) if x.is_f64() => Part::Number(x.as_f64().unwrap_or(f64::NAN)),
        Value::Object(keys) => Part::Table(keys),
        Value::Array(items) => Part::Array(items),
        _ => Part::Other,
    }
}

pub(super) fn remove<'a>(table: &mut Table<'a>, key: &str) -> Option<Item<'a>> {
    table.keys.remove(key).map(item)
}

fn item<'a>(value: Value) -> Item<'a> {
    let shape = match value {
        Value::String(text) => Shape::String(text),
        Value::Object(keys) => Shape::Table(Table::from(keys)),
        Value::Array(items) => Shape::Array(items.into_iter().map(item).collect()),
        other => Shape::Other(other.to_string()),
    };
    Item { span: None, shape }
}
