//! Observers of a run: progress bar, file of records, and those of its kind.

use super::{Lines, note_inputs};
use crate::cli::progress::Progress;
use crate::cli::verbosity::say;
use crate::cli::{doubt, print};
use crate::error::Error;
use crate::experiment::{ByProduct, Event, Experiment, Extent, Failure, Known, Observer, Record};
use crate::report::RunFolder;
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// All observers of a run, as one.
pub(super) struct Consumers<'a, R> {
    pub(super) stop: Arc<AtomicBool>,
    pub(super) progress: Progress,
    /// Where records are appended to their file.
    pub(super) folder: &'a RefCell<RunFolder<R>>,
    /// Lines that are printed.
    pub(super) lines: Option<Lines<'a, R>>,
    pub(super) list: Vec<Box<dyn Observer<R> + 'a>>,
}

impl<R: Record> Observer<R> for Consumers<'_, R> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn begins(&mut self, work: f64) {
        self.progress.begin(work as u64);
    }

    fn requests(&self, wish: &ByProduct<'_>) -> bool {
        self.list.iter().any(|consumer| consumer.requests(wish))
    }

    fn observe(&mut self, event: &Event<'_, R>) -> Result<(), Error> {
        self.progress.follow(event);
        // What is printed must not run into the bar.
        match event {
            // Failures are printed with --quiet too.
            Event::Failed(failure) => {
                self.progress
                    .suspend(|| print_failures(std::slice::from_ref(failure)));
            }
            Event::Loaded(material, _, brdf) => {
                self.progress.suspend(|| doubt(material, *brdf));
            }
            Event::Made(rows) => self.folder.borrow_mut().write_rows(rows)?,
            Event::Complete(rows) => {
                if let Some(lines) = &self.lines {
                    self.progress.suspend(|| print(&lines(rows)))?;
                }
            }
            _ => {}
        }
        for consumer in &mut self.list {
            consumer.observe(event)?;
        }
        Ok(())
    }
}

/// Keeps records in memory, and shows the progress.
struct Collect<T> {
    progress: Progress,
    made: Vec<T>,
}

/// Runs all of an experiment: what was made, and what failed.
pub(crate) fn collect<E: Experiment>(plan: &E) -> Result<(Vec<E::Record>, Vec<Failure>), Error> {
    let mut collected = Collect {
        progress: Progress::new(),
        made: Vec::new(),
    };
    let summary = plan.run(&Extent::default(), &Known::default(), &mut collected)?;
    note_inputs(&summary);
    Ok((collected.made, summary.failures))
}

/// Writes what failed to stderr.
pub(crate) fn print_failures(failures: &[Failure]) {
    for Failure { job, reason, .. } in failures {
        say(&format!("gonio: {job}: {reason}"));
    }
}

impl<T: Clone> Observer<T> for Collect<T> {
    fn begins(&mut self, work: f64) {
        self.progress.begin(work as u64);
    }

    fn observe(&mut self, event: &Event<'_, T>) -> Result<(), Error> {
        self.progress.follow(event);
        if let Event::Made(made) = event {
            self.made.extend_from_slice(made);
        }
        Ok(())
    }
}
