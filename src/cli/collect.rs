//! What an experiment makes, kept in memory.

use super::progress::Progress;
use super::run::tell_inputs;
use super::verbosity::say;
use crate::error::Error;
use crate::experiment::{Event, Experiment, Extent, Failure, Known, Observer};

/// Keeps records and failures, and shows how far it is.
struct Collect<T> {
    progress: Progress,
    made: Vec<T>,
    failures: Vec<Failure>,
}

/// Runs all of an experiment: what was made, and what failed.
pub(super) fn collect<E: Experiment>(plan: &E) -> Result<(Vec<E::Record>, Vec<Failure>), Error> {
    let mut collected = Collect {
        progress: Progress::new(),
        made: Vec::new(),
        failures: Vec::new(),
    };
    let summary = plan.run(&Extent::default(), &Known::default(), &mut collected)?;
    tell_inputs(&summary);
    Ok((collected.made, collected.failures))
}

/// Tells what failed.
pub(super) fn tell_failures(failures: &[Failure]) {
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
        match event {
            Event::Made(made) => self.made.extend_from_slice(made),
            Event::Failed(failure) => self.failures.push((*failure).clone()),
            _ => {}
        }
        Ok(())
    }
}
