//! The experiment `moments`: moment profiles of materials, their fits and the correlations between
//! them (Zubiaga et al. 2015, and what they leave open).
//!
//! Materials of one kind form a *group*: MERL tables are fitted together, a sweep of GGX
//! roughnesses is another group.

mod analysis;
mod plan;
mod profiles;

pub(crate) use analysis::{CorrelationRow, Group, ProfileFits, Spread, at_bound};
pub(crate) use plan::{AnalysisSpec, MomentsPlan, MomentsTable, PublishedNumbers};
pub(super) use plan::{read_keys, read_tables, refuse_others};
pub use profiles::{MaterialProfiles, ProfileRow, degrees, shown};
