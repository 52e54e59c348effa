//! What people read of a study: its folder, its ranking, its report.

mod folder;

pub use folder::{KnownRows, StudyFolder, read_rows};
