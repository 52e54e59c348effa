//! Errors of MERL tables.

use super::MerlGrid;

/// Reason why a table could not be read or written. Messages do not name the file; callers do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MerlError {
    /// The system reported an error.
    #[error("no access to this MERL table: {0}")]
    Io(#[from] std::io::Error),
    /// The path is a folder, a pipe or a device.
    #[error("not a regular file")]
    NotAFile,
    /// Too short for a header.
    #[error("not a MERL file: found {found} bytes, expected a header of 12 and three planes")]
    NoHeader {
        /// Bytes found.
        found: u64,
    },
    /// Other dimensions than MERL's.
    #[error(
        "not a MERL file: found {}, {}, {} in the header, expected 90, 90, 180 or 90, 90, 360",
        found[0], found[1], found[2]
    )]
    Dims {
        /// The header.
        found: [i32; 3],
    },
    /// The header promises another length.
    #[error("found {found} bytes, expected {} for a {grid} table", grid.file_len())]
    Length {
        /// Bytes found.
        found: u64,
        /// The layout the header asks for.
        grid: MerlGrid,
    },
    /// A stream, whose length is not known beforehand, goes on after the table.
    #[error("found more data after the {} bytes expected for a {grid} table", grid.file_len())]
    TooLong {
        /// The layout the header asks for.
        grid: MerlGrid,
    },
    /// No cell holds data.
    #[error("every cell is negative, NaN or infinite: the table holds no data")]
    NoData,
    /// A table has colours only.
    #[error("a MERL table holds R, G, B and no wavelengths")]
    Wavelengths,
    /// A table has no room for a sample that turns.
    #[error("this BRDF is not isotropic, and a MERL table has no axis for the sample's rotation")]
    NotIsotropic,
    /// A 180 table stores a pair and its swap once.
    #[error(
        "this BRDF is not reciprocal, and a {} table stores a pair and its swap once; {} can hold it",
        MerlGrid::RECIPROCAL,
        MerlGrid::FULL
    )]
    NotReciprocal,
}

impl std::fmt::Display for MerlGrid {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let [h, d, phi] = self.dims();
        write!(f, "{h}×{d}×{phi}")
    }
}
