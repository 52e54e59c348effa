//! The parametrization study: which coordinates to sample in, and which to reconstruct in.
//!
//! The cross table sampling parametrization × warp × sample set × instrument × allowance × seed ×
//! reconstruction × its coordinates × material × measure. Unlike an acquisition it goes schedule by
//! schedule: all materials are measured at the same poses and reconstructed together, for one
//! search of neighbours and one set of weights. Every row has a key, the hash of everything that
//! determines it; what is there already is not done again.

mod config;
mod findings;
mod jobs;
mod key;
mod plan;
mod row;
mod run;
mod sketch;

pub use config::PictureSpec;
pub use findings::{Cell, Duel, Duels, Explained, Factor, Findings, Line, Metric, Ranking, Scope};
pub use jobs::{StudyJob, jobs};
pub use plan::{Choice, Expected, Label, OWN, Shard, StudyMethod, StudyPlan, Unit};
pub use row::{RowKey, StudyRow};
pub use run::{StudyObserver, StudySummary, study};
pub use sketch::{Sketch, sketch};
