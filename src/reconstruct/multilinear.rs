//! Multilinear interpolation on the grid in its own coordinates.
//!
//! Between the 2^d nodes around a point; second order in the spacing. Cells that straddle the
//! horizon: see [`super::grid`].

use super::grid::{Continuation, GridInterpolant, Padded, Rule};
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
        let rule = Linear::new(nodes.cropped(1));
        Ok(Box::new(GridInterpolant::new(
            rule,
            readings.schedule,
            transform,
            readings.width,
        )))
    }
}

/// Node values on a lattice padded by one node past each end.
struct Linear<const D: usize> {
    table: Padded<D>,
    strides: [usize; D],
    last: [f64; D],
}

impl<const D: usize> Linear<D> {
    fn new(table: Padded<D>) -> Self {
        let strides = table.strides();
        // Largest padded index a cell may start at.
        let last = table.shape.map(|n| (n - 2) as f64);
        Self {
            table,
            strides,
            last,
        }
    }
}

impl<const D: usize> Rule<D> for Linear<D> {
    #[inline(always)]
    fn interpolate(&self, x: &[f64; D], out: &mut [f64]) {
        let mut base = 0;
        let mut t = [0.0; D];
        for d in 0..D {
            let padded = x[d] + self.table.pad as f64;
            let cell = padded.floor().clamp(0.0, self.last[d]);
            t[d] = padded - cell;
            base += cell as usize * self.strides[d];
        }
        out.fill(0.0);
        for corner in 0..1usize << D {
            let mut weight = 1.0;
            let mut at = base;
            for d in 0..D {
                if corner >> d & 1 == 1 {
                    weight *= t[d];
                    at += self.strides[d];
                } else {
                    weight *= 1.0 - t[d];
                }
            }
            for (c, out) in out.iter_mut().enumerate() {
                *out += weight * self.table.values[at + c];
            }
        }
    }
}
