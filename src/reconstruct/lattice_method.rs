//! Keys of a config for an interpolation on the grid in its own coordinates: equal for every rule.

use super::grid::Continuation;
use super::transform::{EPSILON, Transform, Values};
use super::{Interpolant, Readings, Reconstruct, ReconstructError};
use crate::error::ParameterError;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::marker::PhantomData;

/// A rule on a lattice, as a kind of reconstruction.
pub trait LatticeRule: Debug + Clone + Send + Sync + 'static {
    /// The `kind` a config writes.
    const KIND: &'static str;
    /// One-line description for lists.
    const SUMMARY: &'static str;

    /// The interpolant of this rule through readings on a grid with `D` axes.
    ///
    /// # Errors
    /// If the readings lie on no grid, or there is none.
    fn build<const D: usize>(
        readings: &Readings<'_>,
        transform: Transform,
        beyond: Continuation,
    ) -> Result<Box<dyn Interpolant>, ReconstructError>;
}

fn is_default(beyond: &Continuation) -> bool {
    *beyond == Continuation::default()
}

/// Interpolation on a grid by the rule `R`, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "")]
pub struct LatticeMethod<R> {
    /// Function of f_r that is interpolated.
    pub values: Values,
    /// Offset of the logarithm, sr⁻¹.
    pub epsilon: f64,
    /// What stands at nodes without a reading.
    #[serde(skip_serializing_if = "is_default")]
    pub beyond: Continuation,
    #[serde(skip)]
    rule: PhantomData<fn() -> R>,
}

impl<R> Default for LatticeMethod<R> {
    fn default() -> Self {
        Self {
            values: Values::Log,
            epsilon: EPSILON,
            beyond: Continuation::default(),
            rule: PhantomData,
        }
    }
}

impl<R: LatticeRule> LatticeMethod<R> {
    /// The registry entry.
    pub(super) const ENTRY: Entry<dyn Reconstruct> = Entry {
        kind: R::KIND,
        summary: R::SUMMARY,
        examples: &[
            "values = \"log\"\nepsilon = 1e-3",
            "values = \"linear\"\nbeyond = \"copy\"",
        ],
        read: |table| Ok(Box::new(registry::parse::<Self>(table)?)),
    };
}

impl<R: LatticeRule> Reconstruct for LatticeMethod<R> {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(R::KIND, self)
    }

    fn label(&self) -> String {
        super::label(R::KIND, self.values, false, None)
    }

    fn needs_grid(&self) -> bool {
        true
    }

    fn check(&self) -> Result<(), ParameterError> {
        self.values.check(self.epsilon)
    }

    fn interpolate(
        &self,
        readings: &Readings<'_>,
    ) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        let transform = self.values.with(self.epsilon);
        match readings.schedule.parametrization.axes().len() {
            3 => R::build::<3>(readings, transform, self.beyond),
            _ => R::build::<4>(readings, transform, self.beyond),
        }
    }
}
