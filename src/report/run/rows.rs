//! The file of a run's records, JSON Lines: appended as they come, read again when it goes on.
//!
//! A line ends with its seal: [`RESULTS_REVISION`], a colon, and 16 hexadecimal digits of the BLAKE3 of the bytes before it. The
//! wall times of a record are a line of [`TIMINGS`](super::timings::TIMINGS).

use super::timings::{Machine, Times, Timings};
use crate::error::{Error, excerpt, reason};
use crate::experiment::{RESULTS_REVISION, Record};
use crate::files::{self, write_atomically};
use serde::Deserialize;
use serde_json::Value;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Longest time between writing a record and its being on the disk.
const SYNC: Duration = Duration::from_secs(1);

/// Bytes that are read to see whether the first line is a record.
const FIRST_LINE: u64 = 1 << 26;

/// A file of records, open for appending and locked.
pub(super) struct RowFile {
    path: PathBuf,
    file: File,
    timings: Timings,
    syncer: Option<Syncer>,
}

impl RowFile {
    /// Opens the file, which is made if need be.
    pub(crate) fn open(dir: &Path, name: &str) -> Result<Self, Error> {
        let path = dir.join(name);
        let failed = |e| no_folder(dir, &e);
        // A pipe would open, and have no end.
        if path.exists() {
            files::open(&path).map_err(failed)?;
        }
        let mut options = OpenOptions::new();
        let file = options.read(true).append(true).create(true).open(&path);
        let file = file.map_err(failed)?;
        // Where the file system has no locks the run goes on without.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let message = "a run is going on here; choose another folder with -o, or wait for it";
            return Err(Error::output(dir, message));
        }
        let other = file.try_clone().map_err(failed)?;
        Ok(Self {
            path,
            file,
            timings: Timings::new(dir),
            syncer: Some(Syncer::new(other)),
        })
    }

    /// The records that are there; what a crash left of a line after them is cut off.
    pub fn read<R: Record>(&mut self) -> Result<Vec<Arc<R>>, Error> {
        let mut rows = Vec::new();
        let times = self.timings.read();
        let whole = read(&self.path, &self.file, &times, |row| {
            rows.push(Arc::new(row))
        })?;
        let cut = self.file.set_len(whole);
        cut.map_err(|e| unwritable(&self.path, &e))?;
        Ok(rows)
    }

    /// Drops all records, of whatever version; a file that holds something else is left alone.
    pub(crate) fn clear<R: Record>(&mut self) -> Result<(), Error> {
        let mut first = String::new();
        let mut start = (&self.file).take(FIRST_LINE);
        // What is no text is no record.
        let read = BufReader::new(&mut start).read_line(&mut first);
        let is_record = || {
            let line: Option<serde_json::Value> = serde_json::from_str(&first).ok();
            line.is_some_and(|line| line["key"].is_string())
        };
        let cut = !first.ends_with('\n') && first.starts_with('{');
        if read.is_err() || !(first.is_empty() || cut || is_record()) {
            return Err(no_record::<R>(&self.path, "line 1 is no record of a run"));
        }
        let cleared = self.file.set_len(0).and_then(|()| self.timings.clear());
        cleared.map_err(|e| unwritable(&self.path, &e))
    }

    /// Appends records: they are with the system when this returns, and on the disk a second later.
    pub(crate) fn append<R: Record>(&mut self, rows: &[R]) -> io::Result<()> {
        self.is_there()?;
        let (mut lines, mut times) = (Vec::new(), Vec::new());
        write_lines(&mut lines, &mut times, rows)?;
        // A record without its times would be taken for one of unknown times.
        self.timings.append(&times)?;
        self.file.write_all(&lines)?;
        if let Some(syncer) = &self.syncer {
            syncer.later();
        }
        Ok(())
    }

    /// An error if the file was moved or replaced: writing into it would be lost.
    pub(crate) fn is_there(&self) -> io::Result<()> {
        let there = std::fs::metadata(&self.path);
        if there.is_ok_and(|there| is_same(&self.file, &there)) {
            return Ok(());
        }
        let message = "the folder was removed or replaced while the run went on";
        Err(io::Error::other(message))
    }

    /// Replaces the records by the same in another order, and adds the times of the run to theirs.
    pub(crate) fn finish<R: Record>(&mut self, sorted: &[&R], machine: &Machine) -> io::Result<()> {
        self.is_there()?;
        // The old file is not needed on the disk any more.
        self.syncer = None;
        let mut times = Vec::new();
        write_atomically(&self.path, |out| {
            write_lines(out, &mut times, sorted.iter().copied())
        })?;
        self.timings.finish(&times, machine)
    }
}

/// The records of a folder that no run writes to.
///
/// # Errors
/// [`Error::Data`] if there are none or a line is none.
pub fn read_rows<R: Record>(dir: &Path) -> Result<Vec<R>, Error> {
    let path = &dir.join(R::FILE);
    let file = files::open(path).map_err(|e| unreadable(path, &e))?;
    let mut rows = Vec::new();
    read(path, &file, &Timings::new(dir).read(), |row| rows.push(row))?;
    Ok(rows)
}

/// What is wrong with a file that cannot be read.
fn unreadable(path: &Path, e: &dyn std::fmt::Display) -> Error {
    Error::data(path, format!("cannot read this file: {e}"))
}

/// What is wrong with a folder that cannot be written to.
pub(super) fn no_folder(dir: &Path, e: &io::Error) -> Error {
    let message = format!("cannot write to this folder: {e}; choose another with -o");
    Error::output(dir, message)
}

/// What is wrong with a file that does not hold records.
fn no_record<R: Record>(path: &Path, what: &str) -> Error {
    let allowed = format!("the {} of one, or another folder with -o", R::FILE);
    Error::data(path, format!("{what}; allowed: {allowed}"))
}

/// What is wrong with a file that cannot be written.
pub(super) fn unwritable(path: &Path, e: &io::Error) -> Error {
    Error::output(path, format!("cannot write this file: {e}"))
}

#[cfg(unix)]
fn is_same(file: &File, there: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    let here = file.metadata();
    here.is_ok_and(|here| (here.dev(), here.ino()) == (there.dev(), there.ino()))
}

#[cfg(not(unix))]
fn is_same(_file: &File, there: &std::fs::Metadata) -> bool {
    there.is_file()
}

/// Writes each record without its times, with its seal, and its times.
fn write_lines<'a, R: Record + 'a>(
    out: &mut impl Write,
    times: &mut impl Write,
    rows: impl IntoIterator<Item = &'a R>,
) -> io::Result<()> {
    for row in rows {
        let [line, own] = row.parts()?;
        let line = serde_json::to_string(&line)?;
        let body = line.strip_suffix('}').unwrap_or(&line);
        writeln!(out, "{body},{SEAL}\"{}\"}}", seal(body))?;
        if own.len() > 1 {
            writeln!(times, "{}", serde_json::to_string(&own)?)?;
        }
    }
    Ok(())
}

/// The key of a line.
#[derive(Deserialize)]
struct Key {
    key: String,
}

/// The wall times of a record as text behind its other fields: nothing else of its line counts, and no text.
fn own<R: Record>(times: &Times, key: &str) -> String {
    let is_time = |value: &&Value| match value {
        Value::Array(times) => times.iter().all(Value::is_number),
        time => time.is_number() || time.is_null(),
    };
    let field = |name: &&str| {
        let value = times.get(key)?.get(*name).filter(is_time)?;
        Some(format!(",\"{name}\":{value}"))
    };
    R::TIMES.iter().filter_map(field).collect()
}

/// The last key of a line.
const SEAL: &str = "\"seal\":";

/// The value of the last key, of the bytes before it.
fn seal(body: &str) -> String {
    let hash = blake3::hash(body.as_bytes()).to_hex();
    format!("{RESULTS_REVISION}:{}", &hash[..16])
}

/// A line without its seal and closing brace; what is wrong about it, and what is allowed.
fn sealed(line: &str) -> Result<&str, String> {
    let parts = line.rsplit_once(SEAL).and_then(|(body, own)| {
        let own = own.strip_prefix('"')?.strip_suffix("\"}")?;
        Some((body.strip_suffix(',')?, own))
    });
    let again = "or `gonio run --force` to make them again";
    let Some((body, own)) = parts else {
        return Err(format!(
            "has no seal; allowed: rows of this version of gonio, {again}"
        ));
    };
    let revision = own.split(':').next().unwrap_or_default();
    if revision != RESULTS_REVISION.to_string() {
        let revision = excerpt(revision);
        return Err(format!(
            "is of another version of gonio (revision {revision} of results, this is {RESULTS_REVISION}); allowed: rows of \
             this version, {again}"
        ));
    }
    match own == seal(body) {
        true => Ok(body),
        false => Err(format!(
            "is not as it was written: it has another seal; allowed: rows as they were written, {again}"
        )),
    }
}

/// Takes each record of a file; the length of its complete lines, bytes.
fn read<R: Record>(
    path: &Path,
    mut file: &File,
    times: &Times,
    mut take: impl FnMut(R),
) -> Result<u64, Error> {
    let unreadable = |e: &dyn std::fmt::Display| unreadable(path, e);
    file.seek(SeekFrom::Start(0)).map_err(|e| unreadable(&e))?;
    let mut file = BufReader::new(file);
    let (mut line, mut whole) = (Vec::new(), 0);
    for number in 1.. {
        line.clear();
        let length = file.read_until(b'\n', &mut line);
        let length = length.map_err(|e| unreadable(&e))?;
        if line.last() != Some(&b'\n') {
            break;
        }
        let text = std::str::from_utf8(&line).map_err(|e| unreadable(&e))?;
        let none = |e| {
            let kind = "is no record of this kind of run";
            no_record::<R>(path, &format!("line {number} {kind} ({})", reason(e)))
        };
        let text = text.trim_end();
        let Key { key } = serde_json::from_str(text).map_err(none)?;
        let body = sealed(text).map_err(|e| Error::data(path, format!("line {number} {e}")))?;
        take(serde_json::from_str(&format!("{body}{}}}", own::<R>(times, &key))).map_err(none)?);
        whole += length as u64;
    }
    // A crash may have cut a line anywhere, also inside a character; one of the machine may have
    // left zeros where a line was to be. What is left of a line must be one of ours: others' files are not cut.
    let first = line.iter().find(|byte| **byte != 0);
    match first {
        None | Some(b'{') => Ok(whole),
        Some(_) => Err(no_record::<R>(path, "its last line is no record of a run")),
    }
}

/// Writes a file to the disk now and then, beside the work.
struct Syncer {
    /// Wakes the thread; `None` when nothing more will be written.
    wake: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Syncer {
    fn new(file: File) -> Self {
        let (wake, woken) = mpsc::channel();
        let thread = thread::spawn(move || {
            while woken.recv().is_ok() {
                // What comes within the next second goes along.
                let until = Instant::now() + SYNC;
                let over = loop {
                    let left = until.saturating_duration_since(Instant::now());
                    match woken.recv_timeout(left) {
                        Ok(()) => {}
                        Err(end) => break end,
                    }
                };
                // A file system that cannot do this keeps its files in its own way.
                let _ = file.sync_data();
                if over == RecvTimeoutError::Disconnected {
                    break;
                }
            }
        });
        Self {
            wake: Some(wake),
            thread: Some(thread),
        }
    }

    /// Asks for the file to be written to the disk.
    fn later(&self) {
        if let Some(wake) = &self.wake {
            // Fails when the thread has ended, which it does after this.
            let _ = wake.send(());
        }
    }
}

impl Drop for Syncer {
    fn drop(&mut self) {
        self.wake = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has nothing to say here.
            let _ = thread.join();
        }
    }
}
