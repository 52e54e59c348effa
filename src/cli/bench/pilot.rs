//! How long a bench takes, and how far it is.

use super::{ENOUGH, Named, REFERENCE, REPEATS, ladders, profile};
use crate::cli::print;
use crate::cli::progress::Progress;
use crate::error::Error;
use crate::moments::{Estimator, MomentsSpec};
use std::time::Instant;

/// Seconds of the reference and of every rung, a list for each material: those of a few views, in
/// proportion.
pub(super) fn seconds(materials: &[Named], spec: &MomentsSpec) -> Result<Vec<Vec<f64>>, Error> {
    // As many as work at the same time: fewer would take as long.
    let views = rayon::current_num_threads().clamp(2, spec.views.max(2));
    let few = MomentsSpec {
        views,
        ..spec.clone()
    };
    let share = spec.views as f64 / views as f64;
    let of = |(_, brdf): &Named| {
        let once = |by: &dyn Estimator| {
            let start = Instant::now();
            profile(&**brdf, &few, by)?;
            Ok::<_, Error>(start.elapsed().as_secs_f64() * share)
        };
        let mut seconds = vec![once(&REFERENCE)?];
        for (_, _, by) in ladders() {
            let one = once(&*by)?;
            let repeats = (ENOUGH / one).ceil().clamp(1.0, REPEATS as f64);
            seconds.push(one * repeats);
        }
        Ok(seconds)
    };
    materials.iter().map(of).collect()
}

/// A time for people.
pub(super) fn shown(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{} s", s.ceil()),
        s => format!("{:.0} minutes", s / 60.0),
    }
}

/// The rows that are printed, and the bar below them.
pub(super) struct Told {
    json: bool,
    progress: Progress,
    /// Seconds of what is still to be done, the next last.
    left: Vec<f64>,
}

/// Steps of the bar in a second.
const STEPS: f64 = 1000.0;

impl Told {
    pub(super) fn new(json: bool, seconds: Vec<Vec<f64>>) -> Self {
        let mut left: Vec<f64> = seconds.into_iter().flatten().collect();
        left.reverse();
        let all = left.iter().sum::<f64>();
        Self {
            json,
            progress: Progress::of((STEPS * all) as u64, "estimators"),
            left,
        }
    }

    /// One more is done.
    pub(super) fn done(&mut self) {
        let seconds = self.left.pop().unwrap_or(0.0);
        self.progress.advance(STEPS * seconds);
    }

    pub(super) fn suspend(&self, tell: impl FnOnce()) {
        self.progress.suspend(tell);
    }

    /// Prints a row for people.
    pub(super) fn row(&self, line: &str) -> Result<(), Error> {
        match self.json {
            true => Ok(()),
            false => self.progress.suspend(|| print(line)),
        }
    }
}
