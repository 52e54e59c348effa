//! Measurements: readings and outcomes of the poses of a schedule, and their files.

pub mod alta;
pub(crate) mod astm;
pub(crate) mod bird;
mod columns;
mod doubts;
mod file;
pub(crate) mod fred;
mod merge;
pub mod pab;
mod pixels;
mod record;
mod retro;
mod scattered;

use doubts::Negative;
pub use file::{read_measurement, write_measurement};
pub use record::measurement_schema;
pub use retro::{RetroPeak, retro_peak};

use crate::brdf::Channels;
use crate::numeric::LARGEST_READING;
use crate::schedule::{Pose, Schedule, Sequence, Unreachable};
use serde::{Deserialize, Deserializer, Serialize};
use std::sync::Arc;

/// The reading (f_r, sr⁻¹), at most [`LARGEST_READING`], of a value or uncertainty of a file, in which 1 sr⁻¹ is `of_one`.
fn reading_of(value: f64, of_one: f64) -> Result<f64, String> {
    let reading = value / of_one;
    if reading.abs() <= LARGEST_READING {
        return Ok(reading);
    }
    Err(format!(
        "without the cosine it is {reading:e} 1/sr; allowed is a reading of at most {LARGEST_READING:e} 1/sr"
    ))
}

/// Outcome of one pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[must_use]
pub enum Outcome {
    /// There is a reading.
    Reading,
    /// The material has no data there (an invalid cell of a table).
    NoData,
    /// The instrument cannot take this pose.
    Unreachable(Unreachable),
    /// The pose was not visited, e.g. its row is missing from a file.
    NotVisited,
}

impl Outcome {
    /// Its name, without the number of an axis or pair.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Reading => "reading",
            Outcome::NoData => "no-data",
            Outcome::Unreachable(why) => why.name(),
            Outcome::NotVisited => "not-visited",
        }
    }
}

/// A set of flags of a reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flags(u8);

impl Flags {
    /// The empty set.
    pub const NONE: Flags = Flags(0);
    /// Every exposure ran into full scale: the value is a lower bound.
    pub const SATURATED: Flags = Flags(1);
    /// The value is below its own noise (k = 2).
    pub const BELOW_NOISE: Flags = Flags(2);
    /// Part of an aperture was below the horizon.
    pub const CLIPPED: Flags = Flags(4);
    /// All other readings contradict it.
    pub(crate) const SUSPECTED: Flags = Flags(8);

    /// Every flag with its name in files.
    pub const ALL: [(Flags, &'static str); 4] = [
        (Flags::SATURATED, "saturated"),
        (Flags::BELOW_NOISE, "below-noise"),
        (Flags::CLIPPED, "clipped"),
        (Flags::SUSPECTED, "suspected"),
    ];

    /// The union of both sets.
    #[must_use]
    pub fn with(self, other: Flags) -> Flags {
        Flags(self.0 | other.0)
    }

    /// True if every flag of `other` is set.
    pub fn has(self, other: Flags) -> bool {
        self.0 & other.0 == other.0
    }
}

/// Numbers as JSON has them: NaN is `null`.
fn numbers<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let all = Vec::<Option<f64>>::deserialize(from)?.into_iter();
    Ok(all.map(|x| x.unwrap_or(f64::NAN)).collect())
}

/// Uncertainties and flags of readings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Details {
    /// Standard uncertainty (k = 1) of the scatter between repeated readings, sr⁻¹, laid out as
    /// the values; 0 of one that is not known.
    #[serde(deserialize_with = "numbers")]
    pub type_a: Vec<f64>,
    /// Standard uncertainty (k = 1) of errors that repeated readings of one instrument share, sr⁻¹,
    /// laid out as the values; 0 of one that is not known.
    #[serde(deserialize_with = "numbers")]
    pub type_b: Vec<f64>,
    /// One set of flags per pose, in the order of the schedule.
    pub flags: Vec<Flags>,
}

impl Details {
    /// No uncertainty that is known, and no flag.
    fn unknown(values: usize, poses: usize) -> Self {
        Self {
            type_a: vec![0.0; values],
            type_b: vec![0.0; values],
            flags: vec![Flags::NONE; poses],
        }
    }
}

/// Where a reading stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// The number of the file, counted from 0.
    pub file: usize,
    /// The line, counted from 1; 0 of a pose that is in no line.
    pub line: usize,
}

/// Largest half-angle of an aperture, and largest error of an axis, degrees: beyond it the directions of a pose mean nothing.
pub(crate) const WIDEST_DEG: f64 = 10.0;

/// The outcomes of a schedule, in its order.
#[derive(Clone, Serialize, Deserialize)]
pub struct Measurement {
    /// The poses that were to be visited.
    pub schedule: Arc<Schedule>,
    /// Values per reading.
    pub channels: Channels,
    /// f_r in sr⁻¹, pose-major (`poses × channels`); meaningless where there is no reading. Noise
    /// can make it negative.
    #[serde(deserialize_with = "numbers")]
    pub values: Vec<f64>,
    /// One outcome per pose, in the order of the schedule.
    pub outcomes: Vec<Outcome>,
    /// Uncertainties and flags; `None` of an instrument that has neither.
    pub details: Option<Details>,
    /// Half-angles of the caps of directions of the source and of the sensor, over which readings are means; 0 of one direction.
    pub half_angles_deg: [f64; 2],
    /// Where each pose was read, of several rows of one pose the first; none of what comes from no text file.
    pub places: Vec<Place>,
}

impl Measurement {
    /// Number of poses with a reading.
    pub fn readings(&self) -> usize {
        self.count(|o| o == Outcome::Reading)
    }

    /// Number of poses where the material has no data.
    pub fn no_data(&self) -> usize {
        self.count(|o| o == Outcome::NoData)
    }

    /// Number of poses that the instrument cannot take.
    pub fn unreachable(&self) -> usize {
        self.count(|o| matches!(o, Outcome::Unreachable(_)))
    }

    fn count(&self, is: impl Fn(Outcome) -> bool) -> usize {
        self.outcomes.iter().filter(|o| is(**o)).count()
    }

    /// This measurement at these poses alone, with the reasons why others are lost: a lattice has poses that a file does not list.
    pub fn of_poses(mut self, poses: &[u32], lost: &[(u32, Unreachable)]) -> Self {
        let mut asked = vec![false; self.outcomes.len()];
        for &pose in poses {
            asked[pose as usize] = true;
        }
        for (outcome, asked) in self.outcomes.iter_mut().zip(asked) {
            if !asked {
                *outcome = Outcome::NotVisited;
            }
        }
        for &(pose, reason) in lost {
            self.outcomes[pose as usize] = Outcome::Unreachable(reason);
        }
        self
    }

    /// This measurement with the outcomes of an earlier one at the first poses of its schedule.
    pub(crate) fn after(mut self, earlier: &Measurement) -> Self {
        let (poses, values) = (earlier.outcomes.len(), earlier.values.len());
        self.outcomes[..poses].copy_from_slice(&earlier.outcomes);
        self.values[..values].copy_from_slice(&earlier.values);
        if let (Some(details), Some(earlier)) = (&mut self.details, &earlier.details) {
            details.type_a[..values].copy_from_slice(&earlier.type_a);
            details.type_b[..values].copy_from_slice(&earlier.type_b);
            details.flags[..poses].copy_from_slice(&earlier.flags);
        }
        self
    }

    /// This measurement followed by another of the same material, in the coordinates of this one; `None` if its
    /// channels are others.
    pub fn followed_by(&self, other: &Measurement) -> Option<Measurement> {
        if self.channels != other.channels {
            return None;
        }
        let form = &self.schedule.parametrization;
        let further = other.schedule.poses.iter().map(|pose| Pose {
            coords: form.forward(&pose.pair),
            pair: pose.pair,
        });
        let details = |m: &Measurement| match &m.details {
            Some(details) => details.clone(),
            None => Details::unknown(m.values.len(), m.outcomes.len()),
        };
        let has_details = self.details.is_some() || other.details.is_some();
        let both = has_details.then(|| {
            let (mut all, more) = (details(self), details(other));
            all.type_a.extend(more.type_a);
            all.type_b.extend(more.type_b);
            all.flags.extend(more.flags);
            all
        });
        let mut places = Vec::new();
        if self.places.len() == self.outcomes.len() && other.places.len() == other.outcomes.len() {
            let files = self.places.iter().map(|place| place.file + 1).max();
            places.clone_from(&self.places);
            places.extend(other.places.iter().map(|place| Place {
                file: place.file + files.unwrap_or(0),
                ..*place
            }));
        }
        Some(Measurement {
            schedule: Arc::new(Schedule {
                poses: self.schedule.poses.iter().copied().chain(further).collect(),
                lattice: None,
                ..(*self.schedule).clone()
            }),
            channels: self.channels.clone(),
            values: [&self.values[..], &other.values].concat(),
            outcomes: [&self.outcomes[..], &other.outcomes].concat(),
            details: both,
            half_angles_deg: [0, 1].map(|k| self.half_angles_deg[k].max(other.half_angles_deg[k])),
            places,
        })
    }

    /// This measurement without the readings of some poses.
    #[must_use]
    pub(crate) fn without(mut self, poses: impl IntoIterator<Item = usize>) -> Self {
        for pose in poses {
            self.outcomes[pose] = Outcome::NoData;
        }
        self
    }

    /// This measurement with `flag` on some poses, and on no others.
    #[must_use]
    pub(crate) fn flagged(mut self, flag: Flags, poses: impl IntoIterator<Item = usize>) -> Self {
        let [values, number] = [self.values.len(), self.outcomes.len()];
        let unknown = || Details::unknown(values, number);
        let details = self.details.get_or_insert_with(unknown);
        details.flags.iter_mut().for_each(|all| all.0 &= !flag.0);
        for pose in poses {
            details.flags[pose] = details.flags[pose].with(flag);
        }
        self
    }

    /// The poses with a reading, in the order of a sequence.
    fn read_poses(&self, sequence: Sequence<'_>) -> Vec<usize> {
        let mut poses = sequence.poses(self.outcomes.len(), false);
        poses.retain(|pose| self.value(*pose).is_some());
        poses
    }

    /// The values of pose `i`, `None` if there is no reading.
    pub fn value(&self, i: usize) -> Option<&[f64]> {
        let n = self.channels.count();
        match self.outcomes[i] {
            Outcome::Reading => Some(&self.values[i * n..(i + 1) * n]),
            Outcome::NoData | Outcome::Unreachable(_) | Outcome::NotVisited => None,
        }
    }
}

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
    /// What the header of a foreign format says that has no place in ours, for the way back.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foreign_header: Option<serde_json::Value>,
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
