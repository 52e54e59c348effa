//! Keys of records: a hash of everything that determines one, equal for equal questions.

use super::choices::Material;
use super::tables::section;
use crate::brdf::BrdfSpec;
use crate::error::Error;
use crate::reconstruct::PriorFile;
use crate::registry::Keys;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::PathBuf;

/// Number of the changes of numbers and columns of results so far, so that rows made before are not taken for finished.
pub const RESULTS_REVISION: u32 = 28;

/// The hash of everything that determines a record, 16 hexadecimal digits.
pub type RowKey = String;

/// A file that a material was read from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// As the config names it.
    pub path: PathBuf,
    /// BLAKE3 of its bytes, hexadecimal.
    pub blake3: String,
}

/// A material's part of the keys of its records.
pub(super) struct Identity {
    /// The hash of its keys and of the bytes of its files.
    pub key: RowKey,
    /// Its files.
    pub inputs: Vec<Input>,
}

impl Identity {
    /// Reads the files of a material.
    pub(crate) fn read(material: &Material) -> Result<Self, Unreadable> {
        let inputs = hash(&material.spec.tables().files)?;
        let mut part = Part::new();
        part.feed(&material.name);
        part.feed(&pathless(&*material.spec).to_string());
        part.feed(&section(&material.symmetry).to_string());
        for input in &inputs {
            part.feed(&input.blake3);
        }
        Ok(Self {
            key: short(&part.finish()),
            inputs,
        })
    }

    /// Checks that the files are still what was hashed: another program may replace them at any time.
    pub(crate) fn check_unchanged(&self) -> Result<(), Unreadable> {
        for input in &self.inputs {
            let now = hash(std::slice::from_ref(&input.path))?;
            if now[0].blake3 != input.blake3 {
                return Err(Unreadable {
                    path: input.path.clone(),
                    source: std::io::Error::other("it was replaced while the run went on"),
                });
            }
        }
        Ok(())
    }
}

/// The hash of what a material is: its keys and the bytes of its files.
///
/// # Errors
/// [`Error::Data`] if a file cannot be read.
pub fn material_key(material: &Material) -> Result<RowKey, Error> {
    let identity = Identity::read(material);
    let identity = identity.map_err(|e| Error::data(&material.name, e))?;
    Ok(identity.key)
}

/// The hash of what a material is, whatever it is called and however it is read: the bytes of its files, or its keys.
///
/// # Errors
/// [`Error::Data`] if a file cannot be read.
pub fn content(material: &Material) -> Result<RowKey, Error> {
    let inputs = hash(&material.spec.tables().files);
    let inputs = inputs.map_err(|e| Error::data(&material.name, e))?;
    let mut part = Part(blake3::Hasher::new());
    if inputs.is_empty() {
        part.feed(&pathless(&*material.spec).to_string());
    }
    for input in inputs {
        part.feed(&input.blake3);
    }
    Ok(short(&part.finish()))
}

/// The keys of a model without the places of its files.
pub(super) fn pathless(spec: &dyn BrdfSpec) -> toml::Table {
    let mut resolved = spec.resolved();
    forget_paths(&mut resolved);
    resolved
}

/// A file that could not be read to be hashed.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", path.display())]
pub(crate) struct Unreadable {
    path: PathBuf,
    source: std::io::Error,
}

pub(super) fn hash(paths: &[PathBuf]) -> Result<Vec<Input>, Unreadable> {
    let hash = |path: &PathBuf| {
        let (path, mut hasher) = (path.clone(), blake3::Hasher::new());
        let read = File::open(&path).and_then(|file| hasher.update_reader(file).map(drop));
        match read {
            Ok(()) => {
                let blake3 = hasher.finalize().to_hex().to_string();
                Ok(Input { path, blake3 })
            }
            Err(source) => Err(Unreadable { path, source }),
        }
    };
    paths.iter().map(hash).collect()
}

/// Removes paths of files: keys depend on their bytes. Also in the parts of a compound material.
pub(super) fn forget_paths(table: &mut toml::Table) {
    for key in ["path", "file", "prior"] {
        table.remove(key);
    }
    for (_, value) in table.iter_mut() {
        match value {
            toml::Value::Table(inner) => forget_paths(inner),
            toml::Value::Array(list) => {
                let inner = list.iter_mut().filter_map(toml::Value::as_table_mut);
                inner.for_each(forget_paths);
            }
            _ => {}
        }
    }
}

/// True if two resolved configs differ in nothing but where files are.
pub fn asks_the_same(a: &toml::Table, b: &toml::Table) -> bool {
    let question = |config: &toml::Table| {
        let mut config = config.clone();
        config.remove("materials_dir");
        forget_paths(&mut config);
        config
    };
    question(a) == question(b)
}

/// 64 bits: two of a million share them with a probability of 3e-8.
fn short(hash: &blake3::Hash) -> String {
    hash.to_hex()[..16].to_owned()
}

/// Hasher of everything that determines a record but its material.
pub(super) struct Part(blake3::Hasher);

impl Part {
    pub(crate) fn new() -> Self {
        let mut part = Self(blake3::Hasher::new());
        part.feed(&RESULTS_REVISION.to_string());
        part
    }

    /// Feeds a text with its length before it, so that no two lists of texts hash alike.
    pub(crate) fn feed(&mut self, text: &str) {
        self.0.update(&(text.len() as u64).to_le_bytes());
        self.0.update(text.as_bytes());
    }

    /// Feeds the keys of a member, with what its files hold instead of where these are: a prior here, poses by their hash.
    pub(crate) fn feed_member(&mut self, mut keys: Keys, prior: Option<&PriorFile>) {
        keys.remove("file");
        if let Some(prior) = prior {
            keys.remove("prior");
            self.feed(&prior.content());
        }
        self.feed(&keys.to_string());
    }

    /// The hash with one text more.
    pub(crate) fn hash_with(&self, text: &str) -> blake3::Hash {
        let mut other = Self(self.0.clone());
        other.feed(text);
        other.finish()
    }

    pub(crate) fn finish(self) -> blake3::Hash {
        self.0.finalize()
    }
}

/// The key of a record, from that of its material.
pub(super) fn of_part(material: &str, part: &blake3::Hash) -> RowKey {
    let mut hasher = blake3::Hasher::new();
    hasher.update(material.as_bytes());
    hasher.update(part.as_bytes());
    short(&hasher.finalize())
}

/// A record that a plan asks for; its key needs the bytes of its material's files.
#[derive(Clone, Debug)]
pub struct Expected {
    /// Position of its material in the plan.
    pub material: usize,
    /// Its identity without the material: [`Record::label`](super::Record::label).
    pub label: String,
    /// Name of the job that makes it, without the material; records of one job are made together.
    pub job: String,
    /// The hash of everything but the material.
    pub part: blake3::Hash,
}

impl Expected {
    /// A record of any material, by its label and the name of its job.
    pub(super) fn of_any(label: &str, job: &str, part: blake3::Hash) -> Self {
        Self {
            material: 0,
            label: label.to_owned(),
            job: job.to_owned(),
            part,
        }
    }

    /// The key of the record, from that of its material.
    pub fn key(&self, material_key: &str) -> RowKey {
        of_part(material_key, &self.part)
    }
}
