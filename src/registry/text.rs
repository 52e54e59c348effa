//! Tables of TOML, with the place of each key and value.

use super::{Item, Part, ReadError, Shape};
use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A TOML table with the position of each key and value.
pub type Table<'a> = Spanned<DeTable<'a>>;

/// Keys with their values, in the order they are written in.
pub type Keys = toml::Table;

/// A value of [`Keys`].
pub type Value = toml::Value;

impl From<toml::de::Error> for ReadError {
    fn from(e: toml::de::Error) -> Self {
        Self {
            message: e.message().to_owned(),
            span: e.span(),
        }
    }
}

/// Deserializes what is left of a table into a plain struct.
pub fn parse<S: DeserializeOwned>(table: Table<'_>) -> Result<S, ReadError> {
    Ok(S::deserialize(toml::de::Deserializer::from(table))?)
}

pub(super) fn table(text: &str) -> Result<Table<'_>, ReadError> {
    Ok(DeTable::parse(text)?)
}

pub(super) fn written(keys: Keys) -> String {
    keys.to_string()
}

/// A struct as a table, without keys that have no value; `None` if it is none.
pub(super) fn keys(of: &impl Serialize) -> Option<Keys> {
    match Value::try_from(of) {
        Ok(Value::Table(table)) => Some(table),
        _ => None,
    }
}

/// What numbers may be in.
pub(super) fn part(value: &mut Value) -> Part<'_> {
    match value {
        Value::Float(x) => Part::Number(*x),
        Value::Table(keys) => Part::Table(keys),
        Value::Array(items) => Part::Array(items),
        _ => Part::Other,
    }
}

pub(super) fn remove<'a>(table: &mut Table<'a>, key: &str) -> Option<Item<'a>> {
    table.get_mut().remove(key).map(item)
}

fn item(value: Spanned<DeValue<'_>>) -> Item<'_> {
    let span = value.span();
    let shape = match value.into_inner() {
        DeValue::String(text) => Shape::String(text.into_owned()),
        DeValue::Table(table) => Shape::Table(Spanned::new(span.clone(), table)),
        DeValue::Array(items) => Shape::Array(items.into_iter().map(item).collect()),
        DeValue::Integer(number) => Shape::Other(number.to_string()),
        DeValue::Float(number) => Shape::Other(number.to_string()),
        DeValue::Boolean(on) => Shape::Other(on.to_string()),
        other => Shape::Other(format!("a value of type {}", other.type_str())),
    };
    Item {
        span: Some(span),
        shape,
    }
}
