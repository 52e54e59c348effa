//! Output of an acquisition: the printed tables, the files of rows and findings, and the report.

mod calibration;
mod csv;
mod findings;
#[cfg(feature = "pictures")]
mod html;
mod instruments;
mod order;
#[cfg(feature = "parquet")]
mod parquet;
mod ranking;
#[cfg(feature = "pictures")]
mod studio;
pub(super) mod table;

pub use calibration::calibration;
pub use csv::{RANKING_COLUMNS, ranking_csv, results_csv};
pub use findings::study_text;
#[cfg(feature = "pictures")]
pub use html::{MaterialPictures, Picture, html as study_html, study_curves, study_timings};
#[cfg(all(feature = "pictures", feature = "stability"))]
pub(crate) use html::{frame, table as html_table};
pub use instruments::instruments;
#[cfg(feature = "parquet")]
pub use parquet::results_parquet;
pub use ranking::ranking;
#[cfg(feature = "pictures")]
pub use studio::Studio;
pub use table::{Table, error as error_text};
