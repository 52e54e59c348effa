//! The errors that findings compare.

use crate::experiment::row::Row;

/// The error that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// `nrmse`.
    Nrmse,
    /// `log_relative`.
    LogRelative,
}

impl Metric {
    /// Those of a report.
    pub const ALL: [Metric; 2] = [Metric::Nrmse, Metric::LogRelative];

    /// Its column.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Nrmse => "nrmse",
            Metric::LogRelative => "log_relative",
        }
    }

    pub(super) fn of(self, row: &Row) -> Option<f64> {
        row.value(self.name())
    }
}
