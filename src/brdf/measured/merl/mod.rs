//! Isotropic tables in the format of the MERL database (Matusik et al. 2003).
//!
//! A plane holds one channel of f_r over (theta_h, theta_d, phi_d), square-root spaced in theta_h;
//! [`grid`] has the angles and their cells, [`mod@file`] the bytes. Where in its cell a value is exact
//! the format does not say. Readers hold it constant over the cell (the database's own, pbrt-v2, BRDF Explorer, Falcor), which
//! puts it at the **centre**; libbsdf interpolates from **corner** to corner. See [`Nodes`].
//!
//! Interpolations:
//! * `nearest`: the value of the cell the pair falls in, the reference reader's but for rounding at its edges;
//! * `trilinear`: between the eight nodes around the pair, in index coordinates. Nodes without data
//!   are left out and the weights of the others renormalised. Periodic in phi_d; constant beyond
//!   the last node of theta_h and theta_d. All phi_d at theta_h = 0 and one theta_d are one configuration, and so are those at
//!   theta_d = 0 and one theta_h: values go over to the mean of the row's data, so that they do not jump there.
//!
//! Missing: a cell with no data (`nearest`), or no node with data and weight (`trilinear`). It is
//! never read as 0. Below the horizon the value is 0.

pub mod file;
pub mod grid;
mod spec;
mod write;

pub use file::{SCALE, check};
pub use grid::{MerlGrid, Nodes};
pub use spec::{ENTRY, Interpolation, MerlSpec};
pub(super) use write::NOT_ISOTROPIC;
pub(crate) use write::tabulate;
pub use write::write_merl;

use super::TableError;
use super::doubts::{Doubts, is_doubted};
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{BLOCK, DirectionPair, PairBlock, Symmetry};
use file::{is_data, no_data};
use grid::Corner;
use pulp::{Arch, NullaryFnOnce};

/// A MERL table as a BRDF.
#[derive(Clone, Debug)]
pub struct Merl {
    grid: MerlGrid,
    cells: Cells,
    interpolation: Interpolation,
    bilateral: bool,
    doubts: Doubts,
}

/// The cells of a table, and after them the [means over phi_d](MerlGrid::POLES) where phi_d has no meaning.
#[derive(Clone, Debug)]
enum Cells {
    /// In sr⁻¹, negative where any channel has no data.
    Luminance(Vec<[f64; 1]>),
    /// R, G, B as stored, unscaled.
    Rgb(Vec<[f64; 3]>),
}

impl Merl {
    fn new(grid: MerlGrid, mut cells: Cells, doubts: Doubts) -> Result<Self, TableError> {
        match &mut cells {
            Cells::Luminance(cells) => cells.extend(means_at_poles(cells, grid)),
            Cells::Rgb(cells) => cells.extend(means_at_poles(cells, grid)),
        }
        let table = Self {
            grid,
            cells,
            interpolation: Interpolation::default(),
            bilateral: true,
            doubts,
        };
        if (0..grid.cells()).all(|i| table.at(i).is_none()) {
            return Err(no_data());
        }
        Ok(table)
    }

    /// The table with another interpolation; a fresh one is trilinear.
    #[must_use]
    pub fn with_interpolation(mut self, interpolation: Interpolation) -> Self {
        self.interpolation = interpolation;
        self
    }

    /// The table with values at other places of its cells; a fresh one has them at centres.
    #[must_use]
    pub fn with_nodes(mut self, nodes: Nodes) -> Self {
        self.grid = self.grid.with_nodes(nodes);
        self
    }

    /// The table, declared bilaterally symmetric or not; a fresh one is. The format does not
    /// guarantee it and look-ups do not use it: it tells others whether phi_d and −phi_d may be folded.
    #[must_use]
    pub(crate) fn with_bilateral(mut self, bilateral: bool) -> Self {
        self.bilateral = bilateral;
        self
    }

    /// The layout.
    pub fn grid(&self) -> MerlGrid {
        self.grid
    }

    /// The planes as held: R, G, B as stored in the file, or one plane of luminance in sr⁻¹.
    pub fn planes(&self) -> Vec<Vec<f64>> {
        fn planes<const N: usize>(cells: &[[f64; N]]) -> Vec<Vec<f64>> {
            let plane = |c: usize| cells.iter().map(|cell| cell[c]).collect();
            (0..N).map(plane).collect()
        }
        let own = ..self.grid.cells();
        match &self.cells {
            Cells::Luminance(cells) => planes(&cells[own]),
            Cells::Rgb(cells) => planes(&cells[own]),
        }
    }

    /// f_r (sr⁻¹) of one cell; in luminance all three values are the luminance. `None` without data
    /// or outside the table.
    pub fn value(&self, cell: [usize; 3]) -> Option<[f64; 3]> {
        let inside = cell.iter().zip(self.grid.dims()).all(|(&i, n)| i < n);
        inside.then(|| self.at(self.grid.index(cell)))?
    }

    /// Number of cells without data.
    pub fn missing_cells(&self) -> usize {
        (0..self.grid.cells())
            .filter(|&i| self.at(i).is_none())
            .count()
    }

    fn at(&self, i: usize) -> Option<[f64; 3]> {
        match &self.cells {
            Cells::Luminance(cells) => data(cells[i]).map(|[v]| [v; 3]),
            Cells::Rgb(cells) => data(cells[i]),
        }
    }
}

impl Brdf for Merl {
    fn channels(&self) -> &Channels {
        match &self.cells {
            Cells::Luminance(_) => &Channels::Luminance,
            Cells::Rgb(_) => &Channels::Rgb,
        }
    }

    fn symmetry(&self) -> Symmetry {
        self.grid.symmetry(self.bilateral)
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn remarks(&self) -> Vec<String> {
        let [_, n_d, n_phi] = self.grid.dims();
        let pair = |i: usize| {
            let row = i / n_phi;
            move || self.grid.pair([row / n_d, row % n_d, i % n_phi])
        };
        let cells = 0..self.grid.cells();
        let first = cells.filter_map(|i| self.at(i).map(|[value, ..]| (i, value)));
        let doubted = first.filter(|(i, value)| is_doubted(*value, pair(*i)));
        let mut doubts = self.doubts.clone();
        doubts.look_for_zeros(doubted.map(|(_, value)| value));
        doubts.remarks()
    }

    fn cells_without_reading(&self) -> usize {
        self.doubts.marks.count()
    }

    fn as_merl(&self) -> Option<&Merl> {
        Some(self)
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        match &self.cells {
            Cells::Luminance(cells) => self.one(cells, pair, out),
            Cells::Rgb(cells) => self.one(cells, pair, out),
        }
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        match &self.cells {
            Cells::Luminance(cells) => self.batch(cells, pairs, out, presence),
            Cells::Rgb(cells) => self.batch(cells, pairs, out, presence),
        }
    }
}

impl Merl {
    fn one<const N: usize>(
        &self,
        cells: &[[f64; N]],
        pair: &DirectionPair,
        out: &mut [f64],
    ) -> Presence
    where
        [f64; N]: Cell<N>,
    {
        let found = if pair.is_above_horizon() {
            self.look_up(cells, self.grid.coordinates(pair))
        } else {
            Some([0.0; N])
        };
        out.copy_from_slice(&found.unwrap_or([0.0; N]));
        presence(&found)
    }

    fn batch<const N: usize>(
        &self,
        cells: &[[f64; N]],
        pairs: &[DirectionPair],
        out: &mut [f64],
        presence: &mut [Presence],
    ) where
        [f64; N]: Cell<N>,
    {
        Arch::new().dispatch(LookUps {
            table: self,
            cells,
            pairs,
            out: out.as_chunks_mut().0,
            presence,
        });
    }

    /// The value at index coordinates.
    #[inline(always)]
    fn look_up<const N: usize>(&self, cells: &[[f64; N]], coordinates: [f64; 3]) -> Option<[f64; N]>
    where
        [f64; N]: Cell<N>,
    {
        let grid = self.grid;
        match self.interpolation {
            Interpolation::Nearest => data(cells[grid.index_at(coordinates) as usize]),
            Interpolation::Trilinear => trilinear(grid, cells, grid.corner(coordinates)),
        }
    }
}

/// Look-ups of many pairs.
struct LookUps<'a, const N: usize> {
    table: &'a Merl,
    cells: &'a [[f64; N]],
    pairs: &'a [DirectionPair],
    out: &'a mut [[f64; N]],
    presence: &'a mut [Presence],
}

impl<const N: usize> NullaryFnOnce for LookUps<'_, N>
where
    [f64; N]: Cell<N>,
{
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { table, cells, .. } = self;
        let mut block = PairBlock::new();
        let [mut h, mut d, mut phi] = [[0.0; BLOCK]; 3];
        let mut index = [0u32; BLOCK];
        let mut corners = [Corner::default(); BLOCK];
        let out = self.out.chunks_mut(BLOCK);
        let out = out.zip(self.presence.chunks_mut(BLOCK));
        for (pairs, (out, presences)) in self.pairs.chunks(BLOCK).zip(out) {
            block.load(pairs);
            for j in 0..BLOCK {
                [h[j], d[j], phi[j]] = table.grid.coordinates_of(block.vectors(j));
            }
            let targets = out.iter_mut().zip(presences).enumerate();
            match table.interpolation {
                Interpolation::Nearest => {
                    for j in 0..BLOCK {
                        index[j] = table.grid.index_at([h[j], d[j], phi[j]]);
                    }
                    for (j, (out, of)) in targets {
                        let cell = cells[index[j] as usize];
                        let there = cell.is_data() | block.is_below(j);
                        let shown = cell.is_data() & !block.is_below(j);
                        let value = cell.scaled();
                        *of = if there {
                            Presence::Present
                        } else {
                            Presence::Missing
                        };
                        for (out, v) in out.iter_mut().zip(value) {
                            *out = if shown { v } else { 0.0 };
                        }
                    }
                }
                Interpolation::Trilinear => {
                    for j in 0..BLOCK {
                        corners[j] = table.grid.corner([h[j], d[j], phi[j]]);
                    }
                    for (j, (out, of)) in targets {
                        let found = if block.is_below(j) {
                            Some([0.0; N])
                        } else {
                            trilinear(table.grid, cells, corners[j])
                        };
                        *of = presence(&found);
                        *out = found.unwrap_or([0.0; N]);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn presence<T>(found: &Option<T>) -> Presence {
    match found {
        Some(_) => Presence::Present,
        None => Presence::Missing,
    }
}

/// One cell of a table: a value per channel, as held.
trait Cell<const N: usize>: Copy {
    /// True if every channel holds data.
    fn is_data(&self) -> bool;

    /// f_r (sr⁻¹).
    fn scaled(self) -> [f64; N];
}

impl Cell<1> for [f64; 1] {
    #[inline(always)]
    fn is_data(&self) -> bool {
        self[0] >= 0.0
    }

    #[inline(always)]
    fn scaled(self) -> [f64; 1] {
        self
    }
}

impl Cell<3> for [f64; 3] {
    #[inline(always)]
    fn is_data(&self) -> bool {
        let [r, g, b] = *self;
        is_data(r) & is_data(g) & is_data(b)
    }

    #[inline(always)]
    fn scaled(self) -> [f64; 3] {
        let [r, g, b] = self;
        [r * SCALE[0], g * SCALE[1], b * SCALE[2]]
    }
}

/// f_r of a cell if it holds data.
#[inline(always)]
fn data<const N: usize>(cell: [f64; N]) -> Option<[f64; N]>
where
    [f64; N]: Cell<N>,
{
    cell.is_data().then(|| cell.scaled())
}

/// The means over phi_d of cells that hold data, as held; −1 if none does.
fn means_at_poles<const N: usize>(cells: &[[f64; N]], grid: MerlGrid) -> [[f64; N]; MerlGrid::POLES]
where
    [f64; N]: Cell<N>,
{
    let n_phi = grid.dims()[2];
    std::array::from_fn(|i| {
        let row = grid.index(MerlGrid::row_of_mean(i));
        let cells = cells[row..row + n_phi].iter();
        let data = cells.filter(|cell| cell.is_data()).zip(1u32..);
        // Of equal values it is that value, and of large ones finite.
        data.fold([-1.0; N], |mean, (cell, n)| {
            let mean = if n == 1 { *cell } else { mean };
            std::array::from_fn(|c| mean[c] + (cell[c] - mean[c]) / f64::from(n))
        })
    })
}

#[inline(always)]
fn trilinear<const N: usize>(
    grid: MerlGrid,
    table: &[[f64; N]],
    Corner { whole, part }: Corner,
) -> Option<[f64; N]>
where
    [f64; N]: Cell<N>,
{
    let n_phi = grid.dims()[2];
    let last = grid.last_row();
    let [h, d, phi] = whole;
    let [h, d, phi] = [h as usize, d as usize, phi as usize];
    let [f_h, f_d, f_phi] = part;
    let next = if phi + 1 < n_phi { phi + 1 } else { 0 };
    let (h_next, d_next) = ((h + 1).min(last), (d + 1).min(last));
    let corners = [[h, d], [h, d_next], [h_next, d], [h_next, d_next]];
    let (g_h, g_d, g_phi) = (1.0 - f_h, 1.0 - f_d, 1.0 - f_phi);
    let row_weights = [g_h * g_d, g_h * f_d, f_h * g_d, f_h * f_d];
    let mut nodes = [[[0.0; N]; 2]; 4];
    for (nodes, [h, d]) in nodes.iter_mut().zip(corners) {
        let cells = [phi, next].map(|phi| grid.position([h, d], phi));
        for (node, cell) in nodes.iter_mut().zip(cells) {
            *node = table[cell];
        }
    }

    // Away from the horizon every node holds data, and one predictable branch replaces eight
    // choices and a division.
    let all = nodes
        .iter()
        .flatten()
        .fold(true, |all, &node| all & node.is_data());
    let (mut sum, mut total) = ([0.0; N], 0.0);
    for (pair, w) in nodes.into_iter().zip(row_weights) {
        for (node, w) in pair.into_iter().zip([w * g_phi, w * f_phi]) {
            if all || node.is_data() {
                total += w;
                for (sum, v) in sum.iter_mut().zip(node) {
                    *sum += w * v;
                }
            }
        }
    }
    if all {
        Some(sum.scaled())
    } else {
        (total > 0.0).then(|| sum.map(|v| v / total).scaled())
    }
}
