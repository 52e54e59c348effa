//! Readings of a file, and what is peculiar about it.

use super::Measurement;
use serde::{Deserialize, Serialize};

/// Origin of a measurement: material, instrument, seeds, schedule.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
    /// Name of the material.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Name of the instrument.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instrument: Option<String>,
    /// Realisation of the instrument: the seed of its own errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub realisation: Option<u64>,
    /// Seed of its noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Hash of the schedule, see [`crate::schedule::schedule_hash`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub schedule_hash: Option<String>,
    /// True if it does not say which coordinates and symmetries its poses have: then a copy does not either.
    #[serde(skip)]
    pub is_bare: bool,
}

/// Readings of a file.
pub struct Readings {
    /// What was measured.
    pub measurement: Measurement,
    /// Where it comes from, as far as the file says.
    pub about: About,
    /// What was peculiar about the file, a sentence each.
    pub notes: Vec<String>,
    /// What may be wrong about it, a sentence each.
    pub warnings: Vec<String>,
    /// Rows that were read.
    pub rows: usize,
    /// Cells that stand for no reading, and rows without the value of some channel.
    pub lost: usize,
    /// Keys of the header that are not read.
    pub unread: Vec<String>,
    /// True if the file vouches for being whole.
    pub intact: bool,
}
