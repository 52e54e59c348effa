//! Any BRDF as a MERL file.
//!
//! A cell holds f_r / scale at its node, or where that is not above the horizon (h_z ≤ |k_z|) at a place of the cell that is, if
//! there is one ([`MerlGrid::pair`]). It holds −1 where there is none, where the BRDF has no data, and where it breaks its promise and
//! returns a negative value or one that is not finite when stored. A BRDF in luminance is written as
//! a grey one.
//!
//! The cells of a MERL table of the same layout and nodes are copied.

use super::super::{fill_gaps, gaps};
use super::file::{SCALE, is_data};
use super::{MerlError, MerlGrid};
use crate::brdf::{Brdf, Presence};
use crate::files;
use crate::geometry::DirectionPair;
use rayon::prelude::*;
use std::io::{self, Write};
use std::path::Path;

/// Stored value of a cell without data.
const MISSING: f64 = -1.0;

impl MerlGrid {
    /// The smallest layout that can hold this BRDF without loss of symmetry, with the nodes that it has if it is such a table.
    ///
    /// # Errors
    /// [`MerlError::NotIsotropic`] and [`MerlError::Wavelengths`].
    pub fn holding(brdf: &dyn Brdf) -> Result<Self, MerlError> {
        if brdf.channels().wavelengths().is_some() {
            return Err(MerlError::Wavelengths);
        }
        let symmetry = brdf.symmetry();
        let grid = match (symmetry.isotropic, symmetry.reciprocal) {
            (true, true) => MerlGrid::RECIPROCAL,
            (true, false) => MerlGrid::FULL,
            (false, _) => return Err(MerlError::NotIsotropic),
        };
        let nodes = brdf.as_merl().map(|table| table.grid().nodes());
        Ok(grid.with_nodes(nodes.unwrap_or_default()))
    }
}

/// Tabulates a BRDF and writes it in the format of a MERL file. Runs on rayon's threads; the bytes
/// do not depend on their number.
///
/// # Errors
/// [`MerlError::NotIsotropic`], [`MerlError::NotReciprocal`] or [`MerlError::Wavelengths`] if `grid`
/// cannot hold the BRDF, and any error of `out`.
///
/// ```
/// use gonio::brdf::measured::merl::{Merl, MerlGrid, write_merl};
/// use gonio::brdf::{Channels, Lambert, Spectrum};
/// let grey = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
/// let mut bytes = Vec::new();
/// write_merl(&grey, MerlGrid::RECIPROCAL, &mut bytes)?;
/// assert_eq!(bytes.len() as u64, MerlGrid::RECIPROCAL.file_len());
/// let table = Merl::read(bytes.as_slice(), Channels::Luminance)?;
/// let value = table.value([0, 0, 0]).map(|v| v[0]);
/// assert!((value.unwrap_or(-1.0) * std::f64::consts::PI - 0.5).abs() < 1e-15);
/// # Ok::<(), gonio::brdf::measured::merl::MerlError>(())
/// ```
pub fn write_merl(brdf: &dyn Brdf, grid: MerlGrid, out: &mut impl Write) -> Result<(), MerlError> {
    let values = tabulate(brdf, grid)?;
    Ok(write_planes(&values, brdf.channels().count(), grid, out)?)
}

/// Writes a file that appears whole or not at all; after an error nothing is left behind, and a file
/// that was there is as it was.
///
/// # Errors
/// As [`write_merl`].
pub fn write_merl_file(brdf: &dyn Brdf, grid: MerlGrid, path: &Path) -> Result<(), MerlError> {
    // Before the file is opened: a model that panics leaves no part of a file either.
    let values = tabulate(brdf, grid)?;
    Ok(files::write_atomically(path, |out| {
        write_planes(&values, brdf.channels().count(), grid, out)
    })?)
}

/// The same file, but cells above the horizon without data have the values of the one before them in it, those at the start of
/// the first that has some. Returns their number.
///
/// # Errors
/// As [`write_merl`], and [`MerlError::NoData`] of a BRDF without any.
pub fn write_merl_file_filled(
    brdf: &dyn Brdf,
    grid: MerlGrid,
    path: &Path,
) -> Result<usize, MerlError> {
    let n = brdf.channels().count();
    let mut values = tabulate(brdf, grid)?;
    // Cells that no pair is in stay as they are.
    let [_, n_d, n_phi] = grid.dims();
    let has_pair = |cell: &usize| {
        let (row, phi) = (cell / n_phi, cell % n_phi);
        grid.pair([row / n_d, row % n_d, phi]).is_some()
    };
    let cells: Vec<usize> = (0..grid.cells()).filter(has_pair).collect();
    let seen = cells
        .iter()
        .flat_map(|cell| &values[n * cell..n * (cell + 1)]);
    let or_nan = |v: &f64| if is_data(*v) { *v } else { f64::NAN };
    let mut seen: Vec<f64> = seen.map(or_nan).collect();
    let filled = gaps(&seen, n);
    if !fill_gaps(&mut seen, n) {
        return Err(MerlError::NoData);
    }
    for (cell, found) in cells.into_iter().zip(seen.chunks_exact(n)) {
        values[n * cell..n * (cell + 1)].copy_from_slice(found);
    }
    files::write_atomically(path, |out| write_planes(&values, n, grid, out))?;
    Ok(filled)
}

/// The file of `n` interleaved channels, 1 or 3.
fn write_planes(values: &[f64], n: usize, grid: MerlGrid, out: &mut impl Write) -> io::Result<()> {
    for dim in grid.header() {
        out.write_all(&dim.to_le_bytes())?;
    }
    let mut bytes = Vec::new();
    for (c, scale) in SCALE.into_iter().enumerate() {
        let c = c.min(n - 1);
        for row in values.chunks(n * grid.dims()[2]) {
            bytes.clear();
            bytes.extend(row.iter().skip(c).step_by(n).flat_map(|&v| {
                let stored = if is_data(v) { v / scale } else { MISSING };
                stored.to_le_bytes()
            }));
            out.write_all(&bytes)?;
        }
    }
    Ok(())
}

/// Values of all cells, channels together, all [`MISSING`] where there is no data.
///
/// The file wants all of R before any of G. Holding every value (12 MB in luminance, 35 MB in R, G,
/// B; twice that for 360) costs less than asking the BRDF three times: it may be a reconstruction
/// that takes microseconds a pair.
fn tabulate(brdf: &dyn Brdf, grid: MerlGrid) -> Result<Vec<f64>, MerlError> {
    let holding = MerlGrid::holding(brdf)?;
    if grid.is_reciprocal() && !holding.is_reciprocal() {
        return Err(MerlError::NotReciprocal);
    }
    let n = brdf.channels().count();
    let [_, n_d, n_phi] = grid.dims();
    let mut values = vec![MISSING; n * grid.cells()];
    values
        .par_chunks_mut(n * n_phi)
        .enumerate()
        .for_each_init(Row::default, |row, (i, values)| {
            row.fill(brdf, grid, [i / n_d, i % n_d], values);
        });
    Ok(values)
}

/// Buffers for the cells of one (theta_h, theta_d).
#[derive(Default)]
struct Row {
    cells: Vec<usize>,
    pairs: Vec<DirectionPair>,
    out: Vec<f64>,
    presence: Vec<Presence>,
}

impl Row {
    fn fill(&mut self, brdf: &dyn Brdf, grid: MerlGrid, [h, d]: [usize; 2], values: &mut [f64]) {
        let n = brdf.channels().count();
        self.cells.clear();
        self.pairs.clear();
        for phi in 0..grid.dims()[2] {
            if let Some(pair) = grid.pair([h, d, phi]) {
                self.cells.push(phi);
                self.pairs.push(pair);
            }
        }
        self.out.clear();
        self.out.resize(n * self.pairs.len(), 0.0);
        self.presence.clear();
        self.presence.resize(self.pairs.len(), Presence::Missing);
        brdf.eval_batch(&self.pairs, &mut self.out, &mut self.presence);
        let found = self.out.chunks_exact(n).zip(&self.presence);
        for (&phi, (found, &presence)) in self.cells.iter().zip(found) {
            // Of the scales the least: the others make smaller numbers of a value.
            if presence == Presence::Present && found.iter().all(|&v| is_data(v / SCALE[0])) {
                values[n * phi..][..n].copy_from_slice(found);
            }
        }
        if let Some(table) = brdf.as_merl().filter(|table| table.grid() == grid) {
            for (phi, values) in values.chunks_exact_mut(n).enumerate() {
                match table.value([h, d, phi]) {
                    Some(found) => values.copy_from_slice(&found[..n]),
                    None => values.fill(MISSING),
                }
            }
        }
    }
}
