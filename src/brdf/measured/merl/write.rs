//! Any BRDF as a MERL file.
//!
//! A cell holds f_r / scale at its node, or where that is not above the horizon (h_z ≤ |k_z|) at a place of the cell that is, if
//! there is one ([`MerlGrid::pair`]). It holds −1 where there is none, where the BRDF has no data, and where it breaks its promise and
//! returns a negative value or one that is not finite when stored. A BRDF in luminance is written as
//! a grey one.
//!
//! The cells of a MERL table of the same layout and nodes are copied.

use super::super::{Planes, TableError, fill_gaps, gaps, row_or_nan};
use super::MerlGrid;
use super::file::{SCALE, WAVELENGTHS, is_data, no_access, no_data};
use crate::brdf::Brdf;
use crate::geometry::DirectionPair;
use rayon::prelude::*;
use std::io::Write;

/// Stored value of a cell without data.
const MISSING: f64 = -1.0;

/// Why a BRDF is refused that changes as the sample is turned.
pub(in super::super) const NOT_ISOTROPIC: &str =
    "this BRDF is not isotropic, and a MERL table has no axis for the sample's rotation";

impl MerlGrid {
    /// The smallest layout that can hold this BRDF without loss of symmetry, with the nodes that it has if it is such a table.
    /// Errors: [`TableError::Unsuited`] of a BRDF that is not isotropic, or is by wavelength.
    pub(crate) fn holding(brdf: &dyn Brdf) -> Result<Self, TableError> {
        if brdf.channels().wavelengths().is_some() {
            return Err(TableError::Unsuited(WAVELENGTHS.into()));
        }
        let symmetry = brdf.symmetry();
        let grid = match (symmetry.isotropic, symmetry.reciprocal) {
            (true, true) => MerlGrid::RECIPROCAL,
            (true, false) => MerlGrid::FULL,
            (false, _) => return Err(TableError::Unsuited(NOT_ISOTROPIC.into())),
        };
        let nodes = brdf.as_merl().map(|table| table.grid().nodes);
        Ok(grid.with_nodes(nodes.unwrap_or_default()))
    }
}

/// Tabulates a BRDF and writes it in the format of a MERL file.
///
/// # Errors
/// [`TableError::Unsuited`] if `grid` cannot hold the BRDF, and any error of `out`.
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
/// # Ok::<(), gonio::brdf::measured::TableError>(())
/// ```
pub fn write_merl(brdf: &dyn Brdf, grid: MerlGrid, out: &mut impl Write) -> Result<(), TableError> {
    tabulate(brdf, grid, false)?.0.write(out).map_err(no_access)
}

/// Tabulates a BRDF. If `fill`, cells above the horizon without data have the values of the one before them in the file, those at
/// the start of the first that has some; also returns their number, else 0.
/// Errors: as [`write_merl`], and [`TableError::NoData`] if there is none to fill with.
pub(crate) fn tabulate(
    brdf: &dyn Brdf,
    grid: MerlGrid,
    fill: bool,
) -> Result<(Planes, usize), TableError> {
    let holding = MerlGrid::holding(brdf)?;
    if grid.reciprocal && !holding.reciprocal {
        return Err(TableError::Unsuited(format!(
            "this BRDF is not reciprocal, and a {} table stores a pair and its swap once; {} can hold it",
            MerlGrid::RECIPROCAL,
            MerlGrid::FULL
        )));
    }
    let n = brdf.channels().count();
    let [_, n_d, n_phi] = grid.dims();
    let mut values = vec![MISSING; n * grid.cells()];
    let rows = values.par_chunks_mut(n * n_phi).enumerate();
    rows.for_each(|(i, values)| fill_row(brdf, grid, [i / n_d, i % n_d], values));
    let filled = match fill {
        true => fill_cells(grid, n, &mut values)?,
        false => 0,
    };
    let header = grid.dims().map(|dim| (dim as i32).to_le_bytes());
    let planes = Planes {
        head: header.concat(),
        stored: |c, v| if is_data(v) { v / SCALE[c] } else { MISSING },
        n,
        values,
    };
    Ok((planes, filled))
}

/// Fills those cells without data that have a pair of directions, and returns their number.
fn fill_cells(grid: MerlGrid, n: usize, values: &mut [f64]) -> Result<usize, TableError> {
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
        return Err(no_data());
    }
    for (cell, found) in cells.into_iter().zip(seen.chunks_exact(n)) {
        values[n * cell..n * (cell + 1)].copy_from_slice(found);
    }
    Ok(filled)
}

/// Fills the cells of one (theta_h, theta_d).
fn fill_row(brdf: &dyn Brdf, grid: MerlGrid, [h, d]: [usize; 2], values: &mut [f64]) {
    let n = brdf.channels().count();
    let pair = |phi: usize| Some((phi, grid.pair([h, d, phi])?));
    let n_phi = grid.dims()[2];
    // Cells that symmetries make equal are evaluated once.
    let own = grid.own_cells(brdf.symmetry());
    let above = (0..own).filter_map(pair);
    let (cells, pairs): (Vec<usize>, Vec<DirectionPair>) = above.unzip();
    let found = row_or_nan(brdf, &pairs);
    for (phi, found) in cells.into_iter().zip(found.chunks_exact(n)) {
        // Of the scales the least: the others make smaller numbers of a value.
        if found.iter().all(|&v| is_data(v / SCALE[0])) {
            values[n * phi..][..n].copy_from_slice(found);
            if own < n_phi {
                values[n * (n_phi - 1 - phi)..][..n].copy_from_slice(found);
            }
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
