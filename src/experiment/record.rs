//! The parts that all kinds of experiments share: records with keys, one line of a file each, and
//! the records that a plan expects.

use super::choices::Material;
use super::key::{Expected, RowKey};
use super::observer::{Observer, Summary};
use crate::error::Error;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// Records from earlier runs, by key.
pub type Known<R> = HashMap<RowKey, Arc<R>>;

/// A finished piece of an experiment: one line of its file; a run goes on from those it finds.
pub trait Record: Serialize + DeserializeOwned + Clone {
    /// Name of the file of these records, JSON Lines.
    const FILE: &'static str;

    /// Names of the fields that are wall times; they alone may differ between equal runs, and are in a file of their own.
    const TIMES: &'static [&'static str];

    /// The hash of everything that determines it.
    fn key(&self) -> &str;

    /// Name of its material, and the hash of the material's keys and files.
    fn material(&self) -> (&str, &str);

    /// Its identity without the material.
    fn label(&self) -> String;

    /// Its fields by name without the wall times, and these with its key.
    ///
    /// # Errors
    /// Those of serialising it.
    fn parts(&self) -> serde_json::Result<[Map<String, Value>; 2]> {
        let (mut fields, mut times) = (Map::new(), Map::new());
        if let Value::Object(all) = serde_json::to_value(self)? {
            times.insert("key".into(), self.key().into());
            for (name, value) in all {
                match Self::TIMES.contains(&name.as_str()) {
                    true => times.insert(name, value),
                    false => fields.insert(name, value),
                };
            }
        }
        Ok([fields, times])
    }

    /// True if every number but the wall times is the same.
    fn agrees(&self, other: &Self) -> bool {
        let fields = |record: &Self| record.parts().map(|[fields, _]| fields).unwrap_or_default();
        fields(self) == fields(other)
    }
}

/// The parts of a plan that all kinds of experiments have.
#[derive(Clone, Copy, Debug)]
pub struct Head<'a> {
    /// The question it asks.
    pub question: Option<&'a str>,
    /// The config with every default filled in; reading it gives this experiment again.
    pub resolved: &'a toml::Table,
    /// Seeds of everything random.
    pub seeds: &'a [u64],
    /// The materials.
    pub materials: &'a [Material],
    /// Names of the config's `only` that its folder of materials does not have.
    pub missing: &'a [String],
}

/// An experiment that can be run, continued, split into shards and merged.
pub trait Experiment {
    /// Its type of record.
    type Record: Record;

    /// What it has in common with others.
    fn head(&self) -> Head<'_>;

    /// The materials of a run, or of a part of it, and the records of each, in the order of results, named without the material.
    fn of_each(&self, shard: Option<Shard>) -> (Shard, Vec<Expected>);

    /// The records of a complete run, or of a part of it, in the order of results.
    fn expected(&self, shard: Option<Shard>) -> Vec<Expected> {
        let (mine, records) = self.of_each(shard);
        let materials = self.head().materials.iter().enumerate();
        let of = |(material, m): (usize, &Material)| {
            let of_material = |record: &Expected| Expected {
                material,
                job: format!("{}, {}", m.name, record.job),
                ..record.clone()
            };
            records.iter().map(of_material).collect::<Vec<_>>()
        };
        materials
            .filter(|(i, _)| mine.has(*i))
            .flat_map(of)
            .collect()
    }

    /// Makes the records that are not known.
    ///
    /// # Errors
    /// Errors of the observer. A job that cannot be done is no error but a failure in the summary.
    fn run(
        &self,
        extent: &Extent,
        known: &Known<Self::Record>,
        observer: &mut dyn Observer<Self::Record>,
    ) -> Result<Summary, Error>;
}

/// The part of an experiment that is run, and the memory it may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// The part that is run; `None`: all of it.
    pub shard: Option<Shard>,
    /// Bytes that materials and their readings may take at a time; one material is always held.
    pub memory: usize,
}

impl Extent {
    /// Memory that a run may take by default, 2²⁰ bytes.
    pub(crate) const MEMORY_MB: usize = 384;
}

impl Default for Extent {
    fn default() -> Self {
        Self {
            shard: None,
            memory: Self::MEMORY_MB << 20,
        }
    }
}

/// A part of the work: `i/n`, 1 ≤ i ≤ n.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    /// Number of the part, 1 to `of`.
    pub part: usize,
    /// Number of parts.
    pub of: usize,
}

impl Shard {
    /// The only part.
    pub(super) const WHOLE: Self = Self { part: 1, of: 1 };

    /// True if the item at a position (from 0) is of this part; items are dealt out one by one.
    pub fn has(self, position: usize) -> bool {
        position % self.of == self.part - 1
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parts = text.split_once('/');
        let parsed = parts.and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parsed {
            Some((part, of)) if 1 <= part && part <= of && of <= 100_000 => Ok(Self { part, of }),
            _ => Err(ShardError),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.part, self.of)
    }
}

/// A text that is no [`Shard`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("allowed: i/n with 1 <= i <= n <= 100000, e.g. 1/8")]
pub struct ShardError;
