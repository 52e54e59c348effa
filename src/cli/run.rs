//! `gonio run`.

use super::progress::Progress;
use super::{ConfigArgs, SeedArgs, ThreadArgs, print, say};
use crate::error::Error;
use crate::experiment::study::Shard;
use crate::experiment::{
    self, Allowance, Failure, Input, Job, Kind, Material, Observer, Plan, Row, ScheduleKey, Stage,
};
use crate::report::{MadeBy, Manifest, Outcome, RunFolder, Table, instruments, ranking};
use crate::schedule::{Itinerary, Schedule};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

/// Where runs go that name no folder.
pub(super) const RUNS: &str = "runs";

#[derive(Debug, Args)]
pub(super) struct Run {
    #[command(flatten)]
    pub(super) config: ConfigArgs,
    #[command(flatten)]
    seed: SeedArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Folder of the results [default: runs/NAME, or the next free NAME-2, NAME-3, …]
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: Option<PathBuf>,
    /// Replace a run that is in the output folder; a study makes rows again that are there
    #[arg(long)]
    pub(super) force: bool,
    /// Of a study: only this part of its schedules, i/n with 1 <= i <= n
    #[arg(long, value_name = "I/N")]
    pub(super) shard: Option<Shard>,
    /// Of a study: list what would be run, and what of it is done
    #[arg(long)]
    pub(super) list: bool,
    /// No progress bar and no notes on stderr; errors are still told
    #[arg(short, long)]
    quiet: bool,
}

impl Run {
    pub(super) fn run(self) -> Result<(), Error> {
        let started = SystemTime::now();
        self.threads.apply()?;
        let mut source = self.config.source()?;
        self.seed.apply(&mut source)?;
        match Kind::of(&source)? {
            Kind::Acquisition => {}
            Kind::Moments => return self.moment_study(&source, started),
            Kind::Relations => return self.relations(&source, started),
            Kind::Study => return self.study(&source, started),
        }
        let plan = super::plan(&source)?;
        tell_missing(&plan.missing, self.quiet);
        let stop = stop_on_ctrl_c()?;
        let folder = self.folder(Kind::Acquisition, &plan.resolved)?;
        let table = Table::new(&plan);
        if let Some(question) = &plan.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        print(&table.head())?;
        let mut desk = Desk {
            progress: Progress::new(&plan, self.quiet),
            plan: &plan,
            stop,
            folder,
            table,
            rows: Vec::new(),
            inputs: Vec::new(),
        };
        let summary = experiment::run(&plan, &mut desk)?;
        desk.progress.finish();
        let made_by = MadeBy {
            resolved: &plan.resolved,
            seeds: &plan.seeds,
            missing: &plan.missing,
        };
        let outcome = Outcome {
            rows: summary.rows,
            failures: summary.failures.clone(),
            seconds: serde_json::to_value(summary.seconds).unwrap_or_default(),
            interrupted: summary.interrupted,
            ..Outcome::default()
        };
        let manifest = Manifest::new(made_by, &source, desk.inputs, outcome, started);
        let path = desk.folder.finish(manifest)?;
        if plan.instruments.is_empty() {
            print(&ranking(&desk.rows))?;
        } else {
            print(&instruments(&desk.rows))?;
        }
        let end = End {
            rows: summary.rows,
            failed: summary.failures.iter().map(|f| f.jobs).sum(),
            jobs: plan.jobs(),
            interrupted: summary.interrupted,
        };
        self.tell(&end, path)
    }
}

/// How a run of any kind ended.
pub(super) struct End {
    /// Rows that were written.
    pub(super) rows: usize,
    /// Jobs that could not be done, of all there were.
    pub(super) failed: usize,
    pub(super) jobs: usize,
    /// It was stopped before its end.
    pub(super) interrupted: bool,
}

impl Run {
    /// The folder of the results.
    pub(super) fn folder(&self, kind: Kind, resolved: &toml::Table) -> Result<RunFolder, Error> {
        self.refuse_study_options(kind)?;
        match &self.output {
            Some(dir) => RunFolder::create(dir, self.force, kind, resolved),
            None => {
                let stem = self.config.config.file_stem().unwrap_or("run".as_ref());
                RunFolder::create_next(Path::new(RUNS), &stem.to_string_lossy(), kind, resolved)
            }
        }
    }

    /// Options that only a study knows.
    fn refuse_study_options(&self, kind: Kind) -> Result<(), Error> {
        let shard = self.shard.map(|_| "--shard");
        if let Some(option) = shard.or(self.list.then_some("--list")) {
            let message = format!(
                "an experiment of kind {:?} has no such option; allowed: with {:?}",
                kind.name(),
                Kind::Study.name()
            );
            return Err(Error::config(option, message));
        }
        if self.force && self.output.is_none() {
            let message = "there is nothing to replace in a new folder; allowed: with -o DIR";
            return Err(Error::config("--force", message));
        }
        Ok(())
    }

    /// Says where the results are, or what kept them from being whole.
    pub(super) fn tell(&self, end: &End, path: PathBuf) -> Result<(), Error> {
        let &End {
            rows, failed, jobs, ..
        } = end;
        if end.interrupted {
            return Err(Error::Interrupted { rows, path });
        }
        if failed > 0 {
            return Err(Error::JobsFailed { failed, jobs, path });
        }
        if !self.quiet {
            say(&format!("\n{rows} rows are in {}", path.display()));
        }
        Ok(())
    }

    /// True if nothing but errors shall be told.
    pub(super) fn is_quiet(&self) -> bool {
        self.quiet
    }
}

/// Tells which materials a config names in vain.
pub(super) fn tell_missing(names: &[String], quiet: bool) {
    if !names.is_empty() && !quiet {
        let list = names.join(", ");
        say(&format!("gonio: not in materials_dir, skipped: {list}"));
    }
}

/// A flag that the first Ctrl-C (or SIGTERM) sets; the second ends the program at once.
pub(super) fn stop_on_ctrl_c() -> Result<Arc<AtomicBool>, Error> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    let handler = move || {
        if flag.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
    };
    ctrlc::set_handler(handler).map_err(|e| Error::Internal(e.to_string()))?;
    Ok(stop)
}

/// Where a run's news arrive.
struct Desk<'a> {
    plan: &'a Plan,
    stop: Arc<AtomicBool>,
    progress: Progress,
    folder: RunFolder,
    table: Table,
    rows: Vec<Row>,
    inputs: Vec<Input>,
}

impl Observer for Desk<'_> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn stage(&mut self, stage: Stage, job: &Job<'_>) {
        self.progress.stage(stage, job);
    }

    fn loaded(&mut self, _material: &Material, inputs: &[Input]) {
        self.inputs.extend_from_slice(inputs);
    }

    fn planned(
        &mut self,
        key: &ScheduleKey<'_>,
        schedule: &Schedule,
        itinerary: Option<&Itinerary>,
    ) -> Result<(), Error> {
        match self.plan.output.schedules.0 {
            Some(format) => self.folder.write_schedule(key, schedule, itinerary, format),
            None => Ok(()),
        }
    }

    #[cfg(feature = "exr")]
    fn reconstructed(
        &mut self,
        job: &Job<'_>,
        truth: &dyn crate::brdf::Brdf,
        reconstruction: &dyn crate::brdf::Brdf,
    ) -> Result<(), Error> {
        if self.plan.output.slices {
            self.folder.write_slice(job, truth, reconstruction)?;
        }
        Ok(())
    }

    fn rows(&mut self, rows: Vec<Row>) -> Result<(), Error> {
        self.folder.write_rows(&rows)?;
        let lines = self.table.lines(&rows);
        self.rows.extend(rows);
        self.progress.aside(|| print(&lines))
    }

    fn failed(&mut self, failure: &Failure) {
        let Failure { job, reason, .. } = failure;
        self.progress
            .aside(|| say(&format!("gonio: {job}: {reason}")));
    }

    fn advanced(&mut self, jobs: usize, allowance: Allowance) {
        self.progress.advance(jobs, allowance);
    }
}
