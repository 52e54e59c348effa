//! What people and programs read after a run: the printed table, the files of a run's folder,
//! pictures of slices.

mod claims;
mod distortion;
mod folder;
mod instruments;
mod lobe;
mod manifest;
mod moment_figures;
mod moment_study;
pub mod pictures;
mod plot;
mod profiles;
mod ranking;
mod relations;
mod results;
#[cfg(feature = "exr")]
mod slice;
#[cfg(feature = "exr")]
mod sphere;
mod study;
mod subset;
#[cfg(feature = "plots")]
mod svg;
mod table;

pub use claims::{claims_csv, claims_json, claims_table};
pub use distortion::{
    ReductionRow, SharesRow, StretchRow, reduction_table, rows_csv, rows_json, shares_table,
    stretch_table,
};
pub use folder::file_stem;
pub use folder::{CONFIG, CORRELATIONS, FITS, RunFolder, SUMMARY, schedule_stem};
pub use instruments::instruments;
#[cfg(feature = "plots")]
pub use lobe::lobe_svg;
pub use lobe::{FlatSlice, Radius};
pub use manifest::{MadeBy, Manifest, Outcome, Status};
pub use moment_figures::{Sheet, group_sheets, material_sheet};
pub use moment_study::{correlations_csv, fits_csv, study_table, summary_json};
pub use plot::{Axis, Forest, ForestGroup, ForestLine, Mark, Panel, Scale, Series};
pub use profiles::{profiles_csv, profiles_json};
pub use ranking::ranking;
pub use relations::{relation_sheets, relations_head, relations_lines, relations_summary};
pub use results::ResultFiles;
#[cfg(feature = "exr")]
pub use slice::{RESOLUTION, THETA_O_DEG, write_slice};
#[cfg(feature = "exr")]
pub use sphere::{FilterEllipse, SphereImage, sphere, sphere_svg};
#[cfg(all(feature = "exr", feature = "plots"))]
pub use study::Studio;
#[cfg(feature = "plots")]
pub use study::study_curves;
pub use study::{
    MaterialPictures, Media, Picture, ROWS, StudyFolder, read_rows, study_html, study_text,
};
pub use subset::SubsetReport;
#[cfg(feature = "plots")]
pub use svg::{forest_svg, labelled, svg};
pub use table::Table;
