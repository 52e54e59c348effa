//! What people read of a study: its folder, its ranking, its report.

mod folder;
#[cfg(all(feature = "exr", feature = "plots"))]
mod pictures;
mod tables;

pub use folder::{ROWS, StudyFolder, read_rows};
#[cfg(all(feature = "exr", feature = "plots"))]
pub use pictures::{Shown, Studio, general_pictures};
pub use tables::study_text;
