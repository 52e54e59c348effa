//! What people read of a study: its folder, its ranking, its report.

mod folder;
mod tables;

pub use folder::{ROWS, StudyFolder, read_rows};
pub use tables::study_text;
