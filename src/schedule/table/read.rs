//! Reading of tables.
//!
//! Tables come from here, from other programs, or out of a spreadsheet: a byte-order
//! mark, CRLF, blank lines, spaces, quotes, semicolons or tabs between cells, and with either a comma
//! in place of the decimal point are all taken as they are.

use super::super::convention::{Conventions, NamedColumn, Unsaid};
use super::super::names;
use super::cells::Cells;
use super::head::{self, Head};
use super::{Cell, FileError, RowHash, WORDS};
use crate::brdf::marks::{Marks, is_among, is_mark, marks_among};
use crate::error::{count, excerpt, meant};
use rustc_hash::FxHashSet;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::borrow::Cow;

/// Names of columns that a refusal lists.
const NAMED: usize = 7;

/// A table that was read. Cells are numbers but for one column of words.
#[derive(Debug, Default)]
pub(crate) struct Table {
    pub name: String,
    /// Our names of the columns, in the order of the file; none of one that is passed over.
    pub columns: Vec<String>,
    /// Their names in the file.
    pub labels: Vec<String>,
    /// The line that names them.
    pub head: usize,
    pub lines: Vec<usize>,
    pub(super) facts: Map<String, Value>,
    pub(super) fact_lines: Vec<(String, usize)>,
    /// Keys whose values are not JSON, and their lines.
    others: Vec<(String, usize)>,
    /// Comments that are no keys.
    pub(super) prose: usize,
    /// Row-major; NaN is an empty cell.
    pub(super) numbers: Vec<f64>,
    /// Words, one text per row, if there is a column of words.
    pub(super) words: Vec<String>,
    /// Texts in place of values.
    pub marks: Marks,
    /// What is said of how it was read, a sentence each.
    pub notes: Vec<String>,
    /// How the columns were named.
    named: Vec<NamedColumn>,
}

/// Keys that are read of any header.
const SHARED: &str = "foreign_header half_angles_deg instrument material parametrization symmetry";

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

    /// A fact of the header, or the error of one of another type.
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
    pub(crate) fn is_ours(&self) -> bool {
        let mut keys = self.facts.keys();
        keys.any(|key| key.ends_with("_hash") || key == "sample_set")
    }

    /// Sets keys of a header by others aside that mean something else there, e.g. `rows`.
    fn drop_foreign_facts(&mut self) {
        if self.is_ours() {
            return;
        }
        self.facts.retain(|key, _| is_in(SHARED, key));
        let is_other = |(key, _): &mut (String, usize)| !self.facts.contains_key(key);
        let others = self.fact_lines.extract_if(.., is_other);
        self.others.extend(others);
    }

    /// Header content that is not read: keys, and the number of other comments.
    pub(crate) fn unread(&self) -> Vec<String> {
        let is_read = |key: &str| is_in(SHARED, key) || is_in(OURS, key) || key.ends_with("_hash");
        let keys = self.facts.keys().filter(|key| !is_read(key)).cloned();
        let others = self.others.iter().map(|(key, _)| key.clone());
        let mut unread: Vec<String> = keys.chain(others).collect();
        // Ours are written anew.
        let is_intact = self.facts.keys().any(|key| key.ends_with("_hash"));
        if self.prose > 0 && !is_intact {
            unread.push(count(self.prose, "comment"));
        }
        unread
    }

    pub(crate) fn fact_error(&self, key: &str, message: impl Into<String>) -> FileError {
        let line = self.fact_lines.iter().find(|(k, _)| k == key);
        FileError::on_line(&self.name, line.map_or(1, |(_, line)| *line), message)
    }

    pub(crate) fn row_error(&self, row: usize, message: impl Into<String>) -> FileError {
        FileError::on_line(&self.name, self.lines[row], message)
    }

    /// The name of a column in the file, as messages repeat it.
    pub(crate) fn label(&self, column: usize) -> Cow<'_, str> {
        excerpt(&self.labels[column])
    }

    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == name)
    }

    /// The number in a cell; `None` if it is empty.
    pub(crate) fn number(&self, row: usize, column: usize) -> Option<f64> {
        let value = self.numbers[row * self.columns.len() + column];
        (!value.is_nan()).then_some(value)
    }

    pub(crate) fn clear(&mut self, row: usize, column: usize) {
        self.numbers[row * self.columns.len() + column] = f64::NAN;
    }

    /// The words of a row; empty if there are none.
    pub(crate) fn words(&self, row: usize) -> &str {
        self.words.get(row).map_or("", String::as_str)
    }

    pub(crate) fn pass_over(&mut self, column: usize) {
        self.columns[column].clear();
    }

    /// Puts one column in place of several: its numbers are `of` those of a row, empty where one of them is, or stands for no reading.
    pub(crate) fn combine(
        &mut self,
        columns: &[usize],
        name: &str,
        no_reading: Option<f64>,
        of: impl Fn(&[f64]) -> f64,
    ) {
        let width = self.columns.len();
        let column = |d: usize| self.numbers.iter().skip(d).step_by(width).copied();
        let marks = |&d: &usize| marks_among(column(d).filter(|x| !x.is_nan()), no_reading);
        let marks: Vec<Vec<f64>> = columns.iter().map(marks).collect();
        let stays = |d: &usize| *d == columns[0] || !columns.contains(d);
        let kept: Vec<usize> = (0..width).filter(stays).collect();
        let mut numbers = Vec::with_capacity(self.lines.len() * kept.len());
        for row in self.numbers.chunks_exact(width) {
            let parts: Vec<f64> = columns.iter().map(|&d| row[d]).collect();
            let mut each = parts.iter().zip(&marks);
            let combined = match each.find(|(x, all)| is_among(**x, all)) {
                Some((mark, _)) => {
                    self.marks.see(&mark.to_string());
                    f64::NAN
                }
                None => of(&parts),
            };
            let cell = |&d: &usize| if d == columns[0] { combined } else { row[d] };
            numbers.extend(kept.iter().map(cell));
        }
        self.numbers = numbers;
        self.columns[columns[0]] = name.into();
        for names in [&mut self.columns, &mut self.labels] {
            let name = |&d: &usize| std::mem::take(&mut names[d]);
            *names = kept.iter().map(name).collect();
        }
    }

    pub(crate) fn retain(&mut self, keep: impl Fn(&Self, usize) -> bool) {
        let kept = (0..self.lines.len()).filter(|&row| keep(self, row));
        let kept: Vec<usize> = kept.collect();
        let width = self.columns.len();
        let cells = |&row: &usize| &self.numbers[row * width..(row + 1) * width];
        self.numbers = kept.iter().flat_map(cells).copied().collect();
        // Without a column of words there are none.
        let words = |&row: &usize| self.words.get_mut(row).map(std::mem::take);
        self.words = kept.iter().filter_map(words).collect();
        self.lines = kept.iter().map(|&row| self.lines[row]).collect();
    }

    pub(crate) fn hash(&self) -> String {
        let mut hash = RowHash::new(self.labels.iter().map(String::as_str));
        for row in 0..self.lines.len() {
            for (d, name) in self.columns.iter().enumerate() {
                hash.add(&match name.as_str() {
                    WORDS => Cell::Words(self.words(row).into()),
                    _ => self.number(row, d).into(),
                });
            }
        }
        hash.finish()
    }

    pub(super) fn error(&self, line: usize, message: impl Into<String>) -> FileError {
        FileError::on_line(&self.name, line, message)
    }

    /// Checks the rows against the facts; of a part of them there is no hash. Of the last row digits
    /// may be missing, unless it `ended`.
    pub(super) fn keeps_promises(
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
    pub(crate) fn passed_over(&self) -> Vec<String> {
        let columns = self.columns.iter().zip(&self.labels);
        let over = columns.filter(|(ours, _)| ours.is_empty());
        over.map(|(_, label)| label.clone()).collect()
    }

    /// Names the columns, each once and each known.
    pub(super) fn name_columns(
        &mut self,
        labels: Vec<String>,
        line: usize,
        conventions: &Conventions,
        allowed: impl Fn(&Table) -> Result<Vec<String>, FileError>,
    ) -> Result<(), FileError> {
        self.drop_foreign_facts();
        let named = conventions.our_names(&labels);
        (self.labels, self.head) = (labels, line);
        self.named = named.map_err(|message| self.error(line, message))?;
        // What is allowed may depend on what there is.
        let columns = self.named.iter().map(|column| column.name.clone());
        self.columns = columns.collect();
        let known = allowed(self)?;
        // There may be as many as a line has room for.
        let names: FxHashSet<&str> = known.iter().map(String::as_str).collect();
        let (mut seen, mut over) = (FxHashSet::default(), Vec::new());
        for (i, column) in self.columns.iter().enumerate() {
            if column.is_empty() {
                continue;
            }
            if names.contains(column.as_str()) {
                if !seen.insert(column) {
                    let column = excerpt(column);
                    return Err(self.error(line, format!("column {column:?} is there twice")));
                }
                continue;
            }
            let is_given = self.named[i].is_given;
            if conventions.columns.is_empty() || is_given {
                let column = if is_given { column } else { &self.labels[i] };
                return Err(self.error(line, self.unknown(column, &known)));
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
        let guess = names::guess(&self.labels);
        if let (Some(guess), "1") = (&guess, column) {
            return format!(
                "no line names the columns, which --columns does by their numbers; a guess: {guess}"
            );
        }
        let ours = self.labels.iter().find(|label| known.contains(label));
        let example = match (guess, ours) {
            (Some(guess), _) => format!("; a guess: {guess}"),
            (None, Some(ours)) => format!(", e.g. --columns {0}={0}", excerpt(ours)),
            (None, None) => String::new(),
        };
        format!(
            "column {:?} is not known; allowed: {} and {others} others; with --columns, which says \
             their names in the file, others are passed over{example}{}",
            excerpt(column),
            some.join(", "),
            meant(column, known)
        )
    }

    /// Finds the units that nothing names in the numbers, and brings all numbers to ours.
    pub(super) fn settle_units(&mut self) -> Result<(), FileError> {
        for unsaid in [Unsaid::Angle, Unsaid::Wavelength] {
            let is_of = |d: &usize| self.named[*d].unsaid == Some(unsaid);
            let columns: Vec<usize> = (0..self.named.len()).filter(is_of).collect();
            let Some(&first) = columns.first() else {
                continue;
            };
            let (table, rows) = (&*self, 0..self.lines.len());
            let cells = rows.flat_map(|row| columns.iter().map(move |&d| table.number(row, d)));
            let numbers = cells.flatten().map(f64::abs);
            let least = numbers.clone().fold(f64::INFINITY, f64::min);
            let most = numbers.fold(0.0, f64::max);
            let Some((unit, factor)) = unsaid.unit([least, most]) else {
                let message = unsaid.refuse(&self.label(first));
                return Err(self.error(self.head, message));
            };
            let labels: Vec<_> = columns.iter().map(|&d| self.label(d)).collect();
            self.notes.push(format!(
                "no unit of {} is named: taken for {unit}, as the numbers can be nothing else",
                labels.join(", ")
            ));
            columns.iter().for_each(|&d| self.named[d].factor = factor);
        }
        for (d, NamedColumn { factor, .. }) in self.named.iter().enumerate() {
            if *factor == 1.0 {
                continue;
            }
            for number in self.numbers.iter_mut().skip(d).step_by(self.named.len()) {
                // Digits beyond those of the file are rounding.
                *number = (*number * factor * 1e9).round() / 1e9;
            }
        }
        Ok(())
    }

    pub(super) fn read_csv(
        &mut self,
        text: &str,
        conventions: &Conventions,
        name_columns: impl Fn(&mut Self, Vec<String>, usize) -> Result<(), FileError>,
    ) -> Result<(), FileError> {
        let Some(head) = Head::find(text, conventions) else {
            let message = "there is no line that names the columns; allowed: CSV, JSON Lines";
            return Err(FileError::whole(&self.name, message));
        };
        self.prose += head.prose;
        let mut cells = Cells::new(head.separator);
        let comma = head.separator != b',';
        let mut of_head: Vec<&str> = Vec::new();
        for (line, content) in (1..).zip(text.lines()) {
            let content = content.trim_matches(' ');
            if line == head.line {
                name_columns(self, head.labels.clone(), line)?;
            }
            if let Some(comment) = head::comment(content) {
                if line != head.line && content.starts_with('"') {
                    // Written by a spreadsheet, which quotes cells that contain a separator.
                    let comment = comment.trim_end_matches([',', ';', '\t']);
                    let comment = comment.strip_suffix('"').unwrap_or(comment);
                    self.read_fact(&comment.replace("\"\"", "\""), line);
                } else if line != head.line {
                    self.read_fact(comment, line);
                }
                continue;
            }
            // Names may be there again, as of files that were put together.
            if (head.line..=head.last).contains(&line) {
                of_head.push(content);
            }
            if line <= head.last || head::is_empty(content) || of_head.contains(&content) {
                continue;
            }
            let unclosed = || self.error(line, "a quote is not closed").cut_if(true);
            let cells = cells.split(content).ok_or_else(unclosed)?;
            let (found, expected) = (cells.len(), self.columns.len());
            if found != expected {
                let message = format!("{found} cells where there are {expected} columns");
                return Err(self.error(line, message).cut_if(found < expected));
            }
            self.lines.push(line);
            for (d, cell) in cells.enumerate() {
                let value = match self.columns[d] == WORDS {
                    true => {
                        self.words.push(cell.to_owned());
                        f64::NAN
                    }
                    false => self.cell(cell, comma, d, line)?,
                };
                self.numbers.push(value);
            }
        }
        Ok(())
    }

    /// The number in a cell of a column; NaN of one that is empty or a mark, or that is passed over.
    pub(super) fn cell(
        &mut self,
        cell: &str,
        comma: bool,
        column: usize,
        line: usize,
    ) -> Result<f64, FileError> {
        if cell.is_empty() || self.columns[column].is_empty() {
            return Ok(f64::NAN);
        }
        if is_mark(cell) {
            self.marks.see(cell);
            return Ok(f64::NAN);
        }
        match head::number(cell, comma) {
            // Programs without empty cells write NaN.
            Some(value) if value.is_finite() || value.is_nan() => Ok(value),
            _ => {
                let (column, cell) = (self.label(column), excerpt(cell));
                let message = format!("{column} = {cell}: allowed is a finite number");
                Err(self.error(line, message))
            }
        }
    }

    /// A comment that is `key = value` is a fact; every other one is prose.
    fn read_fact(&mut self, comment: &str, line: usize) {
        let is_key = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        let (key, value) = comment.split_once('=').unwrap_or_default();
        let key = key.trim();
        if key.is_empty() || !key.chars().all(is_key) {
            self.prose += 1;
            return;
        }
        // Spreadsheets pad short lines to the width of the table.
        let value = value.trim().trim_end_matches([',', ';', '\t']);
        let value = match serde_json::from_str(value) {
            Ok(value) => value,
            // Names as people write them.
            Err(_) if ["material", "instrument"].contains(&key) => value.into(),
            Err(_) => return self.others.push((excerpt(key).into_owned(), line)),
        };
        self.facts.insert(key.into(), value);
        self.fact_lines.push((key.into(), line));
    }
}
