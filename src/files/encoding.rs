//! Texts as laboratories and spreadsheets save them: compressed, in UTF-16, in the code page of Windows, with the line ends of old
//! Macs.

use super::UNPACKED_LIMIT;
use std::io::{self, ErrorKind};

/// What some programs put in front of a text.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// The first bytes of a gzip file.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Bytes that are looked at to see whether a text without a byte-order mark is in UTF-16.
const LOOKED_AT: usize = 1 << 10;

/// What Windows has in place of the control characters from 0x80 to 0x9f; those that it leaves out are U+FFFD.
const WINDOWS_1252: [char; 32] = [
    '€', '\u{fffd}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{fffd}', 'Ž',
    '\u{fffd}', '\u{fffd}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{fffd}',
    'ž', 'Ÿ',
];

/// Reads a number from its two bytes, in their order.
type OfBytes = fn([u8; 2]) -> u16;

/// How bytes of UTF-16 are read: there is a byte-order mark, or characters of which most have a zero byte on the same side.
fn utf_16(bytes: &[u8]) -> Option<OfBytes> {
    let head = &bytes[..bytes.len().min(LOOKED_AT)];
    let zeros = |odd: usize| {
        let side = head.iter().skip(odd).step_by(2);
        side.filter(|b| **b == 0).count()
    };
    let most = head.len() / 2 * 3 / 4;
    match head {
        [0xff, 0xfe, ..] => Some(u16::from_le_bytes),
        [0xfe, 0xff, ..] => Some(u16::from_be_bytes),
        [_, _, _, _, ..] if zeros(1) > most && zeros(0) == 0 => Some(u16::from_le_bytes),
        [_, _, _, _, ..] if zeros(0) > most && zeros(1) == 0 => Some(u16::from_be_bytes),
        _ => None,
    }
}

/// True of bytes that are no text as they stand, but hold one.
pub(super) fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&GZIP) || utf_16(bytes).is_some()
}

/// What a compressed file holds; other bytes are as they were.
fn unpacked(bytes: Vec<u8>, limit: u64) -> io::Result<Vec<u8>> {
    if !bytes.starts_with(&GZIP) {
        return Ok(bytes);
    }
    #[cfg(feature = "arrays")]
    {
        use std::io::Read;
        let limit = limit.min(UNPACKED_LIMIT);
        let mut out = Vec::new();
        let mut gzip = flate2::read::MultiGzDecoder::new(&bytes[..]).take(limit + 1);
        gzip.read_to_end(&mut out)?;
        super::within(limit, out)
    }
    #[cfg(not(feature = "arrays"))]
    {
        let _ = (limit, UNPACKED_LIMIT);
        let message = "this is compressed; allowed: a text, or a build with the feature `arrays`";
        Err(io::Error::new(ErrorKind::InvalidData, message))
    }
}

/// The error of a text that is none, of the line after `good` bytes.
pub(super) fn refuse(good: &[u8], why: &str) -> io::Error {
    let line = 1 + good.iter().filter(|b| **b == b'\n').count();
    let message = format!("line {line} {why}; allowed: text in UTF-8");
    io::Error::new(ErrorKind::InvalidData, message)
}

/// The text of a file, in UTF-8 or UTF-16, without a byte-order mark.
pub(super) fn strict(bytes: Vec<u8>) -> io::Result<String> {
    let mut text = match utf_16(&bytes) {
        Some(of_bytes) => {
            let (pairs, _) = bytes.as_chunks();
            let units: Vec<u16> = pairs.iter().map(|pair| of_bytes(*pair)).collect();
            let text = String::from_utf16_lossy(&units);
            if let Some(at) = text.find('\0') {
                return Err(refuse(&text.as_bytes()[..at], "has a zero character"));
            }
            text
        }
        None => String::from_utf8(bytes).map_err(|e| {
            let good = &e.as_bytes()[..e.utf8_error().valid_up_to()];
            refuse(good, "is no UTF-8")
        })?,
    };
    if text.starts_with(BYTE_ORDER_MARK) {
        text.drain(..BYTE_ORDER_MARK.len_utf8());
    }
    Ok(text)
}

/// The text of a file that another program wrote: gzip, and beside UTF-8 and UTF-16 the code page 1252 of Windows, with any line
/// ends; they are of Unix or Windows afterwards.
pub(super) fn tolerant(bytes: Vec<u8>, limit: u64) -> io::Result<String> {
    let bytes = unpacked(bytes, limit)?;
    let is_utf_16 = utf_16(&bytes).is_some();
    if let Some(at) = bytes.iter().position(|b| *b == 0).filter(|_| !is_utf_16) {
        return Err(refuse(&bytes[..at], ZERO));
    }
    let of_windows = |&byte: &u8| match byte {
        0x80..0xa0 => WINDOWS_1252[usize::from(byte - 0x80)],
        _ => char::from(byte),
    };
    let text = match !is_utf_16 && std::str::from_utf8(&bytes).is_err() {
        true => bytes.iter().map(of_windows).collect(),
        false => strict(bytes)?,
    };
    let is_alone = |i: usize| text.as_bytes().get(i + 1) != Some(&b'\n');
    Ok(match text.match_indices('\r').any(|(i, _)| is_alone(i)) {
        true => text.replace("\r\n", "\n").replace('\r', "\n"),
        false => text,
    })
}

/// Why bytes with a zero among them are no text.
pub(super) const ZERO: &str = "has a zero byte, as files that are no text have";
