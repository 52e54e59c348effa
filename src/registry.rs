//! Registries: one list for every family of named things (models, parametrizations, sample sets,
//! reconstructions). A family's `all()` returns [`Entry`]s, and the config reader, `gonio list`,
//! the help texts, the law tests and the benches all walk that list.
//!
//! A program that is built on this library adds members of its own with a family's `join`. With the feature `experiments`
//! members are read from tables of TOML, and errors have their place in the text; without it from JSON objects.
//!
//! A config table names its member by `kind`. Internally tagged serde enums lose key and line in TOML errors and let stray
//! keys through on unit variants, so `kind` is taken out of the table first and the rest is deserialized into the member's
//! own struct, whose `deny_unknown_fields` then sees every key with its position.

use crate::error::{excerpt, one_of};
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize};
use std::ops::Range;
use std::sync::{PoisonError, RwLock};

mod declare;
#[cfg(not(feature = "experiments"))]
mod json;
mod named;
#[cfg(feature = "experiments")]
mod text;

pub(crate) use declare::{declare, family, forwarded, keys, only};
#[cfg(not(feature = "experiments"))]
pub use json::{Keys, Table, Value, parse};
#[cfg(not(feature = "experiments"))]
use json::{keys, part, remove, table, written};
pub(crate) use named::named;
#[cfg(feature = "experiments")]
pub use text::{Keys, Table, Value, parse};
#[cfg(feature = "experiments")]
use text::{keys, part, remove, table, written};

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
pub(crate) struct Joined<T: ?Sized + 'static>(RwLock<Vec<Entry<T>>>);

impl<T: ?Sized> Joined<T> {
    pub(crate) const fn new() -> Self {
        Self(RwLock::new(Vec::new()))
    }

    /// The library's members, and then those that were added.
    pub(crate) fn after(&self, mut members: Vec<Entry<T>>) -> Vec<Entry<T>> {
        // A thread that panicked while adding has not changed the list.
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
    pub(crate) fn new(span: impl Into<Option<Range<usize>>>, message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            span: span.into(),
        }
    }
}

/// Reads the member of `family` that the table's `kind` names.
pub fn read<T: ?Sized>(
    what: &str,
    family: &[Entry<T>],
    table: Table<'_>,
) -> Result<Box<T>, ReadError> {
    read_of_two(what, family, |member| member, &[], table)
}

/// Reads the member of one family or another that the table's `kind` names, of the first as one of the second.
pub(crate) fn read_of_two<A: ?Sized, B: ?Sized>(
    what: &str,
    first: &[Entry<A>],
    wrap: fn(Box<A>) -> Box<B>,
    second: &[Entry<B>],
    mut table: Table<'_>,
) -> Result<Box<B>, ReadError> {
    let (a, b) = (first.iter().map(|e| e.kind), second.iter().map(|e| e.kind));
    let kinds: Vec<_> = a.chain(b).collect();
    let index = take_kind(what, &kinds, &mut table)?;
    match first.get(index) {
        Some(entry) => (entry.read)(table).map(wrap),
        None => (second[index - first.len()].read)(table),
    }
}

/// Takes `kind` out of a table: the position in `kinds` of the one it names.
pub(crate) fn take_kind(
    what: &str,
    kinds: &[&str],
    table: &mut Table<'_>,
) -> Result<usize, ReadError> {
    let allowed = kinds.join(", ");
    let place = table.span();
    let Some(kind) = remove(table, "kind") else {
        let message = format!("kind is missing from the {what}; allowed: {allowed}");
        return Err(ReadError::new(place, message));
    };
    match kind.shape {
        Shape::String(name) => kinds.iter().position(|&k| k == name).ok_or_else(|| {
            let a = if what.starts_with(['a', 'e', 'i', 'o', 'u']) {
                "an"
            } else {
                "a"
            };
            let (name, allowed) = (excerpt(&name), one_of(&name, kinds));
            let message = format!("kind = \"{name}\" is not {a} {what}; allowed: {allowed}");
            ReadError::new(kind.span, message)
        }),
        other => {
            let found = other.shown();
            let message = format!("kind of the {what} is {found}; allowed: one of {allowed}");
            Err(ReadError::new(kind.span, message))
        }
    }
}

/// Reads the member of `family` that written-out keys name.
pub(crate) fn read_keys<T: ?Sized>(
    what: &str,
    family: &[Entry<T>],
    keys: Keys,
) -> Result<Box<T>, ReadError> {
    let text = written(keys);
    read(what, family, table(&text)?)
}

/// Reads a member from a text of its own, e.g. one of its examples.
///
/// ```
/// let lambert = gonio::brdf::all().swap_remove(0);
/// assert!(gonio::registry::read_text(&lambert, "albedo = 0.8").is_ok());
/// assert!(gonio::registry::read_text(&lambert, "albdeo = 0.8").is_err());
/// ```
pub fn read_text<T: ?Sized>(entry: &Entry<T>, text: &str) -> Result<Box<T>, ReadError> {
    (entry.read)(table(text)?)
}

/// A member of a family, as a config writes it.
pub trait Resolved {
    /// The kind and every key with its value, defaults filled in.
    fn resolved(&self) -> Keys;
}

/// A member as a table: its kind, then every key with its value; reading it back gives the same.
pub fn resolved<S: Serialize>(kind: &str, member: &S) -> Keys {
    let mut table = Keys::new();
    table.insert("kind".into(), kind.into());
    // Members are structs of numbers, strings and tables: serialization cannot fail on them.
    if let Some(rest) = keys(member) {
        table.extend(rest);
    }
    table
}

/// A member as a table, whose only key is a table, or an array of tables.
pub(crate) fn nested(kind: &str, key: &str, value: impl Into<Value>) -> Keys {
    with(resolved(kind, &NoKeys {}), key, value)
}

/// A table with one more key.
pub(crate) fn with(mut table: Keys, key: &str, value: impl Into<Value>) -> Keys {
    table.insert(key.into(), value.into());
    table
}

/// The keys of a member that has none: any key is one too many.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NoKeys {}

/// A value, as far as numbers are in it.
enum Part<'a> {
    /// One that is not written as a whole one.
    Number(f64),
    Table(&'a mut Keys),
    Array(&'a mut Vec<Value>),
    Other,
}

/// Shows every number of a table that is no whole one, with its place: `alpha[1]`, `component[0].weight`.
pub(crate) fn each_number(keys: &mut Keys, visit: &mut dyn FnMut(&str, &mut f64)) {
    for (key, value) in keys.iter_mut() {
        each_in(key, value, visit);
    }
}

fn each_in(place: &str, value: &mut Value, visit: &mut dyn FnMut(&str, &mut f64)) {
    match part(value) {
        Part::Number(mut x) => {
            visit(place, &mut x);
            *value = x.into();
        }
        Part::Table(keys) => {
            each_number(keys, &mut |key, x| visit(&format!("{place}.{key}"), x));
        }
        Part::Array(items) => {
            for (i, item) in items.iter_mut().enumerate() {
                each_in(&format!("{place}[{i}]"), item, visit);
            }
        }
        Part::Other => {}
    }
}

/// Takes `key` out of the table; it must hold a string.
pub(crate) fn take_string(table: &mut Table<'_>, key: &str) -> Result<Option<String>, ReadError> {
    match remove(table, key) {
        None => Ok(None),
        Some(Item {
            shape: Shape::String(text),
            ..
        }) => Ok(Some(text)),
        Some(other) => Err(other.refused(key, "a string")),
    }
}

/// Takes `key` out of the table; it must hold a table.
pub(crate) fn take_table<'a>(
    table: &mut Table<'a>,
    key: &str,
) -> Result<Option<Table<'a>>, ReadError> {
    let Some(item) = remove(table, key) else {
        return Ok(None);
    };
    item.table(key).map(Some)
}

/// Takes `key` out of the table and reads it; it must hold a table.
pub(crate) fn take<'a, T>(
    table: &mut Table<'a>,
    key: &str,
    read: impl FnOnce(Table<'a>) -> Result<T, ReadError>,
) -> Result<Option<T>, ReadError> {
    take_table(table, key)?.map(read).transpose()
}

/// The default of a key whose table was taken out before, and which is listed in the message about an unknown one.
pub(crate) fn taken<'de, D: Deserializer<'de>, T: Default>(from: D) -> Result<T, D::Error> {
    IgnoredAny::deserialize(from).map(|_| T::default())
}

/// Takes `key` out of the table; it must hold an array of tables.
pub(crate) fn take_tables<'a>(
    table: &mut Table<'a>,
    key: &str,
) -> Result<Option<Vec<Table<'a>>>, ReadError> {
    match remove(table, key) {
        None => Ok(None),
        Some(Item {
            shape: Shape::Array(items),
            ..
        }) => {
            let tables = items.into_iter().map(|item| item.table(key));
            tables.collect::<Result<_, _>>().map(Some)
        }
        Some(other) => Err(other.refused(key, "an array of tables")),
    }
}

/// A value and its place in the text, if that is known.
struct Item<'a> {
    span: Option<Range<usize>>,
    shape: Shape<'a>,
}

/// A value, as far as registries look into it.
enum Shape<'a> {
    String(String),
    Table(Table<'a>),
    Array(Vec<Item<'a>>),
    /// Anything else, as messages show it.
    Other(String),
}

impl Shape<'_> {
    /// A value of the wrong type, for messages.
    fn shown(&self) -> String {
        match self {
            Shape::String(text) => format!("{:?}", excerpt(text)),
            Shape::Table(_) => "a value of type table".into(),
            Shape::Array(_) => "a value of type array".into(),
            Shape::Other(shown) => shown.clone(),
        }
    }
}

impl<'a> Item<'a> {
    fn table(self, key: &str) -> Result<Table<'a>, ReadError> {
        match self.shape {
            Shape::Table(table) => Ok(table),
            _ => Err(self.refused(key, "a table")),
        }
    }

    fn refused(&self, key: &str, allowed: &str) -> ReadError {
        let message = format!("{key} is {}; allowed: {allowed}", self.shape.shown());
        ReadError::new(self.span.clone(), message)
    }
}
