//! Files of heights: a channel of an OpenEXR, a grey PNG of 16 bits, or rows of numbers in CSV.

use super::super::SIZE;
use crate::error::{excerpt, reason};
use crate::files::{TABLE_LIMIT, Unpacked, exr_headers, exr_layer, may_unpack, open, read_text};
use png::{BitDepth, ColorType};
use std::fs;
use std::io::{self, BufReader, ErrorKind, Read};
use std::path::Path;

/// Channels of an OpenEXR that are heights, by their names in small letters; the first of them that is there is read.
const CHANNELS: [&str; 4] = ["y", "r", "z", "height"];

/// The numbers of a file.
pub(crate) struct Numbers {
    /// Numbers to a row, and rows.
    pub size: [usize; 2],
    /// From left to right, row after row from the top.
    pub values: Vec<f64>,
    /// The largest number that the format has, where it has one.
    pub white: Option<f64>,
}

/// Reason why a file is no height map.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Unusable {
    /// Too few heights, or too many.
    #[error(
        "this map has {width} × {height} heights; allowed: {} to {} along each axis",
        SIZE[0], SIZE[1]
    )]
    Size { width: usize, height: usize },
    /// The header promises more than there can be.
    #[error("this map has {width} × {height} heights: {why}")]
    Large {
        width: usize,
        height: usize,
        why: Unpacked,
    },
    /// A number is none.
    #[error("column {column}, row {row} (counted from 1) is {found}; allowed: finite numbers")]
    Number {
        column: usize,
        row: usize,
        found: f64,
    },
    /// The map is too steep.
    #[error(
        "the heights range over {0:e} cells; allowed: less than 2e5 (height_um and pitch_um scale them)"
    )]
    Range(f64),
    /// A cell of CSV is no number.
    #[error("line {line}: cell {cell} is {found:?}; allowed: a finite number")]
    Cell {
        line: usize,
        cell: usize,
        found: String,
    },
    /// A row of CSV is longer or shorter than the first.
    #[error("line {line} has {found} cells; allowed: {expected}, as the first row")]
    Ragged {
        line: usize,
        found: usize,
        expected: usize,
    },
    /// The file is of another format.
    #[error("this is neither OpenEXR nor PNG, and of CSV {0}")]
    Text(io::Error),
    /// A PNG of another kind.
    #[error(
        "this PNG is {0} of {1} bits; allowed: grey of 16 bits, as steps of less are seen as facets"
    )]
    Depth(&'static str, u8),
    /// A PNG that moves, and begins with a part of its picture.
    #[error("the first picture of this film is a part of the whole; allowed: all of it")]
    Film,
    /// No channel is one of heights; the value lists them.
    #[error("its channels are {}; allowed: Y, R, Z or height, or a single one", reason(.0))]
    Channels(String),
    /// The channel is of less resolution than the picture.
    #[error("the channel of heights is coarser than the picture; allowed: a number for each pixel")]
    Coarse,
    /// The file cannot be read.
    #[error("cannot read this file: {}", reason(.0))]
    Io(#[from] io::Error),
    /// The OpenEXR file cannot be read.
    #[error("cannot read this file: {}", reason(.0))]
    Exr(#[from] exr::error::Error),
    /// The PNG file cannot be read.
    #[error("cannot read this file: {}", reason(.0))]
    Png(#[from] png::DecodingError),
}

impl Numbers {
    /// The smallest and the largest one.
    ///
    /// # Errors
    /// [`Unusable::Number`] of the first that is not finite.
    pub(crate) fn range(&self) -> Result<[f64; 2], Unusable> {
        if let Some(i) = self.values.iter().position(|v| !v.is_finite()) {
            return Err(Unusable::Number {
                column: 1 + i % self.size[0],
                row: 1 + i / self.size[0],
                found: self.values[i],
            });
        }
        let first = self.values.first().copied().unwrap_or_default();
        Ok([f64::min, f64::max].map(|f| self.values.iter().copied().fold(first, f)))
    }
}

/// Reads a file; its first bytes say what it is, as names may be wrong.
pub(crate) fn numbers(path: &Path) -> Result<Numbers, Unusable> {
    let mut start = Vec::new();
    open(path)?.take(4).read_to_end(&mut start)?;
    match start[..] {
        [0x76, 0x2f, 0x31, 0x01] => of_exr(path),
        [0x89, b'P', b'N', b'G'] => of_png(path),
        _ => of_csv(path),
    }
}

/// Checks a size before anything is made of it.
fn check_size([width, height]: [usize; 2]) -> Result<(), Unusable> {
    let [least, most] = SIZE;
    match [width, height].iter().all(|n| (least..=most).contains(n)) {
        true => Ok(()),
        false => Err(Unusable::Size { width, height }),
    }
}

/// Checks that a file of `packed` bytes can hold so many bytes for each height.
fn check_packed(packed: u64, size: [usize; 2], bytes: usize) -> Result<(), Unusable> {
    check_size(size)?;
    let [width, height] = size;
    let unpacked = (width * height).saturating_mul(bytes) as u64;
    may_unpack(packed, unpacked).map_err(|why| Unusable::Large { width, height, why })
}

fn of_exr(path: &Path) -> Result<Numbers, Unusable> {
    let packed = fs::metadata(path)?.len();
    for header in &exr_headers(path)? {
        let size = [header.layer_size.width(), header.layer_size.height()];
        // Each value of each channel is held in four bytes.
        check_packed(packed, size, header.channels.list.len().saturating_mul(4))?;
    }
    let layer = exr_layer(path)?;
    let size = [layer.size.width(), layer.size.height()];
    let list = layer.channel_data.list;
    let called = |name: &&str| {
        list.iter()
            .find(|c| c.name.to_string().eq_ignore_ascii_case(name))
    };
    let single = list.first().filter(|_| list.len() == 1);
    let Some(channel) = CHANNELS.iter().find_map(called).or(single) else {
        let names: Vec<_> = list.iter().map(|c| c.name.to_string()).collect();
        return Err(Unusable::Channels(names.join(", ")));
    };
    let samples = &channel.sample_data;
    if samples.len() != size[0] * size[1] {
        return Err(Unusable::Coarse);
    }
    Ok(Numbers {
        size,
        values: samples.values_as_f32().map(f64::from).collect(),
        white: None,
    })
}

fn of_png(path: &Path) -> Result<Numbers, Unusable> {
    let file = open(path)?;
    let packed = file.metadata()?.len();
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let info = decoder.read_header_info()?;
    let size = [info.width as usize, info.height as usize];
    if (info.color_type, info.bit_depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
        let colours = match info.color_type {
            ColorType::Grayscale => "grey",
            ColorType::GrayscaleAlpha => "grey with alpha",
            ColorType::Indexed => "a palette",
            ColorType::Rgb | ColorType::Rgba => "colour",
        };
        return Err(Unusable::Depth(colours, info.bit_depth as u8));
    }
    check_packed(packed, size, 2)?;
    let mut reader = decoder.read_info()?;
    let mut bytes = vec![0; 2 * size[0] * size[1]];
    let frame = reader.next_frame(&mut bytes)?;
    if frame.buffer_size() != bytes.len() {
        return Err(Unusable::Film);
    }
    let number = |two: &[u8]| f64::from(u16::from_be_bytes([two[0], two[1]]));
    Ok(Numbers {
        size,
        values: bytes.chunks_exact(2).map(number).collect(),
        white: Some(f64::from(u16::MAX)),
    })
}

/// Numbers between commas, semicolons or tabs, with the latter two a decimal comma is one; lines that begin with # are
/// comments.
fn of_csv(path: &Path) -> Result<Numbers, Unusable> {
    let text = read_text(path, TABLE_LIMIT).map_err(|e| match e.kind() {
        ErrorKind::InvalidData => Unusable::Text(e),
        _ => Unusable::Io(e),
    })?;
    let rows = text.lines().map(|line| line.trim_matches(' ')).zip(1..);
    let rows = rows.filter(|(row, _)| !row.is_empty() && !row.starts_with('#'));
    let Some((first, _)) = rows.clone().next() else {
        return Err(Unusable::Size {
            width: 0,
            height: 0,
        });
    };
    let separator = [';', '\t', ','].into_iter().find(|s| first.contains(*s));
    let separator = separator.unwrap_or(',');
    let width = |row: &str| row.split(separator).count();
    let size = [width(first), rows.clone().count()];
    let mut values = Vec::new();
    for (row, line) in rows.clone() {
        let found = width(row);
        if found != size[0] {
            return Err(Unusable::Ragged {
                line,
                found,
                expected: size[0],
            });
        }
        for (cell, text) in row.split(separator).map(str::trim).enumerate() {
            let number = match separator {
                ',' => text.parse(),
                _ => text.replacen(',', ".", 1).parse(),
            };
            match number {
                Ok(value) if f64::is_finite(value) => values.push(value),
                _ => {
                    return Err(Unusable::Cell {
                        line,
                        cell: cell + 1,
                        found: excerpt(text).into_owned(),
                    });
                }
            }
        }
    }
    // Last: a line that is no row says more about what is wrong than a size does.
    check_size(size)?;
    Ok(Numbers {
        size,
        values,
        white: None,
    })
}
