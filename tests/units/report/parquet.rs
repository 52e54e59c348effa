use gonio::experiment::{Row, quantities};
use gonio::report::results_parquet;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::fs::File;
use std::io::Write;

/// Rows of one group.
const GROUP: usize = 8192;

fn reread(rows: &[Row]) -> SerializedFileReader<File> {
    let mut file = tempfile::tempfile().unwrap();
    let bytes = results_parquet(&rows.iter().collect::<Vec<_>>());
    file.write_all(&bytes).unwrap();
    SerializedFileReader::new(file).unwrap()
}

/// Cells of all kinds, defined and not, in more rows than a group has, come back as those of results.jsonl, which has no
/// seconds either.
#[test]
fn every_cell_comes_back() {
    let row = |i: usize| {
        let mut row = Row {
            material: format!("\u{e4}, \"{i}\"\n"),
            seed: u64::MAX - i as u64,
            converged: i.is_multiple_of(3),
            reachable: 1.0 / (i as f64 + 3.0),
            instrument_seconds: i.is_multiple_of(2).then_some(i as f64),
            ..Row::default()
        };
        for (d, quantity) in quantities().iter().enumerate() {
            let value = if quantity.is_count { 7.0 } else { -1e-300 };
            let value = (!(i + d).is_multiple_of(5)).then_some(value);
            row.quantities.set(quantity.name, value);
        }
        row
    };
    let rows: Vec<Row> = (0..GROUP + 3).map(row).collect();
    let file = reread(&rows);
    assert_eq!(file.num_row_groups(), 2);
    let mut read = file.get_row_iter(None).unwrap();
    for row in &rows {
        let found = read.next().unwrap().unwrap();
        let expected = serde_json::to_value(row).unwrap();
        let expected = expected.as_object().unwrap();
        let columns = Row::columns().map(|(name, _)| (name, &expected[name]));
        let expected: Vec<_> = columns.collect();
        assert_eq!(found.len(), expected.len());
        for ((name, field), (key, value)) in found.get_column_iter().zip(expected) {
            assert_eq!(name, key);
            let same = match field {
                Field::Null => value.is_null(),
                Field::Str(text) => value.as_str() == Some(text),
                Field::Bool(flag) => value.as_bool() == Some(*flag),
                Field::ULong(n) => value.as_u64() == Some(*n),
                Field::Double(x) => value.as_f64().map(f64::to_bits) == Some(x.to_bits()),
                _ => false,
            };
            assert!(same, "{name}: {field:?}, not {value}");
        }
    }
    assert!(read.next().is_none());
}

#[test]
fn without_rows_there_are_columns() {
    let file = reread(&[]);
    let schema = file.metadata().file_metadata().schema_descr();
    let names: Vec<_> = schema.columns().iter().map(|c| c.name()).collect();
    assert!(Row::columns().map(|(name, _)| name).eq(names));
}
