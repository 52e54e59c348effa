//! `results.csv`: the rows of an acquisition as a table.

use crate::experiment::{Record, Row};
use crate::report::csv::Csv;
use crate::report::in_memory;
use serde_json::{Map, Value};

/// Rows as CSV: a column per key of `results.jsonl`, in the same order; undefined values are empty fields.
pub fn results_csv(rows: &[&Row]) -> String {
    let mut csv = Csv::new();
    csv.row(Row::columns().map(|(name, _)| name));
    for row in rows {
        csv.values(&cells(row));
    }
    csv.text()
}

/// The columns of a row, in order, with their values.
pub(super) fn cells(row: &Row) -> Map<String, Value> {
    let [cells, _] = in_memory(row.parts());
    cells
}
