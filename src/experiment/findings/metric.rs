//! The errors that findings compare.

use crate::error::{ParameterError, one_of};
use crate::experiment::row::Row;
use crate::metrics::{Errors, Expected};
use crate::moments::{MomentErrors, VIEW_BANDS};

/// An error metric that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// `nrmse`.
    Nrmse,
    /// `log_relative`.
    LogRelative,
    /// An error of the moments of slices: positions of its band of views and of itself in [`MomentErrors::QUANTITIES`].
    Moment(usize, usize),
}

impl Metric {
    /// Those of test pairs, which every row has.
    pub const OF_PAIRS: [Self; 2] = [Self::Nrmse, Self::LogRelative];

    /// All of them, in their order: of moments first those over all views.
    pub const ALL: [Self; 2 + VIEW_BANDS.len() * MomentErrors::COUNT] = {
        let mut all = [Self::Nrmse; 2 + VIEW_BANDS.len() * MomentErrors::COUNT];
        all[1] = Self::LogRelative;
        let mut i = 2;
        while i < all.len() {
            let of_moment = i - 2;
            all[i] = Self::Moment(
                of_moment / MomentErrors::COUNT,
                of_moment % MomentErrors::COUNT,
            );
            i += 1;
        }
        all
    };

    /// The name of its column.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nrmse => "nrmse",
            Self::LogRelative => "log_relative",
            Self::Moment(band, of) => MomentErrors::QUANTITIES[band][of].0.name,
        }
    }

    /// True if it is an error of the moments of slices, which is the same for all measures.
    pub fn is_of_moments(self) -> bool {
        matches!(self, Self::Moment(..))
    }

    /// True unless it is of a part of the views.
    pub fn is_of_all_views(self) -> bool {
        !matches!(self, Self::Moment(1.., _))
    }

    /// The error that readings are counted until, of moments; `None` of others.
    pub fn level(self) -> Option<f64> {
        match self {
            Self::Moment(_, of) => MomentErrors::LEVELS[of],
            _ => None,
        }
    }

    /// True if it stands among the findings of some rows: an error of test pairs always, one of moments if a row has it.
    pub fn is_asked(self, rows: &[&Row]) -> bool {
        !self.is_of_moments() || rows.iter().any(|r| self.error(r).is_some())
    }

    /// The metric of test pairs of a name.
    ///
    /// # Errors
    /// If none has it.
    pub fn named(name: &str) -> Result<Self, ParameterError> {
        let found = Self::OF_PAIRS.into_iter().find(|m| m.name() == name);
        let names = Self::OF_PAIRS.map(Self::name);
        found.ok_or_else(|| ParameterError::new("metric", name, one_of(name, names)))
    }

    pub(super) fn expected_error(self, expected: &Expected) -> Option<f64> {
        match self {
            Metric::Nrmse => expected.nrmse,
            Metric::LogRelative => expected.log_relative,
            _ => None,
        }
    }

    pub(in crate::experiment) fn error(self, row: &Row) -> Option<f64> {
        row.value(self.name())
    }

    /// Its standard error as a share of it, 0 if there is none: of the choice of test pairs, and of the truth's paths.
    pub(super) fn relative_error(self, row: &Row) -> f64 {
        let standard = Errors::STANDARD_ERRORS.iter().zip(Errors::QUANTITIES);
        let mut of = standard.filter(|(_, (quantity, _))| quantity.name == self.name());
        let standard = of.next().map(|((standard, _), _)| standard.name);
        let standard = standard.and_then(|name| row.value(name));
        let share = |part: Option<f64>| {
            let share = part.zip(self.error(row)).map(|(part, error)| part / error);
            share.filter(|share| share.is_finite()).unwrap_or(0.0)
        };
        // Of √(e² + t²) what e leaves.
        let of_truth = share(self.truth_error(row)).powi(2);
        share(standard).hypot(1.0 - (1.0 - of_truth).max(0.0).sqrt())
    }

    /// The error of the truth that is in it, [`crate::metrics::TruthErrors`].
    pub(crate) fn truth_error(self, row: &Row) -> Option<f64> {
        match self {
            Metric::Nrmse => row.value("truth_nrmse"),
            Metric::LogRelative => row.value("truth_log_relative"),
            _ => None,
        }
    }
}
