//! `manifest.json`: config, inputs and versions that made the results beside it.

use crate::experiment::{Counts, Failure, Input, Source, Tuned};
use crate::files;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

/// The file.
pub(super) const MANIFEST: &str = "manifest.json";

/// State of a run at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Every row is there.
    Complete,
    /// The user stopped it; finished rows are there.
    Interrupted,
    /// Some jobs failed; the rows of the others are there.
    FailedJobs,
    /// Parts are missing from a merged run.
    Incomplete,
}

/// The parts of a plan that a manifest holds.
#[derive(Clone, Copy, Debug)]
pub struct MadeBy<'a> {
    /// The resolved config.
    pub resolved: &'a toml::Table,
    /// Its seeds.
    pub seeds: &'a [u64],
    /// Materials that it names and its folder does not have.
    pub missing: &'a [String],
}

/// Outcome of a run of any kind.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Rows that were written.
    pub rows: usize,
    /// Jobs that could not be done.
    pub failures: Vec<Failure>,
    /// Ratios of grids that were tuned.
    pub tuned: Vec<Tuned>,
    /// Seconds by stage.
    pub seconds: serde_json::Value,
    /// True if it was stopped before its end.
    pub interrupted: bool,
    /// True if parts are missing.
    pub incomplete: bool,
    /// The part of the work that was done, `i/n`; `None`: all of it.
    pub shard: Option<String>,
}

/// Inputs, failures, times and counts in the manifest of a part of a run.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct MadeFrom {
    /// The config's file, and those of the materials.
    pub inputs: Vec<Input>,
    /// Jobs that could not be done.
    pub failures: Vec<Failure>,
    /// Seconds by stage.
    pub seconds: BTreeMap<String, f64>,
    /// What was done, by stage.
    pub counts: Counts,
    /// Ratios of grids that were tuned.
    pub tuned: Vec<Tuned>,
}

impl MadeFrom {
    /// Reads those of a folder; empty where a run has not ended.
    pub fn read(dir: &Path) -> Self {
        let manifest = files::read(&dir.join(MANIFEST), files::CONFIG_LIMIT).unwrap_or_default();
        serde_json::from_slice(&manifest).unwrap_or_default()
    }

    /// Adds those of another part; the config's file is kept once.
    pub fn extend(&mut self, other: Self) {
        for input in other.inputs.into_iter().skip(1) {
            if !self.inputs.contains(&input) {
                self.inputs.push(input);
            }
        }
        self.failures.extend(other.failures);
        Tuned::add(&mut self.tuned, other.tuned);
        self.counts.extend(&other.counts);
        for (stage, seconds) in other.seconds {
            *self.seconds.entry(stage).or_default() += seconds;
        }
    }
}

/// The manifest's fields.
#[derive(Clone, Debug, Serialize)]
pub struct Manifest {
    /// Version of this program.
    gonio: &'static str,
    status: Status,
    /// The overrides of the command line, as written; `config` has them applied.
    options: Vec<String>,
    /// The resolved config, the same as in `config.toml`.
    config: toml::Table,
    seeds: Vec<u64>,
    /// Number of threads; results do not depend on it, times do.
    threads: usize,
    /// The config's file and those of the materials that were loaded.
    inputs: Vec<Input>,
    /// Materials that the config names and its folder does not have.
    missing: Vec<String>,
    rows: usize,
    /// The part of the work, `i/n`; `null`: all of it.
    shard: Option<String>,
    failures: Vec<Failure>,
    /// Ratios of grids that this run tuned, with their errors on the training materials.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tuned: Vec<Tuned>,
    /// Seconds per stage, over the whole run.
    seconds: serde_json::Value,
    /// What was done, per stage, by this run; one that goes on does less.
    counts: Counts,
    started_unix_seconds: u64,
    ended_unix_seconds: u64,
    os: &'static str,
    arch: &'static str,
    /// Files of this run beside the manifest; `--force` removes these and no others.
    pub(super) files: Vec<String>,
}

impl Manifest {
    /// The manifest of a run that started at `started` and ends now.
    pub fn new(
        made_by: MadeBy<'_>,
        source: &Source,
        materials: Vec<Input>,
        outcome: Outcome,
        started: SystemTime,
    ) -> Self {
        let config = Input {
            path: source.name().into(),
            blake3: blake3::hash(source.original().as_bytes()).to_string(),
        };
        let unix = |time: SystemTime| {
            // A clock before 1970 is wrong anyway.
            let since = time.duration_since(SystemTime::UNIX_EPOCH);
            since.unwrap_or_default().as_secs()
        };
        Self {
            gonio: env!("CARGO_PKG_VERSION"),
            status: match &outcome {
                o if o.interrupted => Status::Interrupted,
                o if o.incomplete => Status::Incomplete,
                o if o.failures.is_empty() => Status::Complete,
                _ => Status::FailedJobs,
            },
            options: source.edits(),
            config: made_by.resolved.clone(),
            seeds: made_by.seeds.to_vec(),
            threads: rayon::current_num_threads(),
            inputs: std::iter::once(config).chain(materials).collect(),
            missing: made_by.missing.to_vec(),
            rows: outcome.rows,
            shard: outcome.shard,
            failures: outcome.failures,
            tuned: outcome.tuned,
            seconds: outcome.seconds,
            counts: Counts::default(),
            started_unix_seconds: unix(started),
            ended_unix_seconds: unix(SystemTime::now()),
            os: std::env::consts::OS,
            arch: std::env::consts::ARCH,
            files: Vec::new(),
        }
    }

    /// Adds what is known when everything is written: the counts, and the seconds that this took.
    pub fn conclude(&mut self, counts: Counts, report: f64) {
        self.counts = counts;
        let before = self.seconds["report"].as_f64().unwrap_or(0.0);
        self.seconds["report"] = (before + report).into();
    }

    /// State of the run at its end.
    pub fn status(&self) -> Status {
        self.status
    }
}
