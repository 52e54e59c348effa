//! `results.parquet`: the rows of an acquisition as a table of typed columns.

use super::csv::cells;
use crate::experiment::{Row, quantities};
use crate::report::in_memory;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;
use serde_json::Value;
use std::sync::Arc;

/// Rows of one group: they are held in memory as they are written.
const GROUP: usize = 8192;

/// What a column holds.
#[derive(Clone, Copy)]
enum Kind {
    Text,
    Flag,
    /// Integers from 0, 64 bits.
    Count,
    /// Numbers of double precision.
    Real,
}

/// Rows as Parquet: a column per key of `results.jsonl`, in the same order. Texts are UTF-8, counts and seeds
/// unsigned integers of 64 bits, other numbers doubles; undefined values are null.
pub fn results_parquet(rows: &[&Row]) -> Vec<u8> {
    let mut file = Vec::new();
    in_memory(write(rows, &columns(), &mut file));
    file
}

/// Names and kinds of the columns. The kind is that of the value in a row without values: only numbers may be undefined.
fn columns() -> Vec<(String, Kind)> {
    let is_count = |name: &str| quantities().iter().any(|q| q.is_count && q.name == name);
    let column = |(name, value): (String, Value)| {
        let kind = match value {
            Value::String(_) => Kind::Text,
            Value::Bool(_) => Kind::Flag,
            Value::Number(n) if n.is_u64() => Kind::Count,
            _ if is_count(&name) => Kind::Count,
            _ => Kind::Real,
        };
        (name, kind)
    };
    cells(&Row::default()).into_iter().map(column).collect()
}

fn field(name: &str, kind: Kind) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match kind {
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Kind::Flag => (Physical::BOOLEAN, None),
        Kind::Count => (Physical::INT64, Some(LogicalType::integer(64, false))),
        Kind::Real => (Physical::DOUBLE, None),
    };
    let field = Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical);
    field.build().map(Arc::new)
}

fn write(rows: &[&Row], columns: &[(String, Kind)], out: &mut Vec<u8>) -> Result<(), ParquetError> {
    let fields = columns.iter().map(|(name, kind)| field(name, *kind));
    let schema = Type::group_type_builder("results").with_fields(fields.collect::<Result<_, _>>()?);
    let schema = schema.build()?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("gonio ", env!("CARGO_PKG_VERSION")).into())
        .build();
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    for rows in rows.chunks(GROUP) {
        let rows: Vec<_> = rows.iter().map(|row| cells(row)).collect();
        let mut group = file.next_row_group()?;
        let mut columns = columns.iter();
        while let (Some(mut column), Some((name, kind))) = (group.next_column()?, columns.next()) {
            let cells = rows.iter().map(|row| &row[name]);
            write_column(&mut column, *kind, cells)?;
            column.close()?;
        }
        group.close()?;
    }
    file.close().map(|_| ())
}

fn write_column<'a>(
    column: &mut SerializedColumnWriter<'_>,
    kind: Kind,
    cells: impl Iterator<Item = &'a Value> + Clone,
) -> Result<(), ParquetError> {
    let defined = cells.clone().map(|cell| i16::from(!cell.is_null()));
    let defined: Vec<i16> = defined.collect();
    macro_rules! write {
        ($of:ty, $get:expr) => {{
            let values: Vec<_> = cells.filter_map($get).collect();
            column
                .typed::<$of>()
                .write_batch(&values, Some(&defined), None)
        }};
    }
    match kind {
        Kind::Text => write!(ByteArrayType, |c| c.as_str().map(ByteArray::from)),
        Kind::Flag => write!(BoolType, Value::as_bool),
        // The bits of an unsigned integer, as its logical type requires.
        Kind::Count => write!(Int64Type, |c| c.as_u64().map(|n| n as i64)),
        Kind::Real => write!(DoubleType, Value::as_f64),
    }?;
    Ok(())
}
