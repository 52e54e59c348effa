//! Text in columns, for people.

use std::fmt;

/// Rows of cells, each column as wide as its widest cell, two spaces between them.
///
/// Cells are given as one text with a tab between them. Headings that begin with `>` stand over
/// cells that are aligned at the right.
pub struct Columns {
    right: Vec<bool>,
    rows: Vec<Vec<String>>,
}

impl Columns {
    /// Only the headings.
    pub fn new(headings: &str) -> Self {
        let of = |heading: &str| match heading.strip_prefix('>') {
            Some(heading) => (true, heading.to_owned()),
            None => (false, heading.to_owned()),
        };
        let (right, names) = headings.split('\t').map(of).unzip();
        let rows = vec![names];
        Self { right, rows }
    }

    /// Headings and rows.
    pub(crate) fn with_rows(headings: &str, rows: impl IntoIterator<Item = String>) -> Self {
        let mut columns = Self::new(headings);
        rows.into_iter().for_each(|row| columns.row(&row));
        columns
    }

    /// Adds a row.
    pub fn row(&mut self, cells: &str) {
        let cells = cells.split('\t').map(String::from);
        self.rows.push(cells.collect());
    }
}

impl fmt::Display for Columns {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let width = |d: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(d));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let most = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let widths: Vec<usize> = (0..most).map(width).collect();
        for row in &self.rows {
            let cells = row.iter().zip(&widths).enumerate();
            let padded = cells.map(|(d, (cell, w))| match self.right.get(d) {
                Some(true) => format!("{cell:>w$}"),
                _ => format!("{cell:<w$}"),
            });
            writeln!(f, "{}", padded.collect::<Vec<_>>().join("  ").trim_end())?;
        }
        Ok(())
    }
}
