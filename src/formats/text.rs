//! Readings as text of other programs.

use super::Format;
use crate::measurement::{alta, astm, pab};

/// Readings in the coordinates that `#PARAM_IN` names, of the ALTA library.
pub(crate) const ALTA: Format = Format {
    name: "alta",
    extensions: &["alta"],
    summary: "text of the ALTA library, known by its line #DIM",
    recognises: Some(alta::is_alta),
    read_readings: Some(alta::read),
    ..Format::NONE
};

/// Readings over the angles of light and scatter, after ASTM E1392.
pub(crate) const ASTM: Format = Format {
    name: "astm",
    extensions: &["astm"],
    summary: "text after ASTM E1392, known by its line VARS; radians",
    recognises: Some(astm::is_astm),
    read_readings: Some(astm::read),
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
    read_readings: Some(pab::read),
    write_readings: Some(pab::write),
    bare_readings: true,
    one_light: true,
    ..Format::NONE
};
