//! What is known of a material before its first reading: the mean of ln(f + ε) over many materials, and the functions
//! of a pair that they differ by (principal components).
//!
//! Both are splines on a lattice in half/difference coordinates, square root along θ_h, of isotropic bilateral
//! materials; others have no prior. The coefficients of a material are near those of one of the many, with a variance
//! that is the same for all; the kernel of what the functions leave has all amplitudes of the usual one times a factor.
//! Variance and factor are those that make families of materials most likely that the functions were not made of.

mod file;
#[cfg(test)]
mod tests;
mod train;

pub use train::{TrainError, Training};

use super::kernel::Kernel;
use super::system::{self, Covariance, Data, FREEDOM};
use crate::error::ParameterError;
use crate::geometry::{DirectionPair, Symmetry};
use crate::parametrization::usual_form;
use crate::reconstruct::cubic::{Spline, spline};
use crate::reconstruct::grid::{Continuation, GridInterpolant};
use crate::reconstruct::{Readings, Transform};
use crate::schedule::{Grid, PlanError, Ratio, SampleSet, Schedule};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::SystemTime;

/// A material that a prior was made of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trained {
    /// Its name.
    pub name: String,
    /// A hash of what it is.
    pub content: String,
}

/// The first line of a file of a prior.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct About {
    /// Version of the format.
    gonio_prior: u32,
    /// BLAKE3 of the line, with nothing here, and of all bytes after it, hexadecimal.
    blake3: String,
    /// The lattice is the largest with at most so many configurations.
    nodes: usize,
    /// Number of functions.
    functions: usize,
    /// Factor of all amplitudes of the kernel.
    scale: f64,
    /// Variance of each coefficient about that of a material.
    share: f64,
    /// Number of centres.
    centres: usize,
    materials: Vec<Trained>,
}

/// Configurations of a lattice, at most.
pub const NODES: RangeInclusive<usize> = 500..=90_000;

/// Functions of a prior, at most.
pub const FUNCTIONS: usize = 500;

/// Values of a node: mean, brightness, then the functions.
const BEFORE: usize = 2;

/// What many materials have in common.
pub struct Prior {
    about: About,
    /// The values of each configuration of the lattice, as in a file.
    values: Vec<half::f16>,
    table: GridInterpolant<Spline<3>, 3>,
    /// Coefficients of the channels of the materials, a column for each.
    pub(crate) centres: DMatrix<f64>,
}

impl std::fmt::Debug for Prior {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.about.fmt(f)
    }
}

/// Pairs of a task.
const TASK: usize = 128;

impl Prior {
    /// `None` if the values are not those of the lattice, or a number is out of its range.
    fn new(about: About, values: Vec<half::f16>) -> Option<Self> {
        let factors = [about.scale, about.share];
        let is_usual = NODES.contains(&about.nodes)
            && (1..=FUNCTIONS).contains(&about.functions)
            && about.centres <= values.len()
            && factors.iter().all(|x| train::SOUGHT.contains(x))
            && values.iter().all(|x| x.is_finite());
        if !is_usual {
            return None;
        }
        let schedule = lattice(about.nodes).ok()?;
        let width = BEFORE + about.functions;
        let of_nodes = schedule.poses.len() * width;
        if values.len() != of_nodes + about.functions * about.centres {
            return None;
        }
        let mut wide: Vec<f64> = values.iter().map(|x| x.to_f64()).collect();
        let centres = wide.split_off(of_nodes);
        let centres = DMatrix::from_vec(about.functions, about.centres, centres);
        let readings = Readings {
            schedule: &Arc::new(schedule),
            width,
            values: &wide,
            present: &vec![true; wide.len() / width],
            noise: None,
            half_angles_deg: [0.0; 2],
        };
        let table = spline::<3>(&readings, Transform::Linear, Continuation::default()).ok()?;
        Some(Self {
            about,
            values,
            table,
            centres,
        })
    }

    /// Number of its functions.
    pub(crate) fn functions(&self) -> usize {
        self.about.functions
    }

    /// Factor of all amplitudes of the kernel, and variance of the coefficients of functions.
    pub(crate) fn scale_and_share(&self) -> [f64; 2] {
        [self.about.scale, self.about.share]
    }

    /// True if materials of this symmetry have priors.
    pub(in crate::reconstruct) fn suits(symmetry: Symmetry) -> bool {
        symmetry == Symmetry::FULL
    }

    /// The materials that it was made of.
    pub fn materials(&self) -> &[Trained] {
        &self.about.materials
    }

    /// The kernel about a material of this prior, of a kernel without one.
    pub(super) fn kernel(&self, kernel: Kernel) -> Kernel {
        kernel.about(self.about.scale, train::LEVEL, self.about.share)
    }

    /// The kernel about the mean of this prior, of a kernel without one: coefficients of its materials have variance 1.
    pub(super) fn kernel_before(&self, kernel: Kernel) -> Kernel {
        kernel.about(self.about.scale, train::LEVEL, self.about.share + 1.0)
    }

    fn values_at(&self, pairs: &[DirectionPair]) -> DMatrix<f64> {
        let width = BEFORE + self.about.functions;
        let mut values = DMatrix::zeros(width, pairs.len());
        let tasks = values.as_mut_slice().par_chunks_mut(width * TASK);
        tasks
            .zip(pairs.par_chunks(TASK))
            .for_each(|(out, pairs)| self.table.batch(pairs, out, None));
        values
    }

    /// The mean of ln(f + ε) at pairs, and the functions, a column per pair.
    pub(crate) fn basis_at(&self, pairs: &[DirectionPair]) -> (Vec<f64>, DMatrix<f64>) {
        let values = self.values_at(pairs);
        let mean = values.row(0).iter().copied().collect();
        (mean, values.remove_rows(0, BEFORE))
    }

    /// f² of the materials at pairs, each as a share of its mean of (f cos)² under the cosine measure, on average.
    pub(crate) fn brightness(&self, pairs: &[DirectionPair]) -> Vec<f64> {
        let values = self.values_at(pairs);
        values.row(1).iter().map(|log| log.exp()).collect()
    }

    /// What readings say of the coefficients, a column for each value of a reading, by a kernel: the mean of those of the
    /// materials, each as often as it makes the readings likely. Then −ln of how likely all together make them, their
    /// mean over values, as of [`Data::likelihood`]. `None` if the covariances are singular.
    pub(super) fn centred(&self, kernel: &Kernel, data: &Data) -> Option<(Centre, f64)> {
        centred(&self.centres, kernel, data)
    }

    /// The mean plus the functions times coefficients, a column for each value of a pair.
    pub(in crate::reconstruct) fn mean(&self, coefficients: &DMatrix<f64>) -> Mean {
        let mut weights = coefficients.clone().insert_rows(0, BEFORE, 0.0);
        weights.row_mut(0).fill(1.0);
        let rule = self.table.rule.combined(&weights);
        Mean(self.table.with(rule, weights.ncols()))
    }
}

/// What readings say of the coefficients of functions before the rest is looked at.
#[derive(Clone)]
pub(super) struct Centre {
    /// Their means, a column for each value of a reading.
    pub mean: DMatrix<f64>,
    /// Columns the sum of whose squares is their covariance, those of the first value.
    pub spread: DMatrix<f64>,
}

/// The likelihood of a material from which on it is one of those that a material may be like.
const LIKELY: f64 = 1e-6;

/// [`Prior::centred`], about these centres.
fn centred(centres: &DMatrix<f64>, kernel: &Kernel, data: &Data) -> Option<(Centre, f64)> {
    let factor = Covariance::new(kernel).factor(data)?;
    let mut readings = data.values.clone();
    system::forward(&factor, &mut readings);
    let mut means = data.sites.functions.tr_mul(centres);
    system::forward(&factor, &mut means);
    let n = data.sites.len();
    let freedom = FREEDOM + n as f64;
    let mut loss = (0..n).map(|i| factor[(i, i)].ln()).sum::<f64>();
    let mut mean = DMatrix::zeros(centres.nrows(), data.values.ncols());
    let mut spread = DMatrix::zeros(centres.nrows(), 0);
    for (c, reading) in readings.column_iter().enumerate() {
        let of_centre = means.column_iter().map(|mean| {
            let square = (reading - mean).norm_squared();
            0.5 * freedom * (square / FREEDOM).ln_1p()
        });
        let losses = DVector::from_iterator(means.ncols(), of_centre);
        let least = losses.min();
        let likely = losses.map(|l| (least - l).exp());
        loss += (least - likely.mean().ln()) / data.values.ncols() as f64;
        let likely = &likely / likely.sum();
        mean.set_column(c, &(centres * &likely));
        if c == 0 {
            let near: Vec<usize> = (0..likely.len()).filter(|&k| likely[k] > LIKELY).collect();
            spread = centres.select_columns(&near);
            for (mut column, &k) in spread.column_iter_mut().zip(&near) {
                column -= mean.column(0);
                column *= likely[k].sqrt();
            }
        }
    }
    loss.is_finite().then_some((Centre { mean, spread }, loss))
}

/// A mean of ln(f + ε), of several values per pair.
pub(in crate::reconstruct) struct Mean(GridInterpolant<Spline<3>, 3>);

impl Mean {
    /// Adds it to the values of pairs (`pairs × width`).
    pub(crate) fn add(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        let mut values = vec![0.0; out.len()];
        self.0.batch(pairs, &mut values, None);
        out.iter_mut().zip(values).for_each(|(o, v)| *o += v);
    }
}

/// The lattice of a prior with at most so many configurations: as fine along θ_h and θ_d as materials change.
fn lattice(nodes: usize) -> Result<Schedule, PlanError> {
    let grid = Grid {
        ratio: Some(Ratio::Numbers(vec![6.0, 4.0, 3.0])),
        ..Grid::default()
    };
    grid.plan(&usual_form(Symmetry::FULL), nodes, 0)
}

/// Name of the prior of formulas, where a config names a file.
const BUILT_IN: &str = "built-in";

/// That prior; `configs/families.toml` says of what it was made, and how.
const FILE: &[u8; 289_608] = include_bytes!("built-in.gonio");

/// Its bytes, those at odd places after those at even ones: in halves the first bytes are alike, and deflate a quarter smaller in a
/// wheel.
static BYTES: [u8; FILE.len()] = {
    let mut parted = [0; FILE.len()];
    let mut i = 0;
    while i < FILE.len() {
        parted[i / 2 + (i % 2) * FILE.len().div_ceil(2)] = FILE[i];
        i += 1;
    }
    parted
};

/// A file of a prior, as configs name it, or `built-in`, the default.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(from = "PathBuf", into = "PathBuf")]
pub struct PriorFile {
    path: PathBuf,
    /// What it was when it was first asked for: a run goes on with that.
    known: OnceLock<Arc<Prior>>,
}

impl Default for PriorFile {
    fn default() -> Self {
        PathBuf::from(BUILT_IN).into()
    }
}

impl From<PathBuf> for PriorFile {
    fn from(path: PathBuf) -> Self {
        Self {
            path,
            known: OnceLock::new(),
        }
    }
}

impl From<PriorFile> for PathBuf {
    fn from(file: PriorFile) -> Self {
        file.path
    }
}

/// Priors that were read, with the size and time of their files then.
type Cache = HashMap<PathBuf, (u64, Option<SystemTime>, Arc<Prior>)>;

impl PriorFile {
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The file; `None`: it is built in.
    pub(crate) fn file(&self) -> Option<&Path> {
        (self.path != Path::new(BUILT_IN)).then_some(&self.path)
    }

    /// A hash of the content of the prior; of an invalid file, the reason.
    pub fn content(&self) -> String {
        let known = self.load();
        known.map_or_else(|e| e.to_string(), |prior| prior.about.blake3.clone())
    }

    /// The prior, as it was when it was first asked for; a file that did not change is read once.
    ///
    /// # Errors
    /// If the file cannot be read, or holds no prior.
    pub fn load(&self) -> Result<Arc<Prior>, ParameterError> {
        if let Some(known) = self.known.get() {
            return Ok(Arc::clone(known));
        }
        let read = self.read();
        let known = read.map_err(|why| {
            let allowed = format!("{BUILT_IN:?}, or a file of gonio train ({why})");
            ParameterError::new("prior", format!("{:?}", self.path), allowed)
        })?;
        Ok(Arc::clone(self.known.get_or_init(|| known)))
    }

    fn read(&self) -> Result<Arc<Prior>, String> {
        static KNOWN: Mutex<Option<Cache>> = Mutex::new(None);
        static FORMULAS: OnceLock<Result<Arc<Prior>, String>> = OnceLock::new();
        let Some(path) = self.file() else {
            let known = FORMULAS.get_or_init(|| {
                let (even, odd) = BYTES.split_at(FILE.len().div_ceil(2));
                let both = even.iter().zip(odd.iter().map(Some).chain([None]));
                let bytes = both.flat_map(|(a, b)| [Some(*a), b.copied()]);
                Prior::decode(&bytes.flatten().collect::<Vec<u8>>()).map(Arc::new)
            });
            return known.clone();
        };
        let about = std::fs::metadata(path).map_err(|e| e.to_string())?;
        let (size, time) = (about.len(), about.modified().ok());
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let known = known.get_or_insert_default();
        match known.get(path) {
            Some((s, t, prior)) if (*s, *t) == (size, time) => Ok(Arc::clone(prior)),
            _ => {
                let prior = Arc::new(Prior::read(path).map_err(|e| e.to_string())?);
                known.insert(path.to_owned(), (size, time, Arc::clone(&prior)));
                Ok(prior)
            }
        }
    }
}
