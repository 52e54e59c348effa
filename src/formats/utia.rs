//! Tables of the UTIA database.

use super::{Format, TableError};
use crate::brdf::measured::utia::{
    NODES, UtiaError, UtiaSpec, suits, write_utia_file, write_utia_file_filled,
};

/// Anisotropic tables over the angles of light and sensor.
pub const FORMAT: Format = Format {
    name: "utia",
    extensions: &["bin"],
    summary: "anisotropic, over elevations to 75° and azimuths",
    read_table: Some(|path| Box::new(UtiaSpec::of(path))),
    write_table: Some(|brdf, of, path| match of.fill {
        true => write_utia_file_filled(brdf, path).map_err(told),
        false => write_utia_file(brdf, path).map(|()| 0).map_err(told),
    }),
    has_holes: true,
    table_pairs: Some(|brdf, _| {
        suits(brdf).map_err(told)?;
        Ok(NODES as u64)
    }),
    ..Format::NONE
};

fn told(error: UtiaError) -> TableError {
    match error {
        UtiaError::Io(e) => TableError::Io(e),
        e => TableError::Unsuited(e.into()),
    }
}
