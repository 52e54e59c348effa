//! Interpolation on the grid in its own coordinates: the keys of a config, equal for every rule, and the multilinear rule,
//! between the 2^d nodes around a point; second order in the spacing. Cells that straddle the horizon: see [`super::grid`].

use super::grid::{Cells, Continuation, GridInterpolant, Padded, Rule};
use super::transform::{EPSILON, Transform, Values};
use super::{Interpolant, Readings, Reconstruct, ReconstructError};
use crate::error::ParameterError;
use crate::registry::{self, Entry, Resolved};
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

impl<R: LatticeRule> Resolved for LatticeMethod<R> {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(R::KIND, self)
    }
}

impl<R: LatticeRule> Reconstruct for LatticeMethod<R> {
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

/// Reconstruction by multilinear interpolation on a grid.
pub type Multilinear = LatticeMethod<MultilinearRule>;

/// Multilinear interpolation as a rule on a lattice.
#[derive(Clone, Copy, Debug)]
pub struct MultilinearRule;

impl LatticeRule for MultilinearRule {
    const KIND: &'static str = "multilinear";
    const SUMMARY: &'static str = "multilinear on the grid, in its own coordinates";

    fn build<const D: usize>(
        readings: &Readings<'_>,
        transform: Transform,
        beyond: Continuation,
    ) -> Result<Box<dyn Interpolant>, ReconstructError> {
        let nodes = Padded::<D>::new(Self::KIND, readings, transform, 2, beyond)?;
        let rule = Linear(Cells::new(nodes.cropped(1), 2));
        Ok(Box::new(GridInterpolant::new(rule, readings, transform)))
    }
}

/// Node values on a lattice padded by one node past each end.
struct Linear<const D: usize>(Cells<D>);

impl<const D: usize> Rule<D> for Linear<D> {
    #[inline(always)]
    fn interpolate(&self, x: &[f64; D], out: &mut [f64]) {
        let Cells { table, strides, .. } = &self.0;
        let (base, t) = self.0.around(x);
        out.fill(0.0);
        for corner in 0..1usize << D {
            let mut weight = 1.0;
            let mut at = base;
            for d in 0..D {
                if corner >> d & 1 == 1 {
                    weight *= t[d];
                    at += strides[d];
                } else {
                    weight *= 1.0 - t[d];
                }
            }
            for (c, out) in out.iter_mut().enumerate() {
                *out += weight * table.values[at + c];
            }
        }
    }
}
