//! Tensor trees of Radiance.

use super::{Format, TableError};
use crate::brdf::measured::tensor_tree::{
    LEVELS, TensorTreeError, TensorTreeSpec, suits, table_pairs, write_tensor_tree_file,
};

/// Isotropic tables that are fine where the BRDF changes.
pub const FORMAT: Format = Format {
    name: "tensor-tree",
    extensions: &["xml"],
    summary: "isotropic, for the material BSDF of Radiance: TensorTree3, luminance or R, G, B",
    read_table: Some(|path| Box::new(TensorTreeSpec::of(path))),
    write_table: Some(|brdf, of, path| {
        write_tensor_tree_file(brdf, LEVELS[of.size], path).map_err(told)
    }),
    table_pairs: Some(|brdf, size| {
        suits(brdf).map_err(told)?;
        Ok(table_pairs(LEVELS[size]))
    }),
    table_sizes: LEVELS.len(),
    ..Format::NONE
};

fn told(error: TensorTreeError) -> TableError {
    match error {
        TensorTreeError::Io(e) => TableError::Io(e),
        e => TableError::Unsuited(e.into()),
    }
}
