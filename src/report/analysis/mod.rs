//! Output about claims, distortions and subsets: tables, JSON and pictures.

#[cfg(feature = "pictures")]
mod alignment;
mod claims;
mod distortion;
#[cfg(feature = "pictures")]
mod subset;

#[cfg(feature = "pictures")]
pub use alignment::alignment_svg;
pub use claims::{claims_csv, claims_json, claims_table};
pub use distortion::{
    AlignmentRow, ReductionRow, SharesRow, StretchRow, alignment_table, reduction_table, rows_csv,
    rows_json, shares_table, stretch_table,
};
#[cfg(feature = "pictures")]
pub use subset::SubsetReport;
