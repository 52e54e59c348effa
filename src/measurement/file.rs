//! Measurements as CSV and JSON Lines.
//!
//! The rows are those of a schedule (see [`crate::schedule::write_schedule`]) and go on with
//!
//! | column | meaning |
//! |---|---|
//! | `value`, or `value_r, value_g, value_b` | f_r in sr⁻¹, without the cosine; luminance, or linear R, G, B |
//! | or `value_450nm, value_550nm, …` | f_r at each wavelength, nm |
//! | `type_a…`, `type_b…`, `uncertainty…` | standard uncertainties (k = 1), the last of both together; empty where not known |
//! | `flags` | what is odd about the reading, or why there is none, joined by `;` |
//! | `attempt` | number of the try, from 1 |
//!
//! Poses without a reading keep their row: values are empty and `flags` says `no-data`, `occluded`,
//! `unreachable:<reason>` or `not-visited`. Nothing of a measurement is lost on the way through a
//! file, and its numbers keep every bit.
//!
//! Of a table by others the angles and the values are enough, under the names and in the units of
//! [`Conventions`](crate::schedule::Conventions). There `uncertainty` alone is
//! taken for what all readings share (type B), the cautious reading; `value_cos…` is taken for the
//! value times cos theta_i and divided by it, with its uncertainties; `wavelength_nm` says that a
//! row has one of several wavelengths; an empty value (or NaN) without a
//! reason is `no-data`; rows with light or sensor at the horizon are passed over, unless there is a
//! column `attempt` or a lattice. Where there is a column `attempt`, a later attempt at a pose replaces an
//! earlier one; where there is none, rows of one pose are repeats and are averaged, see
//! [`Measurement::merged`].

use super::columns::{
    self, TYPE_A, TYPE_B, UNCERTAINTY, VALUE, ValueColumns, WAVELENGTH, columns_of, derive,
    take_rare_wavelengths,
};
use super::doubts::{seem_elevations, seem_no_readings, seem_percent, seems_radians};
use super::merge::Pool;
use super::{
    About, Flags, Measurement, Negative, Outcome, Place, Readings, WIDEST_DEG, retro_peak,
};
use crate::error::{count, count_are, excerpt};
use crate::schedule::arms::{Outside, take_incomplete, take_outside, unread_angles};
use crate::schedule::export::{PoseRows, description};
use crate::schedule::import::{Again, Rows, known_columns};
use crate::schedule::table::{Cell, Column, Sheet, Table, WORDS};
use crate::schedule::{Assume, FileError, ScheduleFormat, Sequence, Unreachable};
use rustc_hash::FxHashMap;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::sync::Arc;

const MEASUREMENT_HASH: &str = "measurement_hash";

/// The column that numbers the tries at a pose.
pub(super) const ATTEMPT: &str = "attempt";

const NO_DATA: &str = "no-data";
const OCCLUDED: &str = "occluded";
const NOT_VISITED: &str = "not-visited";
const UNREACHABLE: &str = "unreachable:";

/// Writes a measurement, every pose of its schedule that `sequence` names.
pub fn write_measurement(
    measurement: &Measurement,
    about: &About,
    sequence: Sequence<'_>,
    format: ScheduleFormat,
    out: &mut dyn Write,
) -> io::Result<()> {
    let channels = &measurement.channels;
    let n = channels.count();
    let mut rows = PoseRows::new(&measurement.schedule, sequence, true);
    rows.is_bare = about.is_bare;
    let poses = &rows.poses;
    let mut columns = rows.columns();
    let meaning = "f_r without the cosine, 1/sr; empty without a reading";
    for (c, name) in columns_of(VALUE, channels).into_iter().enumerate() {
        let value = move |row: usize| Some(measurement.value(poses[row])?[c]);
        columns.push(Column::new(name, meaning, value));
    }
    let scatter = "standard uncertainty (k = 1) of the scatter, 1/sr";
    let shared = "standard uncertainty (k = 1) readings share, 1/sr";
    type Of = fn(f64, f64) -> f64;
    let families: [(&str, &str, Of); 3] = [
        (TYPE_A, scatter, |a, _| a),
        (TYPE_B, shared, |_, b| b),
        (UNCERTAINTY, "hypot of both, 1/sr", f64::hypot),
    ];
    if let Some(details) = &measurement.details {
        for (family, meaning, of) in families {
            for (c, name) in columns_of(family, channels).into_iter().enumerate() {
                let uncertainty = move |row: usize| {
                    let pose = poses[row];
                    measurement.value(pose)?;
                    let at = pose * n + c;
                    // One of 0 is not known.
                    Some(of(details.type_a[at], details.type_b[at])).filter(|u| *u != 0.0)
                };
                columns.push(Column::new(name, meaning, uncertainty));
            }
        }
    }
    let flags = "what is odd about the reading, or why there is none";
    columns.push(Column::new(WORDS, flags, |row| {
        Cell::Words(words(measurement, poses[row]))
    }));
    columns.push(Column::new(ATTEMPT, "number of the try, from 1", |_| 1.0));
    let mut facts = rows.facts();
    if let Ok(Value::Object(about)) = serde_json::to_value(about) {
        facts.extend(about);
    }
    if measurement.half_angles_deg != [0.0; 2] {
        facts.insert(HALF_ANGLES.into(), json!(measurement.half_angles_deg));
    }
    facts.insert("channels".into(), json!(channels));
    facts.insert("unit".into(), json!("sr^-1, without the cosine"));
    let mut lines = description(&measurement.schedule, "measurement");
    let readings = count(measurement.readings(), "reading");
    lines.push(format!("measurement: {readings} of these poses"));
    let sheet = Sheet {
        about: lines,
        facts,
        columns,
        rows: poses.len(),
    };
    sheet.write(format, MEASUREMENT_HASH, out)
}

/// The key of the half-angles of source and sensor in the header.
const HALF_ANGLES: &str = "half_angles_deg";

/// The half-angles of source and sensor that a header has, else 0.
fn half_angles(table: &Table) -> Result<[f64; 2], FileError> {
    let Some(both) = table.fact::<[f64; 2]>(HALF_ANGLES)? else {
        return Ok([0.0; 2]);
    };
    if both.iter().all(|angle| (0.0..=WIDEST_DEG).contains(angle)) {
        return Ok(both);
    }
    let message = format!(
        "{HALF_ANGLES} = {both:?}: allowed are two angles from 0 to {WIDEST_DEG}°, of source and sensor"
    );
    Err(table.fact_error(HALF_ANGLES, message))
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

/// Why there is no reading, and the flags.
fn parse_words(words: &str) -> Result<(Option<Outcome>, Flags), String> {
    let (mut outcome, mut flags) = (None, Flags::NONE);
    for word in words.split(';').map(str::trim).filter(|w| !w.is_empty()) {
        if let Some((flag, _)) = Flags::ALL.iter().find(|(_, name)| *name == word) {
            flags = flags.with(*flag);
            continue;
        }
        let label = word.strip_prefix(UNREACHABLE);
        let found = match (word, label.and_then(Unreachable::of_label)) {
            (NO_DATA, _) => Outcome::NoData,
            (OCCLUDED, _) => Outcome::Unreachable(Unreachable::Occluded),
            (NOT_VISITED, _) => Outcome::NotVisited,
            (_, Some(reason)) => Outcome::Unreachable(reason),
            (_, None) => {
                return Err(format!(
                    "{:?} is no flag; allowed are {}, {NO_DATA}, {OCCLUDED}, {NOT_VISITED}, {UNREACHABLE} with one of {}",
                    excerpt(word),
                    Flags::ALL.map(|(_, name)| name).join(", "),
                    Unreachable::NAMES.join(", ")
                ));
            }
        };
        if outcome.replace(found).is_some() {
            return Err("allowed is one reason for no reading".into());
        }
    }
    Ok((outcome, flags))
}

/// Reads a measurement, each configuration once, see [`Measurement::merged`]; `name` stands for the file in messages.
///
/// # Errors
/// As [`crate::schedule::read_schedule`]; also one sentence with the line for a value that is no
/// number or beyond [`crate::numeric::LARGEST_READING`], a negative uncertainty, an unknown flag,
/// two rows of one pose with the same attempt.
pub fn read_measurement(text: &str, name: &str, assume: &Assume) -> Result<Readings, FileError> {
    let conventions = &assume.conventions;
    let mut table = Table::read(text, name, MEASUREMENT_HASH, conventions, |table| {
        let further = columns::known(table);
        let further = further.iter().map(String::as_str);
        let further: Vec<&str> = further.chain([WORDS, ATTEMPT]).collect();
        known_columns(table, &assume.axes, &further)
    })?;
    let is_ours = is_ours(&table)?;
    let (mut unplaced, mut outside) = (0, Outside::default());
    if !is_ours {
        unplaced = take_incomplete(&mut table, &[WAVELENGTH]) + take_rare_wavelengths(&mut table);
        if unplaced > 0 && table.lines.is_empty() {
            let message = "no row has all of its angles and a wavelength";
            return Err(FileError::whole(name, message));
        }
        outside = take_outside(&mut table, conventions);
        if outside.at_horizon > 0 && table.lines.is_empty() {
            return Err(FileError::whole(name, "there is no row above the horizon"));
        }
    }
    let derived = derive(&mut table, conventions)?;
    let rows = Rows::read(&table, conventions)?;
    let columns = ValueColumns::find(&table, conventions, derived)?;
    let mut marks = std::mem::take(&mut table.marks);
    if !is_ours {
        marks.add(columns.clear_marks(&mut table, conventions.no_reading));
    }
    // Equal poses of different pictures are not averaged pixel by pixel.
    let used = match conventions.pixels {
        Some(_) => (0..table.lines.len()).map(|row| (row, row)).collect(),
        None => used(&table, &rows, &columns)?,
    };
    // The first row of each pose stands for it.
    let mut place = vec![usize::MAX; table.lines.len()];
    let mut kept = Vec::new();
    for &(row, first) in &used {
        if place[first] == usize::MAX {
            place[first] = kept.len();
            kept.push(row);
        }
    }
    let (schedule, order) = rows.schedule(&table, &kept, assume, MEASUREMENT_HASH)?;
    let mut pool = Pool::new(schedule.poses.len(), columns.channels.count());
    let mut negative = Negative::default();
    let (mut incomplete, mut empty, mut exact) = (0, 0, 0);
    let stated = columns.stated(&table);
    for &(row, first) in &used {
        let pose = order[place[first]] as usize;
        let (reason, flags) = parse_words(table.words(row)).map_err(|e| {
            let message = format!("flags = {:?} cannot be read", excerpt(table.words(row)));
            table.row_error(row, message).because(e)
        })?;
        let pair = &rows.directions.pairs[row];
        let values = columns.read(&table, row, pair)?;
        let outcome = match (&values, reason) {
            (None, _) if columns.cells(&table, row).next().is_some() => {
                if is_ours {
                    let message = "some of the values are empty or NaN; allowed: all or none";
                    return Err(table.row_error(row, message));
                }
                incomplete += 1;
                reason.unwrap_or(Outcome::NoData)
            }
            (None, Some(reason)) => reason,
            (None, None) => {
                empty += columns.span(&table, row).len();
                Outcome::NoData
            }
            (Some(_), None) => Outcome::Reading,
            (Some(_), Some(_)) => {
                let words = excerpt(table.words(row));
                let message = format!("there is a value, and flags = {words:?} says there is none");
                return Err(table.row_error(row, message));
            }
        };
        pool.see(pose, outcome, flags);
        if let Some(values) = values {
            negative.see(table.lines[row], columns.cells(&table, row));
            let [a, b] = columns.read_uncertainties(&table, row, pair)?;
            let states = |column: &usize| table.number(row, *column).is_some_and(|u| u > 0.0);
            exact += usize::from(!stated.iter().all(states));
            let channels = columns.span(&table, row);
            for ((channel, value), (a, b)) in channels.zip(values).zip(a.into_iter().zip(b)) {
                pool.add(pose, channel, [value, a, b]);
            }
        }
    }
    for (&row, &pose) in kept.iter().zip(&order) {
        let missing = pool.missing(pose as usize);
        if missing.is_some() && !is_ours {
            pool.lose(pose as usize);
            incomplete += 1;
        } else if let Some(missing) = missing {
            let nm = columns.channels.wavelengths().map(|w| w.nm()[missing]);
            let message = format!(
                "this pose has no reading at {} nm; allowed: one at every wavelength of the file",
                nm.unwrap_or_default()
            );
            return Err(table.row_error(row, message));
        }
    }
    if incomplete > 0 && !pool.has_readings() {
        let message = "no pose has a value in all channels";
        return Err(FileError::whole(name, message));
    }
    let averaged = pool.repeats() / columns.values.len();
    let detailed = columns.has_uncertainties();
    let mut measurement = pool.measurement(Arc::new(schedule), columns.channels, detailed);
    measurement.places = vec![Place::default(); measurement.outcomes.len()];
    for (&row, &pose) in kept.iter().zip(&order) {
        measurement.places[pose as usize].line = table.lines[row];
    }
    measurement.half_angles_deg = half_angles(&table)?;
    let mut about = About {
        material: table.fact("material")?,
        instrument: table.fact("instrument")?,
        realisation: table.fact("realisation")?,
        seed: table.fact("seed")?,
        schedule_hash: table.fact("schedule_hash")?,
        foreign_header: table.fact("foreign_header")?,
        is_bare: table.fact::<Value>("parametrization")?.is_none()
            && table.fact::<Value>("symmetry")?.is_none(),
    };
    let mut notes = std::mem::take(&mut table.notes);
    if let Some(nodes) = conventions.pixels {
        let stops = stops(&table, kept.iter().zip(&order), &measurement.outcomes)?;
        let thinned;
        (measurement, thinned) = measurement.thinned(&stops, nodes.get());
        notes.push(thinned.note());
        about.schedule_hash = None;
    }
    let (measurement, folded) = measurement.merged();
    let mut ignored = table.passed_over();
    // Ours have coordinates that are called as an angle is.
    if !is_ours {
        ignored.extend(unread_angles(&table));
    }
    for nameless in ignored.iter_mut().filter(|name| name.is_empty()) {
        *nameless = "one without a name".into();
    }
    if !ignored.is_empty() {
        notes.push(format!("ignored columns: {}", ignored.join(", ")));
    }
    let replaced = table.lines.len() - used.len();
    #[rustfmt::skip]
    let counted = [
        (replaced, "row", "replaced by later attempts"),
        (rows.directions.signed, "row", "with a polar angle below 0: the same angle in the opposite azimuth"),
        (averaged, "row", "with a pose of another row: averaged, with the standard error of the mean"),
        (folded.poses, "pose", "averaged with others under these symmetries"),
        (folded.repeated, "pose", "within .005° of another, and far from all others: averaged with it"),
        (outside.at_horizon, "row", "with light or sensor at the horizon: passed over"),
        (outside.behind, "row", "with light or sensor behind the sample: passed over"),
    ];
    for (number, noun, what) in counted.into_iter().filter(|(number, ..)| *number > 0) {
        let of = if noun == "pose" { count_are } else { count };
        notes.push(format!("{} {what}", of(number, noun)));
    }
    // Our own files count azimuths from the sample, and say what is below their noise.
    let intact = table.fact::<String>(MEASUREMENT_HASH)?.is_some();
    let mut warnings: Vec<String> = Vec::new();
    if !intact {
        let peak = retro_peak(&measurement).filter(|_| conventions.azimuth.is_none());
        warnings.extend(peak.iter().map(ToString::to_string));
        warnings.extend(negative.warning());
        warnings.extend(marks.warning());
    }
    if unplaced > 0 {
        let what = "without an angle or a wavelength that others are at: passed over";
        warnings.push(format!("{} {what}", count(unplaced, "row")));
    }
    // Cells of marks are empty by now.
    let empty = empty.saturating_sub(marks.count());
    if !intact && empty > 0 {
        warnings.push(format!("{} empty: no reading", count_are(empty, "cell")));
    }
    if incomplete > 0 {
        let what = "without the value of some channel: no reading";
        warnings.push(format!("{} {what}", count(incomplete, "pose")));
    }
    if !intact {
        warnings.extend(seem_no_readings(&measurement));
        warnings.extend(folded.warning());
        if exact > 0 {
            let what = "without an uncertainty in a column that has some: it is not known";
            warnings.push(format!("{} {what}", count(exact, "reading")));
        }
        warnings.extend(seems_radians(&measurement));
    }
    if outside.lights > 0 && !conventions.elevation {
        warnings.extend(seem_elevations(&measurement, outside.lights));
    }
    if !intact && detailed && conventions.uncertainties.is_none() {
        warnings.extend(seem_percent(&measurement));
    }
    Ok(Readings {
        measurement,
        about,
        notes,
        warnings,
        rows: table.lines.len() + outside.at_horizon + outside.behind + unplaced,
        lost: marks.count() + empty + incomplete + unplaced,
        unread: table.unread(),
        intact,
    })
}

/// The stop of each pose with a reading, from the rows that stand for them.
fn stops<'a>(
    table: &Table,
    rows: impl Iterator<Item = (&'a usize, &'a u32)>,
    outcomes: &[Outcome],
) -> Result<Vec<f64>, FileError> {
    let Some(column) = table.column("stop") else {
        let message = "--pixels: there is no column stop, which names the picture of each row; allowed: one, or \
                       --columns stop=NAME";
        return Err(FileError::on_line(&table.name, table.head, message));
    };
    let mut stops = vec![0.0; outcomes.len()];
    for (&row, &pose) in rows.filter(|(_, pose)| outcomes[**pose as usize] == Outcome::Reading) {
        let stop = table.number(row, column);
        let is_number = |stop: &f64| *stop >= 0.0 && stop.fract() == 0.0;
        stops[pose as usize] = stop.filter(is_number).ok_or_else(|| {
            let stop = stop.map_or("empty".into(), |stop| stop.to_string());
            let message = format!(
                "stop = {stop}: allowed is the number of the picture, a whole number from 0"
            );
            table.row_error(row, message)
        })?;
    }
    Ok(stops)
}

/// True of a table that counts tries or has a lattice, as ours do: none of its rows is to be missed.
fn is_ours(table: &Table) -> Result<bool, FileError> {
    Ok(table.column(ATTEMPT).is_some() || table.fact::<Value>("lattice")?.is_some())
}

/// The rows that count, in the order of the file, and of each the first row of its pose. In a file
/// that numbers attempts it is the latest at each pose and channel, in any other every row.
fn used(
    table: &Table,
    rows: &Rows,
    columns: &ValueColumns,
) -> Result<Vec<(usize, usize)>, FileError> {
    let Some(column) = table.column(ATTEMPT) else {
        let check = |again: Again| match again.by_index {
            true => Err(again.refuse(table)),
            false => Ok((again.row, again.first)),
        };
        return rows.again().map(check).collect();
    };
    let attempt = |row: usize| match table.number(row, column) {
        None => Ok(1.0),
        Some(value) if value >= 1.0 && value.fract() == 0.0 => Ok(value),
        Some(value) => {
            let name = table.label(column);
            let message = format!("{name} = {value}: allowed is a whole number from 1");
            Err(table.row_error(row, message))
        }
    };
    let mut best: FxHashMap<(usize, usize), (usize, f64)> = FxHashMap::default();
    for again in rows.again() {
        if again.by_index {
            return Err(again.refuse(table));
        }
        let (row, number) = (again.row, attempt(again.row)?);
        let channel = columns.span(table, row).start;
        let best = best.entry((again.first, channel)).or_insert((row, number));
        if best.0 != row && best.1 == number {
            let message = format!(
                "this pose is that of line {} with the same {ATTEMPT}; allowed: each once, or no \
                 column {ATTEMPT}, without which rows of one pose are averaged",
                table.lines[best.0]
            );
            return Err(table.row_error(row, message));
        }
        if number > best.1 {
            *best = (row, number);
        }
    }
    let mut used: Vec<_> = (best.into_iter())
        .map(|((first, _), (row, _))| (row, first))
        .collect();
    used.sort_unstable();
    Ok(used)
}
