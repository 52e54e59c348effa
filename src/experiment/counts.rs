//! What a run did, by stage: counts that explain its seconds, and that tests hold it to. They are no results: a
//! run that goes on does less, and none depends on the number of threads.

use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Presence, Watched};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A part of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Hashing files, building materials.
    Load,
    /// Materials at test pairs.
    Truth,
    /// The alignment of a material's lobe, a column of rows.
    Alignment,
    /// Schedules, tours, and readings that poses are chosen from.
    Plan,
    /// Measuring.
    Measure,
    /// Reconstructing.
    Reconstruct,
    /// Reconstructions at test pairs; relations of moments.
    Evaluate,
    /// Moments of materials and reconstructions.
    Moments,
    /// Pictures, and the reconstructions that are drawn.
    Pictures,
    /// Tables and reports at the end, schedules in between.
    Report,
}

impl Stage {
    /// Every stage, in the order of a run.
    pub const ALL: [Self; 10] = [
        Self::Load,
        Self::Truth,
        Self::Alignment,
        Self::Plan,
        Self::Measure,
        Self::Reconstruct,
        Self::Evaluate,
        Self::Moments,
        Self::Pictures,
        Self::Report,
    ];

    /// Its name in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Load => "load",
            Self::Truth => "truth",
            Self::Alignment => "alignment",
            Self::Plan => "plan",
            Self::Measure => "measure",
            Self::Reconstruct => "reconstruct",
            Self::Evaluate => "evaluate",
            Self::Moments => "moments",
            Self::Pictures => "pictures",
            Self::Report => "report",
        }
    }
}

/// A kind of work that is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// Files of materials read from end to end.
    FilesRead,
    /// Their bytes.
    BytesRead,
    /// Materials built.
    Materials,
    /// Bytes of the tables they hold.
    TableBytes,
    /// Test pairs made.
    TestPairs,
    /// Evaluations of materials, one a pair.
    Evaluations,
    /// Those of them that look into measured tables.
    LookUps,
    /// Grids measured to tune a ratio.
    Grids,
    /// Schedules made.
    Schedules,
    /// Poses: of schedules where they are made, and asked of an instrument where it measures.
    Poses,
    /// Tours of instruments put in order.
    Tours,
    /// Readings taken.
    Readings,
    /// Interpolants built.
    Reconstructions,
    /// Evaluations of reconstructions, one a pair and material.
    Evaluated,
    /// Files of pictures.
    Drawn,
    /// Files written, but those of records.
    FilesWritten,
    /// Their bytes.
    BytesWritten,
}

impl Work {
    /// Every kind.
    pub const ALL: [Self; 17] = [
        Self::FilesRead,
        Self::BytesRead,
        Self::Materials,
        Self::TableBytes,
        Self::TestPairs,
        Self::Evaluations,
        Self::LookUps,
        Self::Grids,
        Self::Schedules,
        Self::Poses,
        Self::Tours,
        Self::Readings,
        Self::Reconstructions,
        Self::Evaluated,
        Self::Drawn,
        Self::FilesWritten,
        Self::BytesWritten,
    ];

    /// Its name in manifests.
    pub fn name(self) -> &'static str {
        self.both().0
    }

    /// What it counts.
    pub fn meaning(self) -> &'static str {
        self.both().1
    }

    fn both(self) -> (&'static str, &'static str) {
        match self {
            Self::FilesRead => ("files_read", "readings of files from end to end"),
            Self::BytesRead => ("bytes_read", "bytes of files read"),
            Self::Materials => ("materials", "materials built"),
            Self::TableBytes => ("table_bytes", "bytes of their tables, at most"),
            Self::TestPairs => ("test_pairs", "test pairs made"),
            Self::Evaluations => ("evaluations", "evaluations of materials"),
            Self::LookUps => ("look_ups", "of them look-ups in tables"),
            Self::Grids => ("grids", "grids measured to tune ratios"),
            Self::Schedules => ("schedules", "schedules made"),
            Self::Poses => ("poses", "poses"),
            Self::Tours => ("tours", "tours put in order"),
            Self::Readings => ("readings", "readings taken"),
            Self::Reconstructions => ("reconstructions", "interpolants built"),
            Self::Evaluated => ("evaluated", "evaluations of reconstructions"),
            Self::Drawn => ("drawn", "files of pictures"),
            Self::FilesWritten => ("files_written", "files written"),
            Self::BytesWritten => ("bytes_written", "bytes written"),
        }
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

    /// The work of a kind at all stages.
    pub fn total(&self, work: Work) -> u64 {
        Stage::ALL.iter().map(|s| self.get(*s, work)).sum()
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

/// The counters of one thread, in cache lines of their own.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Page([[AtomicU64; Work::ALL.len()]; Stage::ALL.len()]);

/// Counters that any thread adds to; clones are the same counters.
#[derive(Clone, Debug)]
pub struct Ledger {
    /// The first is for threads of no pool.
    pages: Arc<[Page]>,
    /// The stage that all is counted at; `None`: that which is named.
    only: Option<Stage>,
}

impl Default for Ledger {
    fn default() -> Self {
        let pages = 0..=rayon::current_num_threads();
        Self {
            pages: pages.map(|_| Page::default()).collect(),
            only: None,
        }
    }
}

impl Ledger {
    /// The same counters for the work of several stages that is done for one.
    #[must_use]
    pub fn within(&self, stage: Stage) -> Self {
        Self {
            pages: Arc::clone(&self.pages),
            only: Some(stage),
        }
    }

    /// Adds work of a kind at a stage.
    pub fn add(&self, stage: Stage, work: Work, count: usize) {
        let thread = rayon::current_thread_index().map_or(0, |i| i + 1);
        let Page(page) = &self.pages[thread % self.pages.len()];
        let stage = self.only.unwrap_or(stage);
        page[stage as usize][work as usize].fetch_add(count as u64, Ordering::Relaxed);
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
    pub fn reconstruction<'a>(&'a self, brdf: &'a dyn Brdf, stage: Stage) -> impl Brdf + 'a {
        self.watched(brdf, stage, &[Work::Evaluated])
    }

    fn watched<'a>(
        &'a self,
        brdf: &'a dyn Brdf,
        stage: Stage,
        works: &'static [Work],
    ) -> impl Brdf + 'a {
        Watched::new(brdf, move |_: &[f64], pairs: &[Presence]| {
            for work in works {
                self.add(stage, *work, pairs.len());
            }
        })
    }
}

/// A material that was built. It can be evaluated only [`at`](Self::at) a stage, so that no evaluation is left out.
pub struct Built {
    brdf: Box<dyn Brdf>,
    /// What an evaluation is counted as.
    works: &'static [Work],
}

impl Built {
    /// Builds a material.
    ///
    /// # Errors
    /// As [`BrdfSpec::build`].
    pub(super) fn new(
        spec: &dyn BrdfSpec,
        channels: Channels,
        ledger: &Ledger,
    ) -> Result<Self, BuildError> {
        let tables = spec.tables();
        let bytes = tables.channel_bytes * channels.count();
        let brdf = spec.build(channels)?;
        ledger.add(Stage::Load, Work::Materials, 1);
        ledger.add(Stage::Load, Work::TableBytes, bytes);
        ledger.read(tables.files.iter().map(|file| &**file));
        Ok(Self {
            brdf,
            works: match bytes {
                0 => &[Work::Evaluations],
                _ => &[Work::Evaluations, Work::LookUps],
            },
        })
    }

    /// The material, as a stage evaluates it.
    pub fn at<'a>(&'a self, ledger: &'a Ledger, stage: Stage) -> impl Brdf + 'a {
        ledger.watched(&*self.brdf, stage, self.works)
    }
}
