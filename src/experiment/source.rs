//! The text of a config with every `--set` applied before anything reads it, and the origin of each of its values: a line of
//! the file, or the `--set` that put it there.

use super::wording::{KeyPath, name_key};
use crate::error::{Error, excerpt};
use crate::files;
use crate::registry::{ReadError, Table};
use std::fmt;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml_edit::{DocumentMut, Item, Key, Value};

/// Every member of an array, in a key.
const ALL: &str = "all";

/// An override and its name in messages.
#[derive(Clone, Debug)]
struct Edit {
    path: KeyPath,
    label: String,
}

/// A config's text, as written and as edited.
#[derive(Clone, Debug)]
pub struct Source {
    name: String,
    original: String,
    text: String,
    edits: Vec<Edit>,
}

impl Source {
    /// A config that is not in a file, e.g. in a test; `name` stands for the file in messages.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let text = text.into();
        Self {
            name: name.into(),
            original: text.clone(),
            text,
            edits: Vec::new(),
        }
    }

    /// Reads a config file.
    ///
    /// # Errors
    /// [`Error::Config`] if there is no such file, or it is no text or too long.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let name = path.display().to_string();
        match files::read_text(path, files::CONFIG_LIMIT) {
            Ok(text) => Ok(Self::new(name, text)),
            Err(e) => Err(Error::config(name, format!("cannot read this config: {e}"))),
        }
    }

    /// The file's name, as the user wrote it.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The text as it is in the file.
    pub(crate) fn original(&self) -> &str {
        &self.original
    }

    /// The overrides, as the user wrote them.
    pub(crate) fn edits(&self) -> Vec<String> {
        let mut labels: Vec<String> = self.edits.iter().map(|e| e.label.clone()).collect();
        labels.dedup();
        labels
    }

    /// Applies `key=value`: a dotted key, whole numbers being positions in arrays and `all` every member of one
    /// that has the rest of the key, and a TOML value, or else a bare string. `label` is the option as the user wrote it.
    ///
    /// # Errors
    /// [`Error::Config`] if it cannot be read, or its key leads nowhere.
    pub fn set(&mut self, assignment: &str, label: String) -> Result<(), Error> {
        // A file that is no TOML is its own, earlier, error.
        self.table()?;
        let refuse = |message: String| Error::config(excerpt(&label), message);
        let Some((key, value)) = assignment.split_once('=') else {
            return Err(refuse(
                "has no `=`; allowed: key=value, e.g. metrics.pairs=1000".into(),
            ));
        };
        let Ok(keys) = Key::parse(key.trim()) else {
            let key = excerpt(key);
            return Err(refuse(format!(
                "`{key}` is no key; allowed: names and array positions joined by dots, e.g. material.0.alpha"
            )));
        };
        let value = value.trim();
        let value = value.parse().unwrap_or_else(|_| Value::from(value));
        let parsed = self.text.parse::<DocumentMut>();
        // Numbers that no type holds are refused here alone.
        let mut document = parsed.map_err(|e| {
            let start = e.span().map_or(0, |span| span.start);
            let message = e.message().lines().collect::<Vec<_>>().join(", ");
            Error::config(self.line(&self.text, start), message)
        })?;
        let each = members(document.as_item(), keys);
        if each.is_empty() {
            let key = excerpt(key);
            return Err(refuse(format!(
                "no member has the key of `{key}`; allowed: one that some have, or a position for `{ALL}`"
            )));
        }
        for keys in each {
            let path = assign(document.as_item_mut(), &keys, value.clone());
            let path = path.map_err(refuse)?;
            let label = label.clone();
            self.edits.push(Edit { path, label });
        }
        self.text = document.to_string();
        Ok(())
    }

    /// The edited text as a table with the place of each of its values.
    ///
    /// # Errors
    /// [`Error::Config`] if the text is no TOML.
    pub fn table(&self) -> Result<Table<'_>, Error> {
        DeTable::parse(&self.text).map_err(|e| self.error(e.into()))
    }

    /// The error for a refused value: one sentence, with the place where the user wrote it.
    pub fn error(&self, e: ReadError) -> Error {
        // The first line of a TOML syntax error says what was found, the others what is allowed.
        let mut message = e.message.lines().collect::<Vec<_>>().join(", ");
        // The reader's own words for values, and for keys, that it will not follow any deeper.
        if message.starts_with("cannot recurse") || message == "recursion limit" {
            message = "this is nested too deep; allowed: less than 80 tables and arrays".into();
        }
        let Some(span) = e.span else {
            return Error::config(&self.name, message);
        };
        let found = self.text.get(span.clone()).unwrap_or_default();
        // The table at the top has no path; the place is that of a value in it.
        let missing = message.strip_prefix("missing field ");
        let (place, message) = match (enclosing(&spots(&self.text), &span), missing) {
            ((_, false), Some(key)) => {
                let message = format!("lacks the key {}", key.replace('`', ""));
                (self.name.clone(), message)
            }
            ((Some(path), _), _) => (self.location(&path), name_key(&path, found, &message)),
            // The only mistake of syntax whose message says nothing of what was found.
            _ if message == "duplicate key" => {
                let key = excerpt(found.trim());
                let message = format!("key {key} is there twice; allowed: once");
                (self.line(&self.text, span.start), message)
            }
            _ => (self.line(&self.text, span.start), message),
        };
        Error::config(place, message)
    }

    /// An error about the value at a path.
    pub fn error_at(&self, path: &KeyPath, message: impl fmt::Display) -> Error {
        Error::config(self.location(path), message)
    }

    /// File and line of a path, or the option that set it; of a default those of the innermost table that is written.
    pub(crate) fn location(&self, path: &KeyPath) -> String {
        let original = spots(&self.original);
        let mut path = path.clone();
        while !path.0.is_empty() {
            if let Some(edit) = self.edits.iter().rfind(|e| path.starts_with(&e.path)) {
                return excerpt(&edit.label).into_owned();
            }
            if let Some(spot) = original.iter().find(|s| s.path == path) {
                return self.line(&self.original, spot.start());
            }
            if let Some(edit) = self.edits.iter().rfind(|e| e.path.starts_with(&path)) {
                return excerpt(&edit.label).into_owned();
            }
            path.0.pop();
        }
        self.name.clone()
    }

    fn line(&self, text: &str, offset: usize) -> String {
        let before = text.as_bytes().iter().take(offset);
        let line = 1 + before.filter(|&&b| b == b'\n').count();
        format!("{}:{line}", self.name)
    }
}

/// What keys with [`ALL`] for a position of an array stand for: each member that has the rest of them.
fn members(root: &Item, keys: Vec<Key>) -> Vec<Vec<Key>> {
    let within = |keys: &[Key]| {
        let mut keys = keys.iter().map(Key::get);
        keys.try_fold(root.clone(), |item, key| match key.parse::<usize>() {
            Ok(i) => item.get(i).cloned(),
            Err(_) => item.get(key).cloned(),
        })
    };
    let count = |at: usize| length(&within(&keys[..at])?);
    let mut places = (0..keys.len()).filter(|&at| keys[at].get() == ALL);
    let Some((at, count)) = places.find_map(|at| Some((at, count(at)?))) else {
        return vec![keys];
    };
    let of = |i: usize| {
        let mut keys = keys.clone();
        keys[at] = Key::new(i.to_string());
        keys
    };
    let has = |keys: &Vec<Key>| {
        let end = keys.iter().position(|key| key.get() == ALL);
        within(&keys[..end.unwrap_or(keys.len())]).is_some()
    };
    let each = (0..count).map(of).filter(has);
    each.flat_map(|keys| members(root, keys)).collect()
}

/// Number of elements of an array; `None` of what is none.
fn length(item: &Item) -> Option<usize> {
    match item {
        Item::ArrayOfTables(tables) => Some(tables.len()),
        Item::Value(Value::Array(values)) => Some(values.len()),
        _ => None,
    }
}

/// Writes `value` at the dotted key `keys`, with missing tables on the way, and returns its path, or why it cannot.
fn assign(root: &mut Item, keys: &[Key], value: Value) -> Result<KeyPath, String> {
    let mut item = root;
    let mut path = KeyPath::default();
    let mut in_array_of_tables = false;
    for (depth, key) in keys.iter().enumerate() {
        let name = key.get();
        in_array_of_tables = item.is_array_of_tables();
        if let Some(length) = length(item) {
            let index = name.parse().ok().filter(|&i: &usize| i < length);
            let Some(next) = index.and_then(|i| Some((i, item.get_mut(i)?))) else {
                let (name, last) = (excerpt(name), length.saturating_sub(1));
                return Err(format!(
                    "`{name}` is no position in {path}, which has {length}; allowed: 0 to {last}"
                ));
            };
            path = path.index(next.0);
            item = next.1;
            continue;
        }
        let found = item.type_name();
        let Some(table) = item.as_table_like_mut() else {
            let name = excerpt(name);
            return Err(format!(
                "{path} is {found}, which has no key `{name}`; allowed: a key of a table"
            ));
        };
        if depth + 1 < keys.len() && !table.contains_key(name) {
            table.insert(name, toml_edit::table());
        }
        path = path.key(name);
        item = table.entry(name).or_insert(Item::None);
    }
    *item = match value {
        Value::InlineTable(table) if item.is_table() => Item::Table(table.into_table()),
        value if in_array_of_tables => {
            let found = value.type_name();
            return Err(format!(
                "{path} is a table, not {found}; allowed: {{ key = value, … }}"
            ));
        }
        value => Item::Value(value),
    };
    Ok(path)
}

/// A value of a document: its path and its range of the text.
struct Spot {
    path: KeyPath,
    key: Option<Range<usize>>,
    value: Range<usize>,
    is_table: bool,
}

impl Spot {
    fn start(&self) -> usize {
        self.key.as_ref().unwrap_or(&self.value).start
    }
}

/// The innermost value that holds a range of the text, by its key or its body; and whether it is or is in a table below the top.
fn enclosing(spots: &[Spot], span: &Range<usize>) -> (Option<KeyPath>, bool) {
    let holds = |r: &&Range<usize>| r.start <= span.start && span.end <= r.end;
    let size = |spot: &Spot| {
        let ranges = spot.key.iter().chain([&spot.value]);
        ranges.filter(holds).map(ExactSizeIterator::len).min()
    };
    let sized = spots.iter().filter_map(|s| Some((size(s)?, s)));
    // Of equal ranges the later is the inner one: `a.b` under one header.
    let best = sized.rev().min_by_key(|(size, _)| *size);
    let best = best.map(|(_, spot)| spot);
    let in_table = best.is_some_and(|spot| spot.is_table || spot.path.0.len() > 1);
    (best.map(|spot| spot.path.clone()), in_table)
}

/// Every value of a document, outer before inner; none if the text is no TOML.
fn spots(text: &str) -> Vec<Spot> {
    fn of_table(path: &KeyPath, table: &DeTable<'_>, out: &mut Vec<Spot>) {
        for (key, value) in table {
            of_value(path.key(key.get_ref()), Some(key.span()), value, out);
        }
    }
    fn of_value(
        path: KeyPath,
        key: Option<Range<usize>>,
        value: &Spanned<DeValue<'_>>,
        out: &mut Vec<Spot>,
    ) {
        out.push(Spot {
            path: path.clone(),
            key,
            value: value.span(),
            is_table: value.get_ref().is_table(),
        });
        match value.get_ref() {
            DeValue::Table(table) => of_table(&path, table, out),
            DeValue::Array(items) => {
                for (i, item) in items.iter().enumerate() {
                    of_value(path.index(i), None, item, out);
                }
            }
            _ => {}
        }
    }
    let mut out = Vec::new();
    if let Ok(root) = DeTable::parse(text) {
        of_table(&KeyPath::default(), root.get_ref(), &mut out);
    }
    out
}
