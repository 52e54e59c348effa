//! Tables as archives of NumPy, npz: every column an array.
//!
//! The names are those of a CSV, `header` is the text of the header of JSON Lines. Two arrays more are for programs:
//! `omega_i` and `omega_o`, (rows, 3), unit vectors. A file with them instead of angles is read too.

use super::npy::{self, Values};
use super::{Cell, Column, FileError, Sheet, WHOLE, WORDS};
use crate::error::{excerpt, reason};
use crate::files::{UNPACKED_LIMIT, may_unpack};
use crate::schedule::export::ARMS;
use glam::DVec3;
use serde_json::{Map, Value, json};
use std::io::{self, Cursor, Read, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// The array that holds the header, a text.
const HEADER: &str = "header";

/// The end of the name of a file that is an array.
const END: &str = ".npy";

/// Vectors of light and sensor, and the columns that hold their angles.
const VECTORS: [(&str, [&str; 2]); 2] = [
    ("omega_i", [ARMS[0], ARMS[1]]),
    ("omega_o", [ARMS[2], ARMS[3]]),
];

/// Bytes of the longest name of an array that is read.
const LONGEST_NAME: usize = 200;

/// Distance up to which vectors are those of the angles: single precision.
const SAME: f64 = 1e-6;

fn put(
    zip: &mut ZipWriter<Cursor<Vec<u8>>>,
    name: &str,
    descr: &str,
    shape: &[u64],
    data: impl IntoIterator<Item = impl AsRef<[u8]>>,
) -> io::Result<()> {
    // As numpy.savez does; and no time, so that equal tables are equal files.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default())
        .large_file(true);
    zip.start_file(format!("{name}{END}"), options)?;
    npy::write(zip, descr, shape, data)
}

fn doubles(values: &[f64]) -> impl Iterator<Item = [u8; 8]> {
    values.iter().map(|v| v.to_le_bytes())
}

/// Writes an array of texts, as wide as the longest.
fn put_texts(
    zip: &mut ZipWriter<Cursor<Vec<u8>>>,
    name: &str,
    shape: &[u64],
    texts: &[String],
) -> io::Result<()> {
    // NumPy has no text of length 0.
    let lengths = texts.iter().map(|text| text.chars().count());
    let longest = lengths.fold(1, usize::max);
    let bytes = texts.iter().map(|text| {
        let bytes = text.chars().flat_map(|c| u32::from(c).to_le_bytes());
        let mut bytes: Vec<u8> = bytes.collect();
        bytes.resize(4 * longest, 0);
        bytes
    });
    put(zip, name, &format!("<U{longest}"), shape, bytes)
}

impl Sheet<'_> {
    /// Writes the table as an archive.
    pub(super) fn write_arrays(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        put_texts(&mut zip, HEADER, &[], &[self.header().to_string()])?;
        let rows = self.rows as u64;
        let numbers = |column: &Column<'_>| -> Vec<f64> {
            let number = |row| match (column.cell)(row) {
                Cell::Number(value) => value,
                Cell::Empty | Cell::Words(_) => f64::NAN,
            };
            (0..self.rows).map(number).collect()
        };
        for column in &self.columns {
            let name = &column.name;
            if name == WORDS {
                let word = |row| match (column.cell)(row) {
                    Cell::Words(text) => text,
                    Cell::Empty | Cell::Number(_) => String::new(),
                };
                let words: Vec<String> = (0..self.rows).map(word).collect();
                put_texts(&mut zip, name, &[rows], &words)?;
                continue;
            }
            let found = numbers(column);
            if WHOLE.contains(&&**name) && !found.iter().any(|v| v.is_nan()) {
                let whole = found.iter().map(|v| (*v as i64).to_le_bytes());
                put(&mut zip, name, "<i8", &[rows], whole)?;
            } else {
                put(&mut zip, name, "<f8", &[rows], doubles(&found))?;
            }
        }
        for (name, angles) in VECTORS {
            let find = |angle: &str| self.columns.iter().find(|column| column.name == angle);
            let [Some(theta), Some(phi)] = angles.map(find) else {
                continue;
            };
            let angles = numbers(theta).into_iter().zip(numbers(phi));
            let vectors = angles.flat_map(|(theta, phi)| vector(theta, phi).to_array());
            let vectors: Vec<f64> = vectors.collect();
            put(&mut zip, name, "<f8", &[rows, 3], doubles(&vectors))?;
        }
        out.write_all(zip.finish()?.get_ref())?;
        out.flush()
    }
}

/// One array that was read: the rest of its shape, and what it holds, row after row.
struct Array {
    name: String,
    shape: Vec<u64>,
    values: Values,
}

/// The table of an archive as JSON Lines, which the readers of tables take: line 1 holds the header, if there is one, and
/// each line after it a row.
///
/// # Errors
/// One sentence: no archive, an array that is not one number or text a row, or of another length than the others.
pub(crate) fn as_lines(bytes: &[u8], name: &str) -> Result<String, FileError> {
    let lines = columns(bytes).and_then(lines);
    lines.map_err(|message| FileError::whole(name, message))
}

fn lines(mut columns: Vec<Array>) -> Result<String, String> {
    let mut text = String::new();
    let mut order = Vec::new();
    if let Some(place) = columns.iter().position(|c| c.name == HEADER) {
        let Values::Words(words) = columns.swap_remove(place).values else {
            return Err("the array header holds numbers; allowed: one text".into());
        };
        let [words] = &words[..] else {
            return Err(format!(
                "the array header holds {} texts; allowed: one",
                words.len()
            ));
        };
        let header: Value = serde_json::from_str(words)
            .map_err(|e| format!("the array header is no JSON object: {}", reason(e)))?;
        if let Some(Value::Object(known)) = header.get(HEADER).and_then(|h| h.get("columns")) {
            order.extend(known.keys().cloned());
        }
        text += &format!("{header}\n");
    }
    for (vector, angles) in VECTORS {
        let Some(place) = columns.iter().position(|c| c.name == vector) else {
            continue;
        };
        let found = columns.swap_remove(place);
        let known = angles.map(|angle| columns.iter().find(|c| c.name == angle));
        match known {
            [None, None] => columns.extend(of_vectors(found, angles)?),
            // The angles have all digits.
            [Some(theta), Some(phi)] if are_those(&found, theta, phi) => {}
            _ => {
                return Err(format!(
                    "the array {vector} is not the directions of {} and {}; allowed: all three, or either the vectors or the angles",
                    angles[0], angles[1]
                ));
            }
        }
    }
    // Those of a header in its order, the others behind them by name.
    let rank = |c: &Array| {
        let place = order.iter().position(|o| *o == c.name);
        place.unwrap_or(usize::MAX)
    };
    columns.sort_by(|a, b| (rank(a), &a.name).cmp(&(rank(b), &b.name)));
    let rows = columns.iter().find(|c| c.shape.len() == 1);
    let rows = rows.ok_or("there is no array with a row")?.shape[0];
    if let Some(other) = columns.iter().find(|c| c.shape != [rows]) {
        return Err(format!(
            "the array {:?} has the shape {:?}; allowed: one number or text for each of {rows} rows",
            excerpt(&other.name),
            other.shape
        ));
    }
    // Digits of a number, quotes and separators beside the name.
    let line: u64 = columns.iter().map(|c| c.name.len() as u64 + 28).sum();
    let unpacked = rows.saturating_mul(line);
    if unpacked > UNPACKED_LIMIT {
        return Err(format!(
            "{rows} rows of {} arrays are too many; allowed: at most {} MB as text",
            columns.len(),
            UNPACKED_LIMIT >> 20
        ));
    }
    for row in 0..rows as usize {
        let mut object = Map::new();
        for Array { name, values, .. } in &columns {
            let value = match values {
                Values::Words(words) => json!(words[row]),
                Values::Numbers(numbers) => match numbers[row] {
                    number if number.is_nan() => Value::Null,
                    number
                        if WHOLE.contains(&&**name) && number.fract() == 0.0 && number >= 0.0 =>
                    {
                        json!(number as u64)
                    }
                    number if number.is_finite() => json!(number),
                    number => {
                        return Err(format!(
                            "the array {:?} holds {number} at row {row}; allowed: finite numbers, and NaN where there is none",
                            excerpt(name)
                        ));
                    }
                },
            };
            object.insert(name.clone(), value);
        }
        text += &Value::Object(object).to_string();
        text.push('\n');
    }
    Ok(text)
}

/// Unit vector of angles, degrees.
fn vector(theta: f64, phi: f64) -> DVec3 {
    let [(sin, cos), (s, c)] = [theta, phi].map(|a| a.to_radians().sin_cos());
    DVec3::new(sin * c, sin * s, cos)
}

/// Whether vectors of any length have these angles, but for rounding.
fn are_those(vectors: &Array, theta: &Array, phi: &Array) -> bool {
    let [
        Values::Numbers(v),
        Values::Numbers(theta),
        Values::Numbers(phi),
    ] = [vectors, theta, phi].map(|c| &c.values)
    else {
        return false;
    };
    let near = |(v, (theta, phi)): (&[f64], (&f64, &f64))| {
        let v = DVec3::from_slice(v).normalize_or_zero();
        !(v.distance(vector(*theta, *phi)) > SAME)
    };
    v.len() == 3 * theta.len()
        && theta.len() == phi.len()
        && v.chunks_exact(3).zip(theta.iter().zip(phi)).all(near)
}

/// Angles (degrees) of vectors of any length.
fn of_vectors(found: Array, angles: [&str; 2]) -> Result<[Array; 2], String> {
    let (Values::Numbers(v), [rows, 3]) = (found.values, &found.shape[..]) else {
        return Err(format!(
            "the array {} has the shape {:?}; allowed: three numbers a row",
            found.name, found.shape
        ));
    };
    if let Some(row) = v.chunks_exact(3).position(|v| v.iter().all(|x| *x == 0.0)) {
        return Err(format!(
            "the array {} holds no direction at row {row}: its length is 0",
            found.name
        ));
    }
    let angle = |of: fn(&[f64]) -> f64| v.chunks_exact(3).map(|v| of(v).to_degrees()).collect();
    let theta: Vec<f64> = angle(|v| v[0].hypot(v[1]).atan2(v[2]));
    let phi: Vec<f64> = angle(|v| v[1].atan2(v[0]));
    let column = |name: &str, values| Array {
        name: name.into(),
        shape: vec![*rows],
        values: Values::Numbers(values),
    };
    Ok([column(angles[0], theta), column(angles[1], phi)])
}

/// Number of members that the end of an archive says it has, several of one name too; `None` where it does not fit there.
fn members(bytes: &[u8]) -> Option<usize> {
    const END_OF_DIRECTORY: &[u8] = b"PK\x05\x06";
    let end = bytes
        .windows(12)
        .rposition(|w| w.starts_with(END_OF_DIRECTORY))?;
    let listed = u16::from_le_bytes([bytes[end + 10], bytes[end + 11]]);
    (listed < u16::MAX).then_some(listed.into())
}

fn columns(bytes: &[u8]) -> Result<Vec<Array>, String> {
    let no_archive = |e: zip::result::ZipError| {
        let e = reason(e);
        format!("this is no archive of NumPy: {e}; allowed: what numpy.savez writes")
    };
    let mut zip = ZipArchive::new(Cursor::new(bytes)).map_err(no_archive)?;
    if let Some(listed) = members(bytes).filter(|listed| *listed != zip.len()) {
        return Err(format!(
            "the archive lists {listed} arrays of {} names; allowed: a name for each",
            zip.len()
        ));
    }
    let mut total = 0_u64;
    let mut columns: Vec<Array> = Vec::new();
    for i in 0..zip.len() {
        let file = zip.by_index(i).map_err(no_archive)?;
        let file_name = file.name().map_err(no_archive)?.into_owned();
        // Whatever follows a 0 is no part of it.
        let name = file_name.split('\0').next();
        let name = name
            .and_then(|name| name.strip_suffix(END))
            .ok_or_else(|| {
                let name = excerpt(&file_name);
                format!("the archive holds {name:?}; allowed: arrays, files that end in .npy")
            })?;
        if name.len() > LONGEST_NAME {
            let name = excerpt(name);
            return Err(format!(
                "the array {name:?} has a long name; allowed: at most {LONGEST_NAME} bytes"
            ));
        }
        let size = file.size();
        total = total.saturating_add(size);
        may_unpack(bytes.len() as u64, total)?;
        // Every number takes eight bytes in the end.
        let most = UNPACKED_LIMIT / 8;
        if total > most {
            let message = format!("the arrays hold {total} bytes; allowed: at most {most}");
            return Err(message);
        }
        let mut content = Vec::new();
        // Beyond its end: there its check sum is compared.
        let read = file.take(size + 1).read_to_end(&mut content);
        read.map_err(|e| unreadable(name, &e))?;
        if content.len() as u64 > size {
            let why = format!("it is longer than the {size} bytes that are promised");
            return Err(unreadable(name, &why));
        }
        if columns.iter().any(|c| c.name == name) {
            return Err(format!("the array {:?} is there twice", excerpt(name)));
        }
        let (shape, values) = npy::read(&content).map_err(|e| unreadable(name, &e))?;
        columns.push(Array {
            name: name.into(),
            shape,
            values,
        });
    }
    Ok(columns)
}

fn unreadable(name: &str, e: &dyn std::fmt::Display) -> String {
    format!(
        "the array {:?} cannot be read: {}",
        excerpt(name),
        reason(e)
    )
}
