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
        written.map_err(|e| match e {
            MerlError::Io(e) => TableError::Io(e),
            e => TableError::Unsuited(e.into()),
        })
    }),
    table_pairs: Some(|brdf, _| MerlGrid::holding(brdf).map_or(0, |grid| grid.pairs())),
    ..Format::NONE
};
