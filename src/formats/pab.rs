//! Text of the gonio-photometers of pab.

use super::{Format, Readings};
use crate::measurement::pab::{is_pab, read, write};

/// Readings of one light direction a file.
pub const FORMAT: Format = Format {
    name: "pab-opto",
    extensions: &["pab"],
    summary: "text of pab-opto, known by its line #format: theta phi, for pabopto2bsdf of Radiance; one light a file",
    recognises: Some(is_pab),
    read_readings: Some(|text, name, assume| {
        let doubts = assume.conventions.azimuth.is_none();
        Ok(Readings::of(read(text, name, assume)?, doubts))
    }),
    write_readings: Some(write),
    bare_readings: true,
    one_light: true,
    ..Format::NONE
};
