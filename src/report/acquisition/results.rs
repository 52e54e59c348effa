//! `results.csv`: the rows of an acquisition as a table.

use crate::experiment::{Record, Row};
use crate::report::csv::Csv;
use serde_json::{Map, Value};
use std::io::{self, Write};

/// Writes rows as CSV: a column per key of `results.jsonl`, in the same order; undefined values are
/// empty fields.
///
/// # Errors
/// Errors of `out`.
pub fn results_csv(rows: &[&Row], out: &mut impl Write) -> io::Result<()> {
    let mut csv = Csv::new(out);
    csv.row(Row::columns().map(|(name, _)| name))?;
    for row in rows {
        csv.values(&cells(row)?)?;
    }
    csv.flush()
}

/// The columns of a row, in order, with their values.
pub(super) fn cells(row: &Row) -> serde_json::Result<Map<String, Value>> {
    row.parts().map(|[cells, _]| cells)
}
