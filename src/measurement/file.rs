//! Measurements as CSV and JSON Lines.
//!
//! The rows are those of a schedule (see [`crate::schedule::write_schedule`]) and go on with
//!
//! | column | meaning |
//! |---|---|
//! | `value`, or `value_r, value_g, value_b` | f_r in sr⁻¹, without the cosine; luminance, or linear R, G, B |
//! | or `value_450nm, value_550nm, …` | f_r at each wavelength, nm |
//! | `type_a…`, `type_b…`, `uncertainty…` | standard uncertainties (k = 1), the last of both together |
//! | `flags` | what is odd about the reading, or why there is none, joined by `;` |
//! | `attempt` | number of the try, from 1 |
//!
//! Poses without a reading keep their row: values are empty and `flags` says `no-data`, `occluded`,
//! `unreachable:<reason>` or `not-visited`. Nothing of a measurement is lost on the way through a
//! file, and its numbers keep every bit.
//!
//! Of a table by others the four angles and the values are enough. There `uncertainty` alone is
//! taken for what all readings share (type B), the cautious reading; `value_cos…` is taken for the
//! value times cos theta_i and divided by it, with its uncertainties; an empty value without a
//! reason is `no-data`. A later attempt at a pose replaces an earlier one.

use super::{Details, Flags, Measurement, Outcome, without_cosine};
use crate::brdf::{Channels, Wavelengths};
use crate::error::excerpt;
use crate::schedule::export::{PoseRows, description};
use crate::schedule::import::{Rows, known_columns};
use crate::schedule::table::{Cell, Sheet, Table, WORDS};
use crate::schedule::{Assume, FileError, ScheduleFormat, Sequence, Unreachable};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::io::{self, Write};
use std::sync::Arc;

/// The fact that holds the hash of the rows.
const MEASUREMENT_HASH: &str = "measurement_hash";

/// Families of columns; each is one column, three with the ends of [`ENDS`], or one a wavelength.
const VALUE: &str = "value";
const VALUE_COS: &str = "value_cos";
const TYPE_A: &str = "type_a";
const TYPE_B: &str = "type_b";
const UNCERTAINTY: &str = "uncertainty";
const ATTEMPT: &str = "attempt";

/// Every family.
const FAMILIES: [&str; 5] = [VALUE, VALUE_COS, TYPE_A, TYPE_B, UNCERTAINTY];

/// Ends of the columns of colours.
const ENDS: [&str; 3] = ["_r", "_g", "_b"];

const NO_DATA: &str = "no-data";
const OCCLUDED: &str = "occluded";
const NOT_VISITED: &str = "not-visited";
const UNREACHABLE: &str = "unreachable:";

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
}

/// A measurement that was read.
pub struct MeasurementFile {
    /// The measurement.
    pub measurement: Measurement,
    /// Numbers of its poses in the order of the rows.
    pub order: Vec<u32>,
    /// Its origin.
    pub about: About,
    /// Rows that a later attempt replaced.
    pub replaced: usize,
}

/// Names of the columns of a family.
fn columns_of(family: &str, channels: &Channels) -> Vec<String> {
    match channels {
        Channels::Luminance => vec![family.to_owned()],
        Channels::Rgb => ENDS.map(|end| format!("{family}{end}")).to_vec(),
        Channels::Wavelengths(w) => {
            let nm = w.nm().iter();
            nm.map(|nm| format!("{family}_{nm}nm")).collect()
        }
    }
}

/// The wavelength (nm) of a column of a family, if it names one.
fn wavelength_of(column: &str, family: &str) -> Option<f64> {
    let rest = column.strip_prefix(family)?.strip_prefix('_')?;
    let number = rest.strip_suffix("nm")?;
    // Digits alone: no sign, no exponent, no NaN.
    let plain = number.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    number.parse().ok().filter(|_| plain)
}

/// True of a column of a family, of whatever channels.
fn is_of(column: &str, family: &str) -> bool {
    let plain = |channels: Channels| columns_of(family, &channels).iter().any(|c| c == column);
    plain(Channels::Luminance) || plain(Channels::Rgb) || wavelength_of(column, family).is_some()
}

/// The columns of a family that name a wavelength: nm and place, from short to long.
fn spectral_columns(table: &Table, family: &str) -> Vec<(f64, usize)> {
    let columns = table.columns.iter().enumerate();
    let mut found: Vec<_> = columns
        .filter_map(|(i, column)| Some((wavelength_of(column, family)?, i)))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

/// Writes a measurement, every pose of its schedule that `sequence` names.
///
/// # Errors
/// Whatever `out` reports.
pub fn write_measurement(
    measurement: &Measurement,
    about: &About,
    sequence: Sequence<'_>,
    format: ScheduleFormat,
    out: &mut dyn Write,
) -> io::Result<()> {
    let channels = &measurement.channels;
    let n = channels.count();
    let poses = PoseRows::new(&measurement.schedule, sequence, true);
    let mut columns = poses.columns();
    let mut add = |family: &str, meaning: &str| {
        let names = columns_of(family, channels).into_iter();
        columns.extend(names.map(|name| (name, meaning.to_owned())));
    };
    add(
        VALUE,
        "f_r without the cosine, 1/sr; empty without a reading",
    );
    if measurement.details.is_some() {
        add(TYPE_A, "standard uncertainty (k = 1) of the scatter, 1/sr");
        add(TYPE_B, "standard uncertainty (k = 1) readings share, 1/sr");
        add(UNCERTAINTY, "hypot of both, 1/sr");
    }
    let flags = "what is odd about the reading, or why there is none";
    columns.push((WORDS.into(), flags.into()));
    columns.push((ATTEMPT.into(), "number of the try, from 1".into()));
    let mut facts = poses.facts();
    if let Ok(Value::Object(about)) = serde_json::to_value(about) {
        facts.extend(about);
    }
    facts.insert("channels".into(), json!(channels));
    facts.insert("unit".into(), json!("sr^-1, without the cosine"));
    let row = |row: usize, cells: &mut Vec<Cell>| {
        poses.fill(row, cells);
        let pose = poses.pose(row);
        match measurement.value(pose) {
            Some(values) => {
                cells.extend(values.iter().map(|v| Cell::Number(*v)));
                if let Some(details) = &measurement.details {
                    let [a, b] = [&details.type_a, &details.type_b];
                    let [a, b] = [a, b].map(|all| &all[pose * n..(pose + 1) * n]);
                    cells.extend(a.iter().chain(b).map(|u| Cell::Number(*u)));
                    cells.extend(a.iter().zip(b).map(|(a, b)| Cell::Number(a.hypot(*b))));
                }
            }
            None => {
                let families = if measurement.details.is_some() { 4 } else { 1 };
                cells.extend((0..families * n).map(|_| Cell::Empty));
            }
        }
        cells.push(Cell::Words(words(measurement, pose)));
        cells.push(Cell::Number(1.0));
    };
    let mut lines = description(&measurement.schedule, "measurement");
    let readings = measurement.readings();
    lines.push(format!("measurement: {readings} readings of these poses"));
    let sheet = Sheet {
        about: lines,
        facts,
        columns,
        rows: poses.len(),
        row: &row,
    };
    sheet.write(format, MEASUREMENT_HASH, out)
}

/// The flags of a pose and the reason if it has no reading, joined by `;`.
fn words(measurement: &Measurement, pose: usize) -> String {
    let mut words: Vec<String> = Vec::new();
    match measurement.outcomes[pose] {
        Outcome::Reading => {}
        Outcome::NoData => words.push(NO_DATA.into()),
        Outcome::Unreachable(Unreachable::Occluded) => words.push(OCCLUDED.into()),
        Outcome::Unreachable(why) => words.push(format!("{UNREACHABLE}{}", why.label())),
        Outcome::NotVisited => words.push(NOT_VISITED.into()),
    }
    if let Some(details) = &measurement.details {
        let all = Flags::ALL.iter();
        let set = all.filter(|(flag, _)| details.flags[pose].has(*flag));
        words.extend(set.map(|(_, name)| (*name).into()));
    }
    words.join(";")
}

/// What is wrong with a cell of `flags`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FlagsError {
    /// A word that is none of them.
    #[error(
        "{word:?} is no flag; allowed are {}, {NO_DATA}, {OCCLUDED}, {NOT_VISITED}, {UNREACHABLE} with one of {}",
        Flags::ALL.map(|(_, name)| name).join(", "),
        Unreachable::NAMES.join(", ")
    )]
    Unknown {
        /// The word, or its start.
        word: String,
    },
    /// Two reasons.
    #[error("allowed is one reason for no reading")]
    Reasons,
}

/// Why there is no reading, and the flags.
fn parse_words(words: &str) -> Result<(Option<Outcome>, Flags), FlagsError> {
    let (mut outcome, mut flags) = (None, Flags::NONE);
    for word in words.split(';').map(str::trim).filter(|w| !w.is_empty()) {
        if let Some((flag, _)) = Flags::ALL.iter().find(|(_, name)| *name == word) {
            flags = flags.with(*flag);
            continue;
        }
        let reason = word
            .strip_prefix(UNREACHABLE)
            .and_then(Unreachable::of_label);
        let found = match (word, reason) {
            (NO_DATA, _) => Outcome::NoData,
            (OCCLUDED, _) => Outcome::Unreachable(Unreachable::Occluded),
            (NOT_VISITED, _) => Outcome::NotVisited,
            (_, Some(reason)) => Outcome::Unreachable(reason),
            (_, None) => {
                let word = excerpt(word).into_owned();
                return Err(FlagsError::Unknown { word });
            }
        };
        if outcome.replace(found).is_some() {
            return Err(FlagsError::Reasons);
        }
    }
    Ok((outcome, flags))
}

/// Reads a measurement; `name` stands for the file in messages.
///
/// # Errors
/// As [`crate::schedule::read_schedule`]; also one sentence with the line for a value that is no
/// number or beyond [`crate::numeric::LARGEST_READING`], a negative uncertainty, an unknown flag,
/// two rows of one pose with the same attempt.
pub fn read_measurement(
    text: &str,
    name: &str,
    assume: &Assume,
) -> Result<MeasurementFile, FileError> {
    let mut further = vec![WORDS.to_owned(), ATTEMPT.to_owned()];
    for family in FAMILIES {
        for channels in [Channels::Luminance, Channels::Rgb] {
            further.extend(columns_of(family, &channels));
        }
    }
    let table = Table::read(text, name, MEASUREMENT_HASH, |table| {
        let spectral = |column: &&String| {
            let mut families = FAMILIES.iter();
            families.any(|family| wavelength_of(column, family).is_some())
        };
        let further = further.iter().chain(table.columns.iter().filter(spectral));
        let further: Vec<&str> = further.map(String::as_str).collect();
        known_columns(table, &assume.axes, &further)
    })?;
    let rows = Rows::read(&table)?;
    let kept = latest(&table, &rows)?;
    let (schedule, order) = rows.schedule(&table, &kept, assume, MEASUREMENT_HASH)?;
    let columns = ValueColumns::of(&table)?;
    let (poses, n) = (schedule.poses.len(), columns.channels.count());
    let mut measurement = Measurement {
        channels: columns.channels.clone(),
        values: vec![0.0; poses * n],
        outcomes: vec![Outcome::NotVisited; poses],
        details: None,
        schedule: Arc::new(schedule),
    };
    let mut details = Details {
        type_a: vec![0.0; poses * n],
        type_b: vec![0.0; poses * n],
        flags: vec![Flags::NONE; poses],
    };
    let mut flagged = false;
    for (&row, &pose) in kept.iter().zip(&order) {
        let pose = pose as usize;
        let (reason, flags) = parse_words(table.words(row)).map_err(|e| {
            let message = format!("flags = {:?} cannot be read", excerpt(table.words(row)));
            table.row_error(row, message).because(e)
        })?;
        let cos = rows.pairs[row].omega_i.cos_theta();
        let at = pose * n..(pose + 1) * n;
        let read = columns.read(&table, row, cos, &mut measurement.values[at.clone()])?;
        measurement.outcomes[pose] = match (read, reason) {
            (true, None) => Outcome::Reading,
            (false, reason) => reason.unwrap_or(Outcome::NoData),
            (true, Some(_)) => {
                let words = excerpt(table.words(row));
                let message = format!("there is a value, and flags = {words:?} says there is none");
                return Err(table.row_error(row, message));
            }
        };
        details.flags[pose] = flags;
        flagged |= flags != Flags::NONE;
        if read {
            let [a, b] = [&mut details.type_a[at.clone()], &mut details.type_b[at]];
            columns.read_uncertainties(&table, row, cos, a, b)?;
        }
    }
    if flagged || columns.has_uncertainties() {
        measurement.details = Some(details);
    }
    Ok(MeasurementFile {
        measurement,
        order,
        about: About {
            material: table.fact("material")?,
            instrument: table.fact("instrument")?,
            realisation: table.fact("realisation")?,
            seed: table.fact("seed")?,
            schedule_hash: table.fact("schedule_hash")?,
        },
        replaced: table.lines.len() - kept.len(),
    })
}

/// The row of the latest attempt at each pose, in the order of the file.
fn latest(table: &Table, rows: &Rows) -> Result<Vec<usize>, FileError> {
    let column = table.column(ATTEMPT);
    let attempt = |row: usize| match column {
        None => Ok(1.0),
        Some(column) => match table.number(row, column) {
            None => Ok(1.0),
            Some(value) if value >= 1.0 && value.fract() == 0.0 => Ok(value),
            Some(value) => {
                let message = format!("attempt = {value}: allowed is a whole number from 1");
                Err(table.row_error(row, message))
            }
        },
    };
    let mut best: Vec<Option<usize>> = vec![None; table.lines.len()];
    for again in rows.again() {
        let best = &mut best[again.first];
        *best = match *best {
            None => Some(again.row),
            Some(_) if again.is_another_pose() => return Err(again.refuse(table)),
            Some(earlier) => {
                let (a, b) = (attempt(earlier)?, attempt(again.row)?);
                if a == b {
                    return Err(again.refuse(table));
                }
                Some(if a > b { earlier } else { again.row })
            }
        };
        attempt(again.row)?;
    }
    let mut kept: Vec<usize> = best.into_iter().flatten().collect();
    kept.sort_unstable();
    Ok(kept)
}

/// Positions of the columns of values and uncertainties.
struct ValueColumns {
    channels: Channels,
    values: Vec<usize>,
    /// True if the values are times cos theta_i.
    with_cosine: bool,
    type_a: Option<Vec<usize>>,
    type_b: Option<Vec<usize>>,
    both: Option<Vec<usize>>,
}

impl ValueColumns {
    fn of(table: &Table) -> Result<Self, FileError> {
        let find = |family: &str, channels: &Channels| -> Option<Vec<usize>> {
            if let Channels::Wavelengths(w) = channels {
                let (nm, columns): (Vec<_>, _) =
                    spectral_columns(table, family).into_iter().unzip();
                return (nm == w.nm()).then_some(columns);
            }
            let names = columns_of(family, channels).into_iter();
            names.map(|name| table.column(&name)).collect()
        };
        let refuse = |message: String| FileError::at(&table.name, table.head, message);
        let mut found = Vec::new();
        for (family, with_cosine) in [(VALUE, false), (VALUE_COS, true)] {
            let mut kinds = vec![Channels::Luminance, Channels::Rgb];
            let nm: Vec<f64> = spectral_columns(table, family)
                .iter()
                .map(|c| c.0)
                .collect();
            if !nm.is_empty() {
                let wavelengths = Wavelengths::new(&nm);
                let wavelengths = wavelengths.map_err(|e| refuse(format!("columns of {e}")))?;
                kinds.push(Channels::Wavelengths(wavelengths));
            }
            for channels in kinds {
                let columns = find(family, &channels);
                found.extend(columns.map(|values| (channels, values, with_cosine)));
            }
        }
        if found.len() != 1 {
            let message = "there must be one kind of values (a schedule has none: measure it \
                           first); allowed: value, or value_r, value_g and value_b, or \
                           value_450nm and so on (f_r in 1/sr, without the cosine), or the same \
                           as value_cos… (times cos theta_i)";
            return Err(refuse(message.into()));
        }
        let (channels, values, with_cosine) = found.swap_remove(0);
        let [type_a, type_b, both] = [TYPE_A, TYPE_B, UNCERTAINTY].map(|family| {
            let columns = find(family, &channels);
            // One that is of no value would be dropped without a word.
            let of_none = |name: &&String| {
                is_of(name, family)
                    && !(columns.iter().flatten()).any(|&c| table.columns[c] == **name)
            };
            match table.columns.iter().find(of_none) {
                None => Ok(columns),
                Some(name) => Err(refuse(format!(
                    "column {} does not go with the columns of values; allowed: {} together",
                    excerpt(name),
                    columns_of(family, &channels).join(", ")
                ))),
            }
        });
        Ok(Self {
            values,
            with_cosine,
            type_a: type_a?,
            type_b: type_b?,
            both: both?,
            channels,
        })
    }

    fn has_uncertainties(&self) -> bool {
        self.type_a.is_some() || self.type_b.is_some() || self.both.is_some()
    }

    /// The reading (sr⁻¹, without the cosine) of a number in a cell.
    fn reading(
        &self,
        table: &Table,
        row: usize,
        column: usize,
        value: f64,
        cos: f64,
    ) -> Result<f64, FileError> {
        without_cosine(value, if self.with_cosine { cos } else { 1.0 }).map_err(|e| {
            let message = format!("{} = {value:e} is no reading", table.columns[column]);
            table.row_error(row, message).because(e)
        })
    }

    /// Reads the values of a row; false if there are none.
    fn read(
        &self,
        table: &Table,
        row: usize,
        cos: f64,
        out: &mut [f64],
    ) -> Result<bool, FileError> {
        let mut found = 0;
        for (out, &column) in out.iter_mut().zip(&self.values) {
            if let Some(value) = table.number(row, column) {
                *out = self.reading(table, row, column, value, cos)?;
                found += 1;
            }
        }
        if found == 0 || found == out.len() {
            return Ok(found > 0);
        }
        let message = "some of the values are empty; allowed: all or none";
        Err(table.row_error(row, message))
    }

    /// Reads the uncertainties of a row; an empty one is 0.
    fn read_uncertainties(
        &self,
        table: &Table,
        row: usize,
        cos: f64,
        type_a: &mut [f64],
        type_b: &mut [f64],
    ) -> Result<(), FileError> {
        let alone = self.type_a.is_none() && self.type_b.is_none();
        let of_b = if alone { &self.both } else { &self.type_b };
        for (columns, out) in [(&self.type_a, type_a), (of_b, type_b)] {
            for (&column, out) in columns.iter().flatten().zip(out) {
                let value = table.number(row, column).unwrap_or(0.0);
                if value < 0.0 {
                    let name = &table.columns[column];
                    let message = format!("{name} = {value}: allowed is a number from 0");
                    return Err(table.row_error(row, message));
                }
                *out = self.reading(table, row, column, value, cos)?;
            }
        }
        Ok(())
    }
}
