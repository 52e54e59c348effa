//! What every interpolation on a lattice shares: node values without holes, continued past the
//! ends of every axis, and the walk from pairs to index coordinates.
//!
//! The horizon rule. Through a pole or a fold the lattice meets itself again: the value there is
//! that of the same configuration inside the box. Every other node without a reading (below the
//! horizon, past the far end of an axis, no data in the material) continues the readings, layer
//! by layer: the mean, over the lattice directions in which the next two nodes are known, of the
//! next node's value plus half its slope. The slope halves with every layer, so the continuation
//! is straight at the edge, where cells straddle the horizon, and flat far from it, where nothing
//! is known. (On 82 materials at 4000 readings this is a third better in `nrmse` for the cubic
//! spline than copying the nearest reading, and a few per cent better for multilinear.)

use super::ReconstructError;
use super::transform::Transform;
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
        let shape: [usize; D] = std::array::from_fn(|d| lattice.axes[d].n + 2 * pad);
        let nodes = shape.iter().product();
        let mut table = Self {
            shape,
            pad,
            channels,
            values: vec![0.0; nodes * channels],
        };
        let mut unknown = Vec::new();
        let mut known = vec![false; nodes];
        let mut inner = [0i64; D];
        let mut node = 0;
        for_each_node(&shape, |index| {
            for (inner, &i) in inner.iter_mut().zip(index) {
                *inner = i - pad as i64;
            }
            let pose = home(&*schedule.parametrization, lattice, &inner)
                .and_then(|home| lattice.pose[home])
                .and_then(|pose| measurement.value(pose as usize));
            if let Some(reading) = pose {
                let values = &mut table.values[node * channels..(node + 1) * channels];
                for (value, &f) in values.iter_mut().zip(reading) {
                    *value = transform.forward(f);
                }
                known[node] = true;
            } else {
                unknown.push(node);
            }
            node += 1;
        });
        if unknown.len() == nodes {
            return Err(ReconstructError::TooFew {
                method,
                readings: 0,
                needed: 1,
            });
        }
        table.continue_outwards(known, unknown);
        Ok(table)
    }

    /// The horizon rule: fills the `unknown` nodes from the `known` ones.
    fn continue_outwards(&mut self, mut known: Vec<bool>, mut unknown: Vec<usize>) {
        let channels = self.channels;
        let strides = self.strides().map(|s| s / channels);
        // A lone reading has no second node behind it: then slopes count as 0.
        let mut need_two = true;
        let mut layer: Vec<(usize, [f64; 3])> = Vec::new();
        while !unknown.is_empty() {
            layer.clear();
            unknown.retain(|&node| {
                let mut sum = [0.0; 3];
                let mut count = 0.0;
                for (&stride, &n) in strides.iter().zip(&self.shape) {
                    let i = node / stride % n;
                    for (room, step) in [(i, -(stride as isize)), (n - 1 - i, stride as isize)] {
                        if room < 1 {
                            continue;
                        }
                        let next = node.wrapping_add_signed(step);
                        let after = next.wrapping_add_signed(step);
                        let two = room >= 2 && known[after];
                        if !known[next] || (need_two && !two) {
                            continue;
                        }
                        count += 1.0;
                        for (c, sum) in sum.iter_mut().enumerate().take(channels) {
                            let y = self.values[next * channels + c];
                            let slope = if two {
                                y - self.values[after * channels + c]
                            } else {
                                0.0
                            };
                            *sum += y + 0.5 * slope;
                        }
                    }
                }
                if count > 0.0 {
                    layer.push((node, sum.map(|s| s / count)));
                }
                count == 0.0
            });
            if layer.is_empty() {
                need_two = false;
            }
            for &(node, values) in &layer {
                known[node] = true;
                self.values[node * channels..(node + 1) * channels]
                    .copy_from_slice(&values[..channels]);
            }
        }
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

/// The node of the lattice whose configuration is that of `index`, which may lie outside; `None`
/// past the far end of an axis.
fn home<const D: usize>(
    parametrization: &dyn Parametrization,
    lattice: &Lattice,
    index: &[i64; D],
) -> Option<usize> {
    if let Some(node) = lattice.node(index) {
        return Some(node);
    }
    let coords = parametrization.canonical(&lattice.coords(index))?;
    let mut home = [0; D];
    for (d, (home, axis)) in home.iter_mut().zip(&lattice.axes).enumerate() {
        let x = axis.index(coords[d]);
        *home = x.round() as i64;
        // At a pole canonical() sets azimuths to 0, between nodes; every node there is the same
        // configuration, so the first will do.
        if x < 0.0 {
            *home = (*home).max(0);
        }
    }
    lattice.node(&home)
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
