//! Any BRDF as a MERL file.
//!
//! A cell holds f_r / scale at its node, the lower edge. It holds −1 where a direction is not above
//! the horizon (h_z ≤ |k_z|), where the BRDF has no data, and where it breaks its promise and
//! returns a negative or non-finite value. A BRDF in luminance is written as a grey one.

use super::file::{SCALE, is_data};
use super::grid::pair_at;
use super::{MerlError, MerlGrid};
use crate::brdf::{Brdf, Presence};
use crate::numeric;
use rayon::prelude::*;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// What a cell without data holds.
const MISSING: f64 = -1.0;

impl MerlGrid {
    /// The smaller layout that can hold a BRDF of this symmetry.
    ///
    /// # Errors
    /// [`MerlError::NotIsotropic`].
    pub fn holding(brdf: &dyn Brdf) -> Result<Self, MerlError> {
        let symmetry = brdf.symmetry();
        match (symmetry.isotropic, symmetry.reciprocal) {
            (true, true) => Ok(MerlGrid::Reciprocal),
            (true, false) => Ok(MerlGrid::Full),
            (false, _) => Err(MerlError::NotIsotropic),
        }
    }
}

/// Tabulates a BRDF and writes it in the format of a MERL file. Runs on rayon's threads; the bytes
/// do not depend on their number.
///
/// # Errors
/// [`MerlError::NotIsotropic`] or [`MerlError::NotReciprocal`] if `grid` cannot hold the BRDF, and
/// any error of `out`.
///
/// ```
/// use gonio::brdf::measured::merl::{Merl, MerlGrid, write_merl};
/// use gonio::brdf::{Channels, Lambert, Spectrum};
/// let grey = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
/// let mut bytes = Vec::new();
/// write_merl(&grey, MerlGrid::Reciprocal, &mut bytes)?;
/// assert_eq!(bytes.len() as u64, MerlGrid::Reciprocal.file_len());
/// let table = Merl::read(bytes.as_slice(), Channels::Luminance)?;
/// let value = table.value([0, 0, 0]).map(|v| v[0]);
/// assert!((value.unwrap_or(-1.0) * std::f64::consts::PI - 0.5).abs() < 1e-15);
/// # Ok::<(), gonio::brdf::measured::merl::MerlError>(())
/// ```
pub fn write_merl(brdf: &dyn Brdf, grid: MerlGrid, out: &mut impl Write) -> Result<(), MerlError> {
    if MerlGrid::holding(brdf)? == MerlGrid::Full && grid == MerlGrid::Reciprocal {
        return Err(MerlError::NotReciprocal);
    }
    // The file wants all of R before any of G. Holding every value (12 MB in luminance, 35 MB in
    // R, G, B; twice that for 360) costs less than asking the BRDF three times: it may be a
    // reconstruction that takes microseconds a pair.
    let values = tabulate(brdf, grid);
    let n = brdf.channels().count();
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

/// Writes a file that appears whole or not at all: under a temporary name in the same folder,
/// renamed at the end. After an error nothing is left behind, and a file that was there is as it was.
///
/// # Errors
/// As [`write_merl`].
pub fn write_merl_file(brdf: &dyn Brdf, grid: MerlGrid, path: &Path) -> Result<(), MerlError> {
    let mut part = PartFile::create(path)?;
    write_merl(brdf, grid, &mut part.file)?;
    Ok(part.rename_to(path)?)
}

/// Values of all cells, channels together, [`MISSING`] in the first channel or all.
fn tabulate(brdf: &dyn Brdf, grid: MerlGrid) -> Vec<f64> {
    let n = brdf.channels().count();
    let [_, n_d, n_phi] = grid.dims();
    let mut values = vec![MISSING; n * grid.cells()];
    values
        .par_chunks_mut(n * n_phi)
        .enumerate()
        .for_each_init(Row::default, |row, (i, values)| {
            row.fill(brdf, grid, [i / n_d, i % n_d], values);
        });
    values
}

/// Buffers for the cells of one (theta_h, theta_d).
#[derive(Default)]
struct Row {
    cells: Vec<usize>,
    pairs: Vec<crate::geometry::DirectionPair>,
    out: Vec<f64>,
    presence: Vec<Presence>,
}

impl Row {
    fn fill(&mut self, brdf: &dyn Brdf, grid: MerlGrid, [h, d]: [usize; 2], values: &mut [f64]) {
        let n = brdf.channels().count();
        self.cells.clear();
        self.pairs.clear();
        for phi in 0..grid.dims()[2] {
            let (pair, clearance) = pair_at(grid.node([h, d, phi]));
            // Nodes exactly on the horizon exist (theta_h = 10°, theta_d = 80°, phi_d = 0): the
            // slack keeps rounding from lifting them above it.
            if clearance > numeric::HORIZON_SLACK {
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
            if presence == Presence::Present && found.iter().all(|&v| is_data(v)) {
                values[n * phi..][..n].copy_from_slice(found);
            }
        }
    }
}

/// A file that is removed unless it gets its final name.
struct PartFile {
    file: File,
    path: Option<PathBuf>,
}

impl PartFile {
    fn create(target: &Path) -> io::Result<Self> {
        let Some(name) = target.file_name() else {
            return Err(io::Error::new(ErrorKind::InvalidInput, "not a file name"));
        };
        // Two processes may write the same file, and a killed one may have left its part behind.
        for attempt in 0..100 {
            let mut part = std::ffi::OsString::from(".");
            part.push(name);
            part.push(format!(".{}-{attempt}.part", std::process::id()));
            let path = target.with_file_name(part);
            match File::create_new(&path) {
                Ok(file) => {
                    let path = Some(path);
                    return Ok(Self { file, path });
                }
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    }

    fn rename_to(mut self, target: &Path) -> io::Result<()> {
        if let Some(path) = &self.path {
            fs::rename(path, target)?;
        }
        self.path = None;
        Ok(())
    }
}

impl Drop for PartFile {
    fn drop(&mut self) {
        if let Some(path) = &self.path {
            // Nothing more can be done if this fails too; the caller has the first error.
            let _ = fs::remove_file(path);
        }
    }
}
