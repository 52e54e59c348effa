//! The covariance of ln f at two pairs: a sum of Matérn-3/2 functions, each of one to four columns.
//!
//! Columns of a pair are functions that reciprocity and the mirrors of the material do not change: with θ_h, θ_d in
//! degrees, u1 = √(θ_h/90), v = ln(1 + θ_h/0.7)/ln(1 + 90/0.7), u2 = θ_d/90, u3 = u1 sin θ_d cos 2φ_d,
//! g = ½ ln(cos θ_i cos θ_o), q = |cos θ_i − cos θ_o|. Where the material is not isotropic, with φ_k = φ_h + φ_d:
//! a = v cos φ_h, b = v sin φ_h, c = u2 cos 2φ_k, d = u2 sin 2φ_k, or for bilateral ones |a|, |b|, c and
//! u1 d sin 2φ_h. Where it is isotropic and not bilateral d = u1 sin θ_d sin 2φ_d. [`Space`](super::space::Space) has those of other
//! coordinates.
//!
//! Everything is evaluated for [`LANES`] readings at a time, with the same bits on every processor: no sum
//! depends on its width, and the exponential is our own. Products are added in one rounding (fused), which a processor
//! without that instruction does by a slow function.

use crate::geometry::{DirectionPair, Symmetry};
use crate::parametrization::{Form, HalfDifference, Parametrization};
use std::array::from_fn;

/// Readings that are evaluated together.
pub(super) const LANES: usize = 16;

/// Columns of a pair.
pub(super) const COLUMNS: usize = 14;

/// The columns of a pair: u1, v, u2, u3, g, q, a, b, c, d, and those of chosen coordinates: r₁, r₂, e, f.
pub(super) type Columns = [f64; COLUMNS];

pub(super) const U1: usize = 0;
const V: usize = 1;
pub(super) const U2: usize = 2;
pub(super) const U3: usize = 3;
const G: usize = 4;
const Q: usize = 5;
pub(super) const A: usize = 6;
pub(super) const B: usize = 7;
pub(super) const C: usize = 8;
pub(super) const D: usize = 9;
pub(super) const P: usize = 10;
pub(super) const R: usize = 11;
pub(super) const E: usize = 12;
pub(super) const F: usize = 13;

/// Cosines below this count as it: ln cos has no end at the horizon.
const LEAST_COSINE: f64 = 0.01;

/// The lesser cosine of the two elevations of a pair, from its columns.
pub(super) fn least_cosine(x: &Columns) -> f64 {
    // Their difference is q, their product e^(2 g).
    0.5 * ((x[Q] * x[Q] + 4.0 * (2.0 * x[G]).exp()).sqrt() - x[Q])
}

/// The columns of pairs without a choice of coordinates.
pub(super) fn usual_columns(pairs: &[DirectionPair], symmetry: Symmetry) -> Vec<Columns> {
    let form = Form::<HalfDifference>::new(Symmetry::NONE);
    let mut coords = vec![[0.0; 4]; pairs.len()];
    form.forward_batch(pairs, &mut coords);
    let log = |theta_h: f64| (1.0 + theta_h / 0.7).ln() / (1.0 + 90.0 / 0.7_f64).ln();
    let of = |(pair, [theta_h, phi_h, theta_d, phi_d]): (&DirectionPair, [f64; 4])| {
        let degrees = theta_h.to_degrees();
        let (u1, v, u2) = (
            (degrees / 90.0).sqrt(),
            log(degrees),
            theta_d.to_degrees() / 90.0,
        );
        let cosine = [pair.omega_i, pair.omega_o].map(|d| d.cos_theta());
        let [i, o] = cosine.map(|c| c.max(LEAST_COSINE));
        let turned = u1 * theta_d.sin();
        let u3 = turned * (2.0 * phi_d).cos();
        let of_back = 2.0 * (phi_h + phi_d);
        let [a, b, c, d] = match (symmetry.isotropic, symmetry.bilateral) {
            (true, true) => [0.0; 4],
            (true, false) => [0.0, 0.0, 0.0, turned * (2.0 * phi_d).sin()],
            (false, bilateral) => {
                let (a, b) = (v * phi_h.cos(), v * phi_h.sin());
                let (c, d) = (u2 * of_back.cos(), u2 * of_back.sin());
                match bilateral {
                    true => [a.abs(), b.abs(), c, u1 * d * (2.0 * phi_h).sin()],
                    false => [a, b, c, d],
                }
            }
        };
        let g = 0.5 * (i * o).ln();
        let q = (cosine[0] - cosine[1]).abs();
        [u1, v, u2, u3, g, q, a, b, c, d, 0.0, 0.0, 0.0, 0.0]
    };
    pairs.iter().zip(coords).map(of).collect()
}

/// A term of the sum: a (1 + r) e^(−r), r² = 3 Σ δ²/l² over its columns.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Term {
    /// Variance a of ln f.
    pub amplitude: f64,
    /// Columns, each with its length l.
    pub lengths: Vec<(usize, f64)>,
}

/// Variance of the level of ln f of a material of which nothing is known.
const LEVEL: f64 = 25.0;

/// A sum of terms, about a mean that varies too.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Kernel {
    pub terms: Vec<Term>,
    /// Variance of the level of ln f.
    pub level: f64,
    /// Variance of the coefficients of the functions of a prior; 0 where there is none.
    pub share: f64,
    /// Variance of ln f of a reading beyond what it states, see [`fit`](super::fit).
    pub unsaid: f64,
}

impl Kernel {
    /// Fitted to 82 materials of the MERL database (R, G, B and luminance of tables made from published
    /// neural fits) by their likelihood; terms of a, b, c and d are chosen like those of v and u3. What `gonio train --kernel` finds from 61
    /// of them, from here on, is `default` in `kernels.json`.
    pub(crate) fn new(symmetry: Symmetry) -> Self {
        let term = |amplitude: f64, lengths: &[(usize, f64)]| Term {
            amplitude,
            lengths: lengths.to_vec(),
        };
        let mut terms = vec![
            term(0.0841, &[(U1, 1.94)]),
            term(29.8, &[(V, 2.56)]),
            term(0.0612, &[(U2, 1.98)]),
            term(0.0733, &[(G, 2.83)]),
            term(0.0332, &[(U1, 4.11), (U2, 1.17)]),
            term(0.0125, &[(V, 0.16), (U2, 0.68)]),
            term(0.0166, &[(U1, 2.41), (U2, 1.89), (U3, 2.46)]),
            term(0.133, &[(V, 0.56), (U2, 1.99), (U3, 2.44)]),
            term(19.4, &[(U1, 1.75), (U2, 62.69), (U3, 25.83), (G, 5.41)]),
            term(0.0465, &[(U2, 4.16), (U3, 3.48), (G, 1.69), (Q, 2.22)]),
        ];
        if !symmetry.isotropic {
            terms.push(term(29.8, &[(A, 2.56), (B, 2.56)]));
            terms.push(term(0.133, &[(A, 0.56), (B, 0.56), (U2, 1.99)]));
            terms.push(term(0.133, &[(A, 0.56), (B, 0.56), (C, 2.0), (D, 2.0)]));
        } else if !symmetry.bilateral {
            terms.push(term(0.0166, &[(U1, 2.41), (U2, 1.89), (D, 2.46)]));
        }
        Self::of_terms(terms)
    }

    /// Of some terms, without a prior.
    pub(super) fn of_terms(terms: Vec<Term>) -> Self {
        Self {
            terms,
            level: LEVEL,
            share: 0.0,
            unsaid: 0.0,
        }
    }

    /// The kernel about a prior: of what its functions leave, `scale` times the amplitudes.
    pub(crate) fn about(mut self, scale: f64, level: f64, share: f64) -> Self {
        for term in &mut self.terms {
            term.amplitude *= scale;
        }
        Self {
            level,
            share,
            ..self
        }
    }

    /// The logarithms of all amplitudes and lengths, term by term, then that of the share, if there is one.
    pub(crate) fn logs(&self) -> Vec<f64> {
        let of = |t: &Term| {
            let lengths = t.lengths.iter().map(|(_, l)| l.ln());
            std::iter::once(t.amplitude.ln())
                .chain(lengths)
                .collect::<Vec<_>>()
        };
        let share = (self.share > 0.0).then(|| self.share.ln());
        self.terms.iter().flat_map(of).chain(share).collect()
    }

    /// This kernel with other amplitudes, lengths and share, as [`logs`](Self::logs) lists them.
    pub(crate) fn with_logs(&self, logs: &[f64]) -> Self {
        let mut logs = logs.iter().map(|x| x.exp());
        let mut next = || logs.next().unwrap_or(1.0);
        let terms = self.terms.iter().map(|t| Term {
            amplitude: next(),
            lengths: t.lengths.iter().map(|(c, _)| (*c, next())).collect(),
        });
        let terms = terms.collect();
        Self {
            terms,
            level: self.level,
            share: if self.share > 0.0 { next() } else { 0.0 },
            unsaid: self.unsaid,
        }
    }

    /// The variance of ln f that the terms add up to.
    pub(crate) fn amplitude(&self) -> f64 {
        self.terms.iter().map(|t| t.amplitude).sum()
    }

    /// What a way along each column counts where the nearest of readings are looked for: (Σ a/l³)^(1/3), since the variance that
    /// dense readings leave is proportional to a/l³ (the spectral density of a term at high frequencies).
    pub(crate) fn reach(&self) -> Columns {
        let mut sums = [0.0; COLUMNS];
        for term in &self.terms {
            for &(c, l) in &term.lengths {
                sums[c] += term.amplitude / (l * l * l);
            }
        }
        sums.map(f64::cbrt)
    }

    /// The terms as weights 3/l² of all columns.
    pub(crate) fn flat(&self) -> Vec<Flat> {
        let weight = |(c, l): &(usize, f64)| (*c, 3.0 / (l * l));
        let of = |t: &Term| Flat {
            amplitude: t.amplitude,
            weights: t.lengths.iter().map(weight).collect(),
        };
        self.terms.iter().map(of).collect()
    }
}

/// A term with the weights of its columns.
#[derive(Clone)]
pub(super) struct Flat {
    pub amplitude: f64,
    pub weights: Vec<(usize, f64)>,
}

/// Columns of [`LANES`] readings, column by column.
pub(super) type Block = [[f64; LANES]; COLUMNS];

/// Columns in blocks; the last one is filled with its last reading.
pub(super) fn blocks(columns: &[Columns]) -> Vec<Block> {
    let of = |chunk: &[Columns]| from_fn(|c| from_fn(|i| chunk[i.min(chunk.len() - 1)][c]));
    columns.chunks(LANES).map(of).collect()
}

/// The squares of the differences between a pair and a block in a column.
#[inline(always)]
fn squares(x: &Columns, block: &Block, c: usize) -> [f64; LANES] {
    let mut squares = [0.0; LANES];
    for i in 0..LANES {
        let off = block[c][i] - x[c];
        squares[i] = off * off;
    }
    squares
}

/// r² of a term.
#[inline(always)]
fn square_radius(term: &Flat, x: &Columns, block: &Block) -> [f64; LANES] {
    let mut sum = [0.0; LANES];
    for &(c, w) in &term.weights {
        let squares = squares(x, block, c);
        for i in 0..LANES {
            sum[i] = w.mul_add(squares[i], sum[i]);
        }
    }
    sum
}

/// The covariances of a pair with a block.
#[inline(always)]
pub(super) fn covariance(terms: &[Flat], x: &Columns, block: &Block) -> [f64; LANES] {
    let mut sum = [0.0; LANES];
    for term in terms {
        let r2 = square_radius(term, x, block);
        for i in 0..LANES {
            let r = r2[i].sqrt();
            sum[i] = term.amplitude.mul_add((1.0 + r) * decay(r), sum[i]);
        }
    }
    sum
}

/// Adds the derivatives of `Σ weight · covariance` by [`Kernel::logs`] to `out`.
#[inline(always)]
pub(super) fn add_derivatives(
    terms: &[Flat],
    x: &Columns,
    block: &Block,
    weight: &[f64; LANES],
    out: &mut [f64],
) {
    let mut at = 0;
    for term in terms {
        let r2 = square_radius(term, x, block);
        let (mut by_amplitude, mut scaled) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let r = r2[i].sqrt();
            scaled[i] = weight[i] * term.amplitude * decay(r);
            by_amplitude[i] = scaled[i] * (1.0 + r);
        }
        out[at] += sum(&by_amplitude);
        at += 1;
        for &(c, w) in &term.weights {
            let mut by_length = [0.0; LANES];
            let squares = squares(x, block, c);
            for i in 0..LANES {
                by_length[i] = scaled[i] * (w * squares[i]);
            }
            out[at] += sum(&by_length);
            at += 1;
        }
    }
}

/// The sum of a block, in a fixed order.
#[inline(always)]
pub(super) fn sum(x: &[f64; LANES]) -> f64 {
    let mut x = *x;
    let mut half = LANES / 2;
    while half > 0 {
        for i in 0..half {
            x[i] += x[i + half];
        }
        half /= 2;
    }
    x[0]
}

/// e^(−r) of r ≥ 0, to 2e-15 of it down to 1e-304.
#[inline(always)]
pub(super) fn decay(r: f64) -> f64 {
    // 1.5 · 2^52: adding it rounds to a whole number, which the lowest bits of the sum hold.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const LN2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
    // e^x to 3e-16 where |x| ≤ ln 2 / 2, interpolated at Chebyshev's nodes; from x¹⁰ down.
    const SERIES: [f64; 11] = [
        2.762_642_649_055_297_5e-7,
        2.764_019_668_326_599e-6,
        2.480_150_415_019_133e-5,
        1.984_117_023_204_006_3e-4,
        1.388_888_893_268_639e-3,
        8.333_333_385_698_525e-3,
        4.166_666_666_657_232e-2,
        1.666_666_666_655_431_4e-1,
        0.500_000_000_000_000_6,
        1.000_000_000_000_006_7,
        1.0,
    ];
    let x = if r < 700.0 { -r } else { -700.0 };
    let shifted = x.mul_add(std::f64::consts::LOG2_E, ROUND);
    let whole = shifted - ROUND;
    let x = (-whole).mul_add(LN2[1], (-whole).mul_add(LN2[0], x));
    let mut y = SERIES[0];
    for c in &SERIES[1..] {
        y = y.mul_add(x, *c);
    }
    f64::from_bits(y.to_bits().wrapping_add(shifted.to_bits() << 52))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decay_is_the_exponential() {
        for k in 0..200_000 {
            let r = 0.0035 * f64::from(k);
            let off = (decay(r) / (-r).exp() - 1.0).abs();
            assert!(off < 2e-15, "{r}: {off:e}");
        }
        assert!(decay(1e9) < 1e-300);
    }
}
