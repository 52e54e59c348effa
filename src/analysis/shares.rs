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
        let between = |groups: &[[f64; 2]]| {
            let filled = groups.iter().filter(|g| g[0] > 0.0);
            filled.map(|[w, s]| s * s / w).sum::<f64>() / variance
        };
        let [first, second] = [&sums.lines[0], &sums.lines[1]].map(|g| between(g));
        Some(Shares {
            axis: [first.min(1.0), second.min(1.0)],
            additive: (sums.additive() / variance).min(1.0),
            both: between(&sums.places).min(1.0),
        })
    }
}

/// Weight, and weighted sum of the deviations from the mean, of every line and every place.
struct Sums {
    nodes: [usize; 2],
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
        Self {
            nodes,
            lines,
            places,
        }
    }

    /// The sum of squares that the best a(x) + b(y) explains: the a are eliminated, and the b solve
    /// what is left. A constant moved from a to b changes nothing, as does one on each part of a
    /// domain in several parts: the equations are singular, and the shortest solution is taken.
    fn additive(&self) -> f64 {
        let [rows, columns] = self.nodes;
        let [across, along] = [&self.lines[0], &self.lines[1]];
        let weight = |i: usize, j: usize| self.places[i * columns + j][0];
        let mut matrix = DMatrix::zeros(columns, columns);
        let mut right = DVector::zeros(columns);
        for j in 0..columns {
            matrix[(j, j)] = along[j][0];
            right[j] = along[j][1];
        }
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
        let filled = across.iter().filter(|g| g[0] > 0.0);
        filled.map(|[w, s]| s * s / w).sum::<f64>() + added
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(
        n: [usize; 2],
        keep: impl Fn(f64, f64) -> bool,
        f: impl Fn(f64, f64) -> f64,
    ) -> Vec<Cell> {
        let mut cells = Vec::new();
        for i in 0..n[0] {
            for j in 0..n[1] {
                let [x, y] = [(i, n[0]), (j, n[1])].map(|(i, n)| (i as f64 + 0.5) / n as f64);
                if keep(x, y) {
                    cells.push(Cell {
                        place: [i, j],
                        weight: 1.0 + x,
                        value: f(x, y),
                    });
                }
            }
        }
        cells
    }

    #[test]
    fn sums_are_additive_on_any_domain() {
        // A triangle, and two parts that share no line.
        let triangle = |x: f64, y: f64| x + y < 1.0;
        let apart = |x: f64, y: f64| (x < 0.4) == (y < 0.4);
        for keep in [&triangle as &dyn Fn(f64, f64) -> bool, &apart] {
            let f = |x: f64, y: f64| x.exp() - 3.0 * y * y;
            let shares = Shares::of([30, 20], &cells([30, 20], keep, f)).unwrap();
            assert!((shares.additive - 1.0).abs() < 1e-12, "{shares:?}");
            assert!((shares.both - 1.0).abs() < 1e-12);
            assert!(shares.axis.iter().all(|s| *s > 0.01 && *s < 0.99));
        }
    }

    #[test]
    fn one_axis_explains_its_own_functions() {
        let triangle = |x: f64, y: f64| x + y < 1.0;
        let n = [25, 40];
        let along_y = Shares::of(n, &cells(n, triangle, |_, y| y.cos())).unwrap();
        assert!((along_y.axis[1] - 1.0).abs() < 1e-13 && along_y.axis[0] < 0.5);
        let along_x = Shares::of(n, &cells(n, triangle, |x, _| x * x)).unwrap();
        assert!((along_x.axis[0] - 1.0).abs() < 1e-13 && along_x.axis[1] < 0.5);
    }

    #[test]
    fn a_product_on_a_box_has_the_shares_of_its_factors() {
        // v = x y with independent x and y of mean m and variance s: Var = m²s_y + m²s_x + s_x s_y.
        let n = [20, 20];
        let mut all = cells(n, |_, _| true, |x, y| x * y);
        all.iter_mut().for_each(|c| c.weight = 1.0);
        let (m, s) = (0.5, (400.0 - 1.0) / 400.0 / 12.0);
        let variance = 2.0 * m * m * s + s * s;
        let shares = Shares::of(n, &all).unwrap();
        for share in shares.axis {
            assert!((share - m * m * s / variance).abs() < 1e-13, "{share}");
        }
        assert!((shares.additive - 2.0 * m * m * s / variance).abs() < 1e-12);
    }

    #[test]
    fn constants_have_no_shares() {
        for value in [0.0, 0.1, 1e300, 1e-300] {
            let n = [9, 7];
            assert_eq!(
                Shares::of(n, &cells(n, |_, _| true, |_, _| value)),
                None,
                "{value}"
            );
        }
        assert_eq!(Shares::of([3, 3], &[]), None);
    }
}
