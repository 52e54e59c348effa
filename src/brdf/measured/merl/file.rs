//! The file: little-endian, 12 bytes of header, three planes.
//!
//! ```text
//! 3 × i32    90, 90, 180  (or 90, 90, 360)         cells in theta_h, theta_d, phi_d
//! 3 × plane  f64[phi_d + n_phi (theta_d + 90 theta_h)]   R, then G, then B
//! ```
//!
//! Stored value × scale = f_r in sr⁻¹. A negative cell holds no data. Nor does one that is NaN or
//! infinite: some converters write those where the instrument saw nothing, and a few lost cells are
//! no reason to refuse 1.4 million good ones. These are counted, and so are numbers as 9999 far above all others, which stand for no data too
//! ([`crate::brdf::Marks`]). A file with no data at all is refused.

use super::super::doubts::Doubts;
use super::grid::THETA_CELLS;
use super::{Cells, Merl, MerlError, MerlGrid};
use crate::brdf::Channels;
use crate::brdf::marks::{is, is_mark_number, marks_among};
use crate::files;
use crate::numeric;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Factor from a stored R, G, B value to sr⁻¹: 1/1500, 1.15/1500, 1.66/1500, each the nearest `f64`.
pub const SCALE: [f64; 3] = [
    6.666_666_666_666_666e-4,
    7.666_666_666_666_667e-4,
    1.106_666_666_666_666_6e-3,
];

/// Bytes of the header.
const HEADER: u64 = 12;

/// Bytes read at a time: a few pages, so that they stay in the first-level caches between the
/// read and the conversion.
const CHUNK: usize = 1 << 15;

impl MerlGrid {
    /// Length of a file in bytes: 34 992 012 or 69 984 012.
    pub fn file_len(self) -> u64 {
        HEADER + 3 * 8 * self.cells() as u64
    }
}

/// True for a stored value that is data.
#[inline]
pub(super) fn is_data(stored: f64) -> bool {
    (0.0..=f64::MAX).contains(&stored)
}

/// Checks header and length of a file without loading it, and returns its layout.
///
/// # Errors
/// [`MerlError`] if the file cannot be opened, is not a regular file, or has another header or length.
pub fn check(path: &Path) -> Result<MerlGrid, MerlError> {
    open(path).map(|(_, grid)| grid)
}

impl Merl {
    /// Loads a file. Only what `channels` asks for is held: three planes for R, G, B, one for luminance.
    ///
    /// # Errors
    /// [`MerlError`], after the header and length only if those are wrong.
    pub fn load(path: &Path, channels: Channels) -> Result<Self, MerlError> {
        Self::load_without(path, channels, None)
    }

    /// Loads a file; `no_reading` is one more number that stands for no data.
    pub(super) fn load_without(
        path: &Path,
        channels: Channels,
        no_reading: Option<f64>,
    ) -> Result<Self, MerlError> {
        let (mut file, grid) = open(path)?;
        read_planes(&mut file, grid, channels, no_reading)
    }

    /// Reads a file's bytes from anywhere; they must end where the table ends.
    ///
    /// # Errors
    /// [`MerlError`], after 12 bytes only if the header is wrong.
    pub fn read(mut input: impl Read, channels: Channels) -> Result<Self, MerlError> {
        let grid = read_header(&mut input, None)?;
        read_planes(&mut input, grid, channels, None)
    }
}

/// Opens a file and checks its header and length.
fn open(path: &Path) -> Result<(File, MerlGrid), MerlError> {
    // Asked by name: a pipe that nobody writes to would not open.
    let meta = std::fs::metadata(path)?;
    if !meta.is_file() {
        return Err(MerlError::NotAFile);
    }
    let mut file = files::open(path)?;
    let grid = read_header(&mut file, Some(meta.len()))?;
    if meta.len() != grid.file_len() {
        return Err(MerlError::Length {
            found: meta.len(),
            grid,
        });
    }
    Ok((file, grid))
}

fn read_header(input: &mut impl Read, len: Option<u64>) -> Result<MerlGrid, MerlError> {
    let mut bytes = [0; HEADER as usize];
    let got = fill(input, &mut bytes)?;
    if got < bytes.len() {
        return Err(MerlError::NoHeader {
            found: len.unwrap_or(got as u64),
        });
    }
    let mut found = [0; 3];
    for (found, bytes) in found.iter_mut().zip(bytes.as_chunks().0) {
        *found = i32::from_le_bytes(*bytes);
    }
    MerlGrid::from_dims(found).ok_or(MerlError::Dims { found })
}

fn read_planes(
    input: &mut impl Read,
    grid: MerlGrid,
    channels: Channels,
    no_reading: Option<f64>,
) -> Result<Merl, MerlError> {
    let mut source = Source {
        input,
        grid,
        read: HEADER,
        chunk: vec![0; CHUNK],
        values: Vec::with_capacity(CHUNK / 8),
        seen: Seen {
            no_reading,
            ..Seen::default()
        },
    };
    let mut cells = match channels {
        Channels::Rgb => {
            let mut cells = Vec::with_capacity(grid.cells() + THETA_CELLS);
            source.plane(|values| cells.extend(values.map(|v| [v, 0.0, 0.0])))?;
            for c in 1..3 {
                let mut rest = cells.iter_mut();
                source.plane(|values| {
                    for (v, cell) in values.zip(&mut rest) {
                        cell[c] = v;
                    }
                })?;
            }
            Cells::Rgb(cells)
        }
        Channels::Luminance => {
            // Folded plane by plane in the order of `numeric::luminance`, so that the sum has the
            // bits of the luminance of an R, G, B reading. −1 once a channel has no data.
            let mut cells = Vec::with_capacity(grid.cells() + THETA_CELLS);
            let part = |c: usize, v: f64| numeric::LUMINANCE[c] * (v * SCALE[c]);
            source.plane(|values| {
                cells.extend(values.map(|v| [if is_data(v) { part(0, v) } else { -1.0 }]));
            })?;
            for c in 1..3 {
                let mut rest = cells.iter_mut();
                source.plane(|values| {
                    for (v, [sum]) in values.zip(&mut rest) {
                        *sum = if *sum >= 0.0 && is_data(v) {
                            *sum + part(c, v)
                        } else {
                            -1.0
                        };
                    }
                })?;
            }
            Cells::Luminance(cells)
        }
        Channels::Wavelengths(_) => return Err(MerlError::Wavelengths),
    };
    source.end()?;
    let (doubts, marked) = source.seen.marks();
    for i in marked {
        match &mut cells {
            Cells::Luminance(cells) => cells[i % grid.cells()] = [-1.0],
            Cells::Rgb(cells) => cells[i % grid.cells()][i / grid.cells()] = -1.0,
        }
    }
    Merl::new(grid, cells, doubts)
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
    /// Looks at the next values.
    fn look(&mut self, values: &[f64]) {
        for value in values {
            if Some(*value) == self.no_reading || is_data(*value) && is_mark_number(*value) {
                self.candidates.push((self.count, *value));
            } else if is_data(*value) {
                self.largest = self.largest.max(*value);
            } else if !value.is_finite() {
                self.doubts.see(*value);
            }
            self.count += 1;
        }
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

/// The body of a file, read in chunks.
struct Source<'a, R> {
    input: &'a mut R,
    grid: MerlGrid,
    read: u64,
    chunk: Vec<u8>,
    /// The numbers of the chunk.
    values: Vec<f64>,
    seen: Seen,
}

impl<R: Read> Source<'_, R> {
    /// Passes one plane on, chunk by chunk.
    fn plane(
        &mut self,
        mut take: impl FnMut(std::iter::Copied<std::slice::Iter<'_, f64>>),
    ) -> Result<(), MerlError> {
        let mut left = 8 * self.grid.cells();
        while left > 0 {
            let want = left.min(CHUNK);
            let chunk = &mut self.chunk[..want];
            let got = fill(self.input, chunk)?;
            self.read += got as u64;
            if got < want {
                return Err(MerlError::Length {
                    found: self.read,
                    grid: self.grid,
                });
            }
            let numbers = chunk.as_chunks().0.iter();
            self.values.clear();
            self.values.extend(numbers.map(|b| f64::from_le_bytes(*b)));
            self.seen.look(&self.values);
            take(self.values.iter().copied());
            left -= want;
        }
        Ok(())
    }

    /// Checks that nothing follows.
    fn end(&mut self) -> Result<(), MerlError> {
        match fill(self.input, &mut self.chunk[..1])? {
            0 => Ok(()),
            _ => Err(MerlError::TooLong { grid: self.grid }),
        }
    }
}

/// Reads until `buffer` is full or the input ends; returns the bytes read.
fn fill(input: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut got = 0;
    while got < buffer.len() {
        match input.read(&mut buffer[got..]) {
            Ok(0) => break,
            Ok(n) => got += n,
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(got)
}
