//! Objects of JSON in the place of TOML tables, for a library without experiments.

use super::{Item, ReadError, Shape};
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
    pub fn span(&self) -> Option<Range<usize>> {
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

/// The table of a text.
pub(super) fn table(text: &str) -> Result<Table<'_>, ReadError> {
    let keys: Keys = serde_json::from_str(text)?;
    Ok(Table::from(keys))
}

/// The text of a table.
pub(super) fn written(keys: Keys) -> String {
    Value::Object(keys).to_string()
}

/// A struct as a table; `None` if it is none.
pub(super) fn keys(of: &impl Serialize) -> Option<Keys> {
    match serde_json::to_value(of) {
        Ok(Value::Object(keys)) => Some(keys),
        _ => None,
    }
}

/// Shows every number of an object that is no whole one, with its place: `alpha[1]`, `component[0].weight`.
pub fn each_number(keys: &mut Keys, visit: &mut dyn FnMut(&str, &mut f64)) {
    for (key, value) in keys.iter_mut() {
        each_in(key, value, visit);
    }
}

fn each_in(place: &str, value: &mut Value, visit: &mut dyn FnMut(&str, &mut f64)) {
    match value {
        Value::Number(number) if number.is_f64() => {
            let mut x = number.as_f64().unwrap_or(0.0);
            visit(place, &mut x);
            if let Some(new) = serde_json::Number::from_f64(x) {
                *number = new;
            }
        }
        Value::Object(keys) => {
            each_number(keys, &mut |key, x| visit(&format!("{place}.{key}"), x));
        }
        Value::Array(items) => {
            for (i, item) in items.iter_mut().enumerate() {
                each_in(&format!("{place}[{i}]"), item, visit);
            }
        }
        _ => {}
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
