//! Output about claims, distortions, subsets and light paths: tables, JSON and pictures.

#[cfg(feature = "pictures")]
mod alignment;
#[cfg(feature = "pictures")]
mod bounces;
mod claims;
mod distortion;
#[cfg(feature = "pictures")]
mod subset;

#[cfg(feature = "pictures")]
pub use alignment::alignment_svg;
#[cfg(feature = "pictures")]
pub use bounces::BouncesReport;
pub use claims::{claims_csv, claims_json, claims_table};
pub use distortion::{
    AlignmentRow, ReductionRow, SharesRow, alignment_table, reduction_table, rows_csv, rows_json,
    shares_table, stretch_table,
};
#[cfg(feature = "pictures")]
pub use subset::SubsetReport;
