//! `results.csv`: the rows of an acquisition as a table.

use crate::experiment::Row;
use serde_json::Value;
use std::io::{self, Write};

/// Writes rows as CSV: a column per key of `results.jsonl`, in the same order; undefined values are
/// empty fields.
///
/// # Errors
/// Errors of `out`.
pub fn results_csv(rows: &[&Row], out: &mut impl Write) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(Row::columns().map(|(name, _)| name))?;
    for row in rows {
        let Value::Object(cells) = serde_json::to_value(row)? else {
            continue;
        };
        csv.write_record(cells.values().map(|value| match value {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        }))?;
    }
    csv.flush()
}
