//! An observer that keeps what an experiment makes.

use super::progress::Progress;
use crate::error::Error;
use crate::experiment::{Event, Failure, Observer};

/// Keeps records and failures, and shows how far it is.
pub(super) struct Collect<T> {
    progress: Progress,
    made: Vec<T>,
    failures: Vec<Failure>,
}

impl<T> Collect<T> {
    pub(super) fn new() -> Self {
        Self {
            progress: Progress::new(),
            made: Vec::new(),
            failures: Vec::new(),
        }
    }

    /// What was made, and what failed; the bar is gone.
    pub(super) fn end(self) -> (Vec<T>, Vec<Failure>) {
        (self.made, self.failures)
    }
}

impl<T: Clone> Observer<T> for Collect<T> {
    fn begins(&mut self, work: f64) {
        self.progress.begin(work as u64);
    }

    fn tell(&mut self, event: &Event<'_, T>) -> Result<(), Error> {
        self.progress.follow(event);
        match event {
            Event::Made(made) => self.made.extend_from_slice(made),
            Event::Failed(failure) => self.failures.push((*failure).clone()),
            _ => {}
        }
        Ok(())
    }
}
