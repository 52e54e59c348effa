//! Observers of a run: progress bar on stderr, file of records, and those of its kind.

use crate::cli::say;
use crate::error::Error;
use crate::experiment::{Event, Failure, Observer, Record, Wish};
use crate::report::RunFolder;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::cell::RefCell;
use std::io::{IsTerminal, stderr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

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
        self.progress.bar.set_length(work as u64);
    }

    fn wants(&self, wish: &Wish<'_>) -> bool {
        self.list.iter().any(|consumer| consumer.wants(wish))
    }

    fn tell(&mut self, event: &Event<'_, R>) -> Result<(), Error> {
        self.progress.tell(event);
        let bar = self.progress.bar.clone();
        for consumer in &mut self.list {
            // What is printed must not run into the bar.
            match event {
                Event::Complete(_) => bar.suspend(|| consumer.tell(event))?,
                event => consumer.tell(event)?,
            }
        }
        Ok(())
    }
}

/// The progress bar on stderr, with the time left; none if stderr is no terminal or in quiet runs.
/// Failures are told in any case.
pub(super) struct Progress {
    bar: ProgressBar,
    /// Work that is done, of which the bar shows whole units.
    done: f64,
}

impl Progress {
    pub(super) fn new(quiet: bool) -> Self {
        let bar = ProgressBar::new(0);
        if quiet || !stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        } else {
            let style =
                ProgressStyle::with_template("{bar:24} {percent:>3}%  {eta} left  {wide_msg}");
            // The template is a constant; the default style is what is left if it were wrong.
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Self { bar, done: 0.0 }
    }

    fn tell<R>(&mut self, event: &Event<'_, R>) {
        match event {
            Event::Doing(what) if !self.bar.is_hidden() => self.bar.set_message(what.to_string()),
            Event::Advanced(work) => {
                self.done += work;
                self.bar.set_position(self.done as u64);
            }
            Event::Failed(Failure { job, reason, .. }) => {
                self.bar.suspend(|| say(&format!("gonio: {job}: {reason}")));
            }
            _ => {}
        }
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
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
