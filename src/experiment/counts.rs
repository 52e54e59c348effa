//! What a run did, by stage: counts that explain its seconds, and that tests hold it to. They are no results: a
//! run that goes on does less, and none depends on the number of threads.

use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, ObservedBrdf, Presence};
use crate::registry::named;
use crate::statistics::median;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Add;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

named! {
    /// A part of a run.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Stage {
        /// Hashing files, building materials.
        Load = "load",
        /// Materials at test pairs.
        Truth = "truth",
        /// The alignment of a material's lobe, a column of rows.
        Alignment = "alignment",
        /// Schedules, tours, and readings that poses are chosen from.
        Plan = "plan",
        /// Measuring.
        Measure = "measure",
        /// Reconstructing.
        Reconstruct = "reconstruct",
        /// Reconstructions at test pairs; relations of moments.
        Evaluate = "evaluate",
        /// Moments of materials and reconstructions.
        Moments = "moments",
        /// Pictures, and the reconstructions that are drawn.
        Pictures = "pictures",
        /// Tables and reports at the end, schedules in between.
        Report = "report",
    }
}

named! {
    /// A kind of work that is counted.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Work {
        FilesRead = "files_read": "readings of files from end to end",
        BytesRead = "bytes_read": "bytes of files read",
        Materials = "materials": "materials built",
        TableBytes = "table_bytes": "bytes of their tables, at most",
        TestPairs = "test_pairs": "test pairs made",
        Evaluations = "evaluations": "evaluations of materials",
        LookUps = "look_ups": "of them look-ups in tables",
        Grids = "grids": "grids measured to tune ratios",
        Schedules = "schedules": "schedules made",
        /// Of schedules where they are made, and asked of an instrument where it measures:
        Poses = "poses": "poses",
        Tours = "tours": "tours put in order",
        Readings = "readings": "readings taken",
        Reconstructions = "reconstructions": "interpolants built",
        Evaluated = "evaluated": "evaluations of reconstructions",
        Drawn = "drawn": "files of pictures",
        FilesWritten = "files_written": "files written",
        BytesWritten = "bytes_written": "bytes written",
    }
}

/// What was counted, by the names of stages and of kinds of work; what is 0 is left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Counts(BTreeMap<String, BTreeMap<String, u64>>);

impl Counts {
    /// The work of a kind at a stage.
    pub fn get(&self, stage: Stage, work: Work) -> u64 {
        let of_stage = self.0.get(stage.name());
        let count = of_stage.and_then(|works| works.get(work.name()));
        count.copied().unwrap_or(0)
    }

    /// Adds what another run or another part of a run did.
    pub fn extend(&mut self, other: &Self) {
        for (stage, works) in &other.0 {
            let mine = self.0.entry(stage.clone()).or_default();
            for (work, count) in works {
                *mine.entry(work.clone()).or_default() += count;
            }
        }
    }
}

/// Wall times of a run by stage, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds([f64; Stage::ALL.len()]);

impl Seconds {
    /// All, by the names of stages.
    pub(crate) fn by_stage(&self) -> BTreeMap<String, f64> {
        let of = |stage: Stage| (stage.name().to_owned(), self.at_stage(stage));
        Stage::ALL.into_iter().map(of).collect()
    }

    pub(crate) fn at_stage(&self, stage: Stage) -> f64 {
        self.0[stage as usize]
    }

    /// Adds some to those of a stage.
    pub(crate) fn add(&mut self, stage: Stage, seconds: f64) {
        self.0[stage as usize] += seconds;
    }
}

/// How often work is done that is repeated to time it.
pub(super) const REPETITIONS: usize = 6;

/// Share of a time up to which parts of it that were timed once leave its range as it is.
const NEGLIGIBLE: f64 = 0.1;

/// Wall time of some work, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spent {
    /// The median of its repetitions, or its one time.
    pub seconds: f64,
    /// The least and the largest of these.
    range: [f64; 2],
    /// What of `seconds` was timed once.
    once: f64,
}

impl Spent {
    /// Work that was done once.
    pub(crate) fn once(seconds: f64) -> Self {
        Self {
            seconds,
            range: [seconds; 2],
            once: seconds,
        }
    }

    /// The work of a first time, which is repeated by `again` if that takes `limit` seconds at most in all.
    pub(crate) fn repeated(first: f64, limit: f64, mut again: impl FnMut()) -> Self {
        if first * (REPETITIONS - 1) as f64 > limit {
            return Self::once(first);
        }
        let mut times = vec![first];
        times.extend((1..REPETITIONS).map(|_| timed(&mut again).1));
        times.sort_by(f64::total_cmp);
        Self {
            seconds: median(&times).unwrap_or(first),
            range: [times[0], times[REPETITIONS - 1]],
            once: 0.0,
        }
    }

    /// Work that was done in parts of given sizes, each timed once: at least [`REPETITIONS`] of them give a range.
    pub(crate) fn of_parts(parts: &[(usize, f64)]) -> Self {
        let seconds = parts.iter().map(|part| part.1).sum();
        if parts.len() < REPETITIONS {
            return Self::once(seconds);
        }
        let size: usize = parts.iter().map(|part| part.0).sum();
        let rates = parts.iter().map(|(n, s)| s / *n as f64 * size as f64);
        let (low, high) = rates.fold((f64::INFINITY, 0.0_f64), |(low, high), s| {
            (low.min(s), high.max(s))
        });
        Self {
            seconds,
            range: [low, high],
            once: 0.0,
        }
    }

    /// So many times as much, with the same relative range.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self {
            seconds: self.seconds * factor,
            range: self.range.map(|s| s * factor),
            once: self.once * factor,
        }
    }

    /// The least and the largest time within the run; `None` if too much was timed once.
    pub(crate) fn range(&self) -> Option<[f64; 2]> {
        (self.once <= NEGLIGIBLE * self.seconds).then_some(self.range)
    }
}

impl Add for Spent {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            seconds: self.seconds + other.seconds,
            range: [0, 1].map(|end| self.range[end] + other.range[end]),
            once: self.once + other.once,
        }
    }
}

/// The result of some work and its wall time, s.
pub(super) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

/// The counters of one thread, in cache lines of their own.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Page([[AtomicU64; Work::ALL.len()]; Stage::ALL.len()]);

/// Counters and wall times that any thread adds to; clones are the same.
#[derive(Clone, Debug)]
pub struct Counters {
    /// The first is for threads of no pool.
    pages: Arc<[Page]>,
    seconds: Arc<Mutex<Seconds>>,
    /// The stage that all is counted at; `None`: that which is named.
    only: Option<Stage>,
    /// Seconds that a step of a job may be repeated for to time it.
    pub(super) repeat_seconds: f64,
}

impl Default for Counters {
    fn default() -> Self {
        let pages = 0..=rayon::current_num_threads();
        Self {
            pages: pages.map(|_| Page::default()).collect(),
            seconds: Arc::default(),
            only: None,
            repeat_seconds: 0.0,
        }
    }
}

impl Counters {
    /// These counters, with all further work counted at `stage`.
    #[must_use]
    pub fn within(&self, stage: Stage) -> Self {
        Self {
            only: Some(stage),
            ..self.clone()
        }
    }

    /// Adds work of a kind at a stage.
    pub fn add(&self, stage: Stage, work: Work, count: usize) {
        let thread = rayon::current_thread_index().map_or(0, |i| i + 1);
        let Page(page) = &self.pages[thread % self.pages.len()];
        let stage = self.only.unwrap_or(stage);
        page[stage as usize][work as usize].fetch_add(count as u64, Ordering::Relaxed);
    }

    /// The result of some work of a stage, and its wall time, s, which is added to that of the stage.
    pub(super) fn timed<T>(&self, stage: Stage, work: impl FnOnce() -> T) -> (T, f64) {
        let (result, seconds) = timed(work);
        let mut all = self.seconds.lock().unwrap_or_else(PoisonError::into_inner);
        all.add(self.only.unwrap_or(stage), seconds);
        (result, seconds)
    }

    /// As [`timed`](Self::timed), of work that is repeated if it is short, then counted with counters that are thrown away.
    pub(super) fn repeated<T>(&self, stage: Stage, mut work: impl FnMut(&Self) -> T) -> (T, Spent) {
        let (result, first) = self.timed(stage, || work(self));
        let mut unused = None;
        let again = || drop(work(unused.get_or_insert_with(Self::default)));
        (result, Spent::repeated(first, self.repeat_seconds, again))
    }

    pub(super) fn seconds(&self) -> Seconds {
        *self.seconds.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was counted so far.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for stage in Stage::ALL {
            for work in Work::ALL {
                let of =
                    |page: &Page| page.0[stage as usize][work as usize].load(Ordering::Relaxed);
                let count: u64 = self.pages.iter().map(of).sum();
                if count > 0 {
                    let works = counts.0.entry(stage.name().into()).or_default();
                    works.insert(work.name().into(), count);
                }
            }
        }
        counts
    }

    /// Counts files that are read once from end to end; one that cannot be read counts nothing.
    pub(super) fn read<'p>(&self, files: impl IntoIterator<Item = &'p Path>) {
        for file in files.into_iter().filter_map(|path| path.metadata().ok()) {
            self.add(Stage::Load, Work::FilesRead, 1);
            self.add(Stage::Load, Work::BytesRead, file.len() as usize);
        }
    }

    /// A reconstruction whose evaluations are counted.
    pub(crate) fn reconstruction<'a>(&'a self, brdf: &'a dyn Brdf, stage: Stage) -> impl Brdf + 'a {
        self.watched(brdf, stage, &[Work::Evaluated])
    }

    fn watched<'a>(
        &'a self,
        brdf: &'a dyn Brdf,
        stage: Stage,
        works: &'static [Work],
    ) -> impl Brdf + 'a {
        ObservedBrdf::new(brdf, move |_: &[f64], pairs: &[Presence]| {
            for work in works {
                self.add(stage, *work, pairs.len());
            }
        })
    }
}

/// A material that was built. It can be evaluated only at a [`Stage`], so that no evaluation is left out.
pub struct Built {
    brdf: Box<dyn Brdf>,
    /// What an evaluation is counted as.
    works: &'static [Work],
}

impl Built {
    /// Builds a material, or fails as [`BrdfSpec::build`] does.
    pub(super) fn new(
        spec: &dyn BrdfSpec,
        channels: Channels,
        counters: &Counters,
    ) -> Result<Self, BuildError> {
        let tables = spec.tables();
        let bytes = tables.channel_bytes * channels.count();
        let brdf = spec.build(channels)?;
        counters.add(Stage::Load, Work::Materials, 1);
        counters.add(Stage::Load, Work::TableBytes, bytes);
        counters.read(tables.files.iter().map(|file| &**file));
        Ok(Self {
            brdf,
            works: match bytes {
                0 => &[Work::Evaluations],
                _ => &[Work::Evaluations, Work::LookUps],
            },
        })
    }

    /// The material, as a stage evaluates it.
    pub(crate) fn counted_at<'a>(&'a self, counters: &'a Counters, stage: Stage) -> impl Brdf + 'a {
        counters.watched(&*self.brdf, stage, self.works)
    }
}
