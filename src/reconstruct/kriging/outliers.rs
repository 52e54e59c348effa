//! Readings that all others contradict.
//!
//! Each reading is predicted from all others (Rasmussen & Williams 2006, eq. 5.12). What it is off by is either the error of the
//! process, a Student's t of 4 degrees of freedom about its variance, since materials are not Gaussian; or a fault, whose factor
//! has a logarithm of density x² N(x): small factors are no faults. The reading that is the likeliest to be a fault is left out if
//! that is likelier than not, and the others are looked at again without it. Where its neighbours are off too, by what remains
//! without it, as at the foot of a sharp lobe, the variance is that of the neighbours.

use super::kernel::{self, Columns, Kernel};
use super::system::{self, Covariance, Data};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Share of readings that are faults, beforehand.
const SHARE: f64 = 0.005;

/// Mean square of the logarithm of a fault's factor: by 2.2 either way.
const FAULT: f64 = 0.6;

/// Degrees of freedom of the errors of the process.
const FREEDOM: f64 = 4.0;

/// Most readings that are left out, as a share: beyond it, it is the process that does not suit.
const MOST: f64 = 0.2;

/// Least weight of a reading that is near another.
const FAR: f64 = 0.1;

/// The cosine of an elevation from which on all may be otherwise: 87°.
const GRAZING: f64 = 0.05;

/// Steps to the width of a Student's t.
const STEPS: usize = 50;

/// A reading that is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Suspect {
    /// Its number.
    pub row: usize,
    /// ln(f + ε) less what the others predict, and the standard deviation of that.
    pub off: f64,
    pub deviation: f64,
}

/// The readings that are likelier to be faults than not, by their rows; `None` if covariances are singular.
pub(super) fn suspects(data: &Data, kernel: &Kernel) -> Option<Vec<Suspect>> {
    let factor = Covariance::new(kernel).factor(data)?;
    let mut weights = data.values.clone();
    system::back(&factor, &mut weights);
    let mut left = Left {
        columns: &data.sites.columns,
        open: vec![true; data.sites.len()],
        precisions: precisions(&factor),
        weights,
        taken: Vec::new(),
    };
    let mut found = Vec::new();
    while (found.len() as f64) < MOST * data.sites.len() as f64 {
        let likeliest = left.candidates().into_iter().find_map(|candidate| {
            let next = left.without(candidate.row, &factor);
            let variance = next.variance_near(&candidate) / left.precisions[candidate.row];
            (log_odds(candidate.off, variance) > 0.0).then(|| {
                let suspect = Suspect {
                    row: candidate.row,
                    off: candidate.off,
                    deviation: variance.sqrt(),
                };
                (suspect, next)
            })
        });
        let Some((suspect, next)) = likeliest else {
            break;
        };
        found.push(suspect);
        left = next;
    }
    found.sort_by_key(|suspect| suspect.row);
    Some(found)
}

/// The readings that are left, and how they predict each other.
#[derive(Clone)]
struct Left<'a> {
    columns: &'a [Columns],
    /// One flag per reading: true if it is left.
    open: Vec<bool>,
    /// The diagonal of the inverse of their covariances.
    precisions: Vec<f64>,
    /// The inverse times their values, a column per value.
    weights: DMatrix<f64>,
    /// Of each reading that was taken out its row of the inverse then, over the root of its precision.
    taken: Vec<DVector<f64>>,
}

/// A reading that may be a fault.
#[derive(Clone, Copy)]
struct Candidate {
    row: usize,
    /// The column of its value.
    value: usize,
    off: f64,
    /// What all variances of this column are to be multiplied by.
    scale: f64,
}

impl<'a> Left<'a> {
    /// The readings that are likelier to be faults than not by the variances of the process, the likeliest first.
    fn candidates(&self) -> Vec<Candidate> {
        let open: Vec<usize> = (0..self.open.len()).filter(|&i| self.open[i]).collect();
        let mut all = Vec::new();
        for value in 0..self.weights.ncols() {
            let squares: Vec<_> = open.iter().map(|&i| (1.0, self.square(i, value))).collect();
            let scale = width(&squares, 1.0);
            all.extend(open.iter().map(|&row| {
                let off = self.weights[(row, value)] / self.precisions[row];
                let odds = log_odds(off, scale / self.precisions[row]);
                (
                    odds,
                    Candidate {
                        row,
                        value,
                        off,
                        scale,
                    },
                )
            }));
        }
        all.retain(|(odds, candidate)| *odds > 0.0 && !self.is_outermost(candidate.row));
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.into_iter().map(|(_, candidate)| candidate).collect()
    }

    /// True if a reading lies where others say little of it: nearer to the mirror direction than all that are near, where a peak may
    /// be higher or flatter than they show; or at the horizon, where lobes end.
    fn is_outermost(&self, row: usize) -> bool {
        let own = &self.columns[row];
        if kernel::least_cosine(own) < GRAZING {
            return true;
        }
        let others = (0..self.open.len()).filter(|&i| self.open[i] && i != row);
        let mut inner = others.filter(|&i| self.columns[i][kernel::U1] <= own[kernel::U1]);
        !inner.any(|i| system::near(own, &self.columns[i], self.open.len()) > FAR)
    }

    /// The square of what a reading is off by, over its variance.
    fn square(&self, row: usize, value: usize) -> f64 {
        self.weights[(row, value)].powi(2) / self.precisions[row]
    }

    /// These without a reading: the inverse of the covariances with its row and column removed.
    fn without(&self, row: usize, factor: &DMatrix<f64>) -> Left<'a> {
        let mut of_row = DMatrix::zeros(self.open.len(), 1);
        of_row[(row, 0)] = 1.0;
        system::back(factor, &mut of_row);
        let mut of_row: DVector<f64> = of_row.column(0).into_owned();
        for before in &self.taken {
            of_row.axpy(-before[row], before, 1.0);
        }
        of_row /= self.precisions[row].sqrt();
        let mut next = self.clone();
        next.open[row] = false;
        for mut weights in next.weights.column_iter_mut() {
            let own = weights[row] / self.precisions[row].sqrt();
            weights.axpy(-own, &of_row, 1.0);
        }
        for (precision, of_row) in next.precisions.iter_mut().zip(&of_row) {
            *precision = (*precision - of_row * of_row).max(f64::MIN_POSITIVE);
        }
        next.taken.push(of_row);
        next
    }

    /// What the variance of a reading that is not there is to be multiplied by, from what is left near it: as much as of all
    /// at least.
    fn variance_near(&self, candidate: &Candidate) -> f64 {
        let readings = self.open.len();
        let open = (0..readings).filter(|&i| self.open[i]);
        let near = |i: usize| {
            let near = system::near(&self.columns[i], &self.columns[candidate.row], readings);
            (near, self.square(i, candidate.value))
        };
        let mut squares: Vec<_> = open.map(near).collect();
        squares.push((1.0, candidate.scale));
        width(&squares, candidate.scale).max(candidate.scale)
    }
}

/// Columns of a task.
const TASK: usize = 64;

/// The diagonal of the inverse of a matrix, from Cholesky's factor.
fn precisions(factor: &DMatrix<f64>) -> Vec<f64> {
    let n = factor.nrows();
    let squares = system::by_columns([1, n], TASK, |of| {
        // What is above the diagonal is 0.
        let below = n - of.start;
        let lower = factor
            .view((of.start, of.start), (below, below))
            .into_owned();
        let mut columns = DMatrix::identity(below, of.len());
        system::forward(&lower, &mut columns);
        DMatrix::from_iterator(1, of.len(), columns.column_iter().map(|c| c.norm_squared()))
    });
    squares.as_slice().to_vec()
}

/// The square of the width of a Student's t about 0 that suits some squares best, each with a weight.
fn width(squares: &[(f64, f64)], start: f64) -> f64 {
    let all: f64 = squares.iter().map(|(weight, _)| weight).sum();
    let mut width = start;
    for _ in 0..STEPS {
        let part = |(weight, square): &(f64, f64)| {
            weight * (FREEDOM + 1.0) * square / (FREEDOM + square / width.max(f64::MIN_POSITIVE))
        };
        width = squares.iter().map(part).sum::<f64>() / all;
    }
    width
}

/// ln of the odds that a reading which is off by so much is a fault.
fn log_odds(off: f64, variance: f64) -> f64 {
    let square = off * off;
    let both = variance + FAULT;
    let fault = (square / both).ln() - 0.5 * (square / both + (TAU * both).ln());
    // Γ(5/2) / (√(4π) Γ(2)) = 3/8.
    let process = (0.375 / variance.sqrt()).ln()
        - 0.5 * (FREEDOM + 1.0) * (square / variance / FREEDOM).ln_1p();
    (SHARE / (1.0 - SHARE)).ln() + fault - process
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Symmetry;
    use crate::reconstruct::kriging::kernel::Columns;
    use crate::reconstruct::kriging::system::{NUGGET, tests};

    /// Values of a smooth function, of which some are wrong; and the same by covariances without them.
    #[test]
    fn wrong_values_are_found_and_predicted_from_the_others() {
        let n = 80;
        let wrong = [(7, 0.7), (31, -1.1)];
        // Of the columns that the kernel has.
        let sum = |x: &Columns, _: [usize; 2]| x[..kernel::P].iter().sum::<f64>() * 0.1;
        let mut data = tests::data([n, 1], |_| NUGGET, sum);
        let kernel = Kernel::new(Symmetry::FULL);
        assert_eq!(suspects(&data, &kernel), Some(Vec::new()));
        for (row, by) in wrong {
            data.values[(row, 0)] += by;
        }
        let found = suspects(&data, &kernel).unwrap();
        assert_eq!(found.iter().map(|s| s.row).collect::<Vec<_>>(), [7, 31]);
        // The last to be found is predicted from those that are right.
        let last = found.iter().find(|s| s.row == 7).unwrap();
        let right: Vec<usize> = (0..n).filter(|&i| i != 7 && i != 31).collect();
        let covariance = Covariance::new(&kernel);
        let some = Data {
            sites: data.sites.select(&right),
            noise: vec![NUGGET; right.len()],
            values: data.values.select_rows(&right),
        };
        let factor = covariance.factor(&some).unwrap();
        let mut weights = some.values.clone();
        system::back(&factor, &mut weights);
        let of = covariance.between(&some.sites.rows(), &data.sites.select(&[7]), 0..1);
        let off = data.values[(7, 0)] - of.dot(&weights);
        assert!((last.off - off).abs() < 1e-9, "{} {off}", last.off);
    }
}
