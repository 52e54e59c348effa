//! The folder of a run.

mod folder;
mod manifest;
mod rows;
mod timings;

#[cfg(feature = "pictures")]
pub(super) use folder::coordinates_stem;
pub use folder::{
    Below, CONFIG, CORRELATIONS, EXPLORE, FITS, PARQUET, PROFILES, RANKING, RELATIONS, REPORT,
    RESULTS, RunFolder, SUMMARY, TIMES, file_stem, schedule_stem, slice_name,
};
pub use manifest::{MadeFrom, Manifest, Outcome, Status};
pub use rows::read_rows;
pub use timings::Machine;
