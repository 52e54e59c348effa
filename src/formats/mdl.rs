//! Measured BSDFs of the Material Definition Language.

use super::{Format, TableError};
use crate::brdf::measured::mdl::{MdlError, suits, table_pairs, write_mdl_file};

/// Isotropic tables over elevations and the angle between azimuths.
pub const FORMAT: Format = Format {
    name: "mdl",
    extensions: &["mbsdf"],
    summary: "isotropic, over elevations, for MDL (Omniverse, Iray); luminance, R, G, B or one wavelength",
    write_table: Some(|brdf, _, path| write_mdl_file(brdf, path).map_err(told)),
    table_pairs: Some(|brdf, _| {
        suits(brdf).map_err(told)?;
        Ok(table_pairs(brdf))
    }),
    ..Format::NONE
};

fn told(error: MdlError) -> TableError {
    match error {
        MdlError::Io(e) => TableError::Io(e),
        e => TableError::Unsuited(e.into()),
    }
}
