//! Text of the ALTA library.

use super::{Format, Readings};
use crate::error::count;
use crate::measurement::alta::{is_alta, read};

/// Readings in the coordinates that `#PARAM_IN` names.
pub const FORMAT: Format = Format {
    name: "alta",
    extensions: &["alta"],
    summary: "text of the ALTA library, known by its line #DIM",
    recognises: Some(is_alta),
    read_readings: Some(|text, name, assume| {
        let file = read(text, name, assume)?;
        let doubts = file.has_azimuths && assume.conventions.azimuth.is_none();
        let degrees = file.beyond_turn.then(|| {
            "some angles are beyond two turns, as if degrees were read as radians, which ALTA's files have".into()
        });
        let note = format!(
            "ALTA {}: {} below the horizon, {} averaged with earlier ones",
            file.input,
            count(file.rows.below_horizon, "row"),
            count(file.rows.folded.dropped(), "row")
        );
        let mut readings = Readings::of(file.rows, doubts);
        readings.notes = vec![note];
        readings.warnings.extend(degrees);
        Ok(readings)
    }),
    ..Format::NONE
};
