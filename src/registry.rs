//! Registries: one list for every family of named things (models, parametrizations, sample sets,
//! reconstructions). A family's `all()` returns [`Entry`]s, and the config reader, `gonio list`,
//! the help texts, the law tests and the benches all walk that list.
//!
//! A program that is built on this library adds members of its own with a family's `join`: they are
//! then read from configs and listed like all others.
//!
//! A config table names its member by `kind`. Internally tagged serde enums lose key and line in
//! TOML errors and let stray keys through on unit variants, so `kind` is taken out of the table
//! first and the rest is deserialized into the member's own struct, whose
//! `deny_unknown_fields` then sees every key with its position.

use crate::error::excerpt;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::sync::{PoisonError, RwLock};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A TOML table with the position of each key and value.
pub type Table<'a> = Spanned<DeTable<'a>>;

/// A member of a family.
pub struct Entry<T: ?Sized> {
    /// The `kind` a config writes, kebab-case.
    pub kind: &'static str,
    /// One-line description for `gonio list` and the docs.
    pub summary: &'static str,
    /// TOML bodies (without `kind`) that `gonio list` shows and the laws run on.
    pub examples: &'static [&'static str],
    /// Reads the member from its table (without `kind`).
    pub read: fn(Table<'_>) -> Result<Box<T>, ReadError>,
}

// Not derived: T itself need not be copied.
impl<T: ?Sized> Clone for Entry<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: ?Sized> Copy for Entry<T> {}

/// Members that a program adds to a family of the library, for as long as it runs.
pub struct Joined<T: ?Sized + 'static>(RwLock<Vec<Entry<T>>>);

impl<T: ?Sized> Joined<T> {
    /// No members.
    pub(crate) const fn new() -> Self {
        Self(RwLock::new(Vec::new()))
    }

    /// The library's members, and then those that were added.
    pub(crate) fn after(&self, mut members: Vec<Entry<T>>) -> Vec<Entry<T>> {
        // Whoever panicked while adding had not changed the list.
        members.extend(self.0.read().unwrap_or_else(PoisonError::into_inner).iter());
        members
    }

    /// Adds a member to those of the library.
    pub(crate) fn add(&self, members: Vec<Entry<T>>, entry: Entry<T>) -> Result<(), Taken> {
        let mut joined = self.0.write().unwrap_or_else(PoisonError::into_inner);
        if members.iter().chain(&*joined).any(|e| e.kind == entry.kind) {
            return Err(Taken(entry.kind));
        }
        joined.push(entry);
        Ok(())
    }
}

/// A member of this kind is in the family already.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("kind = \"{0}\" is in the registry already; allowed: another name")]
pub struct Taken(pub &'static str);

/// Why a table could not be read, and where in the text.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ReadError {
    /// The message, one sentence: key, value, what is allowed.
    pub message: String,
    /// Byte range in the config text.
    pub span: Option<Range<usize>>,
}

impl ReadError {
    /// An error at a place in the text.
    pub fn at(span: Range<usize>, message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            span: Some(span),
        }
    }
}

impl From<toml::de::Error> for ReadError {
    fn from(e: toml::de::Error) -> Self {
        Self {
            message: e.message().to_owned(),
            span: e.span(),
        }
    }
}

/// Reads the member of `family` that the table's `kind` names.
pub fn read<T: ?Sized>(
    what: &str,
    family: &[Entry<T>],
    mut table: Table<'_>,
) -> Result<Box<T>, ReadError> {
    let kinds: Vec<_> = family.iter().map(|e| e.kind).collect();
    let index = take_kind(what, &kinds, &mut table)?;
    (family[index].read)(table)
}

/// Takes `kind` out of a table: the position in `kinds` of the one it names.
pub fn take_kind(what: &str, kinds: &[&str], table: &mut Table<'_>) -> Result<usize, ReadError> {
    let allowed = kinds.join(", ");
    let span = table.span();
    let Some(kind) = table.get_mut().remove("kind") else {
        let message = format!("kind is missing from the {what}; allowed: {allowed}");
        return Err(ReadError::at(span, message));
    };
    let span = kind.span();
    match kind.into_inner() {
        DeValue::String(name) => kinds.iter().position(|&k| k == name).ok_or_else(|| {
            let a = if what.starts_with(['a', 'e', 'i', 'o', 'u']) {
                "an"
            } else {
                "a"
            };
            let name = excerpt(&name);
            let message = format!("kind = \"{name}\" is not {a} {what}; allowed: {allowed}");
            ReadError::at(span, message)
        }),
        other => {
            let found = shown(&other);
            let message = format!("kind of the {what} is {found}; allowed: one of {allowed}");
            Err(ReadError::at(span, message))
        }
    }
}

/// Reads a member from a TOML text of its own, e.g. one of its examples.
///
/// ```
/// let lambert = gonio::brdf::all().swap_remove(0);
/// assert!(gonio::registry::read_text(&lambert, "albedo = 0.8").is_ok());
/// assert!(gonio::registry::read_text(&lambert, "albdeo = 0.8").is_err());
/// ```
pub fn read_text<T: ?Sized>(entry: &Entry<T>, text: &str) -> Result<Box<T>, ReadError> {
    (entry.read)(DeTable::parse(text)?)
}

/// Deserializes what is left of a table into a plain struct.
pub fn parse<S: DeserializeOwned>(table: Table<'_>) -> Result<S, ReadError> {
    Ok(S::deserialize(toml::de::Deserializer::from(table))?)
}

/// A member as a table: its kind, then every key with its value; reading it back gives the same.
pub fn resolved<S: Serialize>(kind: &str, member: &S) -> toml::Table {
    let mut table = toml::Table::new();
    table.insert("kind".into(), kind.into());
    // Members are structs of numbers, strings and tables: serialization cannot fail on them.
    if let Ok(toml::Value::Table(rest)) = toml::Value::try_from(member) {
        table.extend(rest);
    }
    table
}

/// Takes `key` out of the table; it must hold a string.
pub fn take_string(table: &mut Table<'_>, key: &str) -> Result<Option<String>, ReadError> {
    let Some(value) = table.get_mut().remove(key) else {
        return Ok(None);
    };
    let span = value.span();
    match value.into_inner() {
        DeValue::String(text) => Ok(Some(text.into_owned())),
        other => Err(ReadError::at(
            span,
            format!("{key} is {}; allowed: a string", shown(&other)),
        )),
    }
}

/// Takes `key` out of the table; it must hold a table.
pub fn take_table<'a>(table: &mut Table<'a>, key: &str) -> Result<Option<Table<'a>>, ReadError> {
    let Some(value) = table.get_mut().remove(key) else {
        return Ok(None);
    };
    as_table(key, value).map(Some)
}

/// Takes `key` out of the table; it must hold an array of tables.
pub fn take_tables<'a>(
    table: &mut Table<'a>,
    key: &str,
) -> Result<Option<Vec<Table<'a>>>, ReadError> {
    let Some(value) = table.get_mut().remove(key) else {
        return Ok(None);
    };
    let span = value.span();
    match value.into_inner() {
        DeValue::Array(items) => items
            .into_iter()
            .map(|item| as_table(key, item))
            .collect::<Result<_, _>>()
            .map(Some),
        other => Err(ReadError::at(
            span,
            format!("{key} is {}; allowed: an array of tables", shown(&other)),
        )),
    }
}

/// The value as a table, or an error that names the key.
fn as_table<'a>(key: &str, value: Spanned<DeValue<'a>>) -> Result<Table<'a>, ReadError> {
    let span = value.span();
    match value.into_inner() {
        DeValue::Table(t) => Ok(Spanned::new(span, t)),
        other => Err(ReadError::at(
            span,
            format!("{key} is {}; allowed: a table", shown(&other)),
        )),
    }
}

/// A value of the wrong type, for messages.
fn shown(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(on) => on.to_string(),
        DeValue::String(text) => format!("{:?}", excerpt(text)),
        other => format!("a value of type {}", other.type_str()),
    }
}
