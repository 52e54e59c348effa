//! Output about moments: tables and diagrams of profiles, fits and relations.

#[cfg(feature = "pictures")]
mod figures;
mod maps;
mod profiles;
mod relations;
mod tables;

#[cfg(feature = "pictures")]
pub use figures::{Sheet, group_sheets, material_sheet, relation_sheets};
pub use profiles::{profile_objects, profiles_csv, profiles_json};
pub use relations::{
    relation_objects, relations_csv, relations_head, relations_lines, relations_summary,
};
pub use tables::{correlations_csv, fits_csv, study_table, summary_json};
