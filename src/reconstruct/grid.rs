//! What every interpolation on a lattice shares: node values without holes, continued past the
//! ends of every axis, and the walk from pairs to index coordinates.
//!
//! The horizon rule: a node that is no physical configuration, or where the material has no data,
//! takes the value of the nearest node that has one, in index units of the lattice. A cell that
//! straddles the horizon thus interpolates between what was measured and its continuation.
//!
//! Past the ends: through a pole or a fold the lattice meets itself again (the value there is that
//! of the same configuration inside the box); past the far end of an axis the last node continues.

use super::transform::Transform;
use super::{ReconstructError, scattered};
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::Measurement;
use crate::parametrization::{Coords, Parametrization};
use crate::schedule::{Lattice, LatticeAxis, Schedule, for_each_node};
use std::sync::Arc;

/// Transformed values on a lattice that reaches `pad` nodes past each end of each axis.
pub(super) struct Padded<const D: usize> {
    /// Nodes along each axis, padding included.
    pub shape: [usize; D],
    /// Nodes past each end.
    pub pad: usize,
    /// Values per node.
    pub channels: usize,
    /// Node-major (last axis fastest), channels innermost.
    pub values: Vec<f64>,
}

impl<const D: usize> Padded<D> {
    /// The readings of a grid measurement.
    pub fn new(
        method: &'static str,
        measurement: &Measurement,
        transform: Transform,
        pad: usize,
    ) -> Result<Self, ReconstructError> {
        let schedule = &measurement.schedule;
        let Some(lattice) = &schedule.lattice else {
            return Err(ReconstructError::NoGrid {
                method,
                sample_set: schedule.sample_set.clone(),
            });
        };
        let channels = measurement.channels.count();
        let source = nearest_readings(method, measurement, lattice)?;
        let transformed: Vec<f64> = measurement
            .values
            .iter()
            .map(|&f| transform.forward(f))
            .collect();
        let shape: [usize; D] = std::array::from_fn(|d| lattice.axes[d].n + 2 * pad);
        let mut values = Vec::with_capacity(shape.iter().product::<usize>() * channels);
        let mut inner = [0i64; D];
        for_each_node(&shape, |index| {
            for (inner, &i) in inner.iter_mut().zip(index) {
                *inner = i - pad as i64;
            }
            let node = home(&*schedule.parametrization, lattice, &inner);
            let pose = source[node] as usize;
            values.extend_from_slice(&transformed[pose * channels..(pose + 1) * channels]);
        });
        Ok(Self {
            shape,
            pad,
            channels,
            values,
        })
    }

    /// Distance in `values` between neighbours along each axis.
    pub fn strides(&self) -> [usize; D] {
        let mut strides = [self.channels; D];
        for d in (0..D - 1).rev() {
            strides[d] = strides[d + 1] * self.shape[d + 1];
        }
        strides
    }

    /// The same values with `pad` nodes past each end, fewer than now.
    pub fn cropped(&self, pad: usize) -> Self {
        let cut = self.pad - pad;
        let shape: [usize; D] = std::array::from_fn(|d| self.shape[d] - 2 * cut);
        let strides = self.strides();
        let mut values = Vec::with_capacity(shape.iter().product::<usize>() * self.channels);
        for_each_node(&shape, |index| {
            let at: usize = index
                .iter()
                .zip(strides)
                .map(|(&i, stride)| (i as usize + cut) * stride)
                .sum();
            values.extend_from_slice(&self.values[at..at + self.channels]);
        });
        Self {
            shape,
            pad,
            channels: self.channels,
            values,
        }
    }
}

/// For each node of the lattice, the pose whose reading it takes.
fn nearest_readings(
    method: &'static str,
    measurement: &Measurement,
    lattice: &Lattice,
) -> Result<Vec<u32>, ReconstructError> {
    let shape = lattice.shape();
    let read = |pose: &Option<u32>| pose.filter(|&p| measurement.value(p as usize).is_some());
    let own: Vec<Option<u32>> = lattice.pose.iter().map(read).collect();
    let mut points = Vec::new();
    let mut poses = Vec::new();
    let mut node = 0;
    for_each_node(&shape, |index| {
        if let Some(pose) = own[node] {
            points.push(as_point(index));
            poses.push(pose);
        }
        node += 1;
    });
    if points.is_empty() {
        return Err(ReconstructError::TooFew {
            method,
            readings: 0,
            needed: 1,
        });
    }
    if points.len() == own.len() {
        return Ok(poses);
    }
    let nearest = scattered::Nearest::new(&points);
    let mut source = Vec::with_capacity(own.len());
    for_each_node(&shape, |index| {
        source.push(match own[source.len()] {
            Some(pose) => pose,
            None => poses[nearest.find(&as_point(index))],
        });
    });
    Ok(source)
}

/// Lattice indices as a point of the nearest-node search.
fn as_point(index: &[i64]) -> [f64; 4] {
    let mut point = [0.0; 4];
    for (x, &i) in point.iter_mut().zip(index) {
        *x = i as f64;
    }
    point
}

/// The node of the lattice whose configuration is that of `index`, which may lie outside.
fn home<const D: usize>(
    parametrization: &dyn Parametrization,
    lattice: &Lattice,
    index: &[i64; D],
) -> usize {
    if let Some(node) = lattice.node(index) {
        return node;
    }
    // Past the far end of an axis the last node continues; for the other ends canonical() knows.
    let mut inside = *index;
    for (d, axis) in lattice.axes.iter().enumerate() {
        let far = parametrization.axes()[d].range[1];
        while !axis.periodic && inside[d] > 0 && axis.value(inside[d] as f64) > far {
            inside[d] -= 1;
        }
    }
    let coords = lattice.coords(&inside);
    let home = parametrization.canonical(&coords).unwrap_or(coords);
    let mut node = 0;
    for (d, axis) in lattice.axes.iter().enumerate() {
        let n = axis.n as i64;
        let i = axis.index(home[d]).round() as i64;
        let i = if axis.periodic {
            i.rem_euclid(n)
        } else {
            i.clamp(0, n - 1)
        };
        node = node * axis.n + i as usize;
    }
    node
}

/// An interpolation rule in index coordinates.
pub(super) trait Rule<const D: usize>: Send + Sync {
    /// Writes the transformed value of each channel at index coordinates `x` (of the unpadded
    /// lattice, half a node beyond it at most).
    fn interpolate(&self, x: &[f64; D], out: &mut [f64]);
}

/// A rule on a lattice, as a BRDF.
pub(super) struct GridBrdf<R, const D: usize> {
    rule: R,
    parametrization: Arc<dyn Parametrization>,
    axes: [LatticeAxis; D],
    transform: Transform,
    channels: Channels,
}

/// Pairs per call of `forward_batch`: their coordinates stay in the first-level cache.
const BATCH: usize = 128;

impl<R: Rule<D>, const D: usize> GridBrdf<R, D> {
    /// The BRDF that `rule` makes of a grid schedule.
    pub fn new(rule: R, schedule: &Schedule, transform: Transform, channels: Channels) -> Self {
        let axis = |d: usize| match &schedule.lattice {
            Some(lattice) => lattice.axes[d],
            None => unreachable!("Padded::new refused a schedule without a lattice"),
        };
        Self {
            rule,
            parametrization: Arc::clone(&schedule.parametrization),
            axes: std::array::from_fn(axis),
            transform,
            channels,
        }
    }

    #[inline]
    fn value(&self, pair: &DirectionPair, coords: &Coords, out: &mut [f64]) {
        if !pair.is_above_horizon() {
            out.fill(0.0);
            return;
        }
        let x = std::array::from_fn(|d| self.axes[d].index(coords[d]));
        self.rule.interpolate(&x, out);
        for y in out {
            *y = self.transform.inverse(*y);
        }
    }
}

impl<R: Rule<D>, const D: usize> Brdf for GridBrdf<R, D> {
    fn channels(&self) -> Channels {
        self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.parametrization.symmetry()
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        self.value(pair, &self.parametrization.forward(pair), out);
        Presence::Present
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let n = self.channels.count();
        let mut coords = [[0.0; 4]; BATCH];
        for (pairs, out) in pairs.chunks(BATCH).zip(out.chunks_mut(BATCH * n)) {
            let coords = &mut coords[..pairs.len()];
            self.parametrization.forward_batch(pairs, coords);
            for ((pair, coords), out) in pairs.iter().zip(coords).zip(out.chunks_exact_mut(n)) {
                self.value(pair, coords, out);
            }
        }
        presence.fill(Presence::Present);
    }
}
