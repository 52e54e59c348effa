//! The container: named arrays, little-endian, each in the order of C.
//!
//! ```text
//! "tensor_file\0", u8 1, u8 0, u32 fields
//! field  u16 length of the name, name, u16 dimensions, u8 type, u64 offset of the data, u64[dimensions] shape
//! data   each array at its offset
//! ```
//!
//! Types are 1 u8, 2 i8, 3 u16, … 8 i64, 9 f16, 10 f32, 11 f64; the two that a table needs are read.

use super::super::TableError;
use super::no_access;
use std::io::{self, Read, Seek, SeekFrom, Write};

const MAGIC: &[u8; 12] = b"tensor_file\0";
const VERSION: [u8; 2] = [1, 0];
/// The types that a table needs.
pub(super) const U8: u8 = 1;
pub(super) const F32: u8 = 10;

/// Sizes of the types in bytes, from 1 on.
const SIZES: [u64; 11] = [1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];

/// Dimensions of an array, at most: a table has five.
const MOST_DIMENSIONS: u64 = 8;

/// Arrays begin at multiples of this.
const ALIGNED: usize = 8;

/// An array: its name, the length of each dimension, its type, and the bytes of its numbers, the last dimension fastest.
pub(crate) type Tensor<'a> = (&'a str, Vec<usize>, u8, Vec<u8>);

/// An array of a file: where it is, and what.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    /// Its name.
    pub name: String,
    /// Length of each dimension.
    pub shape: Vec<usize>,
    kind: u8,
    offset: u64,
    count: usize,
}

fn number<const N: usize>(input: &mut impl Read) -> Result<u64, TableError> {
    let mut bytes = [0; 8];
    fill(input, &mut bytes[..N])?;
    Ok(u64::from_le_bytes(bytes))
}

/// Bytes of the header.
fn fill(input: &mut impl Read, bytes: &mut [u8]) -> Result<(), TableError> {
    input.read_exact(bytes).map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => {
            TableError::Malformed("not a tensor file: it ends within its header".into())
        }
        _ => no_access(e),
    })
}

/// The arrays of a file of `length` bytes, from its start; all lie within it.
pub(crate) fn head(input: &mut impl Read, length: u64) -> Result<Vec<Field>, TableError> {
    let mut magic = [0; MAGIC.len() + VERSION.len()];
    let is_long = length >= magic.len() as u64;
    if is_long {
        fill(input, &mut magic)?;
    }
    if !is_long || !magic.starts_with(MAGIC) || !magic.ends_with(&VERSION) {
        return Err(TableError::Malformed(
            "not a tensor file: its first bytes are not \"tensor_file\", 0, and version 1.0".into(),
        ));
    }
    let mut fields = Vec::new();
    let mut left = length;
    for _ in 0..number::<4>(input)? {
        let mut name = vec![0; number::<2>(input)? as usize];
        fill(input, &mut name)?;
        let name = String::from_utf8_lossy(&name).into_owned();
        let dimensions = number::<2>(input)?;
        let kind = number::<1>(input)? as u8;
        let offset = number::<8>(input)?;
        if dimensions > MOST_DIMENSIONS {
            let what = format!("has {dimensions} dimensions; allowed: {MOST_DIMENSIONS}");
            return Err(TableError::field(&name, what));
        }
        let shape = (0..dimensions).map(|_| number::<8>(input));
        let shape = shape.collect::<Result<Vec<u64>, _>>()?;
        let Some(size) = SIZES.get(usize::from(kind).wrapping_sub(1)) else {
            let what = format!("has the type {kind}; allowed: 1 to 11");
            return Err(TableError::field(&name, what));
        };
        let count = shape.iter().try_fold(1_u64, |n, d| n.checked_mul(*d));
        let end = |count: u64| count.checked_mul(*size)?.checked_add(offset);
        let Some(count) = count.filter(|n| end(*n).is_some_and(|end| end <= length)) else {
            let found = format!("{shape:?} from byte {offset} on");
            let what = format!("is {found}, beyond the {length} bytes of the file");
            return Err(TableError::field(&name, what));
        };
        // Arrays that lie over each other would hold more than the file.
        let Some(rest) = left.checked_sub(count * size) else {
            let what = "and those before it hold more than the file does";
            return Err(TableError::field(&name, what));
        };
        left = rest;
        // Not longer than the file, if it is not empty.
        let shape = shape.iter().map(|d| usize::try_from(*d).unwrap_or(0));
        fields.push(Field {
            name,
            shape: shape.collect(),
            kind,
            offset,
            count: count as usize,
        });
    }
    Ok(fields)
}

impl Field {
    /// The bytes of its numbers, which are of the type `wanted`.
    ///
    /// # Errors
    /// [`TableError::Malformed`] of another type, and those of `input`.
    pub fn load(&self, input: &mut (impl Read + Seek), wanted: u8) -> Result<Vec<u8>, TableError> {
        let what = match (self.kind, wanted) {
            (U8, F32) => "is of u8; allowed: f32".into(),
            (F32, U8) => "is of f32; allowed: u8".into(),
            (kind, _) if kind == wanted => {
                let start = SeekFrom::Start(self.offset);
                input.seek(start).map_err(no_access)?;
                let mut bytes = vec![0; SIZES[usize::from(kind) - 1] as usize * self.count];
                input.read_exact(&mut bytes).map_err(no_access)?;
                return Ok(bytes);
            }
            (kind, _) => format!("has the type {kind}; allowed: {U8} (u8) and {F32} (f32)"),
        };
        Err(TableError::field(&self.name, what))
    }
}

/// Writes arrays in their order.
pub(crate) fn write(tensors: &[Tensor<'_>], out: &mut impl Write) -> io::Result<()> {
    let of_field = |(name, shape, ..): &Tensor<'_>| 2 + name.len() + 2 + 1 + 8 + 8 * shape.len();
    let mut next = MAGIC.len() + VERSION.len() + 4 + tensors.iter().map(of_field).sum::<usize>();
    let mut head = Vec::with_capacity(next);
    head.extend(MAGIC);
    head.extend(VERSION);
    head.extend((tensors.len() as u32).to_le_bytes());
    let mut offsets = Vec::new();
    for (name, shape, kind, bytes) in tensors {
        next = next.next_multiple_of(ALIGNED);
        offsets.push(next);
        head.extend((name.len() as u16).to_le_bytes());
        head.extend(name.as_bytes());
        head.extend((shape.len() as u16).to_le_bytes());
        head.push(*kind);
        head.extend((next as u64).to_le_bytes());
        head.extend(shape.iter().flat_map(|d| (*d as u64).to_le_bytes()));
        next += bytes.len();
    }
    out.write_all(&head)?;
    let mut done = head.len();
    for ((.., bytes), offset) in tensors.iter().zip(offsets) {
        out.write_all(&[0; ALIGNED][..offset - done])?;
        out.write_all(bytes)?;
        done = offset + bytes.len();
    }
    Ok(())
}
