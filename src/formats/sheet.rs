//! Rows with named columns, one a pose: CSV and JSON Lines.

use super::{Format, Readings};
use crate::error::{count, count_are};
use crate::measurement::{read_measurement, retro_peak, write_measurement};
use crate::schedule::{Assume, FileError, ScheduleFormat, read_schedule, write_schedule};

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

fn read(text: &str, name: &str, assume: &Assume) -> Result<Readings, FileError> {
    let file = read_measurement(text, name, assume)?;
    let (measurement, merged) = file.measurement.merged();
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
    if file.averaged > 0 {
        notes.push(format!(
            "{} with a pose of another row: averaged, with the standard error of the mean",
            count(file.averaged, "row")
        ));
    }
    if merged > 0 {
        notes.push(format!(
            "{} averaged with others under these symmetries",
            count_are(merged, "pose")
        ));
    }
    if file.at_horizon > 0 {
        notes.push(format!(
            "{} with light or sensor at the horizon: passed over",
            count(file.at_horizon, "row")
        ));
    }
    // Our own files count azimuths from the sample, and say what is below their noise.
    let doubt = !file.intact && assume.conventions.azimuth.is_none();
    let peak = retro_peak(&measurement).filter(|_| doubt);
    let negative = file.negative.warning().filter(|_| !file.intact);
    Ok(Readings {
        warnings: peak
            .iter()
            .map(ToString::to_string)
            .chain(negative)
            .collect(),
        rows: file.rows,
        intact: file.intact,
        measurement,
        notes,
    })
}
