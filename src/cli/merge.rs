//! `gonio merge`.

use super::print;
use super::study::finish;
use crate::error::Error;
use crate::experiment::Source;
use crate::experiment::study::{Label, RowKey, StudyPlan, StudyRow};
use crate::report::{CONFIG, MadeBy, Manifest, Outcome, StudyFolder, read_rows};
use clap::Args;
use std::collections::HashMap;
use std::path::PathBuf;
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
        let mut config: Option<(PathBuf, Source)> = None;
        let mut rows: HashMap<Label, (StudyRow, PathBuf)> = HashMap::new();
        for dir in &self.parts {
            let path = dir.join(CONFIG);
            let text = std::fs::read_to_string(&path)
                .map_err(|e| Error::data(&path, format!("cannot read this file: {e}")))?;
            match &config {
                None => {
                    config = Some((path.clone(), Source::new(path.display().to_string(), text)))
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
            for row in read_rows(dir)? {
                let label = row.label();
                if let Some((known, elsewhere)) = rows.get(&label)
                    && known.key != row.key
                {
                    let message = format!(
                        "its row of {} ({}) has the key {}, that of {} has {}: they are of \
                         different inputs; allowed: parts of one study",
                        row.material,
                        row.allowed,
                        row.key,
                        elsewhere.display(),
                        known.key
                    );
                    return Err(Error::data(dir, message));
                }
                rows.entry(label).or_insert((row, dir.clone()));
            }
        }
        let Some((_, source)) = config else {
            return Err(Error::Internal("a folder is required".into()));
        };
        let plan = StudyPlan::read(&source)?;
        let labels = plan.labels();
        let mut keys: Vec<RowKey> = Vec::new();
        let mut sorted: Vec<StudyRow> = Vec::new();
        for label in &labels {
            if let Some((row, _)) = rows.remove(label) {
                keys.push(row.key.clone());
                sorted.push(row);
            }
        }
        let found = sorted.len();
        let mut folder = StudyFolder::open(&self.output, self.force, &plan.resolved)?;
        let known = folder.known();
        sorted.retain(|row| !known.contains(&row.key));
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
            incomplete: found < labels.len(),
            ..Outcome::default()
        };
        let manifest = Manifest::new(made_by, &source, Vec::new(), outcome, started);
        let unknown = vec![None; plan.plan.materials.len()];
        let path = finish(&plan, folder, &keys, &unknown, manifest)?;
        print(&format!(
            "\n{found} of {} rows are in {}\n",
            labels.len(),
            path.display()
        ))?;
        if found < labels.len() {
            return Err(Error::Incomplete {
                rows: found,
                of: labels.len(),
                path,
            });
        }
        Ok(())
    }
}
