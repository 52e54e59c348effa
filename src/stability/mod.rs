//! Every member of every registry at the edges of its domain: mirror-like lobes, grazing, retro-reflection, poles and
//! seams, one reading, broken tables.
//!
//! An error is judged by the conditioning of its case: what one rounding of the input changes, and one of the result.
//! A coordinate of a pair at the horizon is then allowed to be as wrong as it must, and no coordinate elsewhere is. The
//! truth is computed with 50 digits, or is a law that needs none. See [`crate::docs::stability`].

mod cases;
mod charts;
mod estimators;
mod files;
mod instruments;
mod models;
mod parametrizations;
mod planners;
mod reconstructions;
mod sample_sets;
mod tables;
mod values;

pub use models::extremes;

use crate::registry::named;
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Display;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Relative size of one rounding, 2⁻⁵³.
pub(crate) const ROUNDING: f64 = f64::EPSILON / 2.0;

/// Number of cases of each check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// A part, in some seconds.
    Short,
    /// All of them.
    Whole,
}

impl Extent {
    /// Every case, or of a short run one in `step`, spread over them.
    fn subset<T>(self, cases: Vec<T>, step: usize) -> Vec<T> {
        match self {
            Extent::Short => cases.into_iter().step_by(step).collect(),
            Extent::Whole => cases,
        }
    }
}

/// A family of things that are named in configs or read from files.
pub struct Family {
    /// Name, as a command line writes it.
    pub name: &'static str,
    /// What is checked of it, a phrase.
    pub summary: &'static str,
    /// The checks of its members.
    pub checks: fn(Extent) -> Vec<Check>,
}

/// Every family.
pub fn all() -> Vec<Family> {
    vec![
        parametrizations::FAMILY,
        models::FAMILY,
        tables::FAMILY,
        sample_sets::FAMILY,
        reconstructions::FAMILY,
        estimators::FAMILY,
        instruments::FAMILY,
        planners::FAMILY,
        files::FAMILY,
    ]
}

/// A law of a member, to be checked at many cases.
pub struct Check {
    /// Name of the member of a registry that is checked.
    pub member: String,
    law: Law,
    run: Box<dyn Fn(&mut Finding) + Send + Sync>,
}

/// What is to hold.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Law {
    /// What is compared, a phrase.
    name: &'static str,
    /// Unit of error and conditioning.
    unit: &'static str,
    /// Times the conditioning that an error may have.
    allowed: f64,
}

impl Law {
    /// A law of numbers: errors of at most `allowed` times their conditioning.
    const fn bounded(name: &'static str, unit: &'static str, allowed: f64) -> Self {
        Self {
            name,
            unit,
            allowed,
        }
    }

    /// A law that holds or does not: an error is a count.
    const fn strict(name: &'static str) -> Self {
        Self::bounded(name, "violations", 0.0)
    }
}

/// A law of a member, and what looks for violations of it.
type Test<T> = (Law, fn(&T, Extent, &mut Finding));

impl Check {
    fn new(
        member: impl Into<String>,
        law: Law,
        run: impl Fn(&mut Finding) + Send + Sync + 'static,
    ) -> Self {
        Self {
            member: member.into(),
            law,
            run: Box::new(run),
        }
    }

    /// Checks of one member, each of a law.
    fn each<T: ?Sized + Send + Sync + 'static>(
        member: impl Into<String>,
        of: impl Into<Arc<T>>,
        extent: Extent,
        tests: &[Test<T>],
    ) -> impl Iterator<Item = Self> {
        let (member, of) = (member.into(), of.into());
        tests.iter().map(move |&(law, test)| {
            let of = Arc::clone(&of);
            Self::new(&*member, law, move |watch| test(&of, extent, watch))
        })
    }

    fn run(&self, family: &'static str) -> Finding {
        let start = Instant::now();
        let mut found = self.begun(family);
        (self.run)(&mut found);
        found.seconds = start.elapsed().as_secs_f64();
        found.verdict = match found.cases > 0 && found.ratio <= found.allowed {
            true => Verdict::Holds,
            false => Verdict::Broken,
        };
        found
    }

    /// The finding before the first case.
    fn begun(&self, family: &'static str) -> Finding {
        Finding {
            family,
            member: self.member.clone(),
            law: self.law.name,
            unit: self.law.unit,
            allowed: self.law.allowed,
            ..Finding::default()
        }
    }
}

/// Runs the checks of families on all cores, until `stop` is set: a finding of each in their order; of those that have not
/// ended [`Verdict::Interrupted`]. `done` is called for each that has.
pub fn run(
    families: Vec<(&'static str, Vec<Check>)>,
    stop: &Arc<AtomicBool>,
    done: &dyn Fn(),
) -> Vec<Finding> {
    let begun = |(name, checks): &(&'static str, Vec<Check>)| -> Vec<Finding> {
        checks.iter().map(|check| check.begun(name)).collect()
    };
    let mut found: Vec<Vec<Finding>> = families.iter().map(begun).collect();
    let (ended, ends) = mpsc::channel();
    let stopped = Arc::clone(stop);
    let walk = std::thread::spawn(move || {
        for (f, (name, checks)) in families.iter().enumerate() {
            let run = |(i, check): (usize, &Check)| {
                if !stopped.load(Ordering::SeqCst) {
                    // The receiver is gone after a stop.
                    let _ = ended.send((f, i, check.run(name)));
                }
            };
            checks.par_iter().enumerate().for_each(run);
        }
    });
    while !stop.load(Ordering::SeqCst) {
        match ends.recv_timeout(LOOK) {
            Ok((f, i, finding)) => {
                found[f][i] = finding;
                done();
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    if !stop.load(Ordering::SeqCst)
        && let Err(panic) = walk.join()
    {
        std::panic::resume_unwind(panic);
    }
    found.concat()
}

/// Time between two looks at whether a walk shall stop.
const LOOK: Duration = Duration::from_millis(50);

named! {
    /// Whether a law holds.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Verdict {
        /// Every error is within its bound.
        Holds = "holds",
        /// One is not, or there was no case.
        Broken = "BROKEN",
        /// It was not checked: the walk was interrupted before.
        #[default]
        Interrupted = "interrupted",
    }
}

/// What a check found: the case whose error is largest for its conditioning.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Finding {
    /// Name of the family.
    pub family: &'static str,
    /// Name of the member.
    pub member: String,
    /// What was compared.
    pub law: &'static str,
    /// Number of cases.
    pub cases: u64,
    /// Evaluations of the member.
    pub evaluations: u64,
    /// Error of the worst case.
    pub error: f64,
    /// Unit of errors.
    pub unit: &'static str,
    /// The worst case.
    pub at: String,
    /// What one rounding changes there; 0 of laws without conditioning.
    pub conditioning: f64,
    /// The error over the conditioning; of laws without it the error.
    pub ratio: f64,
    /// Largest ratio that is allowed.
    pub allowed: f64,
    /// Largest error of all cases.
    pub largest: f64,
    /// Wall time, s.
    pub seconds: f64,
    /// Whether the law holds.
    pub verdict: Verdict,
}

/// Collects the cases of a check.
impl Finding {
    /// A case with its error and conditioning.
    fn see(&mut self, error: f64, conditioning: f64, at: &dyn Display) {
        // A NaN is the worst error of all.
        let error = if error.is_nan() { f64::INFINITY } else { error };
        // Where a rounding may change everything no error is one.
        let ratio = match error == 0.0 || conditioning == f64::INFINITY {
            true => 0.0,
            false => error / conditioning,
        };
        self.keep(error, conditioning, ratio, at);
    }

    /// A case where a law holds, or not.
    fn holds(&mut self, holds: bool, at: &dyn Display) {
        let broken = if holds { 0.0 } else { 1.0 };
        self.keep(broken, 0.0, broken, at);
    }

    /// A case whose value, of a reflectance, must be finite and not negative.
    fn is_reflectance(&mut self, value: f64, at: &dyn Display) {
        self.holds((0.0..=f64::MAX).contains(&value), at);
    }

    fn keep(&mut self, error: f64, conditioning: f64, ratio: f64, at: &dyn Display) {
        self.cases += 1;
        self.largest = self.largest.max(error);
        let ratio = if ratio.is_nan() { f64::INFINITY } else { ratio };
        if self.cases == 1 || ratio > self.ratio {
            (self.error, self.conditioning, self.ratio) = (error, conditioning, ratio);
            self.at = at.to_string();
        }
    }

    fn spent(&mut self, evaluations: usize) {
        self.evaluations += evaluations as u64;
    }
}
