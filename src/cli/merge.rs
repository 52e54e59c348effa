//! `gonio merge`.

use super::study::finish;
use super::{print, read_text, say};
use crate::error::Error;
use crate::experiment::Source;
use crate::experiment::study::{Label, RowKey, StudyPlan, StudyRow};
use crate::report::{CONFIG, MadeBy, Manifest, Outcome, ROWS, StudyFolder, read_rows};
use clap::Args;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

#[derive(Debug, Args)]
pub(super) struct Merge {
    /// Folders that `gonio run --shard` wrote, all of one config
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// Folder of the whole
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Replace a study that is in the output folder
    #[arg(long)]
    force: bool,
}

impl Merge {
    pub(super) fn run(self) -> Result<(), Error> {
        let started = SystemTime::now();
        let taken = !self.force && self.output.join(ROWS).exists();
        if taken {
            let message = "a study is here already; choose another folder with -o, or --force";
            return Err(Error::output(&self.output, message));
        }
        let source = self.config()?;
        let plan = StudyPlan::read(&source)?;
        let expected = plan.expected();
        let places: HashMap<&Label, usize> = expected.iter().map(|e| &e.label).zip(0..).collect();
        let mut found: Vec<Option<StudyRow>> = vec![None; expected.len()];
        // Which files each material was made from, and where that was found.
        let mut made_from: HashMap<String, (RowKey, &Path)> = HashMap::new();
        let mut others = 0;
        for dir in &self.parts {
            for row in read_rows(dir)? {
                let place = places.get(&row.label()).copied();
                // What a folder held before it was of this config is left there.
                let Some(place) = place.filter(|&p| expected[p].is(&row)) else {
                    others += 1;
                    continue;
                };
                let entry = made_from.entry(row.material.clone());
                let (key, first) = entry.or_insert_with(|| (row.material_key.clone(), dir));
                if *key != row.material_key {
                    let message = format!(
                        "its {} is another material than in {}: the files differ; allowed: parts \
                         that were made from the same files",
                        row.material,
                        first.display()
                    );
                    return Err(Error::data(dir, message));
                }
                found[place] = Some(row);
            }
        }
        if others > 0 {
            say(&format!(
                "gonio: {others} rows of other configs are left out"
            ));
        }
        let sorted: Vec<StudyRow> = found.into_iter().flatten().collect();
        let keys: Vec<RowKey> = sorted.iter().map(|r| r.key.clone()).collect();
        let materials: Vec<Option<RowKey>> = plan
            .plan
            .materials
            .iter()
            .map(|m| made_from.get(&m.name).map(|(key, _)| key.clone()))
            .collect();
        let (found, of) = (keys.len(), expected.len());
        let mut folder = StudyFolder::open(&self.output, self.force, &plan.resolved)?;
        folder.write_rows(sorted)?;
        for dir in &self.parts {
            folder.copy_pictures(dir)?;
        }
        let made_by = MadeBy {
            resolved: &plan.resolved,
            seeds: &plan.plan.seeds,
            missing: &plan.plan.missing,
        };
        let outcome = Outcome {
            rows: found,
            incomplete: found < of,
            ..Outcome::default()
        };
        let manifest = Manifest::new(made_by, &source, Vec::new(), outcome, started);
        let path = finish(&plan, folder, &keys, &materials, manifest)?;
        print(&format!(
            "\n{found} of {of} rows are in {}\n",
            path.display()
        ))?;
        if found < of {
            return Err(Error::Incomplete {
                rows: found,
                of,
                path,
            });
        }
        Ok(())
    }

    /// The config of the parts, which must be the same.
    fn config(&self) -> Result<Source, Error> {
        let mut config: Option<(PathBuf, Source)> = None;
        for dir in &self.parts {
            let path = dir.join(CONFIG);
            let text = read_text(&path)?;
            match &config {
                None => {
                    let name = path.display().to_string();
                    config = Some((path, Source::new(name, text)));
                }
                Some((first, source)) if source.original() != text => {
                    let message = format!(
                        "this is another config than {}; allowed: parts of one study",
                        first.display()
                    );
                    return Err(Error::data(path, message));
                }
                Some(_) => {}
            }
        }
        match config {
            Some((_, source)) => Ok(source),
            None => Err(Error::Internal("a folder is required".into())),
        }
    }
}
