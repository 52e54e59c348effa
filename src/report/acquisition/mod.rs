//! Output of an acquisition: the printed tables, the files of rows and findings, and the report.

mod csv;
mod findings;
#[cfg(feature = "pictures")]
mod html;
mod levels;
mod order;
#[cfg(feature = "parquet")]
mod parquet;
mod ranking;
#[cfg(feature = "pictures")]
mod studio;
pub(super) mod table;
mod verdict;

pub use csv::{ranking_csv, results_csv};
pub use findings::{calibration, study_text};
#[cfg(feature = "pictures")]
pub use html::{MaterialPictures, Picture, html as study_html, study_curves, study_timings};
#[cfg(all(feature = "pictures", feature = "stability"))]
pub(crate) use html::{frame, table as html_table};
pub use levels::levels_text;
#[cfg(feature = "parquet")]
pub use parquet::results_parquet;
pub use ranking::{instruments, ranking};
#[cfg(feature = "pictures")]
pub use studio::Studio;
pub use table::{Table, error as error_text};
pub use verdict::verdict_text;
