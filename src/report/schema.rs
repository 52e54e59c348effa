//! Tables for programs: the columns of rows, written as CSV and as JSON.

use super::in_memory;
use crate::experiment::moments::shown;
use serde::Serialize;
use serde_json::{Map, Value};

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Cell {
    /// A number, in CSV as [`shown`]; `None` where it is undefined.
    Number(Option<f64>),
    /// Anything else, and numbers as JSON has them.
    Value(Value),
}

impl Cell {
    /// The cell as a field of CSV; empty where there is no value.
    pub(crate) fn text(self) -> String {
        match self {
            Cell::Number(number) => number.map_or(String::new(), shown),
            Cell::Value(Value::Null) => String::new(),
            Cell::Value(Value::String(text)) => text,
            Cell::Value(other) => other.to_string(),
        }
    }

    /// The cell in JSON; `null` where there is no finite value.
    fn json(self) -> Value {
        match self {
            Cell::Number(number) => number.into(),
            Cell::Value(value) => value,
        }
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Cell::Number(Some(number))
    }
}

impl From<Option<f64>> for Cell {
    fn from(number: Option<f64>) -> Self {
        Cell::Number(number)
    }
}

macro_rules! cell_from_value {
    ($($from:ty),*) => {
        $(impl From<$from> for Cell {
            fn from(value: $from) -> Self {
                Cell::Value(value.into())
            }
        })*
    };
}
cell_from_value!(
    Value,
    &str,
    String,
    Option<&str>,
    Option<String>,
    usize,
    Option<usize>,
    bool,
    Option<bool>
);

/// A [`Schema`] of the columns `name => cell` of a row that a pattern takes apart.
macro_rules! columns {
    ($row:pat in $of:ty; $($name:expr => $cell:expr,)*) => {
        $crate::report::schema::Schema::<$of>::new()
            $(.column($name, move |row: &$of| {
                #[allow(unused_variables)]
                let $row = row;
                $crate::report::schema::Cell::from($cell)
            }))*
    };
}
pub(crate) use columns;

/// The cell of a row in a column.
type Of<R> = Box<dyn Fn(&R) -> Cell>;

/// Columns of a table whose rows are made of `R`: a name and the cell of a row each.
pub(crate) struct Schema<R>(Vec<(String, Of<R>)>);

impl<R> Schema<R> {
    pub(crate) fn new() -> Self {
        Self(Vec::new())
    }

    /// The columns with those of another schema behind them.
    pub(crate) fn and(mut self, others: Self) -> Self {
        self.0.extend(others.0);
        self
    }

    /// The columns with another one behind them.
    pub(crate) fn column(
        mut self,
        name: impl Into<String>,
        of: impl Fn(&R) -> Cell + 'static,
    ) -> Self {
        self.0.push((name.into(), Box::new(of)));
        self
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|(name, _)| name.as_str())
    }

    pub(crate) fn cells(&self, row: &R) -> impl Iterator<Item = Cell> {
        self.0.iter().map(|(_, of)| of(row))
    }

    /// A row as an object with the names of the columns.
    pub(crate) fn object(&self, row: &R) -> Map<String, Value> {
        let names = self.names().map(String::from);
        names.zip(self.cells(row).map(Cell::json)).collect()
    }

    /// Rows as objects with the names of the columns.
    pub(crate) fn objects(&self, rows: &[R]) -> Vec<Map<String, Value>> {
        rows.iter().map(|row| self.object(row)).collect()
    }

    /// Rows as CSV below the names of the columns.
    pub(crate) fn csv<'r>(&self, rows: impl IntoIterator<Item = &'r R>) -> String
    where
        R: 'r,
    {
        let mut csv = Csv::new();
        csv.row(self.names());
        for row in rows {
            csv.row(self.cells(row).map(Cell::text));
        }
        csv.text()
    }
}

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
        let cells = object.values().cloned().map(Cell::Value);
        self.row(cells.map(Cell::text));
    }

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
