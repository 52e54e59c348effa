//! Radiance HDR: three mantissas and an exponent of eight bits each a pixel (Ward 1991, *Real pixels*).

use crate::error::excerpt;
use crate::files::PictureError;
use std::io::{self, BufRead, ErrorKind, Read};

/// Bytes of the longest header.
const LONGEST_HEADER: u64 = 1 << 20;

/// Width and height; reads the header, up to the first pixel.
pub fn size(input: &mut impl BufRead) -> Result<[usize; 2], PictureError> {
    let mut header = input.take(LONGEST_HEADER);
    let mut line = || {
        let mut line = Vec::new();
        header.read_until(b'\n', &mut line)?;
        match line.pop() {
            Some(b'\n') => Ok(String::from_utf8_lossy(&line).into_owned()),
            _ => Err(PictureError::unread("its header has no end")),
        }
    };
    if !line()?.starts_with("#?RADIANCE") {
        let message = "it does not begin with the line #?RADIANCE";
        return Err(PictureError::unread(message));
    }
    loop {
        let line = line()?;
        match line.split_once('=') {
            _ if line.is_empty() => break,
            Some((key, format)) if key.trim() == "FORMAT" && format.trim() != "32-bit_rle_rgbe" => {
                let format = excerpt(format);
                return Err(PictureError::unread(format!(
                    "its pixels are {format:?}; allowed: 32-bit_rle_rgbe"
                )));
            }
            _ => {}
        }
    }
    let line = line()?;
    let words: Vec<&str> = line.split_whitespace().collect();
    let number = |word: &str| Some(word.parse::<u32>().ok()? as usize);
    let size = match words[..] {
        ["-Y", height, "+X", width] => number(width).zip(number(height)),
        _ => None,
    };
    let (width, height) = size.ok_or_else(|| {
        let found = excerpt(&line);
        PictureError::unread(format!(
            "its resolution is {found:?}; allowed: -Y height +X width, rows from the top"
        ))
    })?;
    Ok([width, height])
}

/// R, G, B of each pixel, row after row from the top; what follows the header.
pub fn pixels(
    input: &mut impl Read,
    [width, height]: [usize; 2],
) -> Result<Vec<[f32; 3]>, PictureError> {
    let mut pixels = Vec::with_capacity(width * height);
    let mut row = vec![[0; 4]; width];
    for number in 0..if width > 0 { height } else { 0 } {
        let is_whole = read_row(input, &mut row).map_err(|e| match e.kind() {
            ErrorKind::UnexpectedEof => PictureError::unread(format!("it is cut in row {number}")),
            _ => PictureError::from(e),
        })?;
        if !is_whole {
            let message = format!("row {number} is longer than the picture is wide");
            return Err(PictureError::unread(message));
        }
        pixels.extend(row.iter().map(|pixel| colours(*pixel)));
    }
    Ok(pixels)
}

fn colours([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    // 2^(exponent - 136), and 0 of exponent 0; that of exponent 1 begins at a number below the normal ones.
    let bits = match exponent {
        0 | 1 => u32::from(exponent) << 22,
        _ => u32::from(exponent - 1) << 23,
    };
    let unit = f32::from_bits(bits) / 256.0;
    [r, g, b].map(|c| unit * f32::from(c))
}

fn bytes<const N: usize>(input: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    input.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// Reads a row of at least one pixel; false if it is longer than that.
fn read_row(input: &mut impl Read, row: &mut [[u8; 4]]) -> io::Result<bool> {
    let first = bytes(input)?;
    if !matches!(first, [2, 2, 0..128, _]) {
        return read_old_row(input, first, row);
    }
    // Each of the four bytes of all pixels, in runs.
    for byte in 0..4 {
        let mut at = 0;
        while at < row.len() {
            let [count] = bytes(input)?;
            let (length, value) = match count {
                0..=128 => (usize::from(count), None),
                129.. => (usize::from(count - 128), Some(bytes::<1>(input)?)),
            };
            let Some(run) = row.get_mut(at..at + length) else {
                return Ok(false);
            };
            for pixel in run {
                let [value] = match value {
                    Some(value) => value,
                    None => bytes(input)?,
                };
                pixel[byte] = value;
            }
            at += length;
        }
    }
    Ok(true)
}

/// Reads a row of whole pixels, where (1, 1, 1, n) repeats the pixel before n times, and further ones 256 n times and so on.
fn read_old_row(input: &mut impl Read, first: [u8; 4], row: &mut [[u8; 4]]) -> io::Result<bool> {
    let (mut at, mut next) = (0_usize, first);
    let (mut last, mut times) = (None, 1_usize);
    loop {
        let (pixel, count) = match (next, last) {
            ([1, 1, 1, n], Some(last)) => {
                let count = usize::from(n).saturating_mul(times);
                times = times.saturating_mul(256);
                (last, count)
            }
            // There is nothing to repeat.
            ([1, 1, 1, _], None) => return Ok(false),
            (pixel, _) => {
                times = 1;
                (pixel, 1)
            }
        };
        let Some(run) = row.get_mut(at..at.saturating_add(count)) else {
            return Ok(false);
        };
        run.fill(pixel);
        at += count;
        last = Some(pixel);
        if at == row.len() {
            return Ok(true);
        }
        next = bytes(input)?;
    }
}
