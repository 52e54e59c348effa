//! Text of the ALTA library.

use super::{Format, Readings};
use crate::error::count;
use crate::measurement::alta::{is_alta, read};
use crate::measurement::retro_peak;

/// Readings in the coordinates that `#PARAM_IN` names.
pub const FORMAT: Format = Format {
    name: "alta",
    extensions: &["alta"],
    summary: "text of the ALTA library, known by its line #DIM",
    recognises: Some(is_alta),
    read_readings: Some(|text, name, assume| {
        let file = read(text, name, assume)?;
        let note = format!(
            "ALTA {}: {} below the horizon, {} averaged with earlier ones",
            file.input,
            count(file.below_horizon, "row"),
            count(file.folded.poses, "row")
        );
        let degrees = file.beyond_turn.then(|| {
            "some angles are beyond two turns, as if degrees were read as radians, which ALTA's files have".into()
        });
        let doubt = file.has_azimuths && assume.conventions.azimuth.is_none();
        let peak = retro_peak(&file.measurement).filter(|_| doubt);
        Ok(Readings {
            warnings: (peak.iter().map(ToString::to_string))
                .chain(file.negative.warning())
                .chain(file.folded.warning())
                .chain(degrees)
                .collect(),
            rows: file.measurement.schedule.poses.len() + file.below_horizon + file.folded.poses,
            intact: false,
            measurement: file.measurement,
            notes: vec![note],
        })
    }),
    ..Format::NONE
};
