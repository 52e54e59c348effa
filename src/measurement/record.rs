//! JSON Schema (2020-12) of the lines of a measurement.

use super::columns::{ENDS, TYPE_A, TYPE_B, UNCERTAINTY, VALUE};
use super::file::ATTEMPT;
use crate::schedule::record::{Bounds, Column, POSITIVE, line_schema, row_schema};
use crate::schedule::table::WORDS;
use serde_json::{Value, json};

/// What is uncertain about a value.
const UNCERTAINTIES: [(&str, &str); 3] = [
    (
        TYPE_A,
        "Standard uncertainty (k = 1) of the scatter between readings, sr⁻¹.",
    ),
    (
        TYPE_B,
        "Standard uncertainty (k = 1) of what readings share, sr⁻¹.",
    ),
    (
        UNCERTAINTY,
        "Both together: the root of the sum of their squares, sr⁻¹.",
    ),
];

/// The JSON Schema of one line of a measurement in JSON Lines: a row, or the header in front.
pub fn measurement_schema() -> Value {
    let [red, green, blue] = ENDS;
    let ends = [
        ("", "Luminance"),
        (red, "Red"),
        (green, "Green"),
        (blue, "Blue"),
    ];
    let values = ends.map(|(end, channel)| {
        let summary = format!("{channel} of f_r, sr⁻¹, without the cosine.");
        (format!("{VALUE}{end}"), &[][..], summary)
    });
    let uncertainties = ends.iter().flat_map(|(end, channel)| {
        UNCERTAINTIES.map(|(family, summary)| {
            let summary = match *end {
                "" => summary.to_owned(),
                _ => format!("`{family}` of {}.", channel.to_lowercase()),
            };
            (format!("{family}{end}"), POSITIVE, summary)
        })
    });
    let quantities: Vec<(String, Bounds, String)> =
        values.into_iter().chain(uncertainties).collect();
    let quantities = quantities.iter();
    let mut columns: Vec<Column<'_>> = quantities
        .map(|(name, of, what)| (&**name, *of, &**what))
        .collect();
    columns.extend([
        (
            WORDS,
            &[][..],
            "What is odd about the reading, or why there is none; several joined by `;`.",
        ),
        (
            ATTEMPT,
            &[("minimum", 1.0)][..],
            "Number of the try, from 1; a later one replaces an earlier one.",
        ),
    ]);
    let mut row = row_schema(
        "MeasurementRow",
        "A row of a measurement: that of its schedule, and what was read there. Values are empty where\nthere is no reading; `flags` says why. Values by wavelength have columns such as `value_450nm`.",
        &columns,
    );
    let patterns = row.get_mut("patternProperties");
    if let Some(patterns) = patterns.and_then(Value::as_object_mut) {
        let uncertainties = UNCERTAINTIES.map(|(family, _)| (family, POSITIVE));
        for (family, bounds) in [(VALUE, &[][..])].into_iter().chain(uncertainties) {
            let mut cell = json!({ "type": ["number", "null"] });
            for &(keyword, bound) in bounds {
                cell[keyword] = json!(bound);
            }
            patterns.insert(format!("^{family}_[0-9.]+nm$"), cell);
        }
    }
    line_schema("A line of a gonio measurement", row)
}
