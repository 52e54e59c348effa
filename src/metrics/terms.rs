//! What errors are averages of, of many pairs at a time: the same bits on every machine.

use super::histogram::Histogram;
use super::sum::Sum;
use super::{Errors, Values};
use crate::geometry::BLOCK;
use crate::numeric::powers::{cbrt, ln, ln_1p};

/// ε (sr⁻¹): the floor of the relative metrics, a third of a percent of a white diffuse surface.
pub(super) const FLOOR: f64 = 1e-3;

/// Numbers of a pair that are averaged.
pub(super) const TERMS: usize = 8;

/// Number of the relative error among the terms.
const RELATIVE: usize = 5;

/// Weighted sums: of the weights, then of the terms in the order of [`terms`].
pub(super) type Sums = [Sum; 1 + TERMS];

/// ((g − f) cos)², (f cos)², (Δ (f cos)^(1/3))², |Δ ln(f + ε)|, |Δ ln(1 + f cos)|, relative error, g − f, f.
#[inline(always)]
fn terms(f: f64, g: f64, cos: f64) -> [f64; TERMS] {
    let (f_cos, g_cos, difference) = (f * cos, g * cos, g - f);
    let root = cbrt(g_cos) - cbrt(f_cos);
    [
        (difference * cos) * (difference * cos),
        f_cos * f_cos,
        root * root,
        ln((g + FLOOR) / (f + FLOOR)).abs(),
        // One logarithm instead of two, and no cancellation where g is close to f.
        ln_1p(difference * cos / (1.0 + f_cos)).abs(),
        difference.abs() / f.max(FLOOR),
        difference,
        f,
    ]
}

/// Errors that are averages over pairs; the last error is a quantile.
pub(super) const AVERAGES: usize = Errors::QUANTITIES.len() - 1;

/// The number of `energy` among the averages.
pub(super) const ENERGY: usize = AVERAGES - 1;

/// The averages by sums of weights and of the [`terms`], in the order of [`Errors::QUANTITIES`].
pub(super) fn averages(sums: [f64; 1 + TERMS]) -> [Option<f64>; AVERAGES] {
    let [
        weight,
        difference2,
        truth2,
        root2,
        log,
        log_1p,
        relative,
        gain,
        energy,
    ] = sums;
    let mean = |sum: f64| defined(sum / weight);
    [
        defined((difference2 / truth2).sqrt()),
        mean(log),
        mean(log_1p),
        mean(root2).map(f64::sqrt),
        mean(relative),
        defined(gain / energy),
    ]
}

/// The number; `None` for 0/0, x/0 and overflow.
pub(super) fn defined(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// A pair: its numbers in the truth and in the reconstruction, and cos θ_i.
pub(super) struct Pair {
    pub truth: usize,
    pub reconstruction: usize,
    pub cos: f64,
}

/// The pairs of a block that have both values; in place of the others zeros, which add nothing.
pub(super) struct Block {
    f: [f64; BLOCK],
    g: [f64; BLOCK],
    cos: [f64; BLOCK],
    /// 1 of those that are compared, else 0.
    known: [f64; BLOCK],
    /// Steps of the relative errors.
    pub steps: [u64; BLOCK],
    /// Pairs that are compared; those without a truth; those that have one, and no reconstruction.
    pub counts: [usize; 3],
}

impl Block {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        let none = [0.0; BLOCK];
        Self {
            f: none,
            g: none,
            cos: none,
            known: none,
            steps: [0; BLOCK],
            counts: [0; 3],
        }
    }

    /// Takes up a pair at place `j`.
    #[inline(always)]
    pub(crate) fn take(&mut self, j: usize, pair: &Pair, truth: &Values, reconstruction: &Values) {
        let Some(f) = truth.get(pair.truth) else {
            self.counts[1] += 1;
            return;
        };
        let Some(g) = reconstruction.get(pair.reconstruction) else {
            self.counts[2] += 1;
            return;
        };
        self.counts[0] += 1;
        (self.f[j], self.g[j], self.cos[j]) = (f, g, pair.cos);
        self.known[j] = 1.0;
    }
}

/// Adds the terms of a block to sums, one for each list of weights of its pairs; weights of what is not compared become 0.
#[inline(always)]
pub(super) fn add(block: &mut Block, weights: &mut [[f64; BLOCK]], sums: &mut [Sums]) {
    let mut of = [[0.0; BLOCK]; TERMS];
    {
        let [a, b, c, d, e, relative, g, h] = &mut of;
        for j in 0..BLOCK {
            [a[j], b[j], c[j], d[j], e[j], relative[j], g[j], h[j]] =
                terms(block.f[j], block.g[j], block.cos[j]);
        }
    }
    for (step, x) in block.steps.iter_mut().zip(&of[RELATIVE]) {
        *step = Histogram::step(*x);
    }
    for (weights, sums) in weights.iter_mut().zip(sums) {
        for (weight, known) in weights.iter_mut().zip(&block.known) {
            *weight *= known;
        }
        sums[0].add(sum(weights, &[1.0; BLOCK]));
        for (total, of) in sums[1..].iter_mut().zip(&of) {
            total.add(sum(weights, of));
        }
    }
}

/// Σ weight · term, in eight sums side by side whatever the machine.
#[inline(always)]
fn sum(weights: &[f64; BLOCK], terms: &[f64; BLOCK]) -> f64 {
    const SIDE: usize = 8;
    let mut sums = [0.0; SIDE];
    for (w, t) in weights.chunks_exact(SIDE).zip(terms.chunks_exact(SIDE)) {
        for k in 0..SIDE {
            sums[k] += w[k] * t[k];
        }
    }
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}
