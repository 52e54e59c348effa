//! Values of a smooth interpolant along a row of a table: pairs of one θ_h and one θ_d.
//!
//! With t = |cos φ_d| the cosines of both directions are c ± s t, c = cos θ_h cos θ_d, s = sin θ_h sin θ_d. Of isotropic, reciprocal
//! and bilateral materials ln f is a function of t, smooth but for what grows towards the horizon t = c/s like ln(c − s t). So
//! ln(f + ε) is interpolated by a polynomial of y = ln(1 − t s/c), through Chebyshev's points of the range of the row (barycentric
//! form, Berrut & Trefethen 2004), and compared with the interpolant at some cells of the row.

use super::interpolant::Interpolant;
use super::transform::EPSILON;
use crate::geometry::{DirectionPair, Symmetry};
use crate::parametrization::{Coords, Form, HalfDifference, Parametrization};
use std::f64::consts::PI;

/// Points of a polynomial: more are tried where fewer err too much.
const POINTS: [usize; 3] = [14, 20, 36];

/// Cells at which a polynomial is compared with the interpolant, as shares of the row.
const COMPARED: [f64; 6] = [0.0, 0.11, 0.27, 0.45, 0.68, 0.92];

/// Largest error of ln(f + ε) at cells that are compared: between them it may be three times as large.
const TOLERANCE: f64 = 3e-6;

/// Least cosine of cells that are interpolated, above that from which on interpolants take all for equal: there they bend.
const LEAST_COSINE: f64 = 0.011;

/// Angles that differ by less, rad, are those of one row.
const SAME: f64 = 1e-9;

/// A row in coordinates in which a smooth interpolant is a polynomial.
struct Row {
    theta_h: f64,
    theta_d: f64,
    /// s/c, not so small that y has no digits.
    ratio: f64,
    /// Least and largest y.
    range: [f64; 2],
}

impl Row {
    fn y(&self, t: f64) -> f64 {
        (-self.ratio * t).ln_1p()
    }

    /// The pair at a place of the range, in [−1, 1].
    fn pair(&self, form: &dyn Parametrization, x: f64) -> Option<DirectionPair> {
        let [low, high] = self.range;
        let y = 0.5 * ((1.0 - x) * low + (1.0 + x) * high);
        let t = (-y.exp_m1() / self.ratio).clamp(0.0, 1.0);
        form.inverse(&[self.theta_h, self.theta_d, t.acos(), 0.0])
    }
}

/// Writes the values of an interpolant of a material with all symmetries at pairs of a row; false, and nothing, where that takes as
/// long as one by one.
pub(super) fn along(
    interpolant: &dyn Interpolant,
    pairs: &[DirectionPair],
    out: &mut [f64],
) -> bool {
    let most = POINTS[0] + COMPARED.len();
    if pairs.len() < 2 * most {
        return false;
    }
    let form = Form::<HalfDifference>::new(Symmetry::FULL);
    let mut coords: Vec<Coords> = vec![[0.0; 4]; pairs.len()];
    form.forward_batch(pairs, &mut coords);
    // At the ends of a row cells may be cut by the horizon, and have pairs of other angles.
    let [theta_h, theta_d, ..] = coords[pairs.len() / 2];
    let is_of_row = |c: &Coords| (c[0] - theta_h).abs().max((c[1] - theta_d).abs()) < SAME;
    let (of_row, others): (Vec<usize>, Vec<usize>) = (0..pairs.len())
        .partition(|&i| is_of_row(&coords[i]) && pairs[i].least_cosine() > LEAST_COSINE);
    let mut row = Row {
        theta_h,
        theta_d,
        ratio: (theta_h.tan() * theta_d.tan()).max(1e-6),
        range: [f64::MAX, f64::MIN],
    };
    let ys: Vec<f64> = of_row
        .iter()
        .map(|&i| row.y(coords[i][2].cos().abs()))
        .collect();
    for &y in &ys {
        row.range = [row.range[0].min(y), row.range[1].max(y)];
    }
    if !(row.range[0] < row.range[1]) || !row.range[0].is_finite() {
        return false;
    }
    let width = interpolant.width();
    let compared = COMPARED.map(|share| (share * of_row.len() as f64) as usize);
    let exact = logs(interpolant, &compared.map(|k| pairs[of_row[k]]));
    for points in POINTS {
        if 2 * (points + others.len()) > pairs.len() {
            return false;
        }
        let places: Vec<f64> = (0..points)
            .map(|k| -(PI * k as f64 / (points - 1) as f64).cos())
            .collect();
        let nodes: Option<Vec<_>> = places.iter().map(|&x| row.pair(&form, x)).collect();
        let Some(nodes) = nodes else { return false };
        let polynomial = Polynomial {
            values: logs(interpolant, &nodes),
            places,
            width,
        };
        let [low, high] = row.range;
        let at = |k: usize, out: &mut [f64]| {
            polynomial.write((2.0 * ys[k] - low - high) / (high - low), out);
        };
        let mut found = vec![0.0; width];
        let is_near = compared
            .iter()
            .zip(exact.chunks_exact(width))
            .all(|(&k, exact)| {
                at(k, &mut found);
                let mut off = found.iter().zip(exact);
                off.all(|(a, b)| (a - b).abs() <= TOLERANCE)
            });
        if !is_near {
            continue;
        }
        for (k, &i) in of_row.iter().enumerate() {
            let out = &mut out[i * width..][..width];
            at(k, out);
            out.iter_mut()
                .for_each(|z| *z = (z.exp() - EPSILON).max(0.0));
        }
        let some: Vec<DirectionPair> = others.iter().map(|&i| pairs[i]).collect();
        let mut values = vec![0.0; some.len() * width];
        interpolant.eval_batch(&some, &mut values);
        for (i, values) in others.iter().zip(values.chunks_exact(width)) {
            out[i * width..][..width].copy_from_slice(values);
        }
        return true;
    }
    false
}

/// ln(f + ε) at pairs.
fn logs(interpolant: &dyn Interpolant, pairs: &[DirectionPair]) -> Vec<f64> {
    let mut values = vec![0.0; pairs.len() * interpolant.width()];
    interpolant.eval_batch(pairs, &mut values);
    values.iter_mut().for_each(|f| *f = (*f + EPSILON).ln());
    values
}

/// A polynomial by its values at Chebyshev's points, a row of `width` values for each.
struct Polynomial {
    places: Vec<f64>,
    values: Vec<f64>,
    width: usize,
}

impl Polynomial {
    /// Writes its values at a place in [−1, 1].
    fn write(&self, x: f64, out: &mut [f64]) {
        out.fill(0.0);
        let (last, mut sum) = (self.places.len() - 1, 0.0);
        for (k, (place, values)) in self
            .places
            .iter()
            .zip(self.values.chunks_exact(self.width))
            .enumerate()
        {
            if x == *place {
                return out.copy_from_slice(values);
            }
            let end = if k == 0 || k == last { 0.5 } else { 1.0 };
            let weight = end * if k % 2 == 0 { 1.0 } else { -1.0 } / (x - place);
            sum += weight;
            out.iter_mut()
                .zip(values)
                .for_each(|(z, v)| *z += weight * v);
        }
        out.iter_mut().for_each(|z| *z /= sum);
    }
}
