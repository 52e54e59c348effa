//! CSV that spreadsheets open.

use serde_json::{Map, Value};
use std::io::{self, Write};

/// A writer of CSV. A text that spreadsheets would take for a formula, as a material's name that begins with `=`, `+`, `-` or `@` and
/// is no number, has a `'` in front.
pub(crate) struct Csv<W: Write>(csv::Writer<W>);

impl<W: Write> Csv<W> {
    pub(crate) fn new(out: W) -> Self {
        Self(csv::Writer::from_writer(out))
    }

    /// Writes a row.
    ///
    /// # Errors
    /// Errors of the writer.
    pub(crate) fn row<T: AsRef<str>>(
        &mut self,
        cells: impl IntoIterator<Item = T>,
    ) -> io::Result<()> {
        for cell in cells {
            let cell = cell.as_ref();
            let is_formula = cell.starts_with(['=', '+', '-', '@']) && cell.parse::<f64>().is_err();
            match is_formula {
                true => self.0.write_field(format!("'{cell}"))?,
                false => self.0.write_field(cell)?,
            }
        }
        Ok(self.0.write_record(None::<&[u8]>)?)
    }

    /// Writes the values of an object in their order; undefined ones are empty.
    ///
    /// # Errors
    /// Errors of the writer.
    pub(crate) fn values(&mut self, object: &Map<String, Value>) -> io::Result<()> {
        self.row(object.values().map(|value| match value {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        }))
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// Errors of the writer.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_no_formulas_and_numbers_are_numbers() {
        let mut out = Vec::new();
        let mut csv = Csv::new(&mut out);
        csv.row(["=cmd()", "-1.5e-3", "-x", "@a", "+1", "plain, =1"])
            .unwrap();
        csv.flush().unwrap();
        drop(csv);
        assert_eq!(out, b"'=cmd(),-1.5e-3,'-x,'@a,+1,\"plain, =1\"\n");
    }
}
