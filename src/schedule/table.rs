//! Tables of poses as text: CSV and JSON Lines, with facts about the table in front.
//!
//! A CSV begins with comment lines: prose, the facts (`# key = value`, the value in JSON) and what
//! the columns mean (`# column: meaning`). A JSON Lines file begins with one `{"header": …}` object
//! that holds the same. Both carry a hash of their rows, so that a row that was cut or changed is
//! noticed; the hash is of the values, so that both formats of one table have the same.

#[cfg(feature = "arrays")]
mod arrays;
mod cells;
mod head;
mod json;
mod matrix;
#[cfg(feature = "arrays")]
mod npy;
mod open;
mod read;
mod write;

#[cfg(feature = "arrays")]
pub(crate) use arrays::as_lines;
pub(crate) use head::number;
pub(crate) use read::Table;
pub(crate) use write::{Cell, Column, Part, Sheet};

use crate::error::{Cause, Error, printable};
use crate::files;
use std::io;
use std::path::Path;

/// The text of a file of poses: of an archive of NumPy the equivalent one.
pub(crate) fn as_text(path: &Path) -> Result<String, FileError> {
    let name = path.display().to_string();
    let failed = |e: io::Error| FileError::whole(&name, format!("cannot read this file: {e}"));
    #[cfg(feature = "arrays")]
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("npz"))
    {
        let bytes = files::read(path, files::TABLE_LIMIT).map_err(failed)?;
        return as_lines(&bytes, &name);
    }
    files::read_foreign_text(path, files::TABLE_LIMIT).map_err(failed)
}

/// Forms of a table with a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScheduleFormat {
    /// Comma-separated values with a commented header.
    Csv,
    /// One JSON object per line, the first one the header.
    JsonLines,
    /// An archive of NumPy, an array a column.
    #[cfg(feature = "arrays")]
    Arrays,
}

impl ScheduleFormat {
    /// The form of a text: JSON Lines begin with an object.
    pub fn of_text(text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        match text.trim_start().starts_with('{') {
            true => Self::JsonLines,
            false => Self::Csv,
        }
    }
}

/// Columns that hold whole numbers.
pub(crate) const WHOLE: [&str; 4] = ["index", "block", "attempt", "stop"];

/// The column that holds words.
pub(crate) const WORDS: &str = "flags";

/// What is wrong with a file, and where.
#[derive(Debug, thiserror::Error)]
#[error("{}: {message}", self.place())]
pub struct FileError {
    /// Name of the file.
    pub name: String,
    /// The line, from 1, if the error is about one.
    pub line: Option<usize>,
    /// The message, one sentence.
    pub message: String,
    /// Why, if the sentence does not say it.
    #[source]
    pub source: Option<Cause>,
    /// True if the end of the file may be missing.
    pub is_cut: bool,
}

impl FileError {
    /// An error about one line of a file.
    pub(crate) fn on_line(name: &str, line: usize, message: impl Into<String>) -> Self {
        Self {
            line: Some(line),
            ..Self::whole(name, message)
        }
    }

    /// An error about a whole file.
    pub(crate) fn whole(name: &str, message: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            line: None,
            message: printable(&message.into()).into_owned(),
            source: None,
            is_cut: false,
        }
    }

    /// This error with its cause.
    pub(crate) fn because(self, cause: impl Into<Cause>) -> Self {
        let source = Some(cause.into());
        Self { source, ..self }
    }

    /// This error, with a note that the end of the file may be missing if `is_cut`.
    pub(crate) fn cut_if(self, is_cut: bool) -> Self {
        Self { is_cut, ..self }
    }

    /// `file:line`, or the file.
    fn place(&self) -> String {
        match self.line {
            Some(line) => format!("{}:{line}", self.name),
            None => self.name.clone(),
        }
    }
}

impl From<FileError> for Error {
    fn from(e: FileError) -> Self {
        Error::Data {
            path: e.place().into(),
            message: e.message,
            source: e.source,
        }
    }
}

/// Hash of a table's rows: the names of its columns, then cell after cell.
struct RowHash(blake3::Hasher);

impl RowHash {
    fn new<'a>(columns: impl Iterator<Item = &'a str>) -> Self {
        let mut hasher = blake3::Hasher::new();
        for column in columns {
            hasher.update(column.as_bytes());
            hasher.update(b",");
        }
        Self(hasher)
    }

    fn add(&mut self, cell: &Cell) {
        let hasher = &mut self.0;
        match cell {
            Cell::Empty => hasher.update(b"e"),
            Cell::Number(value) => hasher.update(b"n").update(&value.to_bits().to_le_bytes()),
            Cell::Words(text) => {
                let length = text.len() as u64;
                hasher.update(b"w").update(&length.to_le_bytes());
                hasher.update(text.as_bytes())
            }
        };
    }

    fn finish(&self) -> String {
        self.0.finalize().to_hex().to_string()
    }
}
