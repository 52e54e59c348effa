//! Progress on stderr, with the time that is left: a bar on a terminal, else a line every ten seconds.

use super::{is_quiet, say};
use crate::brdf::{Brdf, ObservedBrdf, Presence};
use crate::error::Error;
use crate::experiment::{Event, Material};
use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::{IsTerminal, stderr};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Time between two lines.
const EVERY: Duration = Duration::from_secs(10);

/// The progress of some work; silent with `--quiet`. A bar is gone when this is dropped.
pub(super) struct Progress {
    bar: ProgressBar,
    /// Work that is done, of which the bar shows whole units.
    done: f64,
    /// When the last line was printed, where there is no terminal.
    last_line: Option<Mutex<Instant>>,
}

impl Progress {
    /// A bar of work that is not known yet.
    pub(super) fn new() -> Self {
        let mut progress = Self::hidden();
        if is_quiet() {
            return progress;
        }
        if !stderr().is_terminal() {
            progress.last_line = Some(Mutex::new(Instant::now()));
            return progress;
        }
        progress.bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{bar:24} {percent:>3}%{left}  {wide_msg}");
        // The template is a constant; the default style is what is left if it were wrong.
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        let left = |state: &ProgressState, out: &mut dyn Write| {
            // Before anything is done the time that is left is not known, and a bar has no errors to report.
            if state.pos() > 0 {
                let _ = write!(out, "  {:#} left", HumanDuration(state.eta()));
            }
        };
        progress.bar.set_style(style.with_key("left", left));
        progress.bar.enable_steady_tick(Duration::from_millis(200));
        progress
    }

    /// Prints a line if it is time for one.
    fn line(&self) {
        let Some(Ok(mut last)) = self.last_line.as_ref().map(Mutex::try_lock) else {
            return;
        };
        if last.elapsed() < EVERY {
            return;
        }
        *last = Instant::now();
        let (done, all) = (self.bar.position(), self.bar.length().unwrap_or(0));
        if done == 0 || all == 0 {
            return;
        }
        let share = done as f64 / all as f64;
        let left = self.bar.elapsed().mul_f64((1.0 - share).max(0.0) / share);
        let (percent, left, what) = (100.0 * share, HumanDuration(left), self.bar.message());
        say(&format!("gonio: {percent:.0} %, {left:#} left  {what}"));
    }

    /// A bar of some work, and what it is.
    pub(super) fn with_work(work: u64, what: &str) -> Self {
        let progress = Self::new();
        progress.begin(work);
        progress.bar.set_message(what.to_owned());
        progress
    }

    /// Visits materials with a bar of their names, which is returned.
    pub(super) fn over(
        materials: &[Material],
        mut visit: impl FnMut(&Material, &Self) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let mut progress = Self::with_work(materials.len() as u64, "");
        for material in materials {
            progress.doing(|| material.name.clone());
            visit(material, &progress)?;
            progress.advance(1.0);
        }
        Ok(progress)
    }

    /// A bar that is not shown, which counts.
    pub(super) fn hidden() -> Self {
        Self {
            bar: ProgressBar::hidden(),
            done: 0.0,
            last_line: None,
        }
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
        if !self.bar.is_hidden() || self.last_line.is_some() {
            self.bar.set_message(what());
        }
    }

    /// Adds some work that is done.
    pub(super) fn advance(&mut self, work: f64) {
        self.done += work;
        self.bar.set_position(self.done as u64);
        self.line();
    }

    /// Adds some work that is done, from any thread.
    pub(super) fn count(&self, work: u64) {
        self.bar.inc(work);
        self.line();
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
