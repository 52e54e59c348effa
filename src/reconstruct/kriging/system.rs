//! The linear system of the readings: covariances, their factor, and how likely a kernel makes the readings.

use super::kernel::{self, Block, Columns, Flat, Kernel, LANES};
use super::space::Space;
use crate::geometry::DirectionPair;
use crate::numeric::vectorised;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::ops::Range;

/// Pairs in the form that the system takes.
#[derive(Clone)]
pub(super) struct Sites {
    pub columns: Vec<Columns>,
    /// Mean of ln f at each, beforehand.
    pub mean: Vec<f64>,
    /// Functions of the prior, a column per pair; none without one.
    pub functions: DMatrix<f64>,
}

impl Sites {
    /// Pairs in a space, with the mean and the functions of a prior there, if there is one.
    pub(crate) fn new(
        pairs: &[DirectionPair],
        space: &Space,
        known: Option<(Vec<f64>, DMatrix<f64>)>,
    ) -> Self {
        let nothing = || (vec![MEAN; pairs.len()], DMatrix::zeros(0, pairs.len()));
        let (mean, functions) = known.unwrap_or_else(nothing);
        Self {
            columns: space.columns(pairs),
            mean,
            functions,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.columns.len()
    }

    /// Some of them.
    pub(crate) fn select(&self, which: &[usize]) -> Self {
        Self {
            columns: which.iter().map(|&i| self.columns[i]).collect(),
            mean: which.iter().map(|&i| self.mean[i]).collect(),
            functions: self.functions.select_columns(which),
        }
    }

    /// These, and then others.
    pub(crate) fn and(mut self, others: &Self) -> Self {
        let (own, rows) = (self.len(), self.functions.nrows());
        self.columns.extend(&others.columns);
        self.mean.extend(&others.mean);
        let mut functions = self.functions.resize_horizontally(self.columns.len(), 0.0);
        let mut further = functions.view_mut((0, own), (rows, others.len()));
        further.copy_from(&others.functions);
        self.functions = functions;
        self
    }

    /// The form in which covariances with others are computed.
    pub(crate) fn rows(&self) -> Rows {
        Rows {
            blocks: kernel::blocks(&self.columns),
            functions: self.functions.transpose(),
        }
    }
}

/// Pairs as the rows of a matrix.
pub(super) struct Rows {
    blocks: Vec<Block>,
    /// A row per pair.
    functions: DMatrix<f64>,
}

/// A kernel in the form that the system takes.
#[derive(Clone)]
pub(super) struct Covariance {
    terms: Vec<Flat>,
    level: f64,
    share: f64,
    amplitude: f64,
}

impl Covariance {
    pub(crate) fn new(kernel: &Kernel) -> Self {
        Self {
            terms: kernel.flat(),
            level: kernel.level,
            share: kernel.share,
            amplitude: kernel.amplitude(),
        }
    }

    /// The covariances of some sites with rows, a column per site.
    pub(crate) fn between(&self, rows: &Rows, sites: &Sites, of: Range<usize>) -> DMatrix<f64> {
        self.filled(rows, sites, of, false)
    }

    fn filled(&self, rows: &Rows, sites: &Sites, of: Range<usize>, triangle: bool) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(rows.functions.nrows(), of.len());
        if out.is_empty() {
            return out;
        }
        let first = triangle.then_some(of.start);
        let columns = &sites.columns[of.clone()];
        vectorised!(self.fill(columns, rows, first, out.as_mut_slice()));
        out.add_scalar_mut(self.level);
        if self.share > 0.0 {
            let functions = sites.functions.columns(of.start, of.len());
            out.gemm(self.share, &rows.functions, &functions, 1.0);
        }
        out
    }

    /// Writes covariances by the terms, a column per pair; `first` is the number of the first column where the lower triangle of a
    /// symmetric matrix is enough.
    #[inline(always)]
    fn fill(&self, columns: &[Columns], rows: &Rows, first: Option<usize>, out: &mut [f64]) {
        let columns = columns
            .iter()
            .zip(out.chunks_exact_mut(rows.functions.nrows()));
        for (j, (x, out)) in columns.enumerate() {
            let skipped = first.map_or(0, |first| (first + j) / LANES);
            let blocks = rows.blocks.iter().zip(out.chunks_mut(LANES));
            for (block, out) in blocks.skip(skipped) {
                let values = kernel::covariance(&self.terms, x, block);
                for (out, value) in out.iter_mut().zip(values) {
                    *out = value;
                }
            }
        }
    }

    /// The variance at each site.
    pub(crate) fn variances(&self, sites: &Sites) -> Vec<f64> {
        let plain = self.level + self.amplitude;
        let functions = sites.functions.column_iter();
        functions
            .map(|q| plain + self.share * q.norm_squared())
            .collect()
    }

    /// Cholesky's factor of the covariances of readings; `None` if they are singular.
    pub(crate) fn factor(&self, data: &Data) -> Option<DMatrix<f64>> {
        let rows = data.sites.rows();
        let n = data.sites.len();
        let mut k = by_columns([n, n], TASK, |of| self.filled(&rows, &data.sites, of, true));
        for (i, noise) in data.noise.iter().enumerate() {
            k[(i, i)] += noise;
        }
        factored(&mut k).then_some(k)
    }
}

/// Widths over which errors at 64 readings are averaged, with the columns they are along.
const WIDTHS: [(usize, f64); 3] = [(kernel::U1, 0.15), (kernel::U2, 0.3), (kernel::U3, 0.4)];

/// The weight of one of so many readings in an average of their errors near a pair: 1 where it is that pair.
pub(super) fn near(x: &Columns, of: &Columns, readings: usize) -> f64 {
    nearness(readings)(x, of)
}

/// [`near`] for so many readings.
pub(super) fn nearness(readings: usize) -> impl Fn(&Columns, &Columns) -> f64 {
    let narrower = (64.0 / readings.max(1) as f64).powf(1.0 / 6.0);
    move |x, of| {
        let off = WIDTHS.map(|(c, w)| (x[c] - of[c]) / (w * narrower));
        (-0.5 * off.iter().map(|d| d * d).sum::<f64>()).exp()
    }
}

/// Readings in the form that the system takes.
#[derive(Clone)]
pub(super) struct Data {
    /// The pair of each reading.
    pub sites: Sites,
    /// Variance of ln f of each reading: of its noise, and the nugget.
    pub noise: Vec<f64>,
    /// ln f less its mean beforehand, a column per value of a reading.
    pub values: DMatrix<f64>,
}

/// The mean of ln f over materials and pairs, about which its level varies.
pub(super) const MEAN: f64 = -2.0;

/// The variance of ln f that no column explains.
pub(super) const NUGGET: f64 = 1.8e-5;

/// Degrees of freedom of the prior of the scale of all variances: a t-likelihood.
pub(super) const FREEDOM: f64 = 6.0;

/// Columns of a matrix that are factored together.
const PANEL: usize = 96;

/// Cholesky's factor L of a symmetric matrix, of which the lower triangle is read, in its place; what is
/// above the diagonal is of no use then. False if the matrix is not positive definite.
///
/// nalgebra's own goes column by column: this one, by its matrix products, is ten times as fast at 2000.
pub(super) fn factored(a: &mut DMatrix<f64>) -> bool {
    let n = a.nrows();
    for k in (0..n).step_by(PANEL) {
        let width = PANEL.min(n - k);
        let Some(corner) = a.view((k, k), (width, width)).into_owned().cholesky() else {
            return false;
        };
        let corner = corner.unpack();
        a.view_mut((k, k), (width, width)).copy_from(&corner);
        let below = n - k - width;
        let (mut left, mut right) = a.columns_range_pair_mut(k..k + width, k + width..n);
        let mut panel = left.rows_mut(k + width, below);
        for j in 0..width {
            for i in 0..j {
                let (from, mut to) = panel.columns_range_pair_mut(i, j);
                to.axpy(-corner[(j, i)], &from, 1.0);
            }
            panel.column_mut(j).scale_mut(1.0 / corner[(j, j)]);
        }
        for j in (0..below).step_by(PANEL) {
            let of = PANEL.min(below - j);
            let across = panel.rows(j, of).transpose();
            let mut rest = right.view_mut((k + width + j, j), (below - j, of));
            rest.gemm(-1.0, &panel.rows(j, below - j), &across, 1.0);
        }
    }
    true
}

/// The process given its readings: at each pair the mean beforehand, the level, and weights times the covariances
/// with the readings.
pub(super) struct Solved {
    /// One row per reading, a column per value.
    pub weights: DMatrix<f64>,
    /// What is added to the mean of each value.
    pub levels: Vec<f64>,
}

impl Data {
    /// Takes coefficients of the functions as known, a column for each value.
    pub(crate) fn centre(&mut self, coefficients: &DMatrix<f64>) {
        self.values -= self.sites.functions.tr_mul(coefficients);
    }

    /// The weights of the readings. Without a prior nothing is known of the level beforehand (ordinary kriging): where
    /// all readings are one value, so is the process. `None` if the covariances are singular.
    pub(crate) fn solve(&self, kernel: &Kernel) -> Option<Solved> {
        let factor = self.ordinary(kernel).factor(self)?;
        Some(self.solve_by(kernel, &factor))
    }

    /// The covariances of [`solve`](Self::solve).
    pub(crate) fn ordinary(&self, kernel: &Kernel) -> Covariance {
        Covariance {
            level: if kernel.share > 0.0 {
                kernel.level
            } else {
                0.0
            },
            ..Covariance::new(kernel)
        }
    }

    /// [`solve`](Self::solve) by the factor of its covariances.
    pub(crate) fn solve_by(&self, kernel: &Kernel, factor: &DMatrix<f64>) -> Solved {
        let mut weights = self.values.clone();
        if kernel.share > 0.0 {
            back(factor, &mut weights);
            let levels = weights.column_iter();
            let levels = levels.map(|w| kernel.level * w.sum()).collect();
            return Solved { weights, levels };
        }
        let mut ones = DMatrix::from_element(self.sites.len(), 1, 1.0);
        back(factor, &mut ones);
        let share = ones.sum();
        let mut levels = Vec::new();
        for mut column in weights.column_iter_mut() {
            let level = column.dot(&ones.column(0)) / share;
            column.add_scalar_mut(-level);
            levels.push(level + MEAN);
        }
        back(factor, &mut weights);
        Solved { weights, levels }
    }

    /// Some of the readings.
    pub(crate) fn select(&self, which: &[usize]) -> Self {
        Self {
            sites: self.sites.select(which),
            noise: which.iter().map(|&i| self.noise[i]).collect(),
            values: self.values.select_rows(which),
        }
    }

    /// These readings with `variance` added to the noise of each.
    pub(crate) fn noisier(mut self, variance: f64) -> Self {
        self.noise.iter_mut().for_each(|noise| *noise += variance);
        self
    }

    /// −ln of the likelihood of the values, their mean, and its derivatives by [`Kernel::logs`] and by a variance that all readings
    /// have more: values are t-distributed, as a scale of all variances that is known to six readings makes them.
    pub(crate) fn likelihood(&self, kernel: &Kernel) -> Option<Likelihood> {
        let factor = Covariance::new(kernel).factor(self)?;
        let n = self.sites.len();
        let mut weights = self.values.clone();
        back(&factor, &mut weights);
        let count = self.values.ncols() as f64;
        let mut loss = (0..n).map(|i| factor[(i, i)].ln()).sum::<f64>();
        // ½ K⁻¹ − ½ Σ s α αᵀ, the derivative by K.
        // The lower triangle alone is read, but for functions of a prior: what is above the panel of a column's diagonal stays 0.
        let is_whole = kernel.share > 0.0;
        let mut by = by_columns([n, n], TASK, |of| {
            let mut columns = DMatrix::zeros(n, of.len());
            columns.rows_mut(of.start, of.len()).fill_diagonal(0.5);
            let panel = if is_whole { 0 } else { of.start / PANEL };
            back_below(&factor, &mut columns, panel * PANEL);
            columns
        });
        for (y, alpha) in self.values.column_iter().zip(weights.column_iter()) {
            let square = y.dot(&alpha);
            let freedom = FREEDOM + n as f64;
            loss += 0.5 * freedom * (square / FREEDOM).ln_1p() / count;
            let share = -0.5 * freedom / (FREEDOM + square) / count;
            by.ger(share, &alpha, &alpha, 1.0);
        }
        let terms = kernel.flat();
        let blocks = kernel::blocks(&self.sites.columns);
        let parts: Vec<Vec<f64>> = tasks(n, TASK)
            .into_par_iter()
            .map(|of| {
                let mut out = vec![0.0; kernel.logs().len()];
                let columns = &self.sites.columns;
                vectorised!(add_slopes(&terms, columns, &of, &blocks, &by, &mut out));
                out
            })
            .collect();
        let mut slope = vec![0.0; kernel.logs().len()];
        for part in parts {
            slope
                .iter_mut()
                .zip(part)
                .for_each(|(all, part)| *all += part);
        }
        if let Some(last) = slope.last_mut().filter(|_| kernel.share > 0.0) {
            let functions = &self.sites.functions;
            *last = kernel.share * (functions * &by).dot(functions);
        }
        loss.is_finite().then(|| Likelihood {
            loss,
            by_logs: slope,
            by_noise: by.trace(),
        })
    }
}

/// What [`Data::likelihood`] finds.
pub(super) struct Likelihood {
    /// −ln of the likelihood.
    pub loss: f64,
    /// Its derivatives by the logarithms of the kernel.
    pub by_logs: Vec<f64>,
    /// That by a variance that all readings have more.
    pub by_noise: f64,
}

/// Adds the derivatives of `Σ by · covariance`, of a symmetric matrix of which the lower triangle is read: those of its columns `of`.
#[inline(always)]
fn add_slopes(
    terms: &[Flat],
    columns: &[Columns],
    of: &Range<usize>,
    blocks: &[Block],
    by: &DMatrix<f64>,
    out: &mut [f64],
) {
    let n = columns.len();
    for j in of.clone() {
        let x = &columns[j];
        let column = by.column(j);
        for (b, block) in blocks.iter().enumerate().skip(j / LANES) {
            let mut weight = [0.0; LANES];
            for (w, i) in weight.iter_mut().zip(b * LANES..n) {
                *w = match i.cmp(&j) {
                    Ordering::Less => 0.0,
                    Ordering::Equal => column[i],
                    Ordering::Greater => 2.0 * column[i],
                };
            }
            kernel::add_derivatives(terms, x, block, &weight, out);
        }
    }
}

/// Solves L x = b in place of b, for many columns at once.
pub(super) fn forward(factor: &DMatrix<f64>, b: &mut DMatrix<f64>) {
    forward_below(factor, b, 0);
}

/// [`forward`] where `b`, and so the solution, is 0 above row `first`, a multiple of [`PANEL`].
fn forward_below(factor: &DMatrix<f64>, b: &mut DMatrix<f64>, first: usize) {
    let n = factor.nrows();
    for k in (first..n).step_by(PANEL) {
        let width = PANEL.min(n - k);
        let below = n - k - width;
        let (mut done, mut rest) = b.rows_range_pair_mut(k..k + width, k + width..n);
        factor
            .view((k, k), (width, width))
            .solve_lower_triangular_mut(&mut done);
        let across = factor.view((k + width, k), (below, width));
        rest.gemm(-1.0, &across, &done, 1.0);
    }
}

/// Solves L Lᵀ x = b in place of b, for many columns at once.
pub(super) fn back(factor: &DMatrix<f64>, b: &mut DMatrix<f64>) {
    back_below(factor, b, 0);
}

/// The rows from `first` on, a multiple of [`PANEL`], of [`back`] where `b` is 0 above them.
fn back_below(factor: &DMatrix<f64>, b: &mut DMatrix<f64>, first: usize) {
    forward_below(factor, b, first);
    let n = factor.nrows();
    for k in (first..n).step_by(PANEL).rev() {
        let width = PANEL.min(n - k);
        let below = n - k - width;
        let (mut open, done) = b.rows_range_pair_mut(k..k + width, k + width..n);
        // nalgebra's product with a transposed matrix is a slow one.
        let across = factor.view((k + width, k), (below, width)).transpose();
        open.gemm(-1.0, &across, &done, 1.0);
        factor
            .view((k, k), (width, width))
            .tr_solve_lower_triangular_mut(&mut open);
    }
}

/// Columns of the covariances of readings that one task makes: triangles are as unequal as it is wide.
const TASK: usize = 64;

/// All of `n` columns, at most `task` at a time.
fn tasks(n: usize, task: usize) -> Vec<Range<usize>> {
    let first = (0..n).step_by(task);
    first.map(|first| first..n.min(first + task)).collect()
}

/// A matrix of so many rows and columns, of which `make` makes at most `task` columns at a time, on all cores.
pub(super) fn by_columns(
    [rows, columns]: [usize; 2],
    task: usize,
    make: impl Fn(Range<usize>) -> DMatrix<f64> + Sync,
) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(rows, columns);
    let parts = out.as_mut_slice().par_chunks_mut((rows * task).max(1));
    parts.zip(tasks(columns, task)).for_each(|(out, of)| {
        out.copy_from_slice(make(of).as_slice());
    });
    out
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::Symmetry;
    use crate::reconstruct::kriging::kernel::Columns;
    use std::array::from_fn;

    /// Pairs anywhere in the space of columns, with values and noises by their number.
    pub fn data(
        [n, width]: [usize; 2],
        noise: impl Fn(usize) -> f64,
        value: impl Fn(&Columns, [usize; 2]) -> f64,
    ) -> Data {
        let columns = |i: usize| from_fn(|c| ((i + 1) as f64 * (c + 2) as f64 * 0.618).fract());
        let columns: Vec<Columns> = (0..n).map(columns).collect();
        Data {
            noise: (0..n).map(noise).collect(),
            values: DMatrix::from_fn(n, width, |i, c| value(&columns[i], [i, c])),
            sites: Sites {
                mean: vec![MEAN; n],
                functions: DMatrix::zeros(0, n),
                columns,
            },
        }
    }

    /// Waves with noises of a few sizes.
    fn waves(n: usize) -> Data {
        let noise = |i: usize| NUGGET * (1 + i % 3) as f64;
        data([n, 2], noise, |_, [i, c]| {
            ((i * (c + 3)) as f64 * 0.07).sin()
        })
    }

    /// The covariance of two pairs by the formula, without that of the level.
    pub fn by_formula(kernel: &Kernel, a: &Columns, b: &Columns) -> f64 {
        let of = |t: &kernel::Term| {
            let off = t.lengths.iter().map(|(c, l)| (a[*c] - b[*c]) / l);
            let r = (3.0 * off.map(|d| d * d).sum::<f64>()).sqrt();
            t.amplitude * (1.0 + r) * (-r).exp()
        };
        kernel.terms.iter().map(of).sum()
    }

    /// The covariances by the formula, and nalgebra's own factor of them.
    #[test]
    fn weights_solve_the_system() {
        let kernel = Kernel::new(Symmetry::FULL);
        for n in [1, 7, 95, 96, 97, 300] {
            let data = waves(n);
            let columns = &data.sites.columns;
            let plain = DMatrix::from_fn(n, n, |i, j| {
                let noise = if i == j { data.noise[i] } else { 0.0 };
                by_formula(&kernel, &columns[i], &columns[j]) + noise
            });
            let Solved { weights, levels } = data.solve(&kernel).unwrap();
            let product = &plain * &weights;
            for c in 0..2 {
                // No weight on the level, and every reading is met but for its noise.
                assert!(weights.column(c).sum().abs() <= 1e-6 * weights.column(c).amax());
                for i in 0..n {
                    let off = product[(i, c)] + levels[c] - MEAN - data.values[(i, c)];
                    assert!(off.abs() < 1e-8, "{n} {i}: {off:e}");
                }
            }
        }
    }

    #[test]
    fn slopes_are_those_of_differences() {
        let kernel = Kernel::new(Symmetry::ORTHOTROPIC).about(0.5, 2.0, 0.7);
        let mut data = waves(40);
        data.sites.functions = DMatrix::from_fn(3, 40, |k, i| ((k + 2) as f64 * i as f64).cos());
        let logs = kernel.logs();
        assert!((logs.last().unwrap().exp() - 0.7).abs() < 1e-12);
        let value = |logs: &[f64]| data.likelihood(&kernel.with_logs(logs)).unwrap();
        let slope = value(&logs).by_logs;
        for i in 0..logs.len() {
            let at = |step: f64| {
                let mut logs = logs.clone();
                logs[i] += step;
                value(&logs).loss
            };
            let difference = (at(1e-4) - at(-1e-4)) / 2e-4;
            let allowed = 1e-5 * (1.0 + difference.abs());
            assert!(
                (slope[i] - difference).abs() < allowed,
                "{i}: {} {difference}",
                slope[i]
            );
        }
    }
}
