//! Readings as text of other programs.

use super::Format;
use crate::measurement::{alta, astm, bird, fred, pab};

/// What formats of numbers alone have no place for.
const BARE: &str = "uncertainties, flags and poses without a reading";

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
    left_out: BARE,
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
    left_out: BARE,
    one_light: true,
    ..Format::NONE
};

/// Readings of blocks of one light direction each, as FRED imports them.
pub(crate) const FRED: Format = Format {
    name: "fred",
    extensions: &["fred"],
    summary: "text of FRED, known by its first line type bsdf_data; azimuths from the mirror direction",
    recognises: Some(fred::is_fred),
    read_readings: Some(fred::read),
    ..Format::NONE
};

/// Readings with uncertainties, wavelengths and polarisation, as national laboratories exchange them.
pub(crate) const BIRD: Format = Format {
    name: "bird",
    extensions: &["brdf"],
    summary: "JSON of the BiRD project (universal BRDF data format 1.0), of luminance or wavelengths",
    recognises: Some(bird::is_bird),
    read_readings: Some(bird::read),
    write_readings: Some(bird::write),
    left_out: "flags and poses without a reading",
    ..Format::NONE
};
