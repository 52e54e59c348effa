//! Output of a run: the printed tables, the files of a run's folder, diagrams and pictures.

mod acquisition;
mod analysis;
mod columns;
pub(crate) mod csv;
mod moments;
#[cfg(feature = "pictures")]
pub mod pictures;
mod run;
pub(crate) mod schema;
#[cfg(feature = "stability")]
mod stability;
#[cfg(feature = "pictures")]
mod svg;

#[cfg(feature = "parquet")]
pub use acquisition::results_parquet;
pub use acquisition::{
    RANKING_COLUMNS, Table, calibration, error_text, instruments, ranking, ranking_csv,
    results_csv, study_text,
};
pub use analysis::{
    AlignmentRow, ReductionRow, SharesRow, StretchRow, alignment_table, claims_csv, claims_json,
    claims_table, reduction_table, rows_csv, rows_json, shares_table, stretch_table,
};
pub use columns::Columns;
pub use moments::{
    CORRELATION_COLUMNS, FIT_COLUMNS, PROFILE_COLUMNS, RELATION_COLUMNS, correlations_csv,
    fits_csv, profile_columns, profile_objects, profiles_csv, profiles_json, relations_csv,
    relations_head, relations_lines, relations_summary, study_table, summary_json,
};
pub use run::{
    Below, CONFIG, CORRELATIONS, FITS, Machine, MadeFrom, Manifest, Outcome, PARQUET, PROFILES,
    RANKING, RELATIONS, REPORT, RESULTS, RunFolder, SUMMARY, Status, TIMES, file_stem, read_rows,
    schedule_stem, slice_name,
};

#[cfg(all(feature = "stability", feature = "pictures"))]
pub(crate) use stability::stability_html;
#[cfg(feature = "stability")]
pub use stability::{broken, stability_table};

#[cfg(feature = "pictures")]
pub use acquisition::{MaterialPictures, Picture, Studio, study_curves, study_html, study_timings};
#[cfg(feature = "pictures")]
pub use analysis::{BouncesReport, SubsetReport, alignment_svg};
#[cfg(feature = "pictures")]
pub use moments::{Sheet, group_sheets, material_sheet, relation_sheets};
#[cfg(feature = "pictures")]
pub use pictures::{
    FilterEllipse, FlatSlice, RESOLUTION, Radius, SphereImage, THETA_O_DEG, slice_svg, sphere_svg,
    write_slice,
};
#[cfg(feature = "pictures")]
pub use svg::plot::{Axis, Forest, ForestGroup, ForestLine, Mark, Panel, Scale, Series};
#[cfg(feature = "pictures")]
pub use svg::{forest_svg, labelled, svg};

use std::fmt::Display;

/// Items, each once, in the order of their first appearance.
pub(crate) fn each_once<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut list = Vec::new();
    for item in items {
        if !list.contains(&item) {
            list.push(item);
        }
    }
    list
}

/// What writing to memory gives: memory takes every byte, and what is written there has a form for every value.
pub(crate) fn in_memory<T, E: Display>(written: Result<T, E>) -> T {
    written.unwrap_or_else(|e| unreachable!("memory takes every byte: {e}"))
}
