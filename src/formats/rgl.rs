//! Tables of the RGL database, Mitsuba and pbrt.

use super::{Format, TableError};
use crate::brdf::measured::rgl::{LEVELS, RglError, RglSpec, table_pairs, write_rgl_file};

/// Tables that follow the visible normals, isotropic or not.
pub const FORMAT: Format = Format {
    name: "rgl",
    extensions: &["bsdf"],
    summary: "over visible normals, for Mitsuba and pbrt; R, G, B or wavelengths",
    read_table: Some(|path| Box::new(RglSpec::of(path))),
    write_table: Some(|brdf, of, path| write_rgl_file(brdf, LEVELS[of.size], path).map_err(told)),
    table_pairs: Some(|brdf, size| Ok(table_pairs(brdf, LEVELS[size]))),
    table_sizes: LEVELS.len(),
    ..Format::NONE
};

fn told(error: RglError) -> TableError {
    match error {
        RglError::Io(e) => TableError::Io(e),
        e => TableError::Unsuited(e.into()),
    }
}
