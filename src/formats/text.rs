//! Readings as text of other programs.

use super::{Format, Readings};
use crate::error::count;
use crate::measurement::{alta, astm, pab};
use crate::schedule::Assume;

/// Whether azimuths may count from elsewhere: nothing was said.
fn doubts(assume: &Assume) -> bool {
    assume.conventions.azimuth.is_none()
}

/// Readings in the coordinates that `#PARAM_IN` names, of the ALTA library.
pub(crate) const ALTA: Format = Format {
    name: "alta",
    extensions: &["alta"],
    summary: "text of the ALTA library, known by its line #DIM",
    recognises: Some(alta::is_alta),
    read_readings: Some(|text, name, assume| {
        let file = alta::read(text, name, assume)?;
        let degrees = file.beyond_turn.then(|| {
            "some angles are beyond two turns, as if degrees were read as radians, which ALTA's files have".into()
        });
        let note = format!(
            "ALTA {}: {} below the horizon, {} averaged with earlier ones",
            file.input,
            count(file.rows.below_horizon, "row"),
            count(file.rows.folded.dropped(), "row")
        );
        let mut readings = Readings::of(file.rows, file.has_azimuths && doubts(assume));
        readings.notes = vec![note];
        readings.warnings.extend(degrees);
        Ok(readings)
    }),
    ..Format::NONE
};

/// Readings over the angles of light and scatter, after ASTM E1392.
pub(crate) const ASTM: Format = Format {
    name: "astm",
    extensions: &["astm"],
    summary: "text after ASTM E1392, known by its line VARS; radians",
    recognises: Some(astm::is_astm),
    read_readings: Some(|text, name, assume| {
        Ok(Readings::of(
            astm::read(text, name, assume)?,
            doubts(assume),
        ))
    }),
    write_readings: Some(astm::write),
    bare_readings: true,
    ..Format::NONE
};

/// Readings of one light direction a file, of the gonio-photometers of pab.
pub(crate) const PAB: Format = Format {
    name: "pab-opto",
    extensions: &["pab"],
    summary: "text of pab-opto, known by its line #format: theta phi, for pabopto2bsdf of Radiance; one light a file",
    recognises: Some(pab::is_pab),
    read_readings: Some(|text, name, assume| {
        Ok(Readings::of(pab::read(text, name, assume)?, doubts(assume)))
    }),
    write_readings: Some(pab::write),
    bare_readings: true,
    one_light: true,
    ..Format::NONE
};
