//! Interpolating cubic spline on the grid in its own coordinates.
//!
//! Tensor product of uniform cubic B-splines whose coefficients solve
//! (c[i−1] + 4 c[i] + c[i+1])/6 = y[i] along every axis, so that the spline passes through every
//! node; fourth order in the spacing. The lattice is continued past its ends first (see
//! [`super::grid`]): through poles and folds the spline is as smooth as inside. The continuation
//! ends naturally (zero second derivative), [`REACH`] nodes away, where it no longer matters: each
//! node damps the influence of what lies beyond by 2 − √3 = 0.27.

use super::grid::{Cells, Continuation, GridInterpolant, Padded, Rule};
use super::lattice_method::{LatticeMethod, LatticeRule};
use super::transform::Transform;
use super::{Interpolant, Readings, ReconstructError};
use nalgebra::{DMatrix, DMatrixView};

/// Nodes the lattice is continued past each end: 0.27^8 = 3e-5 of an end effect is left.
const REACH: usize = 8;

/// Nodes past each end that evaluation needs.
const SUPPORT: usize = 2;

/// Reconstruction by a cubic spline on a grid.
pub type Cubic = LatticeMethod<CubicRule>;

/// The cubic spline as a rule on a lattice.
#[derive(Clone, Copy, Debug)]
pub struct CubicRule;

impl LatticeRule for CubicRule {
    const KIND: &'static str = "cubic";
    const SUMMARY: &'static str = "interpolating cubic spline on the grid, in its own coordinates";

    fn build<const D: usize>(
        readings: &Readings<'_>,
        transform: Transform,
        beyond: Continuation,
    ) -> Result<Box<dyn Interpolant>, ReconstructError> {
        Ok(Box::new(spline::<D>(readings, transform, beyond)?))
    }
}

/// The spline through readings on a grid with `D` axes.
pub(super) fn spline<const D: usize>(
    readings: &Readings<'_>,
    transform: Transform,
    beyond: Continuation,
) -> Result<GridInterpolant<Spline<D>, D>, ReconstructError> {
    let nodes = Padded::<D>::new(CubicRule::KIND, readings, transform, REACH, beyond)?;
    Ok(GridInterpolant::new(
        Spline::new(nodes),
        readings,
        transform,
    ))
}

/// B-spline coefficients on the padded lattice.
pub(super) struct Spline<const D: usize>(Cells<D>);

impl<const D: usize> Spline<D> {
    fn new(mut nodes: Padded<D>) -> Self {
        let strides = nodes.strides();
        for d in 0..D {
            solve_lines(&mut nodes.values, nodes.shape[d], strides[d]);
        }
        Self(Cells::new(nodes.cropped(SUPPORT), 4))
    }

    /// Sums of the values of this spline, a column of weights for each.
    pub(crate) fn combined(&self, weights: &DMatrix<f64>) -> Self {
        let Padded {
            shape,
            pad,
            channels,
            values,
        } = &self.0.table;
        let values = DMatrixView::from_slice(values, *channels, values.len() / channels);
        let combined = Padded {
            shape: *shape,
            pad: *pad,
            channels: weights.ncols(),
            values: weights.tr_mul(&values).data.into(),
        };
        Self(Cells::new(combined, 4))
    }
}

/// Replaces node values by spline coefficients along one axis: lines of `n` values `stride` apart.
fn solve_lines(values: &mut [f64], n: usize, stride: usize) {
    // Elimination factors of the tridiagonal system; natural ends give c = y there.
    let mut factor = vec![0.0; n];
    for i in 1..n - 1 {
        factor[i] = 1.0 / (4.0 - factor[i - 1]);
    }
    // All lines of a block move together: the inner loop runs over memory in order.
    for block in values.chunks_exact_mut(n * stride) {
        for i in 1..n - 1 {
            let (before, here) = block.split_at_mut(i * stride);
            for (y, previous) in here[..stride].iter_mut().zip(&before[(i - 1) * stride..]) {
                *y = (6.0 * *y - previous) * factor[i];
            }
        }
        for i in (1..n - 1).rev() {
            let (here, after) = block.split_at_mut((i + 1) * stride);
            for (c, next) in here[i * stride..].iter_mut().zip(&after[..stride]) {
                *c -= factor[i] * next;
            }
        }
    }
}

/// Weights of the four B-splines around a point, `t` in [0, 1] from the second node.
#[inline(always)]
fn weights(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [
        s * s * s / 6.0,
        (t * t * (3.0 * t - 6.0) + 4.0) / 6.0,
        (s * s * (3.0 * s - 6.0) + 4.0) / 6.0,
        t * t * t / 6.0,
    ]
}

impl<const D: usize> Rule<D> for Spline<D> {
    #[inline(always)]
    fn interpolate(&self, x: &[f64; D], out: &mut [f64]) {
        let Cells { table, strides, .. } = &self.0;
        let (base, t) = self.0.around(x);
        let mut w = [[0.0; 4]; D];
        for d in 0..D {
            w[d] = weights(t[d]);
        }
        out.fill(0.0);
        // Rows along the last axis are contiguous; the other axes count in base 4.
        let row = &w[D - 1];
        let channels = table.channels;
        for line in 0..1usize << (2 * (D - 1)) {
            let mut weight = 1.0;
            let mut at = base;
            for d in 0..D - 1 {
                let tap = line >> (2 * d) & 3;
                weight *= w[d][tap];
                at += tap * strides[d];
            }
            let taps = &table.values[at..at + 4 * channels];
            for (c, out) in out.iter_mut().enumerate() {
                *out += weight
                    * (row[0] * taps[c]
                        + row[1] * taps[channels + c]
                        + row[2] * taps[2 * channels + c]
                        + row[3] * taps[3 * channels + c]);
            }
        }
    }
}
