//! Isotropic tables in the format of the MERL database (Matusik et al. 2003).
//!
//! A plane holds one channel of f_r over (theta_h, theta_d, phi_d), square-root spaced in theta_h;
//! [`grid`] has the angles and their cells, [`mod@file`] the bytes. One convention for where in its
//! cell a value lies, because readers disagree: **at the lower edge**, which is what makes the
//! reference reader's `int(...)` a nearest-below look-up and what the writer here tabulates.
//!
//! Interpolations:
//! * `nearest`: the value of the cell the pair falls in, the reference reader's but for rounding at its edges;
//! * `trilinear`: between the eight nodes around the pair, in index coordinates. Nodes without data
//!   are left out and the weights of the others renormalised. Periodic in phi_d; constant beyond
//!   the last node of theta_h (88.0°) and theta_d (89°). The nodes of theta_h = 0 and one theta_d are one
//!   configuration, whatever their phi_d: they have the mean of those with data, so that values do not
//!   jump there.
//!
//! Missing: a cell with no data (`nearest`), or no node with data and weight (`trilinear`). It is
//! never read as 0. Below the horizon the value is 0.

mod error;
pub mod file;
pub mod grid;
mod spec;
mod write;

pub use error::MerlError;
pub use file::{SCALE, check};
pub use grid::MerlGrid;
pub use spec::{ENTRY, Interpolation, MerlSpec};
pub use write::{write_merl, write_merl_file};

use super::Planes;
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{DirectionPair, Symmetry};
use file::is_data;
use grid::THETA_CELLS;

/// A MERL table as a BRDF.
#[derive(Clone, Debug)]
pub struct Merl {
    grid: MerlGrid,
    /// Luminance in sr⁻¹, negative where any channel has no data; R, G, B as stored, unscaled. After the
    /// cells of a plane come the means over phi_d at theta_h = 0, by theta_d.
    planes: Planes,
    interpolation: Interpolation,
    bilateral: bool,
}

impl Merl {
    fn new(grid: MerlGrid, mut planes: Planes) -> Result<Self, MerlError> {
        match &mut planes {
            Planes::Luminance(plane) => {
                let means = One(plane).means_at_the_pole(grid);
                plane.extend(means.as_flattened());
            }
            Planes::Rgb(planes) => {
                let means = Three::of(planes).means_at_the_pole(grid);
                for (c, plane) in planes.iter_mut().enumerate() {
                    plane.extend(means.iter().map(|mean| mean[c]));
                }
            }
        }
        let table = Self {
            grid,
            planes,
            interpolation: Interpolation::default(),
            bilateral: true,
        };
        if (0..grid.cells()).all(|i| table.at(i).is_none()) {
            return Err(MerlError::NoData);
        }
        Ok(table)
    }

    /// The table with another interpolation; a fresh one is trilinear.
    #[must_use]
    pub fn with_interpolation(mut self, interpolation: Interpolation) -> Self {
        self.interpolation = interpolation;
        self
    }

    /// The table, declared bilaterally symmetric or not; a fresh one is. The format does not
    /// guarantee it and look-ups do not use it: it tells others whether phi_d and −phi_d may be folded.
    #[must_use]
    pub fn with_bilateral(mut self, bilateral: bool) -> Self {
        self.bilateral = bilateral;
        self
    }

    /// The layout.
    pub fn grid(&self) -> MerlGrid {
        self.grid
    }

    /// The planes as held: R, G, B as stored in the file, or one plane of luminance in sr⁻¹.
    pub fn planes(&self) -> Vec<&[f64]> {
        let cells = ..self.grid.cells();
        match &self.planes {
            Planes::Luminance(plane) => vec![&plane[cells]],
            Planes::Rgb(planes) => planes.iter().map(|plane| &plane[cells]).collect(),
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
        match &self.planes {
            Planes::Luminance(plane) => One(plane).data(i).map(|[v]| [v; 3]),
            Planes::Rgb(planes) => Three::of(planes).data(i),
        }
    }
}

impl Brdf for Merl {
    fn channels(&self) -> &Channels {
        self.planes.channels()
    }

    fn symmetry(&self) -> Symmetry {
        self.grid.symmetry(self.bilateral)
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn as_merl(&self) -> Option<&Merl> {
        Some(self)
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let mut presence = [Presence::Missing];
        self.eval_batch(std::slice::from_ref(pair), out, &mut presence);
        presence[0]
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        match &self.planes {
            Planes::Luminance(plane) => self.batch(One(plane), pairs, out, presence),
            Planes::Rgb(planes) => self.batch(Three::of(planes), pairs, out, presence),
        }
    }
}

impl Merl {
    #[inline]
    fn batch<const N: usize>(
        &self,
        planes: impl Cells<N>,
        pairs: &[DirectionPair],
        out: &mut [f64],
        presence: &mut [Presence],
    ) {
        let grid = self.grid;
        match self.interpolation {
            Interpolation::Nearest => each(pairs, out, presence, |pair| {
                planes.data(grid.index(grid.cell(pair)))
            }),
            Interpolation::Trilinear => each(pairs, out, presence, |pair| {
                trilinear(grid, &planes, grid.coordinates(pair))
            }),
        }
    }
}

/// Writes one look-up per pair.
#[inline]
fn each<const N: usize>(
    pairs: &[DirectionPair],
    out: &mut [f64],
    presence: &mut [Presence],
    look_up: impl Fn(&DirectionPair) -> Option<[f64; N]>,
) {
    let (out, _) = out.as_chunks_mut::<N>();
    for ((pair, out), presence) in pairs.iter().zip(out).zip(presence) {
        let found = if pair.is_above_horizon() {
            look_up(pair)
        } else {
            Some([0.0; N])
        };
        *presence = match found {
            Some(_) => Presence::Present,
            None => Presence::Missing,
        };
        *out = found.unwrap_or([0.0; N]);
    }
}

/// Cells of N channels.
trait Cells<const N: usize> {
    /// Cell `i` as held.
    fn held(&self, i: usize) -> [f64; N];

    /// True if every channel holds data.
    fn is_data(held: [f64; N]) -> bool;

    /// f_r (sr⁻¹) of values as held.
    fn scaled(held: [f64; N]) -> [f64; N];

    /// f_r of cell `i` if it holds data.
    #[inline]
    fn data(&self, i: usize) -> Option<[f64; N]> {
        let held = self.held(i);
        Self::is_data(held).then(|| Self::scaled(held))
    }

    /// For each theta_d, the mean over phi_d at theta_h = 0 of cells that hold data, as held; −1 if none does.
    fn means_at_the_pole(&self, grid: MerlGrid) -> [[f64; N]; THETA_CELLS] {
        let n_phi = grid.dims()[2];
        std::array::from_fn(|d| {
            let row = grid.index([0, d, 0]);
            let cells = (row..row + n_phi).map(|i| self.held(i));
            let data = cells.filter(|&cell| Self::is_data(cell)).zip(1u32..);
            // Of equal values it is that value, and of large ones finite.
            data.fold([-1.0; N], |mean, (cell, n)| {
                let mean = if n == 1 { cell } else { mean };
                std::array::from_fn(|c| mean[c] + (cell[c] - mean[c]) / f64::from(n))
            })
        })
    }
}

struct One<'a>(&'a [f64]);

impl Cells<1> for One<'_> {
    #[inline]
    fn held(&self, i: usize) -> [f64; 1] {
        [self.0[i]]
    }

    #[inline]
    fn is_data([v]: [f64; 1]) -> bool {
        v >= 0.0
    }

    #[inline]
    fn scaled(held: [f64; 1]) -> [f64; 1] {
        held
    }
}

struct Three<'a>([&'a [f64]; 3]);

impl<'a> Three<'a> {
    fn of(planes: &'a [Vec<f64>; 3]) -> Self {
        Self(planes.each_ref().map(Vec::as_slice))
    }
}

impl Cells<3> for Three<'_> {
    #[inline]
    fn held(&self, i: usize) -> [f64; 3] {
        self.0.map(|plane| plane[i])
    }

    #[inline]
    fn is_data(held: [f64; 3]) -> bool {
        held.map(is_data) == [true; 3]
    }

    #[inline]
    fn scaled([r, g, b]: [f64; 3]) -> [f64; 3] {
        [r * SCALE[0], g * SCALE[1], b * SCALE[2]]
    }
}

#[inline]
fn trilinear<const N: usize, C: Cells<N>>(
    grid: MerlGrid,
    planes: &C,
    [x_h, x_d, x_phi]: [f64; 3],
) -> Option<[f64; N]> {
    let n_phi = grid.dims()[2];
    let last = THETA_CELLS - 1;
    let (h, f_h) = split(x_h.min(last as f64));
    let (d, f_d) = split(x_d.min(last as f64));
    let (phi, f_phi) = split(x_phi);
    // x_phi may round up to n_phi, which is node 0.
    let phi = if phi < n_phi { phi } else { 0 };
    let next = if phi + 1 < n_phi { phi + 1 } else { 0 };
    let (h_next, d_next) = ((h + 1).min(last), (d + 1).min(last));
    let corners = [[h, d], [h, d_next], [h_next, d], [h_next, d_next]];
    let (g_h, g_d, g_phi) = (1.0 - f_h, 1.0 - f_d, 1.0 - f_phi);
    let row_weights = [g_h * g_d, g_h * f_d, f_h * g_d, f_h * f_d];
    let nodes = corners.map(|[h, d]| {
        let cells = if h == 0 {
            [grid.cells() + d; 2]
        } else {
            [phi, next].map(|phi| grid.index([h, d, phi]))
        };
        cells.map(|i| planes.held(i))
    });

    // Away from the horizon every node holds data, and one predictable branch replaces eight
    // choices and a division.
    let all = nodes
        .iter()
        .flatten()
        .fold(true, |all, &node| all & C::is_data(node));
    let (mut sum, mut total) = ([0.0; N], 0.0);
    for (pair, w) in nodes.into_iter().zip(row_weights) {
        for (node, w) in pair.into_iter().zip([w * g_phi, w * f_phi]) {
            if all || C::is_data(node) {
                total += w;
                for (sum, v) in sum.iter_mut().zip(node) {
                    *sum += w * v;
                }
            }
        }
    }
    if all {
        Some(C::scaled(sum))
    } else {
        (total > 0.0).then(|| C::scaled(sum.map(|v| v / total)))
    }
}

/// Whole and fractional part of an index coordinate.
#[inline]
fn split(x: f64) -> (usize, f64) {
    let i = x as usize;
    (i, x - i as f64)
}
