//! Functions on the unit square, linear between nodes, one for each incidence; and the map of the square onto itself
//! that makes their density uniform.
//!
//! x is the fast axis. The marginal density of y, then that of x at y, are inverted: with f linear
//! between the nodes both are quadratic in each cell (Dupuy and Jakob 2018, §3.4). Of several incidences all that is
//! looked up is weighted, as the distributions that belong to them are.

use smallvec::SmallVec;

/// The grids that an incidence lies between, and their weights, above 0, of sum 1.
pub type Weighted = SmallVec<[(usize, f64); 4]>;

/// A cell among `nodes` and the place in it: that of `x` in [0, 1].
#[inline]
fn cell(x: f64, nodes: usize) -> (usize, f64) {
    let x = x.clamp(0.0, 1.0) * (nodes - 1) as f64;
    let cell = (x as usize).min(nodes - 2);
    (cell, x - cell as f64)
}

#[inline]
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    (1.0 - t) * a + t * b
}

/// Grids of equal size.
#[derive(Clone, Debug)]
pub struct Grids {
    /// Nodes along x and y, at least 2.
    pub size: [usize; 2],
    /// Values, grid after grid, x fastest.
    pub values: Vec<f32>,
}

impl Grids {
    /// The value of one grid in a cell, by its corners.
    #[inline]
    fn corners(&self, grid: usize, [column, row]: [usize; 2]) -> [f64; 4] {
        let [w, h] = self.size;
        let first = w * (h * grid + row) + column;
        let v = &self.values;
        [first, first + 1, first + w, first + w + 1].map(|i| f64::from(v[i]))
    }

    /// The value at a place of the square; grid `g` of the weighted ones is `first + step * g`.
    #[inline]
    pub(crate) fn value_at(
        &self,
        grids: &[(usize, f64)],
        [first, step]: [usize; 2],
        [x, y]: [f64; 2],
    ) -> f64 {
        let [(column, u), (row, v)] = [cell(x, self.size[0]), cell(y, self.size[1])];
        let mut sum = 0.0;
        for &(grid, weight) in grids {
            let [a, b, c, d] = self.corners(first + step * grid, [column, row]);
            sum += weight * lerp(lerp(a, b, u), lerp(c, d, u), v);
        }
        match sum.is_nan() {
            true => self.of_known(grids, [first, step], [x, y]),
            false => sum,
        }
    }

    /// The value at a place from the nodes that are not NaN, their weights renormalised; NaN if there is none.
    fn of_known(&self, grids: &[(usize, f64)], [first, step]: [usize; 2], [x, y]: [f64; 2]) -> f64 {
        let [(column, u), (row, v)] = [cell(x, self.size[0]), cell(y, self.size[1])];
        let [mut sum, mut total] = [0.0; 2];
        for &(grid, weight) in grids {
            let corners = self.corners(first + step * grid, [column, row]);
            let shares = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
            let known = corners
                .iter()
                .zip(shares)
                .filter(|(corner, _)| !corner.is_nan());
            for (corner, share) in known {
                sum += weight * share * corner;
                total += weight * share;
            }
        }
        // 0/0 is NaN.
        sum / total
    }

    /// The value of the only grid at a place of the square.
    #[inline]
    pub(crate) fn one(&self, place: [f64; 2]) -> f64 {
        self.value_at(&[(0, 1.0)], [0, 1], place)
    }
}

/// Densities on the square, each of integral 1.
#[derive(Clone, Debug)]
pub struct Densities {
    grids: Grids,
    /// 1 / the integral of each grid.
    scale: Vec<f64>,
    /// Integral along x up to each node, of a normalised grid.
    along_x: Vec<f64>,
    /// Integral over all x and up to each row.
    up_to: Vec<f64>,
}

impl Densities {
    /// Those in proportion to grids of values of at least 0; `None` if one is 0 everywhere.
    pub fn new(grids: Grids) -> Option<Self> {
        let [w, h] = grids.size;
        let steps = [w, h].map(|n| 0.5 / (n - 1) as f64);
        let mut along_x = Vec::with_capacity(grids.values.len());
        let (mut up_to, mut scale) = (Vec::new(), Vec::new());
        for grid in grids.values.chunks_exact(w * h) {
            let first = [along_x.len(), up_to.len()];
            let (mut total, mut before) = (0.0, 0.0);
            for (y, row) in grid.chunks_exact(w).enumerate() {
                let mut sum = 0.0;
                along_x.push(0.0);
                for pair in row.windows(2) {
                    sum += steps[0] * (f64::from(pair[0]) + f64::from(pair[1]));
                    along_x.push(sum);
                }
                if y > 0 {
                    total += steps[1] * (before + sum);
                }
                up_to.push(total);
                before = sum;
            }
            if !(total > 0.0) {
                return None;
            }
            scale.push(1.0 / total);
            along_x[first[0]..].iter_mut().for_each(|v| *v /= total);
            up_to[first[1]..].iter_mut().for_each(|v| *v /= total);
        }
        Some(Self {
            grids,
            scale,
            along_x,
            up_to,
        })
    }

    /// Where a place of the square is in the uniform one, and the density there.
    #[inline]
    pub fn uniform(&self, grids: &Weighted, [x, y]: [f64; 2]) -> ([f64; 2], f64) {
        let [w, h] = self.grids.size;
        let [(column, u), (row, v)] = [cell(x, w), cell(y, h)];
        let mut corners = [0.0; 4];
        // Integrals along both rows up to the column and to the end, and up to the row.
        let (mut left, mut whole, mut below) = ([0.0; 2], [0.0; 2], 0.0);
        for &(grid, weight) in grids {
            let scale = weight * self.scale[grid];
            for (sum, corner) in corners
                .iter_mut()
                .zip(self.grids.corners(grid, [column, row]))
            {
                *sum += scale * corner;
            }
            for side in 0..2 {
                let first = w * (h * grid + row + side);
                left[side] += weight * self.along_x[first + column];
                whole[side] += weight * self.along_x[first + w - 1];
            }
            below += weight * self.up_to[h * grid + row];
        }
        let [a, b, c, d] = corners;
        let [from, to] = [lerp(a, c, v), lerp(b, d, v)];
        let within = |t: f64, from: f64, to: f64, nodes: usize| {
            t * lerp(from, to, 0.5 * t) / (nodes - 1) as f64
        };
        let of_row = lerp(whole[0], whole[1], v);
        let along = lerp(left[0], left[1], v) + within(u, from, to, w);
        let s = if of_row > 0.0 { along / of_row } else { x };
        let t = below + within(v, whole[0], whole[1], h);
        ([s, t], lerp(from, to, u))
    }

    /// The place that is at `[s, t]` in the uniform square, of one grid: the inverse of [`uniform`](Self::uniform).
    pub fn place(&self, grid: usize, [s, t]: [f64; 2]) -> [f64; 2] {
        let [w, h] = self.grids.size;
        let up_to = &self.up_to[h * grid..][..h];
        let row = up_to.partition_point(|c| *c < t).clamp(1, h - 1) - 1;
        let rows = [row, row + 1].map(|r| &self.along_x[w * (h * grid + r)..][..w]);
        let [a, b] = rows.map(|r| r[w - 1]);
        let v = solve((t - up_to[row]) * (h - 1) as f64, a, b);
        let along = |i: usize| lerp(rows[0][i], rows[1][i], v);
        let wanted = s * along(w - 1);
        let (mut low, mut high) = (0, w - 1);
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            match along(middle) < wanted {
                true => low = middle,
                false => high = middle,
            }
        }
        let [a, b, c, d] = self.grids.corners(grid, [low, row]);
        let [from, to] = [lerp(a, c, v), lerp(b, d, v)].map(|f| f * self.scale[grid]);
        let u = solve((wanted - along(low)) * (w - 1) as f64, from, to);
        [
            (low as f64 + u) / (w - 1) as f64,
            (row as f64 + v) / (h - 1) as f64,
        ]
    }
}

/// t in [0, 1] where the integral of a line from `a` to `b`, both at least 0, is `area`.
fn solve(area: f64, a: f64, b: f64) -> f64 {
    // The root of (b − a) t² / 2 + a t = area that keeps its digits where a = b.
    let root = (a * a + 2.0 * (b - a) * area).max(0.0).sqrt();
    let t = 2.0 * area / (a + root);
    if t.is_finite() {
        t.clamp(0.0, 1.0)
    } else {
        0.0
    }
}
