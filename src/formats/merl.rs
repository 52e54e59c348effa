//! Tables of the MERL database.

use super::{Format, TableError};
use crate::brdf::measured::merl::{
    MerlError, MerlGrid, MerlSpec, write_merl_file, write_merl_file_filled,
};

/// Isotropic tables over half/difference angles.
pub const FORMAT: Format = Format {
    name: "merl",
    extensions: &["binary"],
    summary: "isotropic, over half/difference angles",
    read_table: Some(|path| Box::new(MerlSpec::of(path))),
    write_table: Some(|brdf, of, path| {
        let grid = MerlGrid::holding(brdf).map_err(told)?;
        match of.fill {
            true => write_merl_file_filled(brdf, grid, path).map_err(told),
            false => write_merl_file(brdf, grid, path).map(|()| 0).map_err(told),
        }
    }),
    has_holes: true,
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
