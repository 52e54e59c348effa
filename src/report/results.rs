//! `results.csv` and `results.jsonl`: the same rows, the same columns, written as they come; and
//! the tables of other experiments.

use crate::experiment::Row;
use std::fs::{File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes rows to both files, under names that end in `.part` until the run is over: whoever sees
/// a `results.csv` sees a whole one.
pub struct ResultFiles {
    csv: csv::Writer<File>,
    json_lines: BufWriter<File>,
    dir: PathBuf,
    rows: usize,
}

impl ResultFiles {
    /// The names of the finished files.
    pub const NAMES: [&str; 2] = ["results.csv", "results.jsonl"];

    /// Starts both files in a folder that has neither.
    ///
    /// # Errors
    /// Whatever the file system reports.
    pub fn create(dir: &Path) -> io::Result<Self> {
        let [csv, json_lines] = Self::NAMES.map(|name| File::create_new(part(dir, name)));
        let csv = csv?;
        // Tells [`going_on`]. Where the file system has no locks the run goes on without.
        let _ = csv.try_lock();
        // The header is written here, so that a file without rows has one too.
        let mut csv = csv::WriterBuilder::new()
            .has_headers(false)
            .from_writer(csv);
        csv.write_record(Row::COLUMNS.map(|(name, _)| name))?;
        Ok(Self {
            csv,
            json_lines: BufWriter::new(json_lines?),
            dir: dir.to_owned(),
            rows: 0,
        })
    }

    /// Appends rows and hands them to the system, so that a crash loses none of them.
    ///
    /// # Errors
    /// Whatever the file system reports.
    pub fn write(&mut self, rows: &[Row]) -> io::Result<()> {
        for row in rows {
            self.csv.serialize(row)?;
            serde_json::to_writer(&mut self.json_lines, row)?;
            self.json_lines.write_all(b"\n")?;
        }
        self.rows += rows.len();
        self.csv.flush()?;
        self.json_lines.flush()
    }

    /// Rows written so far.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Gives the files their names.
    ///
    /// # Errors
    /// Whatever the file system reports.
    pub fn finish(mut self) -> io::Result<()> {
        self.write(&[])?;
        for name in Self::NAMES {
            std::fs::rename(part(&self.dir, name), self.dir.join(name))?;
        }
        Ok(())
    }
}

/// A table of texts that grows row by row, under a name that ends in `.part` until the run is over.
pub(super) struct TableFile {
    name: &'static str,
    csv: csv::Writer<File>,
    dir: PathBuf,
    rows: usize,
}

impl TableFile {
    /// The names of the finished files.
    pub(super) const NAMES: [&'static str; 2] = ["profiles.csv", "relations.csv"];

    pub(super) fn create(dir: &Path, name: &'static str, columns: Vec<String>) -> io::Result<Self> {
        let file = File::create_new(part(dir, name))?;
        // Tells [`going_on`]. Where the file system has no locks the run goes on without.
        let _ = file.try_lock();
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record(columns)?;
        Ok(Self {
            name,
            csv,
            dir: dir.to_owned(),
            rows: 0,
        })
    }

    pub(super) fn name(&self) -> &'static str {
        self.name
    }

    pub(super) fn write(&mut self, rows: impl Iterator<Item = Vec<String>>) -> io::Result<()> {
        for fields in rows {
            self.csv.write_record(fields)?;
            self.rows += 1;
        }
        self.csv.flush()
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.csv.flush()?;
        std::fs::rename(part(&self.dir, self.name), self.dir.join(self.name))
    }
}

/// True if a run is writing into this folder at this moment.
pub(super) fn going_on(dir: &Path) -> bool {
    let mut names = TableFile::NAMES.iter().chain(&ResultFiles::NAMES[..1]);
    names.any(|name| {
        let file = File::open(part(dir, name));
        let lock = file.as_ref().map(File::try_lock);
        matches!(lock, Ok(Err(TryLockError::WouldBlock)))
    })
}

/// The name of something that is not finished.
pub(super) fn part(dir: &Path, name: &str) -> PathBuf {
    dir.join(format!("{name}.part"))
}
