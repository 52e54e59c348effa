//! What people read of a study: its folder, its ranking, its report.

mod csv;
mod folder;
mod html;
#[cfg(all(feature = "exr", feature = "plots"))]
mod pictures;
mod tables;

pub use folder::{ROWS, StudyFolder, read_rows};
#[cfg(feature = "plots")]
pub use html::study_curves;
pub use html::{MaterialPictures, Media, Picture, html as study_html};
#[cfg(all(feature = "exr", feature = "plots"))]
pub use pictures::Studio;
pub use tables::study_text;
