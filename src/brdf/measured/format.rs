//! File formats of tables.

use super::TableError;
use crate::brdf::{Brdf, BrdfSpec};
use crate::files;
use crate::registry::Entry;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// The material that a table is.
pub type ReadTable = fn(PathBuf) -> Box<dyn BrdfSpec>;

/// How a BRDF is tabulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tabulation {
    /// One of the sizes of the format, 0 the usual.
    pub size: usize,
    /// Whether cells of pairs without data are filled in a format that can leave them empty.
    pub fill: bool,
}

/// Tabulates a BRDF into a file, which is there as a whole or not at all. Returns the number of pairs without data that were filled:
/// all of them in a format without empty cells.
pub type WriteTable = fn(&dyn Brdf, Tabulation, &Path) -> Result<usize, TableError>;

/// Pairs that the table of a BRDF is made of, by its size.
pub type TablePairs = fn(&dyn Brdf, usize) -> Result<u64, TableError>;

/// One file format of tables; a use without a function is one that it has not.
#[derive(Clone, Copy)]
pub struct FileFormat {
    /// Its name, kebab-case.
    pub name: &'static str,
    /// Extensions of file names in lower case; files that are written get the first one.
    pub extensions: &'static [&'static str],
    /// One line for `gonio list` and the docs.
    pub summary: &'static str,
    /// Whether a file that begins so (4096 bytes, if it has as many) is of this format; without it files are known by their extension
    /// alone.
    pub begins: Option<fn(&[u8]) -> bool>,
    /// The registry entry of the material that a file of it is.
    pub material: Option<Entry<dyn BrdfSpec>>,
    /// Reads a table.
    pub read: Option<ReadTable>,
    /// Writes the table of a BRDF.
    pub write: Option<WriteTable>,
    /// The number of pairs that the table of a BRDF is made of, by its size; [`TableError::Unsuited`] of one that it cannot
    /// hold, by its channels and symmetries.
    pub pairs: Option<TablePairs>,
    /// Sizes of its tables, each finer than the one before.
    pub sizes: usize,
    /// Whether cells of its tables may be empty.
    pub has_holes: bool,
}

impl FileFormat {
    /// A format without any use.
    pub(crate) const NONE: Self = Self {
        name: "",
        extensions: &[],
        summary: "",
        begins: None,
        material: None,
        read: None,
        write: None,
        pairs: None,
        sizes: 1,
        has_holes: false,
    };
}

/// Writes the file of a BRDF that was tabulated; `filled` of its pairs had no data.
pub(super) fn write_file(
    path: &Path,
    filled: usize,
    body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<usize, TableError> {
    files::write_atomically(path, body).map_err(|e| TableError::Io("cannot write this file", e))?;
    Ok(filled)
}
