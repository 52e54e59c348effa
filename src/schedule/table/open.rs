//! Which form a table has.

use super::super::convention::Conventions;
use super::read::Table;
use super::{FileError, ScheduleFormat, matrix};

impl Table {
    /// Reads a text; `name` stands for it in messages. The columns are checked by `allowed`, which
    /// gets the facts and gives our names of all columns that may be there.
    ///
    /// # Errors
    /// A line that is no row of this table: cut, with a cell that is no finite number, or against
    /// what the facts promise (`rows`, and the hash under `hash_key`).
    pub(crate) fn read(
        text: &str,
        name: &str,
        hash_key: &str,
        conventions: &Conventions,
        allowed: impl Fn(&Table) -> Result<Vec<String>, FileError>,
    ) -> Result<Self, FileError> {
        let mut table = Self::named(name);
        let content = text.strip_prefix('\u{feff}').unwrap_or(text);
        let name_columns = |table: &mut Table, columns, line| {
            table.name_columns(columns, line, conventions, &allowed)
        };
        if ScheduleFormat::of_text(text) == ScheduleFormat::JsonLines {
            table.read_json(content, name_columns)?;
        } else if let Some(separator) = matrix::separator(text) {
            table.read_matrix(content, separator, name_columns)?;
        } else {
            table.read_csv(content, conventions, name_columns)?;
        }
        table.keeps_promises(hash_key, conventions.partial, text.ends_with('\n'))?;
        table.settle_units()?;
        Ok(table)
    }
}
