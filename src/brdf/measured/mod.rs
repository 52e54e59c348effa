//! Measured tables, and anything turned into one.

pub mod merl;
mod tabulated;
pub mod utia;

pub use tabulated::TabulatedSpec;

pub(super) use merl::ENTRY as MERL;
pub(super) use tabulated::ENTRY as TABULATED;
pub(super) use utia::ENTRY as UTIA;

use std::path::Path;

/// What a table is called: its file, or its kind where that has no name.
fn label_of(path: &Path, kind: &str) -> String {
    let stem = path.file_stem();
    stem.map_or(kind.into(), |stem| stem.to_string_lossy().into_owned())
}
