//! The errors that findings compare.

use crate::error::{ParameterError, one_of};
use crate::experiment::row::Row;
use crate::metrics::{Errors, Expected};
use crate::registry::named;

named! {
    /// An error metric that is compared.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Metric {
        /// `nrmse`.
        Nrmse = "nrmse",
        /// `log_relative`.
        LogRelative = "log_relative",
    }
}

impl Metric {
    /// The metric of a name.
    ///
    /// # Errors
    /// If none has it.
    pub fn named(name: &str) -> Result<Self, ParameterError> {
        let found = Self::ALL.into_iter().find(|m| m.name() == name);
        let names = Self::ALL.map(Self::name);
        found.ok_or_else(|| ParameterError::new("metric", name, one_of(name, names)))
    }

    pub(super) fn expected_error(self, expected: &Expected) -> Option<f64> {
        match self {
            Metric::Nrmse => expected.nrmse,
            Metric::LogRelative => expected.log_relative,
        }
    }

    pub(super) fn error(self, row: &Row) -> Option<f64> {
        row.value(self.name())
    }

    /// Its standard error as a share of it, 0 if there is none: of the choice of test pairs, and of the truth's paths.
    pub(super) fn relative_error(self, row: &Row) -> f64 {
        let standard = Errors::STANDARD_ERRORS.iter().zip(Errors::QUANTITIES);
        let mut of = standard.filter(|(_, (quantity, _))| quantity.name == self.name());
        let standard = of
            .next()
            .and_then(|((standard, _), _)| row.value(standard.name));
        let share = standard.zip(self.error(row)).map(|(se, error)| se / error);
        let share = share.filter(|share| share.is_finite()).unwrap_or(0.0);
        share.hypot(self.share_of_truth(row))
    }

    /// The error of the truth that is in it, [`crate::metrics::TruthErrors`].
    pub(crate) fn truth_error(self, row: &Row) -> Option<f64> {
        row.value(match self {
            Metric::Nrmse => "truth_nrmse",
            Metric::LogRelative => "truth_log_relative",
        })
    }

    /// The part of it that the error of the truth may be: of √(e² + t²) what e leaves.
    fn share_of_truth(self, row: &Row) -> f64 {
        let both = self.truth_error(row).zip(self.error(row));
        let share = both.map(|(truth, error)| truth / error);
        let share = share.filter(|share| share.is_finite()).unwrap_or(0.0);
        1.0 - (1.0 - share * share).max(0.0).sqrt()
    }
}
