//! A density on the unit square from weights of its cells.

use crate::registry::named;
use crate::sampling::Steps;

named! {
    /// Course of a density inside the cells of a table.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum InCells {
        Uniform = "uniform": "the same everywhere in a cell",
        Bilinear = "bilinear": "bilinear between corners, where it is the mean of the cells that meet",
    }
}

/// A density on the unit square, tabulated over cells of equal size: rows along x, columns along v.
#[derive(Clone, Debug)]
pub(super) struct CellTable {
    columns: usize,
    /// Cumulative probability of the rows, and of the columns of each.
    rows: Steps,
    in_row: Vec<Steps>,
    /// Densities of cells, or at their corners.
    density: Vec<f64>,
    in_cells: InCells,
}

impl CellTable {
    /// Of weights ≥ 0, row after row; if all are 0 it is uniform. `closes`: v = 0 and 1 are one place, else each is a mirror.
    pub(crate) fn new(
        columns: usize,
        mut weights: Vec<f64>,
        in_cells: InCells,
        closes: bool,
    ) -> Self {
        let rows = weights.len() / columns;
        if !weights.iter().any(|w| *w > 0.0) {
            weights.fill(1.0);
        }
        let total: f64 = weights.iter().sum();
        let scale = weights.len() as f64 / total;
        weights.iter_mut().for_each(|w| *w *= scale);
        let (cells, density) = match in_cells {
            InCells::Uniform => (weights.clone(), weights),
            InCells::Bilinear => {
                let corners = corners(&weights, columns, closes);
                let width = columns + 1;
                let cell = |i: usize| {
                    let at = i / columns * width + i % columns;
                    let [a, b] = [at, at + width].map(|k| corners[k] + corners[k + 1]);
                    0.25 * (a + b)
                };
                let cells: Vec<f64> = (0..weights.len()).map(cell).collect();
                let scale = cells.len() as f64 / cells.iter().sum::<f64>();
                let scaled = |all: Vec<f64>| all.into_iter().map(|w| w * scale).collect();
                (scaled(cells), scaled(corners))
            }
        };
        let of_rows = cells.chunks_exact(columns);
        let sums: Vec<f64> = of_rows.clone().map(|row| row.iter().sum()).collect();
        let in_row = of_rows.zip(&sums).map(|(row, sum)| Steps::new(row, *sum));
        Self {
            columns,
            in_row: in_row.collect(),
            rows: Steps::new(&sums, (rows * columns) as f64),
            density,
            in_cells,
        }
    }

    /// A point by two numbers in [0, 1).
    pub(crate) fn sample(&self, [u, w]: [f64; 2]) -> [f64; 2] {
        let (row, s) = self.rows.picked(u);
        let (column, t) = self.in_row[row].picked(w);
        let [s, t] = match self.in_cells {
            InCells::Uniform => [s, t],
            InCells::Bilinear => {
                let [a, b, c, d] = self.corners_of(row, column);
                let s = linear(a + b, c + d, s);
                let mix = |low: f64, high: f64| low + s * (high - low);
                [s, linear(mix(a, c), mix(b, d), t)]
            }
        };
        let rows = self.in_row.len() as f64;
        [
            (row as f64 + s) / rows,
            (column as f64 + t) / self.columns as f64,
        ]
    }

    /// Density at a point.
    pub(crate) fn pdf(&self, [x, v]: [f64; 2]) -> f64 {
        let along = |x: f64, cells: usize| {
            let at = x * cells as f64;
            let cell = (at as usize).min(cells - 1);
            (cell, at - cell as f64)
        };
        let (row, s) = along(x, self.in_row.len());
        let (column, t) = along(v, self.columns);
        match self.in_cells {
            InCells::Uniform => self.density[row * self.columns + column],
            InCells::Bilinear => {
                let [a, b, c, d] = self.corners_of(row, column);
                (1.0 - s) * ((1.0 - t) * a + t * b) + s * ((1.0 - t) * c + t * d)
            }
        }
    }

    /// Densities at the corners of a cell: at its first and last column, in its first and last row.
    fn corners_of(&self, row: usize, column: usize) -> [f64; 4] {
        let at = row * (self.columns + 1) + column;
        let below = at + self.columns + 1;
        [at, at + 1, below, below + 1].map(|k| self.density[k])
    }

    /// Bytes that it holds.
    pub(crate) fn bytes(&self) -> usize {
        let steps = self.in_row.iter().chain([&self.rows]);
        steps.map(Steps::bytes).sum::<usize>() + size_of_val(&*self.density)
    }
}

/// The mean of the cells that meet at each corner.
fn corners(weights: &[f64], columns: usize, closes: bool) -> Vec<f64> {
    let rows = weights.len() / columns;
    let mut corners = Vec::with_capacity((rows + 1) * (columns + 1));
    for row in 0..=rows {
        let of_rows = [row.saturating_sub(1), row.min(rows - 1)];
        for column in 0..=columns {
            let [first, last] = if closes { [columns - 1, 0] } else { [0, columns - 1] };
            let before = column.checked_sub(1).unwrap_or(first);
            let after = if column == columns { last } else { column };
            let meet = of_rows.map(|r| weights[r * columns + before] + weights[r * columns + after]);
            corners.push(0.25 * (meet[0] + meet[1]));
        }
    }
    corners
}

/// Where the integral of a density that goes straight from `a` at 0 to `b` at 1 is the share `u` of all of it.
fn linear(a: f64, b: f64, u: f64) -> f64 {
    let all = u * (a + b);
    let root = (a * a + (b - a) * all).max(0.0).sqrt();
    match a + root > 0.0 {
        true => (all / (a + root)).clamp(0.0, 1.0),
        false => u,
    }
}
