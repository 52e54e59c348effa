//! `timings.jsonl`: everything of a run that depends on the machine and its load. All other files of equal runs are equal,
//! byte by byte, whether they were made at once, in parts or with interruptions.
//!
//! A line per record has its key and its wall times (s), of the records that have some; the last line, without a key, is the run:
//!
//! ```text
//! {"key":"5cc3fa3b55028885","plan_seconds":0.00008,"measure_seconds":0.00001,…}
//! {"run":{"threads":2,"os":"linux","arch":"x86_64","started_unix_seconds":…,"ended_unix_seconds":…,"seconds":{…},"counts":{…}}}
//! ```

use crate::experiment::Counts;
use crate::files::{self, write_atomically};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, HashMap};
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The file.
pub(crate) const TIMINGS: &str = "timings.jsonl";

/// Fields of the lines of records, by their keys.
pub(super) type Times = HashMap<String, Map<String, Value>>;

/// What of a run depends on the machine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Machine {
    /// Number of threads; results do not depend on it.
    threads: usize,
    os: String,
    arch: String,
    started_unix_seconds: u64,
    ended_unix_seconds: u64,
    /// Wall seconds by stage, over the whole run; of a merged one the sum of its parts.
    pub(super) seconds: BTreeMap<String, f64>,
    /// What was done, by stage; a run that goes on does less.
    pub(super) counts: Counts,
}

impl Machine {
    /// A run that started at `started` and ends now.
    pub(crate) fn new(started: SystemTime, seconds: BTreeMap<String, f64>, counts: Counts) -> Self {
        let unix = |time: SystemTime| {
            // A clock before 1970 is wrong anyway.
            let since = time.duration_since(SystemTime::UNIX_EPOCH);
            since.unwrap_or_default().as_secs()
        };
        Self {
            threads: rayon::current_num_threads(),
            os: std::env::consts::OS.into(),
            arch: std::env::consts::ARCH.into(),
            started_unix_seconds: unix(started),
            ended_unix_seconds: unix(SystemTime::now()),
            seconds,
            counts,
        }
    }
}

/// The file in the folder of a run.
pub(super) struct Timings(PathBuf);

impl Timings {
    pub(crate) fn new(dir: &Path) -> Self {
        Self(dir.join(TIMINGS))
    }

    /// Lines of the file that are whole; none if it is not there: results do not depend on it.
    fn lines(&self) -> String {
        files::read_text(&self.0, files::TABLE_LIMIT).unwrap_or_default()
    }

    /// The times of records; what is no line of one is passed over.
    pub fn read(&self) -> Times {
        let text = self.lines();
        let of = |line| {
            let fields: Map<String, Value> = serde_json::from_str(line).ok()?;
            Some((fields.get("key")?.as_str()?.to_owned(), fields))
        };
        text.lines().filter_map(of).collect()
    }

    pub(crate) fn machine(&self) -> Option<Machine> {
        let lines = self.lines();
        let last = lines.lines().last()?;
        let of: Value = serde_json::from_str(last).ok()?;
        Machine::deserialize(&of["run"]).ok()
    }

    pub(crate) fn append(&self, lines: &[u8]) -> io::Result<()> {
        let file = OpenOptions::new().append(true).create(true).open(&self.0);
        file?.write_all(lines)
    }

    pub(crate) fn clear(&self) -> io::Result<()> {
        remove(fs::remove_file(&self.0))
    }

    /// Replaces the lines by those of the records in their order, and that of the run.
    pub(crate) fn finish(&self, lines: &[u8], machine: &Machine) -> io::Result<()> {
        write_atomically(&self.0, |out| {
            out.write_all(lines)?;
            serde_json::to_writer(&mut *out, &json!({ "run": machine }))?;
            out.write_all(b"\n")
        })
    }
}

/// Ignores the error that a file to remove does not exist.
pub(super) fn remove(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}
