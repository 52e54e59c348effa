//! The experiment `moments`: moment profiles of materials, what they have in common, and how they
//! depend on each other (Zubiaga et al. 2015, and what they leave open).
//!
//! Materials of one kind form a *group*: MERL tables are fitted together, a sweep of GGX
//! roughnesses is another group.

mod plan;
mod profiles;
mod spec;

pub use plan::MomentsPlan;
pub use profiles::{Desk, MaterialProfiles, ProfileRow, measure};
pub use spec::MomentsTable;
