//! Observers and output of an experiment of kind `relations`.

use super::{End, Printed, Shown};
use crate::cli::print;
use crate::error::Error;
use crate::experiment::relations::{MaterialRelations, RelationRow, RelationsPlan};
use crate::report::{
    RELATIONS, RunFolder, relations_csv, relations_head, relations_lines, relations_summary,
};

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
        for sheet in crate::report::relation_sheets(&rows) {
            use std::io::Write;
            let svg = crate::report::svg(&sheet.title, &sheet.panels, sheet.columns);
            let name = crate::report::file_stem(&sheet.name) + ".svg";
            let below = crate::report::Below::Figures;
            folder.write_below(below, &name, |out| out.write_all(svg.as_bytes()))?;
        }
        Ok(())
    }
}
