//! One array of NumPy, npy: a header of one line of Python, and numbers or texts, row after row.

use crate::error::excerpt;
use std::io::{self, Write};

const MAGIC: &[u8] = b"\x93NUMPY";

/// What an array holds.
pub(super) enum Values {
    Numbers(Vec<f64>),
    Words(Vec<String>),
}

/// Writes an array of a type such as `<f8`.
pub(super) fn write(
    out: &mut impl Write,
    descr: &str,
    shape: &[u64],
    data: impl IntoIterator<Item = impl AsRef<[u8]>>,
) -> io::Result<()> {
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let head = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    // Numbers begin at a multiple of 64 bytes.
    let before = MAGIC.len() + 4;
    let length = (before + head.len() + 1).next_multiple_of(64) - before;
    let size = u16::try_from(length).map_err(io::Error::other)?;
    out.write_all(MAGIC)?;
    out.write_all(&[1, 0])?;
    out.write_all(&size.to_le_bytes())?;
    writeln!(out, "{head:width$}", width = length - 1)?;
    for item in data {
        out.write_all(item.as_ref())?;
    }
    Ok(())
}

/// Shape and values of an array, or what is wrong with it, without its name.
pub(super) fn read(content: &[u8]) -> Result<(Vec<u64>, Values), String> {
    let cut = || "it is cut".to_owned();
    let (start, rest) = content.split_at_checked(8).ok_or_else(cut)?;
    let Some([version, 0]) = start.strip_prefix(MAGIC) else {
        return Err("it does not begin as an array does".into());
    };
    let (length, rest) = match (version, rest) {
        (1, [a, b, rest @ ..]) => (usize::from(u16::from_le_bytes([*a, *b])), rest),
        (2 | 3, [a, b, c, d, rest @ ..]) => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, rest),
        (1..=3, _) => return Err(cut()),
        _ => return Err(format!("it is of version {version}; allowed: 1 to 3")),
    };
    let (head, data) = rest.split_at_checked(length).ok_or_else(cut)?;
    let head = String::from_utf8_lossy(head);
    let (descr, is_fortran, shape) = header(head.trim()).ok_or_else(|| {
        let head = excerpt(head.trim());
        format!("its header is {head}; allowed: descr, fortran_order and shape")
    })?;
    let items = shape.iter().try_fold(1u64, |a, b| a.checked_mul(*b));
    // Every item becomes a value, also one of no bytes.
    let items = items.filter(|n| *n <= data.len() as u64).ok_or_else(cut)?;
    let holds = || {
        let descr = excerpt(descr);
        format!("it holds {descr}; allowed: integers, f4, f8 and text")
    };
    let (is_big, kind, size) = of_type(descr).ok_or_else(holds)?;
    let bytes = size.checked_mul(if kind == 'U' { 4 } else { 1 });
    let bytes = bytes.ok_or_else(holds)?;
    let all = bytes.checked_mul(items as usize);
    let data = all.and_then(|n| data.get(..n)).ok_or_else(cut)?;
    if is_fortran && shape.len() > 1 {
        return Err("it is in Fortran order; allowed: numpy.ascontiguousarray of it".into());
    }
    macro_rules! numbers {
        ($of:ty) => {{
            let (items, _) = data.as_chunks();
            let number = |item: &[u8; size_of::<$of>()]| match is_big {
                true => <$of>::from_be_bytes(*item) as f64,
                false => <$of>::from_le_bytes(*item) as f64,
            };
            Values::Numbers(items.iter().map(number).collect())
        }};
    }
    let values = match (kind, size) {
        ('f', 8) => numbers!(f64),
        ('f', 4) => numbers!(f32),
        ('i', 8) => numbers!(i64),
        ('i', 4) => numbers!(i32),
        ('i', 2) => numbers!(i16),
        ('i', 1) => numbers!(i8),
        ('u', 8) => numbers!(u64),
        ('u', 4) => numbers!(u32),
        ('u', 2) => numbers!(u16),
        ('u', 1) => numbers!(u8),
        ('U' | 'S', 0) => Values::Words(vec![String::new(); items as usize]),
        ('U', _) => {
            let texts = data.chunks_exact(bytes);
            let texts: Option<_> = texts.map(|text| wide(text, is_big)).collect();
            Values::Words(texts.ok_or("it holds a text of no characters of Unicode")?)
        }
        ('S', _) => {
            let texts = data.chunks_exact(size).map(|text| {
                let text = std::str::from_utf8(text).ok()?;
                Some(text.trim_end_matches('\0').to_owned())
            });
            let texts: Option<_> = texts.collect();
            Values::Words(texts.ok_or("it holds a text that is not UTF-8")?)
        }
        _ => return Err(holds()),
    };
    Ok((shape, values))
}

/// A text of four bytes a character.
fn wide(text: &[u8], is_big: bool) -> Option<String> {
    let (chars, _) = text.as_chunks();
    let chars = chars.iter().map(|c| {
        char::from_u32(match is_big {
            true => u32::from_be_bytes(*c),
            false => u32::from_le_bytes(*c),
        })
    });
    let text: String = chars.collect::<Option<_>>()?;
    Some(text.trim_end_matches('\0').to_owned())
}

/// Of a type such as `<f8` whether its bytes are in big order, its kind, and its size.
fn of_type(descr: &str) -> Option<(bool, char, usize)> {
    let (order, rest) = descr.split_at_checked(1)?;
    let mut rest = rest.chars();
    let kind = rest.next()?;
    let size: usize = rest.as_str().parse().ok()?;
    let has_order = matches!(order, "<" | ">") || order == "|" && (size < 2 || kind == 'S');
    has_order.then_some((order == ">", kind, size))
}

/// The header: type, whether the order is Fortran's, and shape. It is not nested, but for types of several fields, which are not
/// read.
fn header(text: &str) -> Option<(&str, bool, Vec<u64>)> {
    let mut rest = text.strip_prefix('{')?.strip_suffix('}')?.trim();
    let (mut descr, mut is_fortran, mut shape) = (None, None, None);
    while !rest.is_empty() {
        let (key, value) = quoted(rest)?;
        let value = value.trim_start().strip_prefix(':')?.trim_start();
        rest = match key {
            // A list of fields has no end that is easy to find: it is refused by its beginning.
            "descr" if value.starts_with('[') => return Some((value, false, Vec::new())),
            "descr" => {
                let (text, rest) = quoted(value)?;
                descr = Some(text);
                rest
            }
            "fortran_order" => {
                let end = value.find(|c: char| !c.is_alphabetic());
                let (word, rest) = value.split_at(end.unwrap_or(value.len()));
                is_fortran = Some(match word {
                    "True" => true,
                    "False" => false,
                    _ => return None,
                });
                rest
            }
            "shape" => {
                let (numbers, rest) = value.strip_prefix(['(', '['])?.split_once([')', ']'])?;
                let numbers = numbers.trim().trim_end_matches(',');
                let numbers = numbers.split(',').filter(|_| !numbers.is_empty());
                let numbers = numbers.map(|n| n.trim().parse().ok());
                shape = Some(numbers.collect::<Option<_>>()?);
                rest
            }
            _ => return None,
        };
        rest = rest.trim_start();
        rest = match rest.strip_prefix(',') {
            Some(rest) => rest.trim_start(),
            None if rest.is_empty() => rest,
            None => return None,
        };
    }
    Some((descr?, is_fortran?, shape?))
}

/// A text in quotes, and what follows.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(quote)
}
