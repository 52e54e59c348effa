//! Multilinear interpolation on the grid in its own coordinates.
//!
//! Between the 2^d nodes around a point; second order in the spacing. Cells that straddle the
//! horizon: see [`super::grid`].

use super::grid::{Cells, Continuation, GridInterpolant, Padded, Rule};
use super::lattice_method::{LatticeMethod, LatticeRule};
use super::transform::Transform;
use super::{Interpolant, Readings, ReconstructError};

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
