//! Estimators of the moments of a slice: the trait and its registry.

use super::component::{Moments, Order};
use super::peak::PeakResolving;
use super::sampled::{MonteCarlo, ScrambledSobol};
use super::slice::Slice;
use crate::error::ParameterError;
use crate::registry::{self, Entry, ReadError, Resolved, Table};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Integrates the moments of a slice. A config names one by `kind`.
pub trait Estimator: Resolved + fmt::Debug + Send + Sync {
    /// A short name for tables.
    fn label(&self) -> String;

    /// Checks every parameter.
    ///
    /// # Errors
    /// Names the key, the value and what is allowed.
    fn check(&self) -> Result<(), ParameterError>;

    /// Largest relative uncertainty of an energy, (0, 0.1]; that of the default estimator for
    /// estimators without one.
    fn tolerance(&self) -> f64 {
        PeakResolving::default().tolerance
    }

    /// The moments up to `order`, and nothing of higher orders. `seed` matters to random
    /// estimators only. The result does not depend on the number of threads.
    fn estimate(&self, slice: &Slice<'_>, order: Order, seed: u64) -> SliceMoments;

    /// The moments of a slice of a reconstruction that are compared with those of its `truth`; by default those of
    /// [`estimate`](Self::estimate). An estimator with a tolerance may stop where the uncertainties are small against the differences.
    fn estimate_against(
        &self,
        slice: &Slice<'_>,
        _truth: &Moments,
        order: Order,
        seed: u64,
    ) -> SliceMoments {
        self.estimate(slice, order, seed)
    }
}

/// Moments of a slice, with their reliability and cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SliceMoments {
    /// The moments of the part of the slice that has data.
    pub moments: Moments,
    /// Reason not to trust the uncertainties; `None` if they can be trusted.
    pub unresolved: Option<Unresolved>,
    /// Share of the square (θ, φ) without data, which is left out, in [0, 1].
    pub missing_share: f64,
    /// Share of the square that was below the diffuse part and read as 0, in [0, 1].
    pub clamped_share: f64,
    /// Number of evaluations of the BRDF.
    pub evaluations: usize,
}

/// Reason not to trust the uncertainties of a result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
pub enum Unresolved {
    /// Fewer than `Unresolved::ENOUGH` effective samples carry the result.
    #[error("only {effective:.0} effective samples")]
    FewSamples {
        /// (Σ w)² / Σ w².
        effective: f64,
    },
    /// The value in the mirror direction is more than twice any sampled one.
    #[error("no sample near the mirror direction")]
    PeakUnseen,
    /// The tolerance was not reached within the allowed evaluations.
    #[error("uncertainty {excess:.1} times the tolerance")]
    Tolerance {
        /// The largest uncertainty, in units of the tolerance or, of a slice that is compared, of what is allowed beyond it.
        #[serde(with = "crate::numeric::infinite_as_null")]
        excess: f64,
    },
}

impl Unresolved {
    /// Effective samples from which the uncertainty of a random estimate can be trusted.
    pub(crate) const ENOUGH: f64 = 1000.0;
}

/// Every estimator a config can name.
pub fn all() -> Vec<Entry<dyn Estimator>> {
    vec![
        MonteCarlo::ENTRY,
        ScrambledSobol::ENTRY,
        PeakResolving::ENTRY,
    ]
}

/// Reads an estimator from its config table.
pub fn read(table: Table<'_>) -> Result<Box<dyn Estimator>, ReadError> {
    registry::read("estimator", &all(), table)
}
