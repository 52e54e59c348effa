//! `gonio run` of an experiment of kind `relations`.

use super::run::{End, Run, stop_on_ctrl_c, tell_missing};
use super::{print, say};
use crate::error::Error;
use crate::experiment::relations::{self, RelationRow, RelationsPlan};
use crate::experiment::{Failure, Input, Kind, Source};
use crate::report::relations_summary;
use crate::report::{MadeBy, Manifest, Outcome, RunFolder, relations_head, relations_lines};
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Instant, SystemTime};

impl Run {
    /// Runs a config of kind `relations`.
    pub(super) fn relations(&self, source: &Source, started: SystemTime) -> Result<(), Error> {
        let plan = RelationsPlan::read(source)?;
        let stop = stop_on_ctrl_c()?;
        let folder = self.folder(Kind::Relations, &plan.resolved)?;
        tell_missing(&plan.base.missing, self.is_quiet());
        if let Some(question) = &plan.base.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        print(&relations_head())?;
        let mut desk = Desk {
            stop,
            folder,
            rows: Vec::new(),
            inputs: Vec::new(),
            failures: Vec::new(),
        };
        let begun = Instant::now();
        let complete = relations::measure(&plan, &mut desk)?;
        let seconds = begun.elapsed().as_secs_f64();
        if !desk.rows.is_empty() {
            print(&relations_summary(&desk.rows))?;
        }
        desk.figures()?;
        let outcome = Outcome {
            rows: desk.folder.rows(),
            failures: desk.failures,
            seconds: serde_json::json!({ "relations": seconds }),
            interrupted: !complete,
            ..Outcome::default()
        };
        let made_by = MadeBy {
            resolved: &plan.resolved,
            seeds: &[plan.base.seed],
            missing: &plan.base.missing,
        };
        let end = End {
            rows: outcome.rows,
            failed: outcome.failures.iter().map(|f| f.jobs).sum(),
            jobs: plan.base.materials.len() * plan.lightings.len(),
            interrupted: !complete,
        };
        let manifest = Manifest::new(made_by, source, desk.inputs, outcome, started);
        let path = desk.folder.finish(manifest)?;
        self.tell(&end, path)
    }
}

/// Where the news of a run arrive.
struct Desk {
    stop: Arc<AtomicBool>,
    folder: RunFolder,
    rows: Vec<RelationRow>,
    inputs: Vec<Input>,
    failures: Vec<Failure>,
}

impl Desk {
    fn figures(&mut self) -> Result<(), Error> {
        #[cfg(feature = "plots")]
        for sheet in crate::report::relation_sheets(&self.rows) {
            let svg = crate::report::svg(&sheet.title, &sheet.panels, sheet.columns)?;
            let name = crate::report::file_stem(&sheet.name) + ".svg";
            self.folder
                .write_figure(name, |out| out.write_all(svg.as_bytes()))?;
        }
        Ok(())
    }
}

impl relations::Desk for Desk {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn rows(&mut self, rows: Vec<RelationRow>, inputs: Vec<Input>) -> Result<(), Error> {
        self.folder.write_relations(&rows)?;
        self.inputs.extend(inputs);
        print(&relations_lines(&rows))?;
        self.rows.extend(rows);
        Ok(())
    }

    fn failed(&mut self, failure: Failure) {
        say(&format!("gonio: {}: {}", failure.job, failure.reason));
        self.failures.push(failure);
    }
}
