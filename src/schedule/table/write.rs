//! Writing of tables.

use super::super::format::ScheduleFormat;
use super::{RowHash, WHOLE};
use serde_json::{Map, Value, json};
use std::io::{self, Write};

/// One cell of a row.
pub(crate) enum Cell {
    /// No value.
    Empty,
    /// A number.
    Number(f64),
    /// Words; nothing that a CSV would have to quote.
    Words(String),
}

/// A table that is ready to be written.
pub(crate) struct Sheet<'a> {
    /// Description of the file, one sentence per line.
    pub about: Vec<String>,
    /// Facts for programs, by key.
    pub facts: Map<String, Value>,
    /// Names and meanings of the columns.
    pub columns: Vec<(String, String)>,
    /// Number of rows.
    pub rows: usize,
    /// Appends the cells of a row to an empty list.
    pub row: &'a dyn Fn(usize, &mut Vec<Cell>),
}

impl Sheet<'_> {
    /// The hash of the rows.
    pub fn hash(&self) -> String {
        let mut hash = RowHash::new(self.columns.iter().map(|(name, _)| name.as_str()));
        let mut cells = Vec::new();
        for i in 0..self.rows {
            self.fill(i, &mut cells);
            for cell in &cells {
                match cell {
                    Cell::Empty => hash.empty(),
                    Cell::Number(value) => hash.number(*value),
                    Cell::Words(text) => hash.words(text),
                }
            }
        }
        hash.finish()
    }

    pub(super) fn fill(&self, i: usize, cells: &mut Vec<Cell>) {
        cells.clear();
        (self.row)(i, cells);
        debug_assert_eq!(cells.len(), self.columns.len());
    }

    /// Writes the table; its hash becomes the fact `hash_key`.
    ///
    /// # Errors
    /// Whatever `out` reports.
    pub fn write(
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
        for (name, meaning) in &self.columns {
            writeln!(out, "# {name}: {meaning}")?;
        }
        let names: Vec<_> = self.columns.iter().map(|(name, _)| quoted(name)).collect();
        writeln!(out, "{}", names.join(","))?;
        let mut cells = Vec::new();
        for i in 0..self.rows {
            self.fill(i, &mut cells);
            for (d, cell) in cells.iter().enumerate() {
                if d > 0 {
                    out.write_all(b",")?;
                }
                match cell {
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
        let meanings = meanings.map(|(name, meaning)| (name.clone(), json!(meaning)));
        header.insert("columns".into(), Value::Object(meanings.collect()));
        json!({ "header": header })
    }

    fn write_json(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "{}", self.header())?;
        let mut cells = Vec::new();
        for i in 0..self.rows {
            self.fill(i, &mut cells);
            let mut object = Map::new();
            for ((name, _), cell) in self.columns.iter().zip(&cells) {
                let value = match cell {
                    Cell::Empty => Value::Null,
                    Cell::Number(value) if WHOLE.contains(&name.as_str()) => json!(*value as u64),
                    Cell::Number(value) => json!(value),
                    Cell::Words(text) => json!(text),
                };
                object.insert(name.clone(), value);
            }
            writeln!(out, "{}", Value::Object(object))?;
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
