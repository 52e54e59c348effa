//! Text after ASTM E1392.

use super::{Format, Readings};
use crate::measurement::astm::{is_astm, read, write};

/// Readings over the angles of light and scatter.
pub const FORMAT: Format = Format {
    name: "astm",
    extensions: &["astm"],
    summary: "text after ASTM E1392, known by its line VARS; radians",
    recognises: Some(is_astm),
    read_readings: Some(|text, name, assume| {
        let doubts = assume.conventions.azimuth.is_none();
        Ok(Readings::of(read(text, name, assume)?, doubts))
    }),
    write_readings: Some(write),
    bare_readings: true,
    ..Format::NONE
};
