//! `gonio run` of a moment experiment.

use super::run::{Run, stop_on_ctrl_c, tell_missing};
use super::{print, say};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::moments::{self, MaterialProfiles, MomentsPlan};
use crate::experiment::{Failure, Input, Kind, Material, Source};
use crate::report::{MadeBy, Manifest, Outcome, RunFolder};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Instant, SystemTime};

impl Run {
    /// Runs a config of kind `moments`.
    pub(super) fn study(&self, source: &Source, started: SystemTime) -> Result<(), Error> {
        let plan = MomentsPlan::read(source)?;
        let stop = stop_on_ctrl_c()?;
        let folder = self.folder(Kind::Moments, &plan.resolved)?;
        tell_missing(&plan.missing);
        if let Some(question) = &plan.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        let mut desk = Desk {
            plan: &plan,
            stop,
            folder,
            materials: Vec::new(),
            inputs: Vec::new(),
            failures: Vec::new(),
        };
        let begun = Instant::now();
        let complete = moments::measure(&plan, &mut desk)?;
        let measured = begun.elapsed().as_secs_f64();
        let outcome = Outcome {
            rows: desk.folder.rows(),
            failures: desk.failures,
            seconds: serde_json::json!({ "profiles": measured }),
            interrupted: !complete,
        };
        let made_by = MadeBy {
            resolved: &plan.resolved,
            seeds: &[plan.seed],
            missing: &plan.missing,
        };
        let (rows, failed) = (outcome.rows, outcome.failures.len());
        let manifest = Manifest::new(made_by, source, desk.inputs, outcome, started);
        let path = desk.folder.finish(manifest)?;
        if !complete {
            return Err(Error::Interrupted { rows, path });
        }
        if failed > 0 {
            return Err(Error::JobsFailed {
                failed,
                jobs: plan.materials.len(),
                path,
            });
        }
        if !self.is_quiet() {
            say(&format!("\n{rows} rows are in {}", path.display()));
        }
        Ok(())
    }
}

/// Where the news of a run arrive.
struct Desk<'a> {
    plan: &'a MomentsPlan,
    stop: Arc<AtomicBool>,
    folder: RunFolder,
    materials: Vec<MaterialProfiles>,
    inputs: Vec<Input>,
    failures: Vec<Failure>,
}

impl moments::Desk for Desk<'_> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn begins(&mut self, _material: &Material) {}

    fn profiles(
        &mut self,
        _brdf: &dyn Brdf,
        profiles: MaterialProfiles,
        inputs: Vec<Input>,
    ) -> Result<(), Error> {
        let rows: Vec<_> = profiles.rows().collect();
        self.folder.write_profiles(&rows)?;
        self.inputs.extend(inputs);
        self.materials.push(profiles);
        Ok(())
    }

    fn failed(&mut self, failure: Failure) {
        say(&format!("gonio: {}: {}", failure.job, failure.reason));
        self.failures.push(failure);
    }
}
