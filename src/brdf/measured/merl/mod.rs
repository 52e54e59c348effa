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
mod write;

pub use file::{SCALE, check};
pub use grid::{MerlGrid, Nodes};
pub(super) use write::NOT_ISOTROPIC;
pub(crate) use write::tabulate;
pub use write::write_merl;

use super::doubts::{Doubts, doubted};
use super::specs::{file_table, length};
use super::{FileFormat, TableError, without_wavelengths, write_file};
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{BLOCK, DirectionPair, PairBlock, Symmetry};
use crate::numeric::vectorised;
use file::{is_data, no_data};
use grid::Corner;
use serde::{Deserialize, Serialize};

/// Interpolation of a table between its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// Between the eight nodes around the pair.
    #[default]
    Trilinear,
    /// The cell the pair falls in, as the reference reader does.
    Nearest,
}

/// A MERL table as a BRDF.
#[derive(Clone, Debug)]
pub struct Merl {
    grid: MerlGrid,
    cells: Cells,
    interpolation: Interpolation,
    /// True as it is read. The format does not guarantee it and look-ups do not use it: it says whether phi_d and −phi_d may be folded.
    pub(super) bilateral: bool,
    doubts: Doubts,
}

/// The cells of a table.
#[derive(Clone, Debug)]
enum Cells {
    /// In sr⁻¹, negative where any channel has no data.
    Luminance(Held<1>),
    /// R, G, B as stored.
    Rgb(Held<3>),
}

/// Cells of so many channels.
#[derive(Clone, Debug)]
struct Held<const N: usize> {
    /// Those of the file, and after them the [means over phi_d](MerlGrid::POLES) where phi_d has no meaning.
    cells: Vec<[f64; N]>,
    /// Factors to sr⁻¹.
    scale: [f64; N],
}

impl Merl {
    fn new(grid: MerlGrid, mut cells: Cells, doubts: Doubts) -> Result<Self, TableError> {
        match &mut cells {
            Cells::Luminance(held) => held.add_means(grid),
            Cells::Rgb(held) => held.add_means(grid),
        }
        let table = Self {
            grid,
            cells,
            interpolation: Interpolation::default(),
            bilateral: true,
            doubts,
        };
        if (0..grid.cells()).all(|i| table.cell(i).is_none()) {
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

    /// How values between nodes are found.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// The layout.
    pub fn grid(&self) -> MerlGrid {
        self.grid
    }

    /// The planes as held: R, G, B as stored in the file, or one plane of luminance in sr⁻¹.
    pub fn planes(&self) -> Vec<Vec<f64>> {
        match &self.cells {
            Cells::Luminance(held) => held.planes(self.grid),
            Cells::Rgb(held) => held.planes(self.grid),
        }
    }

    /// f_r (sr⁻¹) of one cell; in luminance all three values are the luminance. `None` without data
    /// or outside the table.
    pub fn value(&self, cell: [usize; 3]) -> Option<[f64; 3]> {
        let inside = cell.iter().zip(self.grid.dims()).all(|(&i, n)| i < n);
        inside.then(|| self.cell(self.grid.index(cell)))?
    }

    fn cell(&self, i: usize) -> Option<[f64; 3]> {
        match &self.cells {
            Cells::Luminance(held) => held.data(i).map(|[v]| [v; 3]),
            Cells::Rgb(held) => held.data(i),
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

    fn remarks(&self) -> Vec<String> {
        let [_, n_d, n_phi] = self.grid.dims();
        let pair = |i: usize| {
            let row = i / n_phi;
            self.grid.pair([row / n_d, row % n_d, i % n_phi])
        };
        let cells = 0..self.grid.cells();
        let first = cells.filter_map(|i| self.cell(i).map(|[value, ..]| (i, value)));
        let mut doubts = self.doubts.clone();
        doubts.look_for_zeros(first.filter_map(|(i, value)| doubted(value, || pair(i))));
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
            Cells::Luminance(held) => held.one(self, pair, out),
            Cells::Rgb(held) => held.one(self, pair, out),
        }
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        match &self.cells {
            Cells::Luminance(held) => held.batch(self, pairs, out, presence),
            Cells::Rgb(held) => held.batch(self, pairs, out, presence),
        }
    }
}

/// True if every channel of a cell holds data.
#[inline(always)]
fn holds_data<const N: usize>(cell: &[f64; N]) -> bool {
    cell.iter().fold(true, |all, v| all & is_data(*v))
}

impl<const N: usize> Held<N> {
    fn one(&self, table: &Merl, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let (grid, interpolation) = (table.grid, table.interpolation);
        let coordinates = || grid.coordinates(pair);
        let found = match interpolation {
            _ if !pair.is_above_horizon() => Some([0.0; N]),
            Interpolation::Nearest => self.data(grid.index_at(coordinates()) as usize),
            Interpolation::Trilinear => self.trilinear(grid, grid.corner(coordinates())),
        };
        out.copy_from_slice(&found.unwrap_or([0.0; N]));
        Presence::of(found.is_some())
    }

    fn batch(
        &self,
        table: &Merl,
        pairs: &[DirectionPair],
        out: &mut [f64],
        presence: &mut [Presence],
    ) {
        vectorised!(self.look_up(table, pairs, out.as_chunks_mut().0, presence));
    }

    /// Looks up many pairs.
    #[inline(always)]
    fn look_up(
        &self,
        table: &Merl,
        pairs: &[DirectionPair],
        out: &mut [[f64; N]],
        presence: &mut [Presence],
    ) {
        let mut block = PairBlock::new();
        let [mut h, mut d, mut phi] = [[0.0; BLOCK]; 3];
        let mut index = [0u32; BLOCK];
        let mut corners = [Corner::default(); BLOCK];
        let out = out.chunks_mut(BLOCK);
        let out = out.zip(presence.chunks_mut(BLOCK));
        for (pairs, (out, presences)) in pairs.chunks(BLOCK).zip(out) {
            block.load(pairs);
            for j in 0..BLOCK {
                [h[j], d[j], phi[j]] = table.grid.coordinates_of(block.vectors(j));
            }
            match table.interpolation {
                Interpolation::Nearest => {
                    for j in 0..BLOCK {
                        index[j] = table.grid.index_at([h[j], d[j], phi[j]]);
                    }
                }
                Interpolation::Trilinear => {
                    for j in 0..BLOCK {
                        corners[j] = table.grid.corner([h[j], d[j], phi[j]]);
                    }
                }
            }
            for (j, (out, of)) in out.iter_mut().zip(presences).enumerate() {
                let found = match table.interpolation {
                    _ if block.is_below(j) => Some([0.0; N]),
                    Interpolation::Nearest => self.data(index[j] as usize),
                    Interpolation::Trilinear => self.trilinear(table.grid, corners[j]),
                };
                *of = Presence::of(found.is_some());
                *out = found.unwrap_or([0.0; N]);
            }
        }
    }

    /// The cells of the file, a plane a channel.
    fn planes(&self, grid: MerlGrid) -> Vec<Vec<f64>> {
        let own = &self.cells[..grid.cells()];
        let plane = |c: usize| own.iter().map(|cell| cell[c]).collect();
        (0..N).map(plane).collect()
    }

    /// f_r (sr⁻¹) of values as held.
    #[inline(always)]
    fn scaled(&self, values: [f64; N]) -> [f64; N] {
        std::array::from_fn(|c| values[c] * self.scale[c])
    }

    /// f_r of a cell if it holds data.
    #[inline(always)]
    fn data(&self, i: usize) -> Option<[f64; N]> {
        let cell = self.cells[i];
        holds_data(&cell).then(|| self.scaled(cell))
    }

    /// Adds the means over phi_d of cells that hold data, as held; −1 if none does.
    fn add_means(&mut self, grid: MerlGrid) {
        let n_phi = grid.dims()[2];
        for i in 0..MerlGrid::POLES {
            let row = grid.index(MerlGrid::row_of_mean(i));
            let cells = self.cells[row..row + n_phi].iter();
            let data = cells.filter(|cell| holds_data(cell)).zip(1u32..);
            // Of equal values it is that value, and of large ones finite.
            let mean = data.fold([-1.0; N], |mean, (cell, n)| {
                let mean = if n == 1 { *cell } else { mean };
                std::array::from_fn(|c| mean[c] + (cell[c] - mean[c]) / f64::from(n))
            });
            self.cells.push(mean);
        }
    }

    /// f_r between the nodes around a place; `None` without data at any.
    #[inline(always)]
    fn trilinear(&self, grid: MerlGrid, Corner { whole, part }: Corner) -> Option<[f64; N]> {
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
                *node = self.cells[cell];
            }
        }

        // Away from the horizon every node holds data, and one predictable branch replaces eight
        // choices and a division.
        let each = nodes.iter().flatten();
        let all = each.fold(true, |all, node| all & holds_data(node));
        let (mut sum, mut total) = ([0.0; N], 0.0);
        for (pair, w) in nodes.into_iter().zip(row_weights) {
            for (node, w) in pair.into_iter().zip([w * g_phi, w * f_phi]) {
                if all || holds_data(&node) {
                    total += w;
                    for (sum, v) in sum.iter_mut().zip(node) {
                        *sum += w * v;
                    }
                }
            }
        }
        if all {
            return Some(self.scaled(sum));
        }
        (total > 0.0).then(|| self.scaled(sum.map(|v| v / total)))
    }
}

fn yes() -> bool {
    true
}

file_table! {
    "merl": "measured isotropic table, the MERL file at `path`; also interpolation, nodes, bilateral, no_reading",
    HalfDifferenceTable, {
        extensions: &["binary"],
        summary: "isotropic, over half/difference angles",
        write: Some(|brdf, of, path| {
            let grid = MerlGrid::holding(brdf)?;
            let (content, filled) = tabulate(brdf, grid, of.fill)?;
            write_file(path, filled, |out| content.write(out))
        }),
        has_holes: true,
        pairs: Some(|brdf, _| Ok(MerlGrid::holding(brdf)?.pairs(brdf.symmetry()))),
    }
    /// A MERL file, as a config writes it.
    pub struct MerlSpec {
        /// Interpolation between its nodes.
        #[serde(default)]
        interpolation: Interpolation = Interpolation::default();
        /// Where in its cell a value is exact.
        #[serde(default)]
        nodes: Nodes = Nodes::default();
        /// True if phi_d and −phi_d count as one configuration. An assumption: the format does not
        /// guarantee it, but isotropic materials have it but for noise, and a schedule that folds
        /// it visits half as many poses. The bilateral law measures the deviation of a table from it.
        #[serde(default = "yes")]
        bilateral: bool = yes();
    }

    fn fits(&self, channels: &Channels) -> Result<(), TableError> {
        without_wavelengths("path", self.path.display(), channels)?;
        check(&self.path).map(drop)
    }

    fn symmetries(&self, _channels: &Channels) -> Result<Symmetry, TableError> {
        Ok(check(&self.path)?.symmetry(self.bilateral))
    }

    fn load(&self, channels: Channels) -> Result<impl Brdf + 'static, TableError> {
        without_wavelengths("path", self.path.display(), &channels)?;
        let table = Merl::load(&self.path, channels, self.no_reading)?;
        Ok(Merl {
            bilateral: self.bilateral,
            interpolation: self.interpolation,
            ..table.with_nodes(self.nodes)
        })
    }

    fn channel_bytes(&self) -> usize {
        length(&self.path) / Channels::Rgb.count()
    }
}
