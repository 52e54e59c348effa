//! Writing of tables.

use super::{RowHash, ScheduleFormat, WHOLE};
use serde_json::{Map, Value, json};
use std::io::{self, Write};

/// One cell of a row.
pub(crate) enum Cell {
    Empty,
    Number(f64),
    /// Words; nothing that a CSV would have to quote.
    Words(String),
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        value.map_or(Self::Empty, Self::Number)
    }
}

/// Name of a column, and its number of a `T`.
pub(crate) type Part<T> = (&'static str, fn(&T) -> f64);

/// A column of a table that is written.
pub(crate) struct Column<'a> {
    pub name: String,
    /// The meaning of its values.
    pub meaning: String,
    /// The cell of a row.
    pub cell: Box<dyn Fn(usize) -> Cell + 'a>,
}

impl<'a> Column<'a> {
    pub(crate) fn new<C: Into<Cell>>(
        name: impl Into<String>,
        meaning: impl Into<String>,
        cell: impl Fn(usize) -> C + 'a,
    ) -> Self {
        Self {
            name: name.into(),
            meaning: meaning.into(),
            cell: Box::new(move |row| cell(row).into()),
        }
    }
}

/// A table that is ready to be written.
pub(crate) struct Sheet<'a> {
    /// Description of the file, one sentence per line.
    pub about: Vec<String>,
    /// Facts for programs, by key.
    pub facts: Map<String, Value>,
    pub columns: Vec<Column<'a>>,
    pub rows: usize,
}

impl Sheet<'_> {
    pub(crate) fn hash(&self) -> String {
        let mut hash = RowHash::new(self.columns.iter().map(|column| column.name.as_str()));
        for row in 0..self.rows {
            for column in &self.columns {
                hash.add(&(column.cell)(row));
            }
        }
        hash.finish()
    }

    /// Writes the table; its hash becomes the fact `hash_key`.
    pub(crate) fn write(
        mut self,
        format: ScheduleFormat,
        hash_key: &str,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let hash = self.hash();
        self.facts.insert("rows".into(), json!(self.rows));
        self.facts.insert(hash_key.into(), json!(hash));
        match format {
            ScheduleFormat::Csv => self.write_csv(out),
            ScheduleFormat::JsonLines => self.write_json(out),
            #[cfg(feature = "arrays")]
            ScheduleFormat::Arrays => self.write_arrays(out),
        }
    }

    fn write_csv(&self, out: &mut dyn Write) -> io::Result<()> {
        for line in &self.about {
            writeln!(out, "# {line}")?;
        }
        for (key, value) in &self.facts {
            writeln!(out, "# {key} = {value}")?;
        }
        for Column { name, meaning, .. } in &self.columns {
            writeln!(out, "# {name}: {meaning}")?;
        }
        let names: Vec<_> = self.columns.iter().map(|c| quoted(&c.name)).collect();
        writeln!(out, "{}", names.join(","))?;
        for row in 0..self.rows {
            for (d, column) in self.columns.iter().enumerate() {
                if d > 0 {
                    out.write_all(b",")?;
                }
                match (column.cell)(row) {
                    Cell::Empty => {}
                    Cell::Number(value) => write!(out, "{value}")?,
                    Cell::Words(text) => write!(out, "{text}")?,
                }
            }
            out.write_all(b"\n")?;
        }
        out.flush()
    }

    /// Description, facts and columns, as the first line of JSON Lines holds them.
    pub(super) fn header(&self) -> Value {
        let mut header = Map::new();
        header.insert("about".into(), json!(self.about));
        header.extend(self.facts.clone());
        let meanings = self.columns.iter();
        let meanings = meanings.map(|c| (c.name.clone(), json!(c.meaning)));
        header.insert("columns".into(), Value::Object(meanings.collect()));
        json!({ "header": header })
    }

    fn write_json(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "{}", self.header())?;
        for row in 0..self.rows {
            let cells = self.columns.iter().map(|Column { name, cell, .. }| {
                let value = match cell(row) {
                    Cell::Empty => Value::Null,
                    Cell::Number(value) if WHOLE.contains(&name.as_str()) => json!(value as u64),
                    Cell::Number(value) => json!(value),
                    Cell::Words(text) => json!(text),
                };
                (name.clone(), value)
            });
            writeln!(out, "{}", Value::Object(cells.collect()))?;
        }
        out.flush()
    }
}

/// A name as a cell: that of an axis may hold a separator.
fn quoted(name: &str) -> String {
    if name.contains([',', ';', '\t', '"']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
