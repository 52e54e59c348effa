//! Observers of a run: progress bar, file of records, and those of its kind.

use crate::cli::doubt;
use crate::cli::progress::Progress;
use crate::cli::talk::say;
use crate::error::Error;
use crate::experiment::{Event, Failure, Observer, Record, Wish};
use crate::report::RunFolder;
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// All observers of a run, as one.
pub(super) struct Consumers<'a, R> {
    pub(super) stop: Arc<AtomicBool>,
    pub(super) progress: Progress,
    pub(super) list: Vec<Box<dyn Observer<R> + 'a>>,
}

impl<R> Observer<R> for Consumers<'_, R> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn begins(&mut self, work: f64) {
        self.progress.begin(work as u64);
    }

    fn wants(&self, wish: &Wish<'_>) -> bool {
        self.list.iter().any(|consumer| consumer.wants(wish))
    }

    fn tell(&mut self, event: &Event<'_, R>) -> Result<(), Error> {
        self.progress.follow(event);
        // Failures are told in any case.
        if let Event::Failed(Failure { job, reason, .. }) = event {
            let line = format!("gonio: {job}: {reason}");
            self.progress.suspend(|| say(&line));
        }
        if let Event::Loaded(material, _, brdf) = event {
            self.progress.suspend(|| doubt(material, *brdf));
        }
        for consumer in &mut self.list {
            // What is printed must not run into the bar.
            match event {
                Event::Complete(_) => self.progress.suspend(|| consumer.tell(event))?,
                event => consumer.tell(event)?,
            }
        }
        Ok(())
    }
}

/// Observer that appends records to their file.
pub(super) struct Files<'a, R>(pub(super) &'a RefCell<RunFolder<R>>);

impl<R: Record> Observer<R> for Files<'_, R> {
    fn tell(&mut self, event: &Event<'_, R>) -> Result<(), Error> {
        match event {
            Event::Made(rows) => self.0.borrow_mut().write_rows(rows),
            _ => Ok(()),
        }
    }
}
