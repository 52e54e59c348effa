//! Tables that are printed for people, or written for programs.

use super::{one_value, print, refuse_unwritable, write_file};
use crate::error::Error;
use crate::report::{rows_csv, rows_json};
use clap::builder::TypedValueParser;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Formats of what is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// For people
    Text,
    Csv,
    Json,
}

/// Reads the name of one of some formats.
pub(super) fn one_format<const N: usize>(of: [Format; N]) -> impl TypedValueParser<Value = Format> {
    let value = |format: Format| Some((format, format.to_possible_value()?));
    one_value(of.into_iter().filter_map(value).collect())
}

/// `--json`, where a table is printed for people.
#[derive(Clone, Copy, Debug, Args)]
pub(super) struct JsonArgs {
    /// Print JSON, for programs
    #[arg(long)]
    json: bool,
}

impl JsonArgs {
    pub(super) fn wanted(self) -> bool {
        self.json
    }

    /// Prints a value as JSON, or as text for people.
    pub(super) fn print<V: Serialize>(
        self,
        value: &V,
        text: impl FnOnce(&V) -> String,
    ) -> Result<(), Error> {
        match self.json {
            true => print_json(value),
            false => print(&text(value)),
        }
    }
}

pub(super) fn print_json(value: &impl Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(Error::internal)?;
    print(&(text + "\n"))
}

/// Refuses a name that promises another kind of file than is written, if there is one.
pub(super) fn refuse_other_endings(path: Option<&Path>, ending: &str) -> Result<(), Error> {
    let has_it = |path: &&Path| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case(ending))
    };
    let Some(path) = path.filter(|path| !has_it(path)) else {
        return Ok(());
    };
    let kind = ending.to_uppercase();
    let message = format!("this picture is {kind}; allowed: a name that ends in .{ending}");
    Err(Error::output(path, message))
}

/// Where a picture of what is printed goes.
#[derive(Debug, Args)]
pub(super) struct DrawingArgs {
    /// Draw it into this file (*.svg) as well
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long, requires = "output")]
    force: bool,
}

impl DrawingArgs {
    /// Refuses what cannot be written, and to replace a file unless `force`; before anything is computed.
    pub(super) fn check(&self) -> Result<(), Error> {
        let path = self.output.as_deref();
        path.map_or(Ok(()), |path| refuse_unwritable(path, self.force))?;
        refuse_other_endings(path, "svg")
    }

    /// Draws, if that is asked for.
    pub(super) fn write(&self, svg: impl FnOnce() -> Result<String, Error>) -> Result<(), Error> {
        match &self.output {
            Some(path) => write_text(path, &svg()?),
            None => Ok(()),
        }
    }
}

/// Writes a file of text, and says so.
pub(super) fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    write_file(path, |out| out.write_all(text.as_bytes()))
}

/// How, and where to.
#[derive(Debug, Args)]
pub(super) struct OutputArgs {
    /// Format of the table
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    /// JSON: the same as --format json
    #[arg(long, conflicts_with = "format")]
    json: bool,
    /// Write the table to this file instead of printing it
    #[arg(short, long, value_name = "FILE", group = "files")]
    output: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long, requires = "files")]
    force: bool,
}

impl OutputArgs {
    /// Refuses to replace a file unless `force`; before anything is computed.
    pub(super) fn check(&self) -> Result<(), Error> {
        self.check_also(self.output.as_deref())
    }

    /// Refuses to replace a file beside the table unless `force`.
    pub(super) fn check_also(&self, file: Option<&Path>) -> Result<(), Error> {
        file.map_or(Ok(()), |path| refuse_unwritable(path, self.force))
    }

    /// The output file, or `stdout`, for messages.
    pub(super) fn place(&self) -> &Path {
        self.output.as_deref().unwrap_or(Path::new("stdout"))
    }

    /// Prints or writes rows, whose columns are named as their fields.
    pub(super) fn write_rows<T: Serialize>(
        &self,
        rows: &[T],
        text: impl FnOnce(&[T]) -> String,
    ) -> Result<(), Error> {
        self.write(rows, text, rows_csv, rows_json)
    }

    /// Prints or writes rows.
    pub(super) fn write<R: ?Sized>(
        &self,
        rows: &R,
        text: impl FnOnce(&R) -> String,
        csv: impl FnOnce(&R) -> String,
        json: impl FnOnce(&R) -> String,
    ) -> Result<(), Error> {
        let format = if self.json { Format::Json } else { self.format };
        let made = match format {
            Format::Text => text(rows),
            Format::Csv => csv(rows),
            Format::Json => json(rows),
        };
        match &self.output {
            Some(path) => write_text(path, &made),
            None => print(&made),
        }
    }
}
