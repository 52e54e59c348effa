//! The progress bar on stderr.

use crate::experiment::{Allowance, Job, Plan, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, stderr};
use std::time::Duration;

/// Work of a job that does not depend on its budget, in poses: the comparison.
const FIXED_WORK: usize = 4000;

/// A bar with the time left; nothing if stderr is no terminal or nothing shall be seen.
pub(super) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    pub(super) fn new(plan: &Plan, quiet: bool) -> Self {
        let allowances = plan.allowances();
        let each = plan.jobs() / allowances.len();
        let works = allowances.iter().map(|&a| work(each, a));
        Self::with_length(works.sum(), quiet)
    }

    /// A bar of so many steps.
    pub(super) fn with_length(steps: u64, quiet: bool) -> Self {
        let bar = ProgressBar::new(steps);
        if quiet || !stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
            return Self { bar };
        }
        let style = ProgressStyle::with_template("{bar:24} {percent:>3}%  {eta} left  {wide_msg}");
        // The template is a constant; the default style is what is left if it were wrong.
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    pub(super) fn stage(&self, stage: Stage, job: &Job<'_>) {
        if !self.bar.is_hidden() {
            let doing = match stage {
                Stage::Load => "loading",
                Stage::Plan => "planning",
                Stage::Measure => "measuring",
                Stage::Reconstruct => "reconstructing",
                Stage::Evaluate => "comparing",
            };
            self.bar.set_message(format!("{doing} {job}"));
        }
    }

    /// What is done now.
    pub(super) fn say(&self, what: &str) {
        if !self.bar.is_hidden() {
            self.bar.set_message(what.to_owned());
        }
    }

    /// So many steps of a bar [with a length](Self::with_length) are done.
    pub(super) fn step(&self, steps: u64) {
        self.bar.inc(steps);
    }

    pub(super) fn advance(&self, jobs: usize, allowance: Allowance) {
        self.bar.inc(work(jobs, allowance));
    }

    /// Runs something that prints, with the bar out of the way.
    pub(super) fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.bar.suspend(print)
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Poses that an instrument visits in a minute, times the schedules that are tried to find out.
const MINUTE_WORK: f64 = 300.0;

fn work(jobs: usize, allowance: Allowance) -> u64 {
    let budget = match allowance {
        Allowance::Poses(n) | Allowance::Readings(n) => n,
        Allowance::Minutes(minutes) => (minutes * MINUTE_WORK) as usize,
    };
    (jobs as u64).saturating_mul((budget + FIXED_WORK) as u64)
}
