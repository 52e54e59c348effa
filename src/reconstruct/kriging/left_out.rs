//! Readings that are predicted from all others, by the inverse of the covariances of all (Rasmussen & Williams 2006, 5.4.2).

use super::kernel::Kernel;
use super::system::{Covariance, Data, FREEDOM, back, by_columns};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Columns of a task.
const TASK: usize = 64;

/// How the readings of a group are missed by all others.
pub(super) struct Missed {
    /// Values less what the others predict: a row per reading of the group.
    pub off: DMatrix<f64>,
    /// The variances of these, the noise of the readings included.
    pub variances: Vec<f64>,
    /// What all variances were multiplied by.
    pub scale: f64,
}

impl Data {
    /// −ln of the density of the values of each group, predicted from all others, summed over groups (Rasmussen & Williams 2006, eq.
    /// 5.11, for groups); the scale of variances is known to as many readings as in [`likelihood`](Self::likelihood).
    pub(crate) fn left_out(&self, kernel: &Kernel, groups: &[Vec<usize>]) -> Option<f64> {
        let factor = Covariance::new(kernel).factor(self)?;
        let n = self.sites.len();
        let mut inverse = DMatrix::identity(n, n);
        back(&factor, &mut inverse);
        let weights = &inverse * &self.values;
        let (mut loss, mut squares) = (0.0, 0.0);
        for group in groups {
            // The covariance of what the others miss of these is the inverse of this block.
            let block = inverse
                .select_rows(group)
                .select_columns(group)
                .cholesky()?;
            let weights = weights.select_rows(group);
            squares += weights.dot(&block.solve(&weights));
            loss -= block
                .l_dirty()
                .diagonal()
                .iter()
                .map(|x| x.ln())
                .sum::<f64>();
        }
        let freedom = FREEDOM + n as f64;
        Some(loss + 0.5 * freedom * (squares / FREEDOM).ln_1p())
    }

    /// How all others miss the values of each group, by ordinary kriging, whose mean the others determine (Dubrule 1983). `None` if
    /// covariances are singular.
    pub(crate) fn missed(&self, kernel: &Kernel, groups: &[Vec<usize>]) -> Option<Vec<Missed>> {
        let factor = self.ordinary(kernel).factor(self)?;
        let n = self.sites.len();
        let mut inverse = by_columns([n, n], TASK, |of| {
            let mut columns = DMatrix::zeros(n, of.len());
            columns.rows_mut(of.start, of.len()).fill_diagonal(1.0);
            back(&factor, &mut columns);
            columns
        });
        let ones = inverse.column_sum();
        inverse.ger(-1.0 / ones.sum(), &ones, &ones, 1.0);
        let weights = &inverse * &self.values;
        let square = self.values.column(0).dot(&weights.column(0));
        let scale = (FREEDOM + square) / (FREEDOM + n as f64);
        let missed = |group: &Vec<usize>| {
            let block = inverse.select_rows(group).select_columns(group);
            let block = block.cholesky()?;
            let variances = block.inverse().diagonal() * scale;
            Some(Missed {
                off: block.solve(&weights.select_rows(group)),
                variances: variances.as_slice().to_vec(),
                scale,
            })
        };
        groups.par_iter().map(missed).collect()
    }
}
