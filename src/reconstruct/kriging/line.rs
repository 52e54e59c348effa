//! Terms of one column, summed over all readings for the price of a search.

use super::kernel::{Columns, decay};
use nalgebra::DMatrix;

/// Σ w_i a (1 + s|x − x_i|) e^(−s|x − x_i|) over readings i, for several sets of weights. Between two readings each
/// side of it is a line times an exponential, which sums up to the next reading give.
pub(super) struct Line {
    column: usize,
    /// The rate s.
    rate: f64,
    /// The column of the readings, ascending.
    xs: Vec<f64>,
    /// At each reading and set of weights, over all readings up to it and over all from it on: the sum of
    /// a w_i e^(−s|x − x_i|), and that of its terms times |x − x_i|.
    sums: Vec<[[f64; 2]; 2]>,
}

impl Line {
    /// The sums of readings with weights, a column per set.
    pub(crate) fn new(
        (amplitude, column, rate): (f64, usize, f64),
        readings: &[Columns],
        weights: &DMatrix<f64>,
    ) -> Self {
        let n = readings.len();
        let width = weights.ncols();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| readings[a][column].total_cmp(&readings[b][column]));
        let xs: Vec<f64> = order.iter().map(|&i| readings[i][column]).collect();
        let mut sums = vec![[[0.0; 2]; 2]; n * width];
        for side in [0, 1] {
            for k in 0..n {
                let at = if side == 0 { k } else { n - 1 - k };
                let before = if side == 0 {
                    at.wrapping_sub(1)
                } else {
                    at + 1
                };
                for c in 0..width {
                    let mut sum = [0.0; 2];
                    if k > 0 {
                        let step = (xs[at] - xs[before]).abs();
                        let [plain, times] = sums[before * width + c][side];
                        let less = decay(rate * step);
                        sum = [less * plain, less * (times + step * plain)];
                    }
                    sum[0] += amplitude * weights[(order[at], c)];
                    sums[at * width + c][side] = sum;
                }
            }
        }
        Self {
            column,
            rate,
            xs,
            sums,
        }
    }

    /// Adds the sum of each set at a pair to `out`.
    #[inline(always)]
    pub(crate) fn add(&self, pair: &Columns, out: &mut [f64]) {
        let x = pair[self.column];
        let width = out.len();
        let above = self.xs.partition_point(|y| *y <= x);
        let sides = [(above.wrapping_sub(1), 0), (above, 1)];
        for (at, side) in sides.into_iter().filter(|(at, _)| *at < self.xs.len()) {
            let r = self.rate * (x - self.xs[at]).abs();
            let less = decay(r);
            for (out, sums) in out.iter_mut().zip(&self.sums[at * width..]) {
                let [plain, times] = sums[side];
                *out += less * ((1.0 + r) * plain + self.rate * times);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::kriging::kernel::COLUMNS;
    use crate::sampling::Random;

    #[test]
    fn sums_are_those_of_all_terms() {
        let random = Random::new(1);
        for n in [1, 2, 3, 50, 400] {
            // Some readings share their value.
            let readings: Vec<Columns> = (0..n)
                .map(|i| {
                    random
                        .point::<COLUMNS>(i as u64)
                        .map(|x| (40.0 * x).round() / 40.0)
                })
                .collect();
            let weights = DMatrix::from_fn(n, 3, |i, c| {
                1e3 * (random.point::<3>(1000 + i as u64)[c] - 0.5)
            });
            for rate in [0.01, 1.0, 100.0, 3000.0] {
                let line = Line::new((2.5, 4, rate), &readings, &weights);
                for k in 0..200 {
                    let mut pair = [0.0; COLUMNS];
                    pair[4] = f64::from(k) * 0.0075 - 0.25;
                    let mut found = [1.0; 3];
                    line.add(&pair, &mut found);
                    for (c, found) in found.into_iter().enumerate() {
                        let term = |i: usize| {
                            let r = rate * (pair[4] - readings[i][4]).abs();
                            2.5 * weights[(i, c)] * (1.0 + r) * (-r).exp()
                        };
                        let sum: f64 = (0..n).map(term).sum();
                        assert!(
                            (found - 1.0 - sum).abs() < 1e-9,
                            "{n} {rate} {k}: {found} {sum}"
                        );
                    }
                }
            }
        }
    }
}
