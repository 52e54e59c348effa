//! Rows with named columns, one a pose: CSV and JSON Lines.

use super::{Format, Readings};
use crate::error::{count, count_are};
use crate::measurement::{Measurement, read_measurement, retro_peak, write_measurement};
#[cfg(feature = "arrays")]
use crate::schedule::table::as_lines;
use crate::schedule::{Assume, FileError, ScheduleFormat, read_schedule, write_schedule};
use std::f64::consts::FRAC_PI_2;

/// Comma-separated values.
pub const CSV: Format = Format {
    name: "csv",
    extensions: &["csv"],
    summary: "comma-separated values with a commented header",
    recognises: Some(|_| true),
    read_schedule: Some(read_schedule),
    write_schedule: Some(|schedule, sequence, out| {
        write_schedule(schedule, sequence, ScheduleFormat::Csv, out)
    }),
    read_readings: Some(read),
    write_readings: Some(|measurement, about, sequence, out| {
        write_measurement(measurement, about, sequence, ScheduleFormat::Csv, out)
    }),
    ..Format::NONE
};

/// One JSON object a line.
pub const JSON_LINES: Format = Format {
    name: "json-lines",
    extensions: &["jsonl", "ndjson"],
    summary: "one JSON object a line, the first one the header",
    recognises: Some(|text| ScheduleFormat::of_text(text) == ScheduleFormat::JsonLines),
    read_schedule: Some(read_schedule),
    write_schedule: Some(|schedule, sequence, out| {
        write_schedule(schedule, sequence, ScheduleFormat::JsonLines, out)
    }),
    read_readings: Some(read),
    write_readings: Some(|measurement, about, sequence, out| {
        write_measurement(measurement, about, sequence, ScheduleFormat::JsonLines, out)
    }),
    ..Format::NONE
};

/// Arrays of NumPy.
#[cfg(feature = "arrays")]
pub const NPZ: Format = Format {
    name: "npz",
    extensions: &["npz"],
    summary: "an array of NumPy a column, and unit vectors of light and sensor",
    as_text: Some(as_lines),
    read_schedule: Some(read_schedule),
    write_schedule: Some(|schedule, sequence, out| {
        write_schedule(schedule, sequence, ScheduleFormat::Arrays, out)
    }),
    read_readings: Some(read),
    write_readings: Some(|measurement, about, sequence, out| {
        write_measurement(measurement, about, sequence, ScheduleFormat::Arrays, out)
    }),
    ..Format::NONE
};

/// The sentence that doubts the unit of the angles if those of several poses are no larger than
/// those of the hemisphere in radians.
fn seems_radians(measurement: &Measurement) -> Option<String> {
    let poses = &measurement.schedule.poses;
    let polar = poses.iter().flat_map(|pose| {
        let pair = &pose.pair;
        [pair.omega_i.theta(), pair.omega_o.theta()]
    });
    let largest = polar.fold(0.0, f64::max).to_degrees();
    let doubtful = poses.len() > 1 && largest > 0.0 && largest <= FRAC_PI_2;
    doubtful.then(|| {
        format!(
            "no polar angle is above {largest:.2}°, as if radians were read as degrees; allowed: \
             columns that end in _rad, or --angles rad"
        )
    })
}

fn read(text: &str, name: &str, assume: &Assume) -> Result<Readings, FileError> {
    let file = read_measurement(text, name, assume)?;
    let (measurement, folded) = file.measurement.merged();
    let mut notes = Vec::new();
    if !file.passed_over.is_empty() {
        let names = file.passed_over.iter().map(|name| match name.as_str() {
            "" => "one without a name",
            name => name,
        });
        let columns: Vec<&str> = names.collect();
        notes.push(format!(
            "columns that were passed over: {}",
            columns.join(", ")
        ));
    }
    if file.replaced > 0 {
        notes.push(format!(
            "{} replaced by later attempts",
            count(file.replaced, "row")
        ));
    }
    if file.signed > 0 {
        notes.push(format!(
            "{} with a polar angle below 0: the same angle in the opposite azimuth",
            count(file.signed, "row")
        ));
    }
    if file.averaged > 0 {
        notes.push(format!(
            "{} with a pose of another row: averaged, with the standard error of the mean",
            count(file.averaged, "row")
        ));
    }
    if folded.poses > 0 {
        notes.push(format!(
            "{} averaged with others under these symmetries",
            count_are(folded.poses, "pose")
        ));
    }
    if file.at_horizon > 0 {
        notes.push(format!(
            "{} with light or sensor at the horizon: passed over",
            count(file.at_horizon, "row")
        ));
    }
    let exact = (file.exact > 0).then(|| {
        format!(
            "{} without an uncertainty, in a file that has a column of them: it counts as 0",
            count(file.exact, "reading")
        )
    });
    // Our own files count azimuths from the sample, and say what is below their noise.
    let doubt = !file.intact && assume.conventions.azimuth.is_none();
    let peak = retro_peak(&measurement).filter(|_| doubt);
    let negative = file.negative.warning().filter(|_| !file.intact);
    let radians = seems_radians(&measurement).filter(|_| !file.intact);
    Ok(Readings {
        warnings: peak
            .iter()
            .map(ToString::to_string)
            .chain(negative)
            .chain(folded.warning().filter(|_| !file.intact))
            .chain(exact.filter(|_| !file.intact))
            .chain(radians)
            .collect(),
        rows: file.rows,
        intact: file.intact,
        measurement,
        about: file.about,
        notes,
    })
}
