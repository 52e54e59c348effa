//! Readings of files, each in the format that its name or its first lines say.

use super::{READ_READINGS, ReadReadings};
use crate::error::{Error, count, excerpt};
use crate::measurement::{About, Measurement, Readings};
use crate::schedule::{Assume, FileError};
use std::path::{Path, PathBuf};

/// The text before its last line, and the number of that line.
fn without_last_line(text: &str) -> (&str, usize) {
    let text = text.trim_end();
    let end = text.rfind('\n').map_or(0, |i| i + 1);
    (&text[..end], text.lines().count())
}

fn were_read(rows: usize) -> String {
    let verb = if rows == 1 { "was" } else { "were" };
    format!("{} {verb} read", count(rows, "row"))
}

/// The readings of a file, in the format that its name or its first lines say.
///
/// # Errors
/// [`Error::Data`] if it cannot be read, or holds something else.
pub fn load_readings(path: &Path, assume: &Assume) -> Result<Readings, Error> {
    let (text, read) = READ_READINGS.open(path)?;
    let name = path.display().to_string();
    Ok(read_readings(read, &text, &name, assume)?)
}

/// Reads files of one material, at least one; `see` is shown each. Of several those whose content cannot be read are left out:
/// `see` is shown why. A configuration of several files is one, each of them with equal weight, see [`Measurement::merged`]. Origin of all is that of the first.
///
/// # Errors
/// As [`load_readings`], if no file can be read or one is not there; a file that is there twice; other channels or symmetries than
/// those of the first, or other names of material or instrument, unless `assume` takes them for one.
pub fn load_all_readings(
    paths: &[PathBuf],
    assume: &Assume,
    mut see: impl FnMut(&Path, Result<&mut Readings, &Error>),
) -> Result<Readings, Error> {
    let mut all: Option<(&Path, Readings)> = None;
    let mut failed = Vec::new();
    for (i, path) in paths.iter().enumerate() {
        // `load_readings` reports a file that does not exist.
        let file = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
        if paths[..i].iter().any(|other| file(other) == file(path)) {
            let message = "it is there twice; allowed: each file of readings once";
            return Err(Error::data(path, message));
        }
        let further = match load_readings(path, assume) {
            Ok(mut further) => {
                see(path, Ok(&mut further));
                further
            }
            Err(e @ Error::Data { .. }) if paths.len() > 1 && path.is_file() => {
                see(path, Err(&e));
                failed.push(e);
                continue;
            }
            Err(e) => return Err(e),
        };
        all = Some(match all {
            None => (path, further),
            Some((first, all)) => (first, all.with(further, [first, path], assume)?),
        });
    }
    match all {
        Some((_, mut all)) => {
            if paths.len() > 1 {
                let (measurement, folded) = all.measurement.merged();
                all.measurement = measurement;
                if folded.dropped() > 0 {
                    let poses = count(folded.dropped(), "pose");
                    let note = format!("{poses} averaged with those of files before");
                    all.notes.push(note);
                }
                all.warnings.extend(folded.warning());
            }
            all.lost += failed.len();
            let sentences = failed.iter().map(|e| format!("{e}; the file is left out"));
            all.warnings.extend(sentences);
            Ok(all)
        }
        None => {
            let none = || Error::Internal("a file of readings is required".into());
            Err(failed.into_iter().next().unwrap_or_else(none))
        }
    }
}

impl Readings {
    /// Those of another file after these; the files of both.
    fn with(
        mut self,
        further: Self,
        [first, path]: [&Path; 2],
        assume: &Assume,
    ) -> Result<Self, Error> {
        let (about, more) = (&self.about, &further.about);
        for (what, one, other) in [
            ("material", &about.material, &more.material),
            ("instrument", &about.instrument, &more.instrument),
        ] {
            if let (Some(one), Some(other)) = (one, other)
                && one != other
                && !assume.conventions.mixed
            {
                let [one, other] = [one, other].map(|name| excerpt(name));
                let message = format!(
                    "these readings are of the {what} {other:?}, those of {} of {one:?}; allowed: readings of one, or --mixed",
                    first.display()
                );
                return Err(Error::data(path, message));
            }
        }
        let folded = |m: &Measurement| m.schedule.parametrization.symmetry();
        let alike = folded(&self.measurement) == folded(&further.measurement);
        let both = self.measurement.followed_by(&further.measurement);
        self.measurement = both.filter(|_| alike).ok_or_else(|| {
            let message = format!(
                "its channels or symmetries are not those of {}; allowed: readings of one material",
                first.display()
            );
            Error::data(path, message)
        })?;
        // What was done once is not said of all.
        self.about = About {
            material: self.about.material.or(further.about.material),
            instrument: self.about.instrument.or(further.about.instrument),
            is_bare: self.about.is_bare && further.about.is_bare,
            ..About::default()
        };
        let is_new = |key: &String| !self.unread.contains(key);
        let unread: Vec<String> = further.unread.into_iter().filter(is_new).collect();
        self.unread.extend(unread);
        self.notes.extend(further.notes);
        self.warnings.extend(further.warnings);
        self.rows += further.rows;
        self.lost += further.lost;
        self.intact &= further.intact;
        Ok(self)
    }
}

/// Reads a text by the function of its format. One that was cut is read up to the cut if `assume`
/// says so; its last line is left out if it does not end, as digits may be missing from it.
pub fn read_readings(
    read: ReadReadings,
    text: &str,
    name: &str,
    assume: &Assume,
) -> Result<Readings, FileError> {
    let is_last = |e: &FileError, text: &str| {
        e.is_cut && e.line.is_none_or(|line| line == without_last_line(text).1)
    };
    let mut strict = assume.clone();
    strict.conventions.partial = false;
    let ended = text.ends_with('\n');
    let whole = read(text, name, &strict);
    if !assume.conventions.partial {
        return whole.map_err(|mut e| {
            if is_last(&e, text) {
                e.message += "; --partial reads up to the cut";
            }
            e
        });
    }
    if let Ok(mut readings) = whole
        && (ended || readings.intact)
    {
        let rows = were_read(readings.rows);
        readings.notes.push(format!("not cut: {rows}"));
        return Ok(readings);
    }
    let (mut part, mut left_out) = (text, String::new());
    if !ended {
        let (before, line) = without_last_line(text);
        let why = "it has no end, and digits may be missing from it";
        (part, left_out) = (before, format!(", line {line} is left out: {why}"));
    }
    let read_part = match read(part, name, assume) {
        Err(e) if is_last(&e, part) => {
            let (before, line) = without_last_line(part);
            let next = if ended {
                ""
            } else {
                ", and the next one, which has no end"
            };
            left_out = format!(", line {line} is left out{next}");
            read(before, name, assume)
        }
        result => result,
    };
    let mut readings = read_part?;
    let rows = were_read(readings.rows);
    readings.notes.push(format!("cut: {rows}{left_out}"));
    Ok(readings)
}
