//! The folder of a study.
//!
//! ```text
//! results.jsonl   one row per line, appended as they come; a run goes on from here
//! config.toml     the resolved config; running it again gives the same results
//! results.csv     the rows of the config in its order; written at the end
//! manifest.json   version, status, inputs, files; written last
//! ranking.csv     every choice at every allowance with its statistics
//! report.html     what it all says
//! pictures/       what it shows
//! ```

use super::csv::ranking_csv;
use crate::error::Error;
use crate::experiment::study::{Findings, RowKey, StudyRow};
use crate::files::write_atomically;
use crate::report::folder::{CONFIG, CONFIG_HEAD, MANIFEST, remove};
use crate::report::manifest::Manifest;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use toml::Table;

/// The file that a study goes on from.
pub const ROWS: &str = "results.jsonl";
const CSV: &str = "results.csv";
const RANKING: &str = "ranking.csv";
const REPORT: &str = "report.html";
const PICTURES: &str = "pictures";

/// A study's folder while the study goes on.
pub struct StudyFolder {
    dir: PathBuf,
    /// Open for appending, and locked.
    out: BufWriter<File>,
    rows: Vec<StudyRow>,
    files: BTreeSet<String>,
    /// What was drawn before does not count.
    redraw: bool,
}

impl StudyFolder {
    /// Opens a folder, which is made if need be, with the rows that are there. `force` drops them.
    ///
    /// # Errors
    /// [`Error::Output`] if it cannot be written to, if a run is going on there, or if something
    /// else is.
    pub fn open(dir: &Path, force: bool, resolved: &Table) -> Result<Self, Error> {
        let failed = |e: io::Error| {
            let message = format!("cannot write to this folder: {e}; choose another with -o");
            Error::output(dir, message)
        };
        if dir.exists() && !dir.is_dir() {
            return Err(Error::output(
                dir,
                "this is no folder; choose another with -o",
            ));
        }
        fs::create_dir_all(dir).map_err(failed)?;
        let path = dir.join(ROWS);
        if !path.exists()
            && let Some(name) = [CONFIG, MANIFEST, CSV]
                .into_iter()
                .find(|n| dir.join(n).exists())
        {
            let message =
                format!("{name} is here, and no study wrote it; choose another folder with -o");
            return Err(Error::output(dir, message));
        }
        let mut options = OpenOptions::new();
        let file = options.read(true).append(true).create(true).open(&path);
        let mut file = file.map_err(failed)?;
        // Where the file system has no locks the run goes on without.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let message = "a run is going on here; choose another folder with -o, or wait for it";
            return Err(Error::output(dir, message));
        }
        let rows = match read_file(&path, &mut file) {
            // What is dropped need not be understood, but must be ours.
            Ok(_) if force => {
                file.set_len(0).map_err(failed)?;
                Vec::new()
            }
            Ok((rows, whole)) => {
                // A line that a crash cut off.
                file.set_len(whole).map_err(failed)?;
                rows
            }
            Err(e) => return Err(e),
        };
        let config = toml::to_string(resolved).map_err(|e| failed(io::Error::other(e)))?;
        write_atomically(&dir.join(CONFIG), |out| {
            write!(out, "{CONFIG_HEAD}{config}")
        })
        .map_err(failed)?;
        Ok(Self {
            dir: dir.to_owned(),
            out: BufWriter::new(file),
            rows,
            files: BTreeSet::new(),
            redraw: force,
        })
    }

    /// True if the report of a whole study is here.
    pub fn has_report(dir: &Path) -> bool {
        dir.join(REPORT).exists()
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.dir
    }

    /// Keys of the rows that are there.
    pub fn known(&self) -> HashSet<RowKey> {
        self.rows.iter().map(|r| r.key.clone()).collect()
    }

    /// Appends rows and hands them to the system, so that a crash loses none of them.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_rows(&mut self, rows: Vec<StudyRow>) -> Result<(), Error> {
        if !rows.is_empty() {
            // They are of fewer rows now, and shall not look whole.
            for name in [CSV, RANKING, REPORT, MANIFEST] {
                remove(fs::remove_file(self.dir.join(name))).map_err(|e| self.failed(e))?;
            }
        }
        let written = write_lines(&mut self.out, &rows);
        self.rows.extend(rows);
        written.map_err(|e| self.failed(e))
    }

    /// The rows of some keys, in their order; the rows of other configs come after them.
    pub fn sorted(&self, keys: &[RowKey]) -> (Vec<&StudyRow>, Vec<&StudyRow>) {
        let mut by_key: HashMap<&str, &StudyRow> = HashMap::new();
        for row in &self.rows {
            by_key.insert(&row.key, row);
        }
        let mine = keys.iter().filter_map(|k| by_key.remove(k.as_str()));
        let mine = mine.collect();
        let others = self.rows.iter();
        let others = others
            .filter(|r| {
                by_key
                    .get(r.key.as_str())
                    .is_some_and(|&s| std::ptr::eq(s, *r))
            })
            .collect();
        (mine, others)
    }

    /// Writes a picture, unless it is there: its name tells what it shows.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_picture(
        &mut self,
        name: &str,
        body: impl FnOnce() -> Result<Vec<u8>, Error>,
    ) -> Result<(), Error> {
        let folder = self.dir.join(PICTURES);
        let path = folder.join(name);
        if !self.has_picture(name) {
            let bytes = body()?;
            fs::create_dir_all(&folder)
                .and_then(|()| write_atomically(&path, |out| out.write_all(&bytes)))
                .map_err(|e| Error::output(path, format!("cannot write this file: {e}")))?;
        }
        self.files.insert(format!("{PICTURES}/{name}"));
        Ok(())
    }

    /// Writes a picture of the rows, whether it is there or not.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn write_figure(&mut self, name: &str, text: &str) -> Result<(), Error> {
        let folder = self.dir.join(PICTURES);
        let path = folder.join(name);
        fs::create_dir_all(&folder)
            .and_then(|()| write_atomically(&path, |out| out.write_all(text.as_bytes())))
            .map_err(|e| Error::output(path, format!("cannot write this file: {e}")))?;
        self.files.insert(format!("{PICTURES}/{name}"));
        Ok(())
    }

    /// Takes over the pictures of another folder.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn copy_pictures(&mut self, from: &Path) -> Result<(), Error> {
        let Ok(entries) = fs::read_dir(from.join(PICTURES)) else {
            // A study without pictures.
            return Ok(());
        };
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let read = || fs::read(entry.path()).map_err(|e| self.failed(e));
            let bytes = read()?;
            self.write_picture(&name, || Ok(bytes))?;
        }
        Ok(())
    }

    /// True if a picture is there.
    pub fn has_picture(&self, name: &str) -> bool {
        let drawn = self.files.contains(&format!("{PICTURES}/{name}"));
        drawn || (!self.redraw && self.dir.join(PICTURES).join(name).exists())
    }

    /// The bytes of a picture that is there.
    pub fn picture(&self, name: &str) -> Option<Vec<u8>> {
        fs::read(self.dir.join(PICTURES).join(name)).ok()
    }

    /// Ends a study: sorts the rows, writes them as a table, what was found in them, and the report
    /// of it. The manifest comes last. If it is not whole, only the rows and the manifest are kept.
    ///
    /// # Errors
    /// [`Error::Output`].
    pub fn finish(
        mut self,
        keys: &[RowKey],
        mut manifest: Manifest,
        report: Option<(&Findings, String)>,
    ) -> Result<PathBuf, Error> {
        self.out.flush().map_err(|e| self.failed(e))?;
        self.files
            .extend([CONFIG, MANIFEST, ROWS].map(String::from));
        if let Some((findings, report)) = report {
            let (mine, others) = self.sorted(keys);
            let written = write_atomically(&self.dir.join(ROWS), |out| {
                write_lines(out, mine.iter().chain(&others).copied())
            })
            .and_then(|()| write_atomically(&self.dir.join(CSV), |out| write_csv(out, &mine)))
            .and_then(|()| {
                write_atomically(&self.dir.join(RANKING), |out| ranking_csv(out, findings))
            })
            .and_then(|()| {
                write_atomically(&self.dir.join(REPORT), |out| {
                    out.write_all(report.as_bytes())
                })
            });
            written.map_err(|e| self.failed(e))?;
            self.files.extend([CSV, RANKING, REPORT].map(String::from));
        }
        manifest.files = self.files.iter().cloned().collect();
        write_atomically(&self.dir.join(MANIFEST), |out| {
            serde_json::to_writer_pretty(&mut *out, &manifest)?;
            out.write_all(b"\n")
        })
        .map_err(|e| self.failed(e))?;
        Ok(self.dir)
    }

    fn failed(&self, e: io::Error) -> Error {
        Error::output(&self.dir, format!("cannot write results: {e}"))
    }
}

/// The rows of a folder.
///
/// # Errors
/// [`Error::Data`] if there are none or a line is none.
pub fn read_rows(dir: &Path) -> Result<Vec<StudyRow>, Error> {
    let path = dir.join(ROWS);
    let file = File::open(&path);
    let mut file = file.map_err(|e| Error::data(&path, format!("cannot read this file: {e}")))?;
    read_file(&path, &mut file).map(|(rows, _)| rows)
}

/// The rows of a file, and the length of what is whole.
fn read_file(path: &Path, file: &mut File) -> Result<(Vec<StudyRow>, u64), Error> {
    let unreadable =
        |e: &dyn std::fmt::Display| Error::data(path, format!("cannot read this file: {e}"));
    let mut bytes = Vec::new();
    let read = file
        .seek(SeekFrom::Start(0))
        .and_then(|_| file.read_to_end(&mut bytes));
    read.map_err(|e| unreadable(&e))?;
    // A crash may have cut a line anywhere, also inside a character.
    let whole = bytes
        .iter()
        .rposition(|b| *b == b'\n')
        .map_or(0, |end| end + 1);
    let text = std::str::from_utf8(&bytes[..whole]).map_err(|e| unreadable(&e))?;
    let mut rows = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let row = serde_json::from_str(line).map_err(|e| {
            let message = format!(
                "line {} is no row of a study ({e}); allowed: the results.jsonl of one, or another folder with -o",
                i + 1
            );
            Error::data(path, message)
        })?;
        rows.push(row);
    }
    Ok((rows, whole as u64))
}

fn write_lines<'a>(
    out: &mut impl Write,
    rows: impl IntoIterator<Item = &'a StudyRow>,
) -> io::Result<()> {
    for row in rows {
        serde_json::to_writer(&mut *out, row)?;
        out.write_all(b"\n")?;
    }
    out.flush()
}

fn write_csv(out: &mut impl Write, rows: &[&StudyRow]) -> io::Result<()> {
    let mut csv = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(out);
    csv.write_record(StudyRow::COLUMNS.map(|(name, _)| name))?;
    for row in rows {
        csv.serialize(row)?;
    }
    csv.flush()
}
