//! Observers and output of an experiment of kind `relations`.

use super::{End, Printed, Shown};
use crate::cli::print;
use crate::error::Error;
use crate::experiment::relations::{MaterialRelations, RelationRow, RelationsPlan};
use crate::report::{
    Below, RELATIONS, RunFolder, file_stem, relation_sheets, relations_csv, relations_head,
    relations_lines, relations_summary, svg,
};
use std::io::Write;

type Folder = RunFolder<MaterialRelations>;

impl Shown for RelationsPlan {
    fn table(&self) -> Result<Option<Printed<'_, MaterialRelations>>, Error> {
        let lines = |records: &[&MaterialRelations]| {
            let rows: Vec<RelationRow> = records.iter().flat_map(|r| r.rows()).collect();
            relations_lines(&rows)
        };
        Ok(Some((relations_head(), Box::new(lines))))
    }

    fn conclude(&self, folder: &mut Folder, end: &End<'_>) -> Result<(), Error> {
        let (records, _) = folder.sorted(end.keys);
        let rows: Vec<RelationRow> = records.into_iter().flat_map(|r| r.rows()).collect();
        if !rows.is_empty() {
            print(&relations_summary(&rows))?;
        }
        folder.write_file(RELATIONS, relations_csv(&rows))?;
        for sheet in relation_sheets(&rows) {
            let svg = svg(&sheet.title, &sheet.panels, sheet.columns);
            let name = file_stem(&sheet.name) + ".svg";
            folder.write_below(Below::Figures, &name, |out| out.write_all(svg.as_bytes()))?;
        }
        Ok(())
    }
}
