//! Reading and writing the tables of configs, key by key.

use crate::error::{excerpt, one_of};
use crate::registry::{self, ReadError, Table};
use serde::Serialize;
use toml::Value;

/// A choice with the name it has in results, if one is written.
#[derive(Debug)]
pub struct Named<T: ?Sized> {
    /// The key `name`, if it is written.
    pub name: Option<String>,
    /// The member of the family.
    pub choice: Box<T>,
}

impl<T: ?Sized> From<Box<T>> for Named<T> {
    fn from(choice: Box<T>) -> Self {
        Self { name: None, choice }
    }
}

/// Refuses a config with a key of the top level that is in none of these lists.
pub(super) fn refuse_unknown(table: &Table<'_>, keys: &[&[&str]]) -> Result<(), ReadError> {
    let keys = keys.concat();
    for key in table.get_ref().keys() {
        let name = key.get_ref().as_ref();
        if !keys.contains(&name) {
            let (allowed, name) = (one_of(name, &keys), excerpt(name));
            let message = format!("unknown key {name}; allowed: {allowed}");
            return Err(ReadError::new(key.span(), message));
        }
    }
    Ok(())
}

/// Takes an array of tables and reads each; `None` if the key is absent, which is not the same as an empty list.
pub(super) fn take_list<'s, T>(
    table: &mut Table<'s>,
    key: &str,
    read: impl Fn(Table<'s>) -> Result<T, ReadError>,
) -> Result<Option<Vec<T>>, ReadError> {
    let tables = registry::take_tables(table, key)?;
    let read = tables.map(|tables| tables.into_iter().map(read).collect());
    read.transpose()
}

/// Takes `name` and lets the family read the rest.
pub(super) fn named<'s, T: ?Sized>(
    mut table: Table<'s>,
    read: impl Fn(Table<'s>) -> Result<Box<T>, ReadError>,
) -> Result<Named<T>, ReadError> {
    let name = registry::take_string(&mut table, "name")?;
    let choice = read(table)?;
    Ok(Named { name, choice })
}

/// A struct of plain values as a table.
pub(super) fn section(value: &impl Serialize) -> toml::Table {
    match Value::try_from(value) {
        Ok(Value::Table(table)) => table,
        // Structs of numbers, strings, lists and tables: serialization cannot fail on them.
        _ => toml::Table::new(),
    }
}

pub(super) fn insert_list(
    table: &mut toml::Table,
    key: &str,
    list: impl Iterator<Item = toml::Table>,
) {
    let list: Vec<_> = list.map(Value::Table).collect();
    if !list.is_empty() {
        table.insert(key.into(), Value::Array(list));
    }
}
