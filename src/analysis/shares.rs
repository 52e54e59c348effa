//! Shares of a function's variance on a lattice that one axis explains, and two.
//!
//! With weights w and v̄ the weighted average, the share of an approximation g is
//! 1 − Σ w (v − g)² / Σ w (v − v̄)². The best g of one axis alone is the average over each line
//! across it; the best additive one, a(x) + b(y), solves the normal equations on the nodes that
//! are there: on a domain that is no box, averages along both axes would be wrong.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// A node: its place along the two axes, its weight and its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Place along each axis.
    pub place: [usize; 2],
    /// Weight, ≥ 0.
    pub weight: f64,
    /// Value, finite.
    pub value: f64,
}

/// Shares of the variance, in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shares {
    /// Share of the best function of each axis alone.
    pub axis: [f64; 2],
    /// Share of the best sum of a function of one axis and a function of the other.
    pub additive: f64,
    /// Share of the best function of both; below 1 where several nodes share a place.
    pub both: f64,
}

impl Shares {
    /// Shares over nodes of a lattice of `nodes` places along the two axes; several may share a
    /// place. `None` if the values are constant up to rounding, or there are none.
    pub fn of(nodes: [usize; 2], cells: &[Cell]) -> Option<Shares> {
        let total: f64 = cells.iter().map(|c| c.weight).sum();
        let mean = cells.iter().map(|c| c.weight * c.value).sum::<f64>() / total;
        let largest = cells.iter().fold(0.0, |a: f64, c| a.max(c.value.abs()));
        let spread = |v: f64| (v - mean) * (v - mean);
        let variance: f64 = cells.iter().map(|c| c.weight * spread(c.value)).sum();
        // A constant keeps the rounding of its own average. Written so that NaN fails.
        let rounding = f64::EPSILON * (2.0 + cells.len() as f64) * largest;
        if !(variance > total * rounding * rounding) {
            return None;
        }
        let sums = Sums::of(nodes, cells, mean);
        let share = |explained: f64| (explained / variance).min(1.0);
        Some(Shares {
            axis: sums.lines.each_ref().map(|line| share(explained(line))),
            additive: share(sums.additive()),
            both: share(explained(&sums.places)),
        })
    }
}

/// Weight, and weighted sum of the deviations from the mean, of every line and every place.
struct Sums {
    lines: [Vec<[f64; 2]>; 2],
    places: Vec<[f64; 2]>,
}

impl Sums {
    fn of(nodes: [usize; 2], cells: &[Cell], mean: f64) -> Self {
        let mut lines = nodes.map(|n| vec![[0.0; 2]; n]);
        let mut places = vec![[0.0; 2]; nodes[0] * nodes[1]];
        for cell in cells {
            let [i, j] = cell.place;
            let part = [cell.weight, cell.weight * (cell.value - mean)];
            let add = |sum: &mut [f64; 2]| *sum = [sum[0] + part[0], sum[1] + part[1]];
            add(&mut lines[0][i]);
            add(&mut lines[1][j]);
            add(&mut places[i * nodes[1] + j]);
        }
        Self { lines, places }
    }

    /// The sum of squares that the best a(x) + b(y) explains: the a are eliminated, and the b solve
    /// what is left. A constant moved from a to b changes nothing, as does one on each part of a
    /// domain in several parts: the equations are singular, and the shortest solution is taken.
    fn additive(&self) -> f64 {
        let [across, along] = &self.lines;
        let (rows, columns) = (across.len(), along.len());
        let weight = |i: usize, j: usize| self.places[i * columns + j][0];
        let mut right = DVector::from_iterator(columns, along.iter().map(|[_, sum]| *sum));
        let weights = DVector::from_iterator(columns, along.iter().map(|[weight, _]| *weight));
        let mut matrix = DMatrix::from_diagonal(&weights);
        for i in (0..rows).filter(|&i| across[i][0] > 0.0) {
            for j in (0..columns).filter(|&j| weight(i, j) > 0.0) {
                let share = weight(i, j) / across[i][0];
                right[j] -= share * across[i][1];
                for l in 0..columns {
                    matrix[(j, l)] -= share * weight(i, l);
                }
            }
        }
        let parts = SymmetricEigen::new(matrix);
        let largest = parts.eigenvalues.amax();
        let turned = parts.eigenvectors.tr_mul(&right);
        // Explained: Σ s²/w over the rows, and what b adds, rᵀ M⁺ r.
        let pairs = parts.eigenvalues.iter().zip(turned.iter());
        let kept = pairs.filter(|(e, _)| **e > 1e-10 * largest);
        let added: f64 = kept.map(|(e, t)| t * t / e).sum();
        explained(across) + added
    }
}

/// The sum of squares that the averages of groups explain.
fn explained(groups: &[[f64; 2]]) -> f64 {
    let filled = groups.iter().filter(|g| g[0] > 0.0);
    filled.map(|[w, s]| s * s / w).sum()
}
