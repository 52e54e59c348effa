//! A density on the unit square from weights of its cells.

use crate::registry::named;
use smallvec::SmallVec;

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
    rows: usize,
    columns: usize,
    /// Probability of all rows before each, and of all.
    before_row: Vec<f64>,
    /// Of each row, the probability of all columns before each, and of all.
    before_column: Vec<f64>,
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
        let (cells, mut density) = match in_cells {
            InCells::Uniform => (weights.clone(), weights),
            InCells::Bilinear => {
                let corners = corners(&weights, columns, closes);
                let width = columns + 1;
                let cell = |i: usize| {
                    let at = i / columns * width + i % columns;
                    let [a, b] = [at, at + width].map(|k| corners[k] + corners[k + 1]);
                    0.25 * (a + b)
                };
                ((0..weights.len()).map(cell).collect(), corners)
            }
        };
        let total: f64 = cells.iter().sum();
        let scale = cells.len() as f64 / total;
        density.iter_mut().for_each(|d| *d *= scale);
        let (mut before_row, mut before_column) = (vec![0.0], Vec::new());
        let mut of_rows = 0.0;
        for row in cells.chunks_exact(columns) {
            let mut sum = 0.0;
            before_column.push(0.0);
            for cell in row {
                sum += cell / total;
                before_column.push(sum);
            }
            of_rows += sum;
            before_row.push(of_rows);
        }
        Self {
            rows,
            columns,
            before_row,
            before_column,
            density,
            in_cells,
        }
    }

    /// Densities at the corners of a cell: at its first and last column, in its first and last row; of a uniform one all are alike.
    fn corners(&self, row: usize, column: usize) -> [f64; 4] {
        match self.in_cells {
            InCells::Uniform => [self.density[row * self.columns + column]; 4],
            InCells::Bilinear => {
                let at = row * (self.columns + 1) + column;
                let below = at + self.columns + 1;
                [at, at + 1, below, below + 1].map(|k| self.density[k])
            }
        }
    }

    /// Probability of the columns before one, within a row.
    fn before(&self, row: usize, column: usize) -> f64 {
        self.before_column[row * (self.columns + 1) + column]
    }

    /// Bytes that it holds.
    pub(crate) fn bytes(&self) -> usize {
        let all = [&self.before_row, &self.before_column, &self.density];
        all.into_iter().map(|of| size_of_val(&**of)).sum()
    }
}

/// A mixture of tables of one size, each with its share.
pub(super) struct Mixture<'a>(pub SmallVec<[(&'a CellTable, f64); 4]>);

impl Mixture<'_> {
    /// The sum over tables of a number of each times its share.
    #[inline]
    fn sum(&self, of: impl Fn(&CellTable) -> f64) -> f64 {
        self.0.iter().map(|(table, share)| share * of(table)).sum()
    }

    fn corners(&self, row: usize, column: usize) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for (table, share) in &self.0 {
            let of = table.corners(row, column);
            (0..4).for_each(|i| sum[i] += share * of[i]);
        }
        sum
    }

    /// A point by two numbers in [0, 1): by the sums of all tables, so that it does not jump from one table's to another's.
    pub(crate) fn sample(&self, [u, w]: [f64; 2]) -> [f64; 2] {
        let CellTable { rows, columns, .. } = *self.0[0].0;
        let (row, s) = picked(rows, u, |n| self.sum(|table| table.before_row[n]));
        let (column, t) = picked(columns, w, |n| self.sum(|table| table.before(row, n)));
        let [a, b, c, d] = self.corners(row, column);
        let s = linear(a + b, c + d, s);
        let mix = |low: f64, high: f64| low + s * (high - low);
        let t = linear(mix(a, c), mix(b, d), t);
        [
            (row as f64 + s) / rows as f64,
            (column as f64 + t) / columns as f64,
        ]
    }

    /// Density at a point.
    pub(crate) fn pdf(&self, [x, v]: [f64; 2]) -> f64 {
        let CellTable { rows, columns, .. } = *self.0[0].0;
        let along = |x: f64, cells: usize| {
            let at = x * cells as f64;
            let cell = (at as usize).min(cells - 1);
            (cell, at - cell as f64)
        };
        let ((row, s), (column, t)) = (along(x, rows), along(v, columns));
        let [a, b, c, d] = self.corners(row, column);
        (1.0 - s) * ((1.0 - t) * a + t * b) + s * ((1.0 - t) * c + t * d)
    }
}

/// The step that the share `u` in [0, 1) of all of them falls on, and where on it, by the sums of the steps before each.
fn picked(steps: usize, u: f64, before: impl Fn(usize) -> f64) -> (usize, f64) {
    let target = u * before(steps);
    // Steps of no height are never picked.
    let (mut low, mut high) = (0, steps);
    while high - low > 1 {
        let middle = (low + high) / 2;
        match before(middle) <= target {
            true => low = middle,
            false => high = middle,
        }
    }
    let (start, end) = (before(low), before(high));
    let height = end - start;
    let t = if height > 0.0 {
        (target - start) / height
    } else {
        0.5
    };
    (low, t.clamp(0.0, 1.0))
}

/// The mean of the cells that meet at each corner.
fn corners(weights: &[f64], columns: usize, closes: bool) -> Vec<f64> {
    let rows = weights.len() / columns;
    let mut corners = Vec::with_capacity((rows + 1) * (columns + 1));
    for row in 0..=rows {
        let of_rows = [row.saturating_sub(1), row.min(rows - 1)];
        for column in 0..=columns {
            let [first, last] = if closes {
                [columns - 1, 0]
            } else {
                [0, columns - 1]
            };
            let before = column.checked_sub(1).unwrap_or(first);
            let after = if column == columns { last } else { column };
            let meet =
                of_rows.map(|r| weights[r * columns + before] + weights[r * columns + after]);
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
