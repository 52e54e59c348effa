//! Tables of OpticStudio (Zemax).

use super::{Format, TableError};
use crate::brdf::measured::zemax::{
    LEVELS, ZemaxError, ZemaxSpec, suits, table_pairs, write_zemax_file,
};

/// Isotropic tables about the mirror direction.
pub const FORMAT: Format = Format {
    name: "zemax",
    extensions: &["zbsdf"],
    summary: "isotropic, about the mirror direction, text of OpticStudio (Zemax); luminance, R, G, B or one wavelength",
    read_table: Some(|path| Box::new(ZemaxSpec::of(path))),
    write_table: Some(|brdf, of, path| write_zemax_file(brdf, LEVELS[of.size], path).map_err(told)),
    table_pairs: Some(|brdf, size| {
        suits(brdf).map_err(told)?;
        Ok(table_pairs(brdf, LEVELS[size]))
    }),
    table_sizes: LEVELS.len(),
    ..Format::NONE
};

fn told(error: ZemaxError) -> TableError {
    match error {
        ZemaxError::Io(e) => TableError::Io(e),
        e => TableError::Unsuited(e.into()),
    }
}
