//! Kriging: ln(f + ε) as a Gaussian process whose covariance is a sum of functions of a few columns of a
//! pair each ([`kernel`]), with hyper-parameters that were fitted to the MERL database.
//!
//! The mean is a constant that readings tell; readings have the variance of their noise, and one that no column
//! explains, by which they are missed: half a percent. Amplitudes and lengths are fitted again to the readings of a
//! material, near those of the database ([`fit`]), unless these lie in sheets or lines: then columns vary together,
//! and a fit takes the trend along one for that along another. All of it is reciprocal.
//!
//! Readings in the plane of incidence alone say nothing of φ_d. It then continues what it knows of other materials,
//! which for Oren and Nayar's errs at most 2.5 times as much as the nearest reading does
//! (`tests/reconstruction/layouts.rs`).

mod fit;
mod kernel;
mod line;
mod posterior;
mod system;

pub(crate) use posterior::{Places, Posterior};

use super::coordinates::ReconstructionCoordinates;
use super::interpolant::{Interpolant, Readings};
use super::scattered::Embedded;
use super::transform::{EPSILON, Transform, Values};
use super::{Reconstruct, ReconstructError};
use crate::error::ParameterError;
use crate::geometry::{DirectionPair, Symmetry};
use crate::registry::{self, Entry};
use kernel::{Block, Columns, Flat, Kernel, LANES};
use line::Line;
use nalgebra::DMatrix;
use pulp::{Arch, NullaryFnOnce};
use serde::{Deserialize, Serialize};
use system::{Data, MEAN, NUGGET, Solved};

const KIND: &str = "kriging";

/// The registry entry.
pub(super) const ENTRY: Entry<dyn Reconstruct> = Entry {
    kind: KIND,
    summary: "Gaussian process of ln f with a kernel fitted to many materials; at most 10 000 readings",
    examples: &["", "fit = false", "noise = false"],
    read: |table| Ok(Box::new(registry::parse::<Kriging>(table)?)),
};

/// Kriging, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Kriging {
    /// True to fit amplitudes and lengths of the kernel to the first channel of the readings, where these fill space.
    pub fit: bool,
    /// True to miss readings by their uncertainty of type A, where they have one.
    pub noise: bool,
}

impl Default for Kriging {
    fn default() -> Self {
        Self {
            fit: true,
            noise: true,
        }
    }
}

/// Readings to which a kernel is fitted, at most: spread evenly over all.
const FITTED: usize = 300;

/// Readings of one system, at most: its matrix then has 800 MB.
const MOST: usize = 10_000;

impl Kriging {
    /// The readings as a system, every `stride`-th of them, and of their values the first `width`.
    fn data(&self, r: &Readings<'_>, stride: usize, width: usize) -> Data {
        let chosen = (0..r.present.len())
            .filter(|&i| r.present[i])
            .step_by(stride);
        let chosen: Vec<usize> = chosen.collect();
        let poses = &r.schedule.poses;
        let pairs: Vec<DirectionPair> = chosen.iter().map(|&i| poses[i].pair).collect();
        let noise = |&i: &usize| {
            let of_first = r
                .noise
                .filter(|_| self.noise)
                .map_or(0.0, |u| u[i * r.width]);
            let relative = of_first / (r.values[i * r.width].max(0.0) + EPSILON);
            NUGGET + relative * relative
        };
        let transform = TRANSFORM;
        let value =
            |k: usize, c: usize| transform.forward(r.values[chosen[k] * r.width + c]) - MEAN;
        Data {
            columns: kernel::columns(&pairs, symmetry(r)),
            noise: chosen.iter().map(noise).collect(),
            values: DMatrix::from_fn(chosen.len(), width, value),
        }
    }
}

impl Kriging {
    /// The kernel, fitted to the first value of the readings if it is to be and they fill space.
    fn kernel(&self, r: &Readings<'_>) -> Result<Kernel, ReconstructError> {
        let kernel = Kernel::new(symmetry(r));
        Ok(match self.fit && !in_sheets(r)? {
            true => fit::fit(&kernel, &self.data(r, r.count().div_ceil(FITTED), 1)),
            false => kernel,
        })
    }
}

/// True if readings lie in sheets, lines or clusters.
fn in_sheets(r: &Readings<'_>) -> Result<bool, ReconstructError> {
    let own = ReconstructionCoordinates {
        coordinates: None,
        stretch: None,
    };
    Ok(match r.schedule.parametrization.axes().len() {
        3 => Embedded::<3>::new(KIND, r, &own, TRANSFORM, 1)?.is_in_sheets(r),
        _ => Embedded::<4>::new(KIND, r, &own, TRANSFORM, 1)?.is_in_sheets(r),
    })
}

const TRANSFORM: Transform = Transform::Log { epsilon: EPSILON };

/// The symmetry of the readings.
fn symmetry(r: &Readings<'_>) -> Symmetry {
    r.schedule.parametrization.symmetry()
}

impl Reconstruct for Kriging {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        let mut label = super::label(KIND, Values::Log, false, None);
        for (given, name) in [(self.fit, "-published"), (self.noise, "-exact")] {
            if !given {
                label.push_str(name);
            }
        }
        label
    }

    fn needs_grid(&self) -> bool {
        false
    }

    fn weighs_readings(&self) -> bool {
        self.fit || self.noise
    }

    fn check(&self) -> Result<(), ParameterError> {
        Ok(())
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        let readings = r.count();
        if readings == 0 {
            return Err(ReconstructError::TooFew {
                method: KIND,
                readings,
                needed: 1,
            });
        }
        if readings > MOST {
            return Err(ReconstructError::TooMany {
                method: KIND,
                readings,
                allowed: MOST,
            });
        }
        let kernel = self.kernel(r)?;
        let data = self.data(r, 1, r.width);
        let solved = data.solve(&kernel).ok_or(ReconstructError::Singular {
            method: KIND,
            readings,
        })?;
        Ok(Box::new(Process::new(&kernel, &data, solved, symmetry(r))))
    }
}

/// The mean of the process given the readings.
struct Process {
    /// Terms of several columns, which are evaluated for each reading.
    terms: Vec<Flat>,
    /// Terms of one column.
    lines: Vec<Line>,
    blocks: Vec<Block>,
    /// Weights of the readings of a block, one array per value.
    weights: Vec<[f64; LANES]>,
    /// ln(f + ε) of each value where all readings are far.
    levels: Vec<f64>,
    symmetry: Symmetry,
}

impl Process {
    fn new(kernel: &Kernel, data: &Data, solved: Solved, symmetry: Symmetry) -> Self {
        let Solved { weights, levels } = solved;
        let width = levels.len();
        let blocks = kernel::blocks(&data.columns);
        let mut laid_out = vec![[0.0; LANES]; blocks.len() * width];
        for i in 0..weights.nrows() {
            for c in 0..width {
                laid_out[i / LANES * width + c][i % LANES] = weights[(i, c)];
            }
        }
        let (lines, terms): (Vec<Flat>, Vec<Flat>) = kernel
            .flat()
            .into_iter()
            .partition(|t| t.weights.len() == 1);
        let line = |t: &Flat| {
            let (column, square) = t.weights[0];
            let term = (t.amplitude, column, square.sqrt());
            Line::new(term, &data.columns, &weights)
        };
        Self {
            lines: lines.iter().map(line).collect(),
            terms,
            blocks,
            weights: laid_out,
            levels,
            symmetry,
        }
    }
}

/// Writes ln(f + ε) less its level at pairs.
struct Means<'a> {
    process: &'a Process,
    columns: &'a [Columns],
    out: &'a mut [f64],
}

impl NullaryFnOnce for Means<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let of = self.process;
        let width = of.levels.len();
        let mut sums = vec![[0.0; LANES]; width];
        let queries = self.columns.iter().zip(self.out.chunks_exact_mut(width));
        for (x, out) in queries {
            sums.fill([0.0; LANES]);
            for (block, weights) in of.blocks.iter().zip(of.weights.chunks_exact(width)) {
                let k = kernel::covariance(&of.terms, x, block);
                for (sum, weights) in sums.iter_mut().zip(weights) {
                    for i in 0..LANES {
                        sum[i] += k[i] * weights[i];
                    }
                }
            }
            for (out, sum) in out.iter_mut().zip(&sums) {
                *out = kernel::sum(sum);
            }
            for line in &of.lines {
                line.add(x, out);
            }
        }
    }
}

impl Interpolant for Process {
    fn width(&self) -> usize {
        self.levels.len()
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) {
        self.eval_batch(std::slice::from_ref(pair), out);
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        let columns = kernel::columns(pairs, self.symmetry);
        Arch::new().dispatch(Means {
            process: self,
            columns: &columns,
            out,
        });
        for (pair, out) in pairs.iter().zip(out.chunks_exact_mut(self.levels.len())) {
            let above = pair.is_above_horizon();
            for (z, level) in out.iter_mut().zip(&self.levels) {
                *z = match above {
                    true => TRANSFORM.inverse(*z + level),
                    false => 0.0,
                };
            }
        }
    }
}
