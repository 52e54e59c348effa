//! More readings than one system holds: some of their pairs determine the process, and these all others (FITC;
//! Snelson & Ghahramani 2006). What a reading differs by from what those pairs say of it counts as its own noise.

use super::kernel::Kernel;
use super::system::{self, Covariance, Data, MEAN, Sites, Solved};
use crate::sampling::Random;
use nalgebra::{DMatrix, DMatrixViewMut};
use rayon::prelude::*;

/// Pairs that determine the process.
pub(super) const TELLING: usize = 4000;

/// Variance of ln f that is added at them, so that their covariances are regular: a hundredth of what any reading is missed by.
const JITTER: f64 = 1e-2 * system::NUGGET;

/// A seed that no user can give: what noise and sample sets draw has nothing to do with the choice.
const SEED: u64 = u64::MAX - 1;

/// Readings that are taken up together.
const BLOCK: usize = 512;

/// Columns of a square matrix that one task adds to.
const PANEL: usize = 128;

/// Numbers of some readings, spread at random over all of them: steps through a grid would meet the same coordinates again
/// and again.
pub(crate) fn some(readings: usize, most: usize) -> Vec<usize> {
    let mut chosen = shuffled(readings);
    chosen.truncate(most);
    chosen.sort_unstable();
    chosen
}

/// The numbers of so many readings in a random order, always the same one.
pub(super) fn shuffled(readings: usize) -> Vec<usize> {
    let random = Random::new(SEED);
    let mut order: Vec<(f64, usize)> = (0..readings)
        .map(|i| (random.point::<1>(i as u64)[0], i))
        .collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    order.into_iter().map(|(_, i)| i).collect()
}

/// The readings with the numbers `telling` and their weights, given all of `data`; their level is what these say by
/// themselves. Without a prior. `None` if covariances are singular.
pub(super) fn solve(data: &Data, kernel: &Kernel, telling: &[usize]) -> Option<(Sites, Solved)> {
    let alone = data.select(telling);
    let Solved { levels, .. } = alone.solve(kernel)?;
    let covariance = Covariance::new(&Kernel {
        level: 0.0,
        ..kernel.clone()
    });
    let count = telling.len();
    let regular = Data {
        noise: vec![JITTER; count],
        ..alone
    };
    let factor = covariance.factor(&regular)?;
    let rows = regular.sites.rows();
    let variances = covariance.variances(&data.sites);
    let mut weights = DMatrix::zeros(count, levels.len());
    // I + V Λ⁻¹ Vᵀ, of which the lower triangle is made: V = L⁻¹ K of telling pairs with all.
    let mut inner = DMatrix::identity(count, count);
    for first in (0..data.sites.len()).step_by(BLOCK) {
        let of = first..data.sites.len().min(first + BLOCK);
        let mut projected = system::by_columns([count, of.len()], BLOCK / 8, |part| {
            let part = first + part.start..first + part.end;
            let mut projected = covariance.between(&rows, &data.sites, part);
            system::forward(&factor, &mut projected);
            projected
        });
        let mut values = data.values.rows(of.start, of.len()).into_owned();
        for (mut column, level) in values.column_iter_mut().zip(&levels) {
            column.add_scalar_mut(MEAN - level);
        }
        for (k, i) in of.enumerate() {
            let mut column = projected.column_mut(k);
            let untold = (variances[i] - column.norm_squared()).max(0.0) + data.noise[i];
            column.unscale_mut(untold.sqrt());
            values.row_mut(k).unscale_mut(untold.sqrt());
        }
        weights.gemm(1.0, &projected, &values, 1.0);
        let across = projected.transpose();
        let panels = inner.as_mut_slice().par_chunks_mut(count * PANEL);
        panels.enumerate().for_each(|(panel, out)| {
            let start = panel * PANEL;
            let width = out.len() / count;
            let mut out = DMatrixViewMut::from_slice(out, count, width);
            let mut below = out.rows_mut(start, count - start);
            let columns = across.columns(start, width);
            below.gemm(1.0, &projected.rows(start, count - start), &columns, 1.0);
        });
    }
    system::factored(&mut inner).then_some(())?;
    system::back(&inner, &mut weights);
    factor.tr_solve_lower_triangular_mut(&mut weights);
    Some((regular.sites, Solved { weights, levels }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Symmetry;
    use crate::reconstruct::kriging::kernel::Columns;
    use crate::reconstruct::kriging::system::{NUGGET, tests};

    /// Readings of smooth functions, off by so much.
    fn data(n: usize, noise: f64) -> Data {
        let value = |x: &Columns, [i, c]: [usize; 2]| {
            let off = ((i * (c + 3)) as f64 * 0.77).sin() * 2.0_f64.sqrt();
            (3.0 * x[0] + (c + 1) as f64 * x[1]).sin() + noise * off
        };
        tests::data([n, 2], |_| NUGGET + noise * noise, value)
    }

    /// The means at places by the weights of readings.
    fn means(of: &Sites, kernel: &Kernel, solved: &Solved, at: &Sites) -> DMatrix<f64> {
        let covariance = Covariance::new(&Kernel {
            level: 0.0,
            ..kernel.clone()
        });
        let across = covariance.between(&of.rows(), at, 0..at.len());
        let mut out = across.tr_mul(&solved.weights);
        for (mut column, level) in out.column_iter_mut().zip(&solved.levels) {
            column.add_scalar_mut(*level);
        }
        out
    }

    #[test]
    fn where_all_readings_tell_nothing_is_approximated() {
        let kernel = Kernel::new(Symmetry::FULL);
        let data = data(700, 0.0);
        let every = some(700, 700);
        assert_eq!(every, (0..700).collect::<Vec<_>>());
        let (_, sparse) = solve(&data, &kernel, &every).unwrap();
        let whole = data.solve(&kernel).unwrap();
        let at = self::data(1400, 0.0).sites;
        let [sparse, whole] = [sparse, whole].map(|s| means(&data.sites, &kernel, &s, &at));
        let off = (&sparse - &whole).amax();
        assert!(off < 1e-3, "{off}");
    }

    #[test]
    fn uncertain_readings_tell_more_together_than_some_of_them_alone() {
        let kernel = Kernel::new(Symmetry::FULL);
        let data = data(2400, 0.1);
        let telling = some(2400, 400);
        let alone = data.select(&telling);
        let exact = self::data(3000, 0.0);
        let error = |solved: Solved| {
            let known = means(&alone.sites, &kernel, &solved, &exact.sites).add_scalar(-MEAN);
            (known - &exact.values).norm()
        };
        let [some, all] = [
            error(alone.solve(&kernel).unwrap()),
            error(solve(&data, &kernel, &telling).unwrap().1),
        ];
        assert!(all < 0.75 * some, "{all} {some}");
    }
}
