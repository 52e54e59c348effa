//! Observers of a run: progress bar, file of records, and those of its kind.

use super::Lines;
use crate::cli::progress::Progress;
use crate::cli::verbosity::say;
use crate::cli::{doubt, print};
use crate::error::Error;
use crate::experiment::{ByProduct, Event, Failure, Observer, Record};
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

    fn wants(&self, wish: &ByProduct<'_>) -> bool {
        self.list.iter().any(|consumer| consumer.wants(wish))
    }

    fn observe(&mut self, event: &Event<'_, R>) -> Result<(), Error> {
        self.progress.follow(event);
        // What is printed must not run into the bar.
        match event {
            // Failures are printed with --quiet too.
            Event::Failed(Failure { job, reason, .. }) => {
                let line = format!("gonio: {job}: {reason}");
                self.progress.suspend(|| say(&line));
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
