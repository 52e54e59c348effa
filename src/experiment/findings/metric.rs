//! The errors that findings compare.

use crate::experiment::row::Row;

/// An error metric that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// `nrmse`.
    Nrmse,
    /// `log_relative`.
    LogRelative,
}

impl Metric {
    /// Every metric, in the order of reports.
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
