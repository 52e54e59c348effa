//! Files of heights: a channel of an OpenEXR, a grey PNG of 16 bits, or rows of numbers in CSV.

use super::super::SIZE;
use crate::error::{excerpt, listed, reason};
use crate::files::{
    PictureError, TABLE_LIMIT, exr_headers, exr_layer, may_unpack, open, read_foreign_text,
};
use png::{BitDepth, ColorType};
use std::fs;
use std::io::{BufReader, ErrorKind, Read};
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

impl From<png::DecodingError> for PictureError {
    fn from(e: png::DecodingError) -> Self {
        Self::unread(e)
    }
}

impl Numbers {
    /// The smallest and the largest one; refuses the first that is not finite.
    pub(crate) fn range(&self) -> Result<[f64; 2], PictureError> {
        if let Some(i) = self.values.iter().position(|v| !v.is_finite()) {
            let (column, row) = (1 + i % self.size[0], 1 + i / self.size[0]);
            return Err(PictureError(format!(
                "column {column}, row {row} (counted from 1) is {}; allowed: finite numbers",
                self.values[i]
            )));
        }
        let first = self.values.first().copied().unwrap_or_default();
        Ok([f64::min, f64::max].map(|f| self.values.iter().copied().fold(first, f)))
    }
}

/// Reads a file; its first bytes say what it is, as names may be wrong.
pub(crate) fn numbers(path: &Path) -> Result<Numbers, PictureError> {
    let mut start = Vec::new();
    open(path)?.take(4).read_to_end(&mut start)?;
    match start[..] {
        [0x76, 0x2f, 0x31, 0x01] => of_exr(path),
        [0x89, b'P', b'N', b'G'] => of_png(path),
        _ => of_csv(path),
    }
}

/// Checks a size before anything is made of it.
fn check_size([width, height]: [usize; 2]) -> Result<(), PictureError> {
    let [least, most] = SIZE;
    match [width, height].iter().all(|n| (least..=most).contains(n)) {
        true => Ok(()),
        false => Err(PictureError(format!(
            "this map has {width} × {height} heights; allowed: {least} to {most} along each axis"
        ))),
    }
}

/// Checks that a file of `packed` bytes can hold so many bytes for each height.
fn check_packed(packed: u64, size: [usize; 2], bytes: usize) -> Result<(), PictureError> {
    check_size(size)?;
    let [width, height] = size;
    let unpacked = (width * height).saturating_mul(bytes) as u64;
    may_unpack(packed, unpacked)
        .map_err(|why| PictureError(format!("this map has {width} × {height} heights: {why}")))
}

fn of_exr(path: &Path) -> Result<Numbers, PictureError> {
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
        let names = reason(listed(list.iter().map(|c| &c.name)));
        return Err(PictureError(format!(
            "its channels are {names}; allowed: Y, R, Z or height, or a single one"
        )));
    };
    let samples = &channel.sample_data;
    if samples.len() != size[0] * size[1] {
        let message =
            "the channel of heights is coarser than the picture; allowed: a number for each pixel";
        return Err(PictureError(message.into()));
    }
    Ok(Numbers {
        size,
        values: samples.values_as_f32().map(f64::from).collect(),
        white: None,
    })
}

fn of_png(path: &Path) -> Result<Numbers, PictureError> {
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
        return Err(PictureError(format!(
            "this PNG is {colours} of {} bits; allowed: grey of 16 bits, as steps of less are seen as facets",
            info.bit_depth as u8
        )));
    }
    check_packed(packed, size, 2)?;
    let mut reader = decoder.read_info()?;
    let mut bytes = vec![0; 2 * size[0] * size[1]];
    let frame = reader.next_frame(&mut bytes)?;
    if frame.buffer_size() != bytes.len() {
        let message = "the first picture of this film is a part of the whole; allowed: all of it";
        return Err(PictureError(message.into()));
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
fn of_csv(path: &Path) -> Result<Numbers, PictureError> {
    let text = read_foreign_text(path, TABLE_LIMIT).map_err(|e| match e.kind() {
        ErrorKind::InvalidData => {
            PictureError(format!("this is neither OpenEXR nor PNG, and of CSV {e}"))
        }
        _ => e.into(),
    })?;
    let rows = text.lines().map(|line| line.trim_matches(' ')).zip(1..);
    let rows = rows.filter(|(row, _)| !row.is_empty() && !row.starts_with('#'));
    let first = rows.clone().next().map(|(row, _)| row);
    let separator = [';', '\t', ',']
        .into_iter()
        .find(|s| first.is_some_and(|row| row.contains(*s)))
        .unwrap_or(',');
    let width = |row: &str| row.split(separator).count();
    let size = [first.map_or(0, width), rows.clone().count()];
    let mut values = Vec::new();
    for (row, line) in rows.clone() {
        let found = width(row);
        if found != size[0] {
            return Err(PictureError(format!(
                "line {line} has {found} cells; allowed: {}, as the first row",
                size[0]
            )));
        }
        for (cell, text) in row.split(separator).map(str::trim).enumerate() {
            let number = match separator {
                ',' => text.parse(),
                _ => text.replacen(',', ".", 1).parse(),
            };
            match number {
                Ok(value) if f64::is_finite(value) => values.push(value),
                _ => {
                    let (cell, found) = (cell + 1, excerpt(text));
                    return Err(PictureError(format!(
                        "line {line}: cell {cell} is {found:?}; allowed: a finite number"
                    )));
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
