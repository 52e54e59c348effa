//! `manifest.json`: config, inputs and versions that made the results beside it.

use super::timings::Timings;
use crate::experiment::{Counts, Failure, Head, Input, Shard, Source, Tuned};
use crate::files;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The file.
pub(super) const MANIFEST: &str = "manifest.json";

/// Fields of the manifest of a folder; what they are without one if there is none.
pub(super) fn read_manifest<T: Default + DeserializeOwned>(dir: &Path) -> T {
    let manifest = files::read(&dir.join(MANIFEST), files::CONFIG_LIMIT).unwrap_or_default();
    serde_json::from_slice(&manifest).unwrap_or_default()
}

/// State of a run at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

/// Outcome of a run of any kind.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Outcome {
    /// Rows that were written.
    pub rows: usize,
    /// The part of the work that was done, `i/n`; `None`: all of it.
    pub shard: Option<String>,
    /// Jobs that could not be done, by their names.
    pub failures: Vec<Failure>,
    /// Ratios of grids that were tuned, with their errors on the training materials.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tuned: Vec<Tuned>,
    /// True if it was stopped before its end.
    #[serde(skip)]
    pub interrupted: bool,
    /// True if parts are missing.
    #[serde(skip)]
    pub incomplete: bool,
}

/// Inputs, failures, times and counts in the manifest of a part of a run.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct MadeFrom {
    /// The config's file, and those of the materials.
    pub inputs: Vec<Input>,
    /// Jobs that could not be done.
    pub failures: Vec<Failure>,
    /// Overrides of the command line.
    pub options: Vec<String>,
    /// Materials without a file.
    pub missing: Vec<String>,
    /// Ratios of grids that were tuned.
    pub tuned: Vec<Tuned>,
    /// The part, `i/n`, if it has ended.
    shard: Option<String>,
    /// State at its end.
    status: Option<Status>,
    /// Parts that came to their end, by number.
    #[serde(skip)]
    ended: BTreeSet<Shard>,
    /// Seconds by stage, of the timings.
    #[serde(skip)]
    pub seconds: BTreeMap<String, f64>,
    /// What was done by stage, of the timings.
    #[serde(skip)]
    pub counts: Counts,
}

impl MadeFrom {
    /// Reads those of a folder; empty where a run has not ended.
    pub fn read(dir: &Path) -> Self {
        let mut from: Self = read_manifest(dir);
        if let Some(machine) = Timings::new(dir).machine() {
            (from.seconds, from.counts) = (machine.seconds, machine.counts);
        }
        from
    }

    /// Adds those of another part; config and overrides are those of the first.
    pub(crate) fn extend(&mut self, other: Self) {
        if self.inputs.is_empty() {
            self.inputs.extend(other.inputs.first().cloned());
            self.options = other.options;
            self.missing = other.missing;
        }
        for input in other.inputs.into_iter().skip(1) {
            if !self.inputs.contains(&input) {
                self.inputs.push(input);
            }
        }
        for failure in other.failures {
            let same = |f: &&mut Failure| (&f.job, &f.reason) == (&failure.job, &failure.reason);
            match self.failures.iter_mut().find(same) {
                // A material that cannot be read fails in each part.
                Some(known) => known.jobs += failure.jobs,
                None => self.failures.push(failure),
            }
        }
        Tuned::add(&mut self.tuned, other.tuned);
        let shard = other.shard.and_then(|shard| shard.parse::<Shard>().ok());
        let has_ended = matches!(other.status, Some(Status::Complete | Status::FailedJobs));
        self.ended.extend(shard.filter(|_| has_ended));
        self.counts.extend(&other.counts);
        for (stage, seconds) in other.seconds {
            *self.seconds.entry(stage).or_default() += seconds;
        }
    }

    /// True if every part of a run came to its end: what is missing could not be done.
    pub(crate) fn are_all(&self) -> bool {
        let parts = self.ended.first().map_or(0, |part| part.of);
        parts > 0 && self.ended.iter().filter(|part| part.of == parts).count() == parts
    }
}

/// The manifest's fields: nothing that depends on the machine, which is in `timings.jsonl`.
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
    /// The config's file, and those of the materials that were loaded, by their paths.
    inputs: Vec<Input>,
    /// Materials that the config names and its folder does not have.
    missing: Vec<String>,
    #[serde(flatten)]
    outcome: Outcome,
    /// Files of this run beside the manifest; `--force` removes these and no others.
    pub(super) files: Vec<String>,
}

impl Manifest {
    /// The manifest of a run, or of one merged from parts that were made from `parts`.
    pub(crate) fn new(
        head: Head<'_>,
        source: &Source,
        mut materials: Vec<Input>,
        mut outcome: Outcome,
        parts: Option<MadeFrom>,
    ) -> Self {
        let (config, options, missing) = match parts {
            Some(parts) if !parts.inputs.is_empty() => {
                let mut inputs = parts.inputs.into_iter();
                let config = inputs.next();
                materials = inputs.collect();
                (config, parts.options, parts.missing)
            }
            _ => {
                let config = Input {
                    path: source.name().into(),
                    blake3: blake3::hash(source.original().as_bytes()).to_string(),
                };
                (Some(config), source.edits(), head.missing.to_vec())
            }
        };
        materials.sort_by(|a, b| a.path.cmp(&b.path));
        outcome.failures.sort_by(|a, b| a.job.cmp(&b.job));
        let text = |tuned: &Tuned| serde_json::to_string(tuned).unwrap_or_default();
        outcome.tuned.sort_by_cached_key(text);
        Self {
            gonio: env!("CARGO_PKG_VERSION"),
            status: match &outcome {
                o if o.interrupted => Status::Interrupted,
                o if o.incomplete => Status::Incomplete,
                o if o.failures.is_empty() => Status::Complete,
                _ => Status::FailedJobs,
            },
            options,
            config: head.resolved.clone(),
            seeds: head.seeds.to_vec(),
            inputs: config.into_iter().chain(materials).collect(),
            missing,
            outcome,
            files: Vec::new(),
        }
    }
}
