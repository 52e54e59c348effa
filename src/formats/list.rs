//! The list of formats.

use super::Format;
use crate::brdf::measured;
use crate::lighting::MapSpec;
use crate::measurement::{alta, astm, bird, fred, pab, read_measurement, write_measurement};
#[cfg(feature = "arrays")]
use crate::schedule::table::as_lines;
use crate::schedule::{ScheduleFormat, read_schedule, write_schedule};

/// What formats of rows with named columns, one a pose, have in common but for the form in which they are written.
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

/// What formats of numbers alone have no place for.
const BARE: &str = "uncertainties, flags and poses without a reading";

/// An equirectangular picture of the light that arrives; its first bytes say how it is decoded.
const PANORAMA: Format = Format {
    read_environment: Some(|path| {
        Box::new(MapSpec {
            path,
            rotation_deg: 0.0,
        })
    }),
    ..Format::NONE
};

/// Every file format. Of those that recognise a text the last one reads it: CSV, which takes any
/// text, comes before the others.
pub fn all() -> Vec<Format> {
    let before = [
        CSV,
        Format {
            name: "json-lines",
            extensions: &["jsonl", "ndjson"],
            summary: "one JSON object a line, the first one the header",
            recognises: Some(|text| ScheduleFormat::of_text(text) == ScheduleFormat::JsonLines),
            ..rows!(JsonLines)
        },
        #[cfg(feature = "arrays")]
        Format {
            name: "npz",
            extensions: &["npz"],
            summary: "an array of NumPy a column, and unit vectors of light and sensor",
            as_text: Some(as_lines),
            ..rows!(Arrays)
        },
        Format {
            name: "alta",
            extensions: &["alta"],
            summary: "text of the ALTA library, known by its line #DIM",
            recognises: Some(alta::is_alta),
            read_readings: Some(alta::read),
            ..Format::NONE
        },
        Format {
            name: "pab-opto",
            extensions: &["pab"],
            summary: "text of pab-opto, known by its line #format: theta phi, for pabopto2bsdf of Radiance; one light a file",
            recognises: Some(pab::is_pab),
            read_readings: Some(pab::read),
            write_readings: Some(pab::write),
            left_out: BARE,
            one_light: true,
            ..Format::NONE
        },
        Format {
            name: "astm",
            extensions: &["astm"],
            summary: "text after ASTM E1392, known by its line VARS; radians",
            recognises: Some(astm::is_astm),
            read_readings: Some(astm::read),
            write_readings: Some(astm::write),
            left_out: BARE,
            ..Format::NONE
        },
        Format {
            name: "fred",
            extensions: &["fred"],
            summary: "text of FRED, known by its first line type bsdf_data; azimuths from the mirror direction",
            recognises: Some(fred::is_fred),
            read_readings: Some(fred::read),
            ..Format::NONE
        },
        Format {
            name: "bird",
            extensions: &["brdf"],
            summary: "JSON of the BiRD project (universal BRDF data format 1.0), of luminance or wavelengths",
            recognises: Some(bird::is_bird),
            read_readings: Some(bird::read),
            write_readings: Some(bird::write),
            left_out: "flags and poses without a reading",
            ..Format::NONE
        },
    ];
    let panoramas = [
        Format {
            name: "exr",
            extensions: &["exr"],
            summary: "OpenEXR panorama with R, G, B or Y",
            ..PANORAMA
        },
        Format {
            name: "hdr",
            extensions: &["hdr"],
            summary: "Radiance panorama",
            ..PANORAMA
        },
    ];
    let tables = measured::FORMATS.iter().map(Format::of_tables);
    before.into_iter().chain(tables).chain(panoramas).collect()
}
