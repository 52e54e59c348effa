//! The file: little-endian, 12 bytes of header, three planes.
//!
//! ```text
//! 3 × i32    90, 90, 180  (or 90, 90, 360)         cells in theta_h, theta_d, phi_d
//! 3 × plane  f64[phi_d + n_phi (theta_d + 90 theta_h)]   R, then G, then B
//! ```
//!
//! Stored value × scale = f_r in sr⁻¹. A cell holds no data if it is negative, or NaN or infinite, as some converters write it, or
//! a number as 9999 far above all others ([`crate::brdf::Marks`]); all but the negative ones are counted. A file with no data is refused.

use super::super::doubts::Doubts;
use super::super::{TableError, open_regular};
use super::{Cells, Held, Merl, MerlGrid};
use crate::brdf::Channels;
use crate::brdf::marks::{is, is_mark_number, marks_among};
use crate::numeric;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Factor from a stored R, G, B value to sr⁻¹: 1/1500, 1.15/1500, 1.66/1500, each the nearest `f64`.
pub const SCALE: [f64; 3] = [
    6.666_666_666_666_666e-4,
    7.666_666_666_666_667e-4,
    1.106_666_666_666_666_6e-3,
];

/// Bytes of the header.
const HEADER: u64 = 12;

/// Why a scene of wavelengths is refused.
pub(super) const WAVELENGTHS: &str = "a MERL table holds R, G, B and no wavelengths";

impl MerlGrid {
    /// Length of a file in bytes: 34 992 012 or 69 984 012.
    pub fn file_len(self) -> u64 {
        HEADER + 3 * 8 * self.cells() as u64
    }
}

pub(super) fn no_access(e: io::Error) -> TableError {
    TableError::Io("no access to this MERL table", e)
}

pub(super) fn no_data() -> TableError {
    TableError::NoData("every cell is negative, NaN or infinite: the table holds no data".into())
}

fn wrong_length(found: u64, grid: MerlGrid) -> TableError {
    let expected = grid.file_len();
    TableError::Malformed(format!(
        "found {found} bytes, expected {expected} for a {grid} table"
    ))
}

/// True for a stored value that is data.
#[inline]
pub(super) fn is_data(stored: f64) -> bool {
    (0.0..=f64::MAX).contains(&stored)
}

/// Checks header and length of a file without loading it, and returns its layout.
///
/// # Errors
/// [`TableError`] if the file cannot be opened, is not a regular file, or has another header or length.
pub fn check(path: &Path) -> Result<MerlGrid, TableError> {
    open(path).map(|(_, grid)| grid)
}

impl Merl {
    /// Loads a file; `no_reading` is one more number that stands for no data. In luminance one plane is held.
    ///
    /// # Errors
    /// [`TableError`], after the header and length only if those are wrong.
    pub fn load(
        path: &Path,
        channels: Channels,
        no_reading: Option<f64>,
    ) -> Result<Self, TableError> {
        let (mut file, grid) = open(path)?;
        read_planes(&mut file, grid, channels, no_reading)
    }

    /// Reads a file's bytes from anywhere; they must end where the table ends.
    ///
    /// # Errors
    /// [`TableError`], after 12 bytes only if the header is wrong.
    pub fn read(mut input: impl Read, channels: Channels) -> Result<Self, TableError> {
        let grid = read_header(&mut input, None)?;
        read_planes(&mut input, grid, channels, None)
    }
}

fn open(path: &Path) -> Result<(File, MerlGrid), TableError> {
    let (mut file, length) = open_regular(path, no_access)?;
    let grid = read_header(&mut file, Some(length))?;
    match length == grid.file_len() {
        true => Ok((file, grid)),
        false => Err(wrong_length(length, grid)),
    }
}

fn read_header(input: &mut impl Read, len: Option<u64>) -> Result<MerlGrid, TableError> {
    let mut bytes = Vec::new();
    let header = input.take(HEADER).read_to_end(&mut bytes);
    let got = header.map_err(no_access)? as u64;
    let dims = bytes.as_chunks().0.iter().map(|b| i32::from_le_bytes(*b));
    let &[h, d, phi] = &dims.collect::<Vec<_>>()[..] else {
        let found = len.unwrap_or(got);
        return Err(TableError::Malformed(format!(
            "not a MERL file: found {found} bytes, expected a header of 12 and three planes"
        )));
    };
    MerlGrid::from_dims([h, d, phi]).ok_or_else(|| {
        TableError::Malformed(format!(
            "not a MERL file: found {h}, {d}, {phi} in the header, expected 90, 90, 180 or 90, 90, 360"
        ))
    })
}

fn read_planes(
    input: &mut impl Read,
    grid: MerlGrid,
    channels: Channels,
    no_reading: Option<f64>,
) -> Result<Merl, TableError> {
    let mut seen = Seen {
        no_reading,
        ..Seen::default()
    };
    let mut cells = match channels {
        Channels::Rgb => {
            let put = |c: usize, v: f64, cell: &mut [f64; 3]| cell[c] = v;
            let cells = read_cells(input, grid, &mut seen, put)?;
            Cells::Rgb(Held {
                cells,
                scale: SCALE,
            })
        }
        Channels::Luminance => {
            // Folded plane by plane in the order of `numeric::luminance`, so that the sum has the
            // bits of the luminance of an R, G, B reading. −1 once a channel has no data.
            let part = |c: usize, v: f64| numeric::LUMINANCE[c] * (v * SCALE[c]);
            let add = |c: usize, v: f64, [sum]: &mut [f64; 1]| {
                *sum = if *sum >= 0.0 && is_data(v) {
                    *sum + part(c, v)
                } else {
                    -1.0
                };
            };
            let cells = read_cells(input, grid, &mut seen, add)?;
            Cells::Luminance(Held {
                cells,
                scale: [1.0],
            })
        }
        Channels::Wavelengths(_) => return Err(TableError::Channels(WAVELENGTHS)),
    };
    if input.read(&mut [0]).map_err(no_access)? > 0 {
        let bytes = grid.file_len();
        return Err(TableError::Malformed(format!(
            "found more data after the {bytes} bytes expected for a {grid} table"
        )));
    }
    let (doubts, marked) = seen.marks();
    for i in marked {
        match &mut cells {
            Cells::Luminance(held) => held.cells[i % grid.cells()] = [-1.0],
            Cells::Rgb(held) => held.cells[i % grid.cells()][i / grid.cells()] = -1.0,
        }
    }
    Merl::new(grid, cells, doubts)
}

/// Cells of a plane that are read at once: 32 KiB.
const READ_AT_ONCE: usize = 4096;

/// The cells of the body of a file, into which `put` puts the values of one channel after the other.
fn read_cells<const N: usize>(
    input: &mut impl Read,
    grid: MerlGrid,
    seen: &mut Seen,
    put: impl Fn(usize, f64, &mut [f64; N]),
) -> Result<Vec<[f64; N]>, TableError> {
    // Whatever is added to −0 keeps its bits. There is room for the means behind the cells.
    let mut cells = Vec::with_capacity(grid.cells() + MerlGrid::POLES);
    cells.resize(grid.cells(), [-0.0; N]);
    let mut found = HEADER;
    let mut buffer = Vec::with_capacity(8 * READ_AT_ONCE);
    for c in 0..3 {
        for cells in cells.chunks_mut(READ_AT_ONCE) {
            buffer.clear();
            let mut part = input.by_ref().take(8 * cells.len() as u64);
            part.read_to_end(&mut buffer).map_err(no_access)?;
            found += buffer.len() as u64;
            if buffer.len() < 8 * cells.len() {
                return Err(wrong_length(found, grid));
            }
            for (bytes, cell) in buffer.as_chunks().0.iter().zip(cells) {
                let value = f64::from_le_bytes(*bytes);
                seen.look(value);
                put(c, value, cell);
            }
        }
    }
    Ok(cells)
}

/// What was seen among the stored values that are data, or ought to be.
#[derive(Default)]
struct Seen {
    /// One more number that stands for no data.
    no_reading: Option<f64>,
    /// Values so far.
    count: usize,
    /// The largest of data that is no candidate.
    largest: f64,
    /// Numbers that may stand for no data, and their places in the body of the file.
    candidates: Vec<(usize, f64)>,
    doubts: Doubts,
}

impl Seen {
    /// Looks at the next value.
    fn look(&mut self, value: f64) {
        if Some(value) == self.no_reading || is_data(value) && is_mark_number(value) {
            self.candidates.push((self.count, value));
        } else if is_data(value) {
            self.largest = self.largest.max(value);
        } else if !value.is_finite() {
            self.doubts.see(value);
        }
        self.count += 1;
    }

    /// The places of those that stand for no data, all of them counted.
    fn marks(mut self) -> (Doubts, Vec<usize>) {
        let values = self.candidates.iter().map(|(_, value)| *value);
        let marks = marks_among(values.chain([self.largest]), self.no_reading);
        let mut places = Vec::new();
        for (place, value) in self.candidates {
            if let Some(mark) = marks.iter().find(|mark| is(value, **mark)) {
                self.doubts.see(*mark);
                places.push(place);
            }
        }
        (self.doubts, places)
    }
}
