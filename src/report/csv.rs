//! CSV that spreadsheets open.

use super::in_memory;
use serde_json::{Map, Value};

/// A writer of CSV. A text that spreadsheets would take for a formula, as a material's name that begins with `=`, `+`, `-` or `@` and
/// is no number, has a `'` in front.
pub(crate) struct Csv(csv::Writer<Vec<u8>>);

impl Csv {
    pub(crate) fn new() -> Self {
        Self(csv::Writer::from_writer(Vec::new()))
    }

    /// Writes a row; all of a file are of one length.
    pub(crate) fn row<T: AsRef<str>>(&mut self, cells: impl IntoIterator<Item = T>) {
        for cell in cells {
            let cell = cell.as_ref();
            let is_formula = cell.starts_with(['=', '+', '-', '@']) && cell.parse::<f64>().is_err();
            in_memory(match is_formula {
                true => self.0.write_field(format!("'{cell}")),
                false => self.0.write_field(cell),
            });
        }
        in_memory(self.0.write_record(None::<&[u8]>));
    }

    /// Writes the values of an object in their order; undefined ones are empty.
    pub(crate) fn values(&mut self, object: &Map<String, Value>) {
        self.row(object.values().map(|value| match value {
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        }));
    }

    /// The rows.
    pub(crate) fn text(self) -> String {
        text(self.0)
    }
}

/// What was written as CSV.
pub(crate) fn text(csv: csv::Writer<Vec<u8>>) -> String {
    in_memory(String::from_utf8(in_memory(csv.into_inner())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_no_formulas_and_numbers_are_numbers() {
        let mut csv = Csv::new();
        csv.row(["=cmd()", "-1.5e-3", "-x", "@a", "+1", "plain, =1"]);
        assert_eq!(csv.text(), "'=cmd(),-1.5e-3,'-x,'@a,+1,\"plain, =1\"\n");
    }
}
