//! JSON Schema (2020-12) of the lines of a schedule.

use super::export::{ARMS, TIMES};
use super::import::coordinate_columns;
use super::table::{WHOLE, WORDS};
use serde_json::{Map, Value, json};

/// A column of a row: its name, keywords that bound its numbers, and what it says. Angles of the arms are in every row; columns
/// that [hold whole numbers](WHOLE) or [words](WORDS) are those of all tables, the others hold numbers.
pub(crate) type Column<'a> = (&'a str, Bounds, &'a str);

pub(crate) type Bounds = &'static [(&'static str, f64)];

/// Numbers that are not negative.
pub(crate) const POSITIVE: Bounds = &[("minimum", 0.0)];

const ELEVATION: Bounds = &[("minimum", 0.0), ("exclusiveMaximum", 90.0)];
const AZIMUTH: Bounds = &[("minimum", -360.0), ("maximum", 360.0)];

/// The columns of a schedule, without those of coordinates and axes, which a file names itself.
#[rustfmt::skip]
pub(crate) const COLUMNS: [Column<'static>; 11] = [
    (WHOLE[0], POSITIVE, "Number of the pose in its schedule, from 0."),
    (ARMS[0], ELEVATION, "Angle of the light from the normal, degrees."),
    (ARMS[1], AZIMUTH, "Azimuth of the light, degrees."),
    (ARMS[2], ELEVATION, "Angle of the sensor from the normal, degrees."),
    (ARMS[3], AZIMUTH, "Azimuth of the sensor, degrees."),
    (WHOLE[1], POSITIVE, "Number of the run of rows that share a light direction, from 0."),
    (WHOLE[3], POSITIVE, "Number of the stop, from 0: rows that share one are read in one picture."),
    (TIMES[0], POSITIVE, "Travel from the row before, and settling, s."),
    (TIMES[1], POSITIVE, "All exposures of this pose, s."),
    (TIMES[2], POSITIVE, "Moving, exposures, overhead and a calibration before it, s."),
    (TIMES[3], POSITIVE, "From the start to the middle of the exposures, s."),
];

fn cell_schema((name, bounds, summary): Column<'_>) -> Value {
    let is_whole = WHOLE.contains(&name);
    let (kind, format) = match name {
        WORDS => ("string", None),
        _ if is_whole => ("integer", Some("uint32")),
        _ => ("number", Some("double")),
    };
    let mut schema = match ARMS.contains(&name) {
        true => json!({ "type": kind }),
        false => json!({ "type": [kind, "null"] }),
    };
    if let Some(format) = format {
        schema["format"] = json!(format);
    }
    schema["description"] = json!(summary);
    for &(keyword, bound) in bounds {
        schema[keyword] = match is_whole {
            true => json!(bound as u32),
            false => json!(bound),
        };
    }
    schema
}

/// The JSON Schema of one line of a schedule in JSON Lines: a row, or the header in front.
pub fn schedule_schema() -> Value {
    let row = row_schema(
        "ScheduleRow",
        "A row of a schedule. Columns of coordinates and of axis positions come on top: which ones the\nheader says.",
        &[],
    );
    line_schema("A line of a gonio schedule", row)
}

/// The schema of a row with the columns of a schedule, further ones, and those of coordinates and axes.
pub(crate) fn row_schema(title: &str, description: &str, further: &[Column<'_>]) -> Value {
    let all = COLUMNS.iter().chain(further);
    let cells = all.map(|column| (column.0.to_owned(), cell_schema(*column)));
    let mut properties: Map<String, Value> = cells.collect();
    let number = json!({ "type": ["number", "null"] });
    let mut plain = coordinate_columns();
    plain.retain(|column| !column.ends_with("_deg"));
    properties.extend(plain.into_iter().map(|column| (column, number.clone())));
    json!({
        "title": title,
        "description": description,
        "type": "object",
        "properties": properties,
        "required": ARMS,
        "patternProperties": { "_deg$": number },
        "additionalProperties": false,
    })
}

pub(crate) fn line_schema(title: &str, row: Value) -> Value {
    let header = json!({
        "type": "object",
        "description": "The first line: what the columns are, and facts about the rows.",
        "properties": { "header": { "type": "object" } },
        "required": ["header"],
        "additionalProperties": false,
    });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "oneOf": [header, row],
    })
}
