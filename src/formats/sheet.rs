//! Rows with named columns, one a pose: CSV and JSON Lines.

use super::Format;
use crate::measurement::{read_measurement, write_measurement};
#[cfg(feature = "arrays")]
use crate::schedule::table::as_lines;
use crate::schedule::{ScheduleFormat, read_schedule, write_schedule};

/// What formats of rows have in common but for the form in which they are written.
macro_rules! rows {
    ($form:ident) => {
        Format {
            read_schedule: Some(read_schedule),
            write_schedule: Some(|schedule, sequence, out| {
                write_schedule(schedule, sequence, ScheduleFormat::$form, out)
            }),
            read_readings: Some(read_measurement),
            write_readings: Some(|measurement, about, sequence, out| {
                write_measurement(measurement, about, sequence, ScheduleFormat::$form, out)
            }),
            ..Format::NONE
        }
    };
}

/// Comma-separated values.
pub(crate) const CSV: Format = Format {
    name: "csv",
    extensions: &["csv"],
    summary: "comma-separated values with a commented header",
    recognises: Some(|_| true),
    ..rows!(Csv)
};

/// One JSON object a line.
pub(crate) const JSON_LINES: Format = Format {
    name: "json-lines",
    extensions: &["jsonl", "ndjson"],
    summary: "one JSON object a line, the first one the header",
    recognises: Some(|text| ScheduleFormat::of_text(text) == ScheduleFormat::JsonLines),
    ..rows!(JsonLines)
};

/// Arrays of NumPy.
#[cfg(feature = "arrays")]
pub(crate) const NPZ: Format = Format {
    name: "npz",
    extensions: &["npz"],
    summary: "an array of NumPy a column, and unit vectors of light and sensor",
    as_text: Some(as_lines),
    ..rows!(Arrays)
};
