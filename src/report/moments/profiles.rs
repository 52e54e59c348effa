//! Moment profiles as files: a row per material, channel and view.

use crate::experiment::moments::ProfileRow;
use crate::report::csv::Csv;
use std::io::{self, Write};

/// Writes rows as CSV; an undefined moment is an empty field.
///
/// # Errors
/// Whatever `out` reports.
pub fn profiles_csv(rows: &[ProfileRow<'_>], out: &mut impl Write) -> io::Result<()> {
    let mut csv = Csv::new(out);
    csv.row(ProfileRow::columns())?;
    for row in rows {
        csv.row(row.fields())?;
    }
    csv.flush()
}

/// Writes rows as a JSON array of objects with the names of the columns; an undefined moment is
/// `null`, one of unknown uncertainty (an infinite one) has `null` for that.
///
/// # Errors
/// Whatever `out` reports.
pub fn profiles_json(rows: &[ProfileRow<'_>], out: &mut impl Write) -> io::Result<()> {
    for (i, row) in rows.iter().enumerate() {
        out.write_all(if i == 0 { b"[\n" } else { b",\n" })?;
        serde_json::to_writer(&mut *out, &row.json())?;
    }
    out.write_all(if rows.is_empty() { b"[]\n" } else { b"\n]\n" })
}
