//! Reading of tables.
//!
//! Tables come from here, from other programs, or out of a spreadsheet: a byte-order
//! mark, CRLF, blank lines, spaces, quotes, semicolons or tabs between cells, and with either a comma
//! in place of the decimal point are all taken as they are.

use super::super::convention::Conventions;
use super::super::format::ScheduleFormat;
use super::cells::Cells;
use super::{FileError, RowHash, WORDS};
use crate::brdf::marks::{Marks, is_mark};
use crate::error::{count, excerpt, meant, reason};
use rustc_hash::FxHashSet;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, MapAccess, Visitor};
use serde_json::{Map, Value};
use std::borrow::Cow;
use std::fmt::{self, Formatter};

/// The key of the first line of JSON Lines.
const HEADER: &str = "header";

/// Names of columns that a refusal lists.
const NAMED: usize = 7;

/// A table that was read. Cells are numbers but for one column of words.
#[derive(Debug, Default)]
pub(crate) struct Table {
    /// The file, for messages.
    pub name: String,
    /// Our names of the columns, in the order of the file; none of one that is passed over.
    pub columns: Vec<String>,
    /// Their names in the file.
    pub labels: Vec<String>,
    /// The line that names them.
    pub head: usize,
    /// Line of each row.
    pub lines: Vec<usize>,
    facts: Map<String, Value>,
    fact_lines: Vec<(String, usize)>,
    /// Keys whose values are not JSON, and their lines.
    others: Vec<(String, usize)>,
    /// Comments that are no keys.
    prose: usize,
    /// Row-major; NaN is an empty cell.
    numbers: Vec<f64>,
    /// Words, one text per row, if there is a column of words.
    words: Vec<String>,
    /// Texts in place of values.
    pub marks: Marks,
}

/// Keys that are read of any header.
const SHARED: &str = "half_angles_deg instrument material parametrization symmetry";

/// Further keys of our headers, beside hashes.
const OURS: &str = "about assumes channels columns description gonio lattice poses realisation rows sample_set seed \
                    unit unphysical_share warp";

fn is_in(keys: &str, key: &str) -> bool {
    keys.split_whitespace().any(|k| k == key)
}

impl Table {
    /// A table without facts or rows.
    pub(crate) fn named(name: &str) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }

    /// Reads a text; `name` stands for it in messages. The columns are checked by `allowed`, which
    /// gets the facts and gives our names of all columns that may be there.
    ///
    /// # Errors
    /// A line that is no row of this table: cut, with a cell that is no finite number, or against
    /// what the facts promise (`rows`, and the hash under `hash_key`).
    pub fn read(
        text: &str,
        name: &str,
        hash_key: &str,
        conventions: &Conventions,
        allowed: impl Fn(&Table) -> Result<Vec<String>, FileError>,
    ) -> Result<Self, FileError> {
        let mut table = Self::named(name);
        let content = text.strip_prefix('\u{feff}').unwrap_or(text);
        let name_columns = |table: &mut Table, columns, line| {
            table.name_columns(columns, line, conventions, &allowed)
        };
        match ScheduleFormat::of_text(text) == ScheduleFormat::JsonLines {
            true => table.read_json(content, name_columns)?,
            false => table.read_csv(content, name_columns)?,
        }
        table.keeps_promises(hash_key, conventions.partial, text.ends_with('\n'))?;
        Ok(table)
    }

    /// A fact of the header.
    ///
    /// # Errors
    /// If it is of another type than it must be.
    pub(crate) fn fact<T: DeserializeOwned>(&self, key: &str) -> Result<Option<T>, FileError> {
        match self.facts.get(key) {
            None | Some(Value::Null) => Ok(None),
            Some(value) => T::deserialize(value).map(Some).map_err(|e| {
                let (value, e) = (value.to_string(), e.to_string());
                self.fact_error(key, format!("{key} = {}: {}", excerpt(&value), excerpt(&e)))
            }),
        }
    }

    /// True of a header of ours, even if its hash was taken out.
    fn is_ours(&self) -> bool {
        let mut keys = self.facts.keys();
        keys.any(|key| key.ends_with("_hash") || key == "sample_set")
    }

    /// Sets keys of a header by others aside that mean something else there, e.g. `rows`.
    fn drop_foreign_facts(&mut self) {
        if self.is_ours() {
            return;
        }
        self.facts.retain(|key, _| is_in(SHARED, key));
        let lines = std::mem::take(&mut self.fact_lines).into_iter();
        let (read, others) = lines.partition(|(key, _)| self.facts.contains_key(key));
        self.fact_lines = read;
        self.others.extend::<Vec<_>>(others);
    }

    /// Header content that is not read: keys, and the number of other comments.
    pub(crate) fn unread(&self) -> Vec<String> {
        let is_read = |key: &str| is_in(SHARED, key) || is_in(OURS, key) || key.ends_with("_hash");
        let keys = self.facts.keys().filter(|key| !is_read(key)).cloned();
        let others = self.others.iter().map(|(key, _)| key.clone());
        let mut unread: Vec<String> = keys.chain(others).collect();
        // Ours are written anew.
        let is_intact = self.facts.keys().any(|key| key.ends_with("_hash"));
        if !is_intact && self.prose > 0 {
            unread.push(count(self.prose, "comment"));
        }
        unread
    }

    /// An error about a fact.
    pub(crate) fn fact_error(&self, key: &str, message: impl Into<String>) -> FileError {
        let line = self.fact_lines.iter().find(|(k, _)| k == key);
        FileError::on_line(&self.name, line.map_or(1, |(_, line)| *line), message)
    }

    /// An error about a row.
    pub(crate) fn row_error(&self, row: usize, message: impl Into<String>) -> FileError {
        FileError::on_line(&self.name, self.lines[row], message)
    }

    /// The name of a column in the file, as messages repeat it.
    pub(crate) fn label(&self, column: usize) -> Cow<'_, str> {
        excerpt(&self.labels[column])
    }

    /// Position of a column.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == name)
    }

    /// The number in a cell; `None` if it is empty.
    pub(crate) fn number(&self, row: usize, column: usize) -> Option<f64> {
        let value = self.numbers[row * self.columns.len() + column];
        (!value.is_nan()).then_some(value)
    }

    /// Empties a cell of numbers.
    pub(crate) fn clear(&mut self, row: usize, column: usize) {
        self.numbers[row * self.columns.len() + column] = f64::NAN;
    }

    /// The words of a row; empty if there are none.
    pub(crate) fn words(&self, row: usize) -> &str {
        self.words.get(row).map_or("", String::as_str)
    }

    /// Keeps the rows of which this is true.
    pub(crate) fn retain(&mut self, keep: impl Fn(&Self, usize) -> bool) {
        let kept: Vec<usize> = (0..self.lines.len())
            .filter(|&row| keep(self, row))
            .collect();
        let width = self.columns.len();
        let cells = kept
            .iter()
            .flat_map(|&row| &self.numbers[row * width..(row + 1) * width]);
        self.numbers = cells.copied().collect();
        // Without a column of words there are none.
        let words = kept
            .iter()
            .filter_map(|&row| self.words.get_mut(row).map(std::mem::take));
        self.words = words.collect();
        self.lines = kept.iter().map(|&row| self.lines[row]).collect();
    }

    /// The hash of the rows.
    pub(crate) fn hash(&self) -> String {
        let mut hash = RowHash::new(self.labels.iter().map(String::as_str));
        for row in 0..self.lines.len() {
            for (d, name) in self.columns.iter().enumerate() {
                match (name.as_str(), self.number(row, d)) {
                    (WORDS, _) => hash.words(self.words(row)),
                    (_, Some(value)) => hash.number(value),
                    (_, None) => hash.empty(),
                }
            }
        }
        hash.finish()
    }

    fn error(&self, line: usize, message: impl Into<String>) -> FileError {
        FileError::on_line(&self.name, line, message)
    }

    /// Checks the rows against the facts; of a part of them there is no hash. Of the last row digits
    /// may be missing, unless it `ended`.
    fn keeps_promises(
        &mut self,
        hash_key: &str,
        partial: bool,
        ended: bool,
    ) -> Result<(), FileError> {
        self.drop_foreign_facts();
        let found = self.lines.len();
        match self.fact::<usize>("rows")? {
            Some(rows) if partial && found < rows => {
                self.facts.remove(hash_key);
            }
            Some(rows) if found != rows => {
                let message =
                    format!("{found} rows where the header promises {rows}: the file is cut");
                return Err(FileError::whole(&self.name, message).cut_if(found < rows));
            }
            _ => {}
        }
        let hash = self.fact::<String>(hash_key)?;
        if let (Some((key, line)), true) = (self.others.first(), hash.is_some()) {
            return Err(self.error(*line, format!("{key}: allowed is a value in JSON")));
        }
        if let Some(hash) = hash
            && hash != self.hash()
        {
            let message = format!(
                "the rows are not those that {hash_key} was made of: the file was cut or edited; \
                 allowed: the rows as they were, or a header without {hash_key}"
            );
            return Err(match ended {
                true => self.fact_error(hash_key, message),
                false => FileError::whole(&self.name, message).cut_if(true),
            });
        }
        Ok(())
    }

    /// Columns that are passed over, by their names in the file.
    pub(crate) fn passed_over(&self) -> Vec<&str> {
        let columns = self.columns.iter().zip(&self.labels);
        let over = columns.filter(|(ours, _)| ours.is_empty());
        over.map(|(_, label)| label.as_str()).collect()
    }

    /// Names the columns, each once and each known.
    fn name_columns(
        &mut self,
        labels: Vec<String>,
        line: usize,
        conventions: &Conventions,
        allowed: impl Fn(&Table) -> Result<Vec<String>, FileError>,
    ) -> Result<(), FileError> {
        self.drop_foreign_facts();
        let ours = conventions.our_names(&labels);
        (self.labels, self.head) = (labels, line);
        // What is allowed may depend on what there is.
        self.columns = ours.map_err(|message| self.error(line, message))?;
        let known = allowed(self)?;
        // There may be as many as a line has room for.
        let names: FxHashSet<&str> = known.iter().map(String::as_str).collect();
        let (mut seen, mut over) = (FxHashSet::default(), Vec::new());
        for (i, (column, label)) in self.columns.iter().zip(&self.labels).enumerate() {
            if column.is_empty() {
                continue;
            }
            if !seen.insert(column) {
                let column = excerpt(column);
                return Err(self.error(line, format!("column {column:?} is there twice")));
            }
            if names.contains(column.as_str()) {
                continue;
            }
            if conventions.columns.is_empty() || column != label {
                let message = self.unknown(column, &known);
                return Err(self.error(line, message));
            }
            over.push(i);
        }
        over.into_iter().for_each(|i| self.columns[i].clear());
        Ok(())
    }

    /// The sentence about a column that is none of the `known`: some of them, the one that may be
    /// meant, and how to pass it over.
    fn unknown(&self, column: &str, known: &[String]) -> String {
        let some = known.iter().take(NAMED).map(String::as_str);
        let (some, others) = (some.collect::<Vec<_>>(), known.len().saturating_sub(NAMED));
        let ours = self.labels.iter().find(|label| known.contains(label));
        let example = ours.map_or(String::new(), |ours| {
            format!(", e.g. --columns {0}={0}", excerpt(ours))
        });
        format!(
            "column {:?} is not known; allowed: {} and {others} others; with --columns, which says \
             their names in the file, others are passed over{example}{}",
            excerpt(column),
            some.join(", "),
            meant(column, known)
        )
    }

    fn read_csv(
        &mut self,
        text: &str,
        name_columns: impl Fn(&mut Self, Vec<String>, usize) -> Result<(), FileError>,
    ) -> Result<(), FileError> {
        let name = self.name.clone();
        let mut cells: Option<Cells> = None;
        for (i, content) in text.lines().enumerate() {
            let line = i + 1;
            let content = content.trim_matches(' ');
            if let Some(comment) = content.strip_prefix('#') {
                self.read_fact(comment, line)?;
                continue;
            }
            // A comment written by a spreadsheet, which quotes cells that contain a separator.
            if let Some(comment) = content.strip_prefix("\"#") {
                let comment = comment.trim_end_matches([',', ';', '\t']);
                let comment = comment.strip_suffix('"').unwrap_or(comment);
                self.read_fact(&comment.replace("\"\"", "\""), line)?;
                continue;
            }
            // A spreadsheet writes rows of nothing but separators below a table.
            if content.chars().all(|c| matches!(c, ',' | ';' | '\t' | ' ')) {
                continue;
            }
            let unclosed = || FileError::on_line(&name, line, "a quote is not closed").cut_if(true);
            let Some(cells) = &mut cells else {
                let found = [b';', b'\t', b',']
                    .into_iter()
                    .find(|s| content.as_bytes().contains(s));
                let cells = cells.insert(Cells::new(found.unwrap_or(b',')));
                let columns = cells.split(content).ok_or_else(unclosed)?;
                let columns = columns.map(String::from).collect();
                name_columns(self, columns, line)?;
                continue;
            };
            let comma = cells.separator != b',';
            let cells = cells.split(content).ok_or_else(unclosed)?;
            let (found, expected) = (cells.len(), self.columns.len());
            if found != expected {
                let message = format!("{found} cells where there are {expected} columns");
                return Err(self.error(line, message).cut_if(found < expected));
            }
            self.lines.push(line);
            for (d, cell) in cells.enumerate() {
                let value = if self.columns[d] == WORDS {
                    self.words.push(cell.to_owned());
                    Ok(f64::NAN)
                } else if is_mark(cell) && !self.columns[d].is_empty() {
                    self.marks.see(cell);
                    Ok(f64::NAN)
                } else if cell.is_empty() || self.columns[d].is_empty() {
                    Ok(f64::NAN)
                } else if comma && !cell.contains('.') {
                    self.parse(&cell.replacen(',', ".", 1), d, line)
                } else {
                    self.parse(cell, d, line)
                };
                self.numbers.push(value?);
            }
        }
        if cells.is_none() {
            let message = "there is no line that names the columns; allowed: CSV, JSON Lines";
            return Err(FileError::whole(&self.name, message));
        }
        Ok(())
    }

    fn parse(&self, cell: &str, column: usize, line: usize) -> Result<f64, FileError> {
        match cell.parse::<f64>() {
            // Programs without empty cells write NaN.
            Ok(value) if value.is_finite() || value.is_nan() => Ok(value),
            _ => {
                let (column, cell) = (self.label(column), excerpt(cell));
                let message = format!("{column} = {cell}: allowed is a finite number");
                Err(self.error(line, message))
            }
        }
    }

    /// A comment that is `key = value` is a fact; every other one is prose.
    fn read_fact(&mut self, comment: &str, line: usize) -> Result<(), FileError> {
        let is_key = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        let parts = comment
            .split_once('=')
            .map(|(key, value)| (key.trim(), value));
        let parts = parts.filter(|(key, _)| !key.is_empty() && key.chars().all(is_key));
        let Some((key, value)) = parts else {
            self.prose += 1;
            return Ok(());
        };
        let value = value.trim();
        // Spreadsheets pad short lines to the width of the table.
        let value = value.trim_end_matches([',', ';', '\t']);
        let value = match serde_json::from_str(value) {
            Ok(value) => value,
            // Names as people write them.
            Err(_) if ["material", "instrument"].contains(&key) => value.into(),
            Err(_) => {
                self.others.push((excerpt(key).into_owned(), line));
                return Ok(());
            }
        };
        self.facts.insert(key.into(), value);
        self.fact_lines.push((key.into(), line));
        Ok(())
    }

    fn read_json(
        &mut self,
        text: &str,
        name_columns: impl Fn(&mut Self, Vec<String>, usize) -> Result<(), FileError>,
    ) -> Result<(), FileError> {
        for (i, content) in text.lines().enumerate() {
            let line = i + 1;
            if content.trim().is_empty() {
                continue;
            }
            let Object { mut map, twice } = serde_json::from_str(content).map_err(|_| {
                self.error(
                    line,
                    "this is no JSON object; allowed: one whole object a line",
                )
                .cut_if(true)
            })?;
            if let Some(key) = twice {
                let message = format!("key {:?} is there twice; allowed: once", excerpt(&key));
                return Err(self.error(line, message));
            }
            if let Some(Value::Object(header)) = map.remove(HEADER) {
                if self.head > 0 || !self.facts.is_empty() {
                    return Err(self.error(line, "the header must be the first line"));
                }
                self.fact_lines = header.keys().map(|key| (key.clone(), line)).collect();
                self.facts = header;
                if self.is_ours()
                    && let Some(columns) = self.fact::<Map<String, Value>>("columns")?
                {
                    let columns = columns.into_iter().map(|(name, _)| name).collect();
                    name_columns(self, columns, line)?;
                }
                continue;
            }
            if self.columns.is_empty() {
                name_columns(self, map.keys().cloned().collect(), line)?;
            }
            self.read_object(map, line)?;
        }
        if self.columns.is_empty() {
            return Err(FileError::whole(&self.name, "there is no row"));
        }
        Ok(())
    }

    fn read_object(
        &mut self,
        mut object: Map<String, Value>,
        line: usize,
    ) -> Result<(), FileError> {
        self.lines.push(line);
        for d in 0..self.columns.len() {
            let column = self.label(d);
            let Some(value) = object.remove(&self.labels[d]) else {
                return Err(self.error(line, format!("{column} is missing")));
            };
            let number = match (&value, self.columns[d] == WORDS) {
                _ if self.columns[d].is_empty() => f64::NAN,
                (Value::String(words), true) => {
                    self.words.push(words.clone());
                    f64::NAN
                }
                (Value::Null, false) => f64::NAN,
                (Value::Number(number), false) => match number.as_f64() {
                    Some(value) if value.is_finite() => value,
                    _ => {
                        let message = format!("{column} = {number}: allowed is a finite number");
                        return Err(self.error(line, message));
                    }
                },
                (other, words) => {
                    let kind = if words { "a string" } else { "a finite number" };
                    let other = other.to_string();
                    let other = excerpt(&other);
                    let message = format!("{column} = {other}: allowed is {kind}");
                    return Err(self.error(line, message));
                }
            };
            self.numbers.push(number);
        }
        match object.keys().next() {
            Some(stray) => {
                let (stray, known) = (excerpt(stray), reason(self.labels.join(", ")));
                let message =
                    format!("{stray:?} is no column of the rows before; allowed: {known}");
                Err(self.error(line, message))
            }
            None => Ok(()),
        }
    }
}

/// A line, and a key that it or its header has twice: a plain map would keep the last.
#[derive(Default)]
struct Object {
    map: Map<String, Value>,
    twice: Option<String>,
}

impl<'de> Deserialize<'de> for Object {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Object::default())
    }
}

impl<'de> Visitor<'de> for Object {
    type Value = Self;

    fn expecting(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str("a row, or a header that is an object")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut entries: A) -> Result<Self, A::Error> {
        while let Some(key) = entries.next_key::<String>()? {
            let value = if key == HEADER {
                let header: Object = entries.next_value()?;
                self.twice = self.twice.or(header.twice);
                Value::Object(header.map)
            } else {
                entries.next_value()?
            };
            if self.map.insert(key.clone(), value).is_some() {
                self.twice = Some(key);
            }
        }
        Ok(self)
    }
}
