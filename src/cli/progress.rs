//! The bar on stderr, with the time that is left.

use super::is_quiet;
use crate::brdf::{Brdf, ObservedBrdf, Presence};
use crate::experiment::Event;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, stderr};
use std::time::Duration;

/// A progress bar; none if stderr is no terminal, or with `--quiet`. It is gone when it is dropped.
pub(super) struct Progress {
    bar: ProgressBar,
    /// Work that is done, of which the bar shows whole units.
    done: f64,
}

impl Progress {
    /// A bar of work that is not known yet.
    pub(super) fn new() -> Self {
        let bar = ProgressBar::new(0);
        if is_quiet() || !stderr().is_terminal() {
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

    /// A bar of some work, and what it is.
    pub(super) fn with_work(work: u64, what: &str) -> Self {
        let progress = Self::new();
        progress.begin(work);
        progress.bar.set_message(what.to_owned());
        progress
    }

    /// A bar that is not shown, which counts.
    pub(super) fn hidden() -> Self {
        let bar = ProgressBar::hidden();
        Self { bar, done: 0.0 }
    }

    /// The work that was counted.
    pub(super) fn counted(&self) -> u64 {
        self.bar.position()
    }

    /// Sets the whole of the work.
    pub(super) fn begin(&self, work: u64) {
        self.bar.set_length(work);
    }

    /// Shows what is done now.
    pub(super) fn doing(&self, what: impl FnOnce() -> String) {
        if !self.bar.is_hidden() {
            self.bar.set_message(what());
        }
    }

    /// Adds some work that is done.
    pub(super) fn advance(&mut self, work: f64) {
        self.done += work;
        self.bar.set_position(self.done as u64);
    }

    /// Adds some work that is done, from any thread.
    pub(super) fn count(&self, work: u64) {
        self.bar.inc(work);
    }

    /// A BRDF whose pairs are the work of whatever is made of it.
    pub(super) fn watches<'a>(&'a self, brdf: &'a dyn Brdf) -> impl Brdf + 'a {
        ObservedBrdf::new(brdf, |_: &[f64], pairs: &[Presence]| {
            self.count(pairs.len() as u64)
        })
    }

    /// Shows the step and the progress of an event.
    pub(super) fn follow<R>(&mut self, event: &Event<'_, R>) {
        match event {
            Event::Doing(what) => self.doing(|| what.to_string()),
            Event::Advanced(work) => self.advance(*work),
            _ => {}
        }
    }

    /// True if it is not shown.
    pub(super) fn is_hidden(&self) -> bool {
        self.bar.is_hidden()
    }

    /// Prints without running into the bar.
    pub(super) fn suspend<T>(&self, print: impl FnOnce() -> T) -> T {
        self.bar.suspend(print)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Channels, Lambert, Spectrum};
    use crate::formats::{Tabulation, WRITE_TABLE};

    /// Or the time that is left would not be.
    #[test]
    fn tables_ask_for_as_many_pairs_as_they_say() {
        let brdf = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
        let dir = tempfile::tempdir().unwrap();
        for format in WRITE_TABLE.formats() {
            let progress = Progress::hidden();
            let watched = progress.watches(&brdf);
            let path = dir.path().join(format.name);
            format.table.write.unwrap()(&watched, Tabulation::default(), &path).unwrap();
            let said = format.table.pairs.unwrap()(&brdf, 0).unwrap();
            assert_eq!(progress.counted(), said, "{}", format.name);
        }
    }
}
