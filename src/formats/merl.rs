//! Tables of the MERL database.

use super::{Format, TableError};
use crate::brdf::measured::merl::{MerlError, MerlGrid, MerlSpec, write_merl_file};

/// Isotropic tables over half/difference angles.
pub const FORMAT: Format = Format {
    name: "merl",
    extensions: &["binary"],
    summary: "isotropic, over half/difference angles",
    read_table: Some(|path| Box::new(MerlSpec::of(path))),
    write_table: Some(|brdf, _, path| {
        let written = MerlGrid::holding(brdf).and_then(|grid| write_merl_file(brdf, grid, path));
        written.map_err(told)
    }),
    table_pairs: Some(|brdf, _| {
        let grid = MerlGrid::holding(brdf).map_err(told)?;
        Ok(grid.pairs())
    }),
    ..Format::NONE
};

fn told(error: MerlError) -> TableError {
    match error {
        MerlError::Io(e) => TableError::Io(e),
        e => TableError::Unsuited(e.into()),
    }
}
