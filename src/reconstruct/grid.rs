//! The base of every interpolation on a lattice: node values without holes, continued past the
//! ends of every axis, and the conversion of pairs to index coordinates.
//!
//! The horizon rule. Through a pole or a fold the lattice meets itself again: nodes that name one
//! configuration are one place and hold one value. Every place without a reading (below the
//! horizon, past the far end of an axis, no data in the material) continues the readings, layer
//! by layer: the mean, over the lattice directions in which the next two nodes are known, of the
//! next node's value plus half its slope. The slope halves with every layer, so the continuation
//! is straight at the edge, where cells straddle the horizon, and flat far from it, where nothing
//! is known. Copying the nearest reading instead would put a kink at the horizon.

use super::ReconstructError;
use super::interpolant::{Interpolant, Readings};
use super::transform::Transform;
use crate::geometry::DirectionPair;
use crate::numeric::vectorised;
use crate::parametrization::{AxisKind, Coords, Parametrization};
use crate::schedule::{Lattice, LatticeAxis, for_each_node};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Rule for the value of a place without a reading, e.g. below the horizon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Continuation {
    /// The next node's value plus half its slope.
    #[default]
    Straight,
    /// The next node's value: always one of the readings.
    Copy,
}

/// Transformed values on a lattice that reaches `pad` nodes past each end of each axis.
pub(super) struct Padded<const D: usize> {
    /// Nodes along each axis, padding included.
    pub shape: [usize; D],
    /// Nodes past each end.
    pub pad: usize,
    /// Values per node.
    pub channels: usize,
    /// Transformed values, node-major (last axis fastest), channels innermost.
    pub values: Vec<f64>,
}

impl<const D: usize> Padded<D> {
    /// Pads readings on a grid; `pad` is at least 2, so that every place of the box
    /// sees two nodes in each direction.
    pub(crate) fn new(
        method: &'static str,
        readings: &Readings<'_>,
        transform: Transform,
        pad: usize,
        continuation: Continuation,
    ) -> Result<Self, ReconstructError> {
        debug_assert!(pad >= 2);
        let schedule = readings.schedule;
        let Some(lattice) = &schedule.lattice else {
            return Err(ReconstructError::NoGrid {
                method,
                sample_set: schedule.sample_set.clone(),
            });
        };
        let channels = readings.width;
        let shape: [usize; D] = std::array::from_fn(|d| lattice.axes[d].n + 2 * pad);
        let nodes = shape.iter().product();
        let mut table = Self {
            shape,
            pad,
            channels,
            values: vec![0.0; nodes * channels],
        };
        let places = Places::new(&*schedule.parametrization, lattice, &table);
        let mut known = vec![false; nodes];
        for (&node, &pose) in places.inside.iter().zip(&lattice.pose) {
            let place = places.of[node];
            let reading = pose.and_then(|pose| readings.value(pose as usize));
            if let Some(reading) = reading {
                let values = &mut table.values[place * channels..(place + 1) * channels];
                for (value, &f) in values.iter_mut().zip(reading) {
                    *value = transform.forward(f);
                }
                known[place] = true;
            }
        }
        super::admit(method, usize::from(known.contains(&true)), usize::MAX)?;
        table.continue_outwards(&places, known, continuation);
        for (node, &place) in places.of.iter().enumerate() {
            let from = place * channels;
            table
                .values
                .copy_within(from..from + channels, node * channels);
        }
        Ok(table)
    }

    /// The horizon rule: fills the places that are not `known` from those that are.
    fn continue_outwards(
        &mut self,
        places: &Places,
        mut known: Vec<bool>,
        continuation: Continuation,
    ) {
        let channels = self.channels;
        let strides = self.strides().map(|s| s / channels);
        // A lone reading has no second node behind it: then slopes count as 0.
        let mut need_two = continuation == Continuation::Straight;
        let mut unknown: Vec<usize> = places.inside.clone();
        unknown.extend(&places.outside);
        // Directions that spoke for a place of this layer; their sum collects in `values`.
        let mut voices = vec![0u32; known.len()];
        let mut layer = Vec::new();
        loop {
            unknown.retain(|&node| {
                let place = places.of[node];
                if known[place] {
                    return false;
                }
                for (&stride, &n) in strides.iter().zip(&self.shape) {
                    let i = node / stride % n;
                    for (room, step) in [(i, -(stride as isize)), (n - 1 - i, stride as isize)] {
                        if room < 1 {
                            continue;
                        }
                        let next = node.wrapping_add_signed(step);
                        let after = (room >= 2).then(|| next.wrapping_add_signed(step));
                        let next = places.of[next];
                        let after = after.map(|a| places.of[a]).filter(|&a| known[a]);
                        if !known[next] || (need_two && after.is_none()) {
                            continue;
                        }
                        if continuation == Continuation::Copy && voices[place] > 0 {
                            continue;
                        }
                        if voices[place] == 0 {
                            layer.push(place);
                        }
                        voices[place] += 1;
                        for c in 0..channels {
                            let y = self.values[next * channels + c];
                            let slope = match (continuation, after) {
                                (Continuation::Straight, Some(after)) => {
                                    y - self.values[after * channels + c]
                                }
                                _ => 0.0,
                            };
                            self.values[place * channels + c] += y + 0.5 * slope;
                        }
                    }
                }
                true
            });
            if unknown.is_empty() || (layer.is_empty() && !need_two) {
                break;
            }
            if layer.is_empty() {
                need_two = false;
            }
            for place in layer.drain(..) {
                known[place] = true;
                for value in &mut self.values[place * channels..(place + 1) * channels] {
                    *value /= f64::from(voices[place]);
                }
            }
        }
    }

    /// Distance in `values` between neighbours along each axis.
    pub(crate) fn strides(&self) -> [usize; D] {
        let mut strides = [self.channels; D];
        for d in (0..D - 1).rev() {
            strides[d] = strides[d + 1] * self.shape[d + 1];
        }
        strides
    }

    /// Number of the node at an index of the unpadded lattice, if it is inside the padding.
    fn node(&self, index: &[i64; D]) -> Option<usize> {
        let mut node = 0;
        for (&i, &n) in index.iter().zip(&self.shape) {
            let i = usize::try_from(i + self.pad as i64)
                .ok()
                .filter(|&i| i < n)?;
            node = node * n + i;
        }
        Some(node)
    }

    /// The values with `pad` nodes past each end, fewer than now.
    pub(crate) fn cropped(&self, pad: usize) -> Self {
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

/// A padded lattice and what finds the nodes around a point.
pub(super) struct Cells<const D: usize> {
    pub table: Padded<D>,
    /// Distance in the values between neighbours along each axis.
    pub strides: [usize; D],
    /// Padded index of the first node around the origin of the unpadded lattice.
    shift: f64,
    /// Largest padded index that the nodes around a point may start at.
    last: [f64; D],
}

impl<const D: usize> Cells<D> {
    /// For `taps` nodes along each axis, half of them on either side of a point.
    pub(crate) fn new(table: Padded<D>, taps: usize) -> Self {
        Self {
            strides: table.strides(),
            shift: (table.pad + 1 - taps / 2) as f64,
            last: table.shape.map(|n| (n - taps) as f64),
            table,
        }
    }

    /// Where the values of the first node around a point are, and the point's distance along each axis from the last
    /// node before it.
    #[inline(always)]
    pub(crate) fn around(&self, x: &[f64; D]) -> (usize, [f64; D]) {
        let mut base = 0;
        let mut t = [0.0; D];
        for d in 0..D {
            let padded = x[d] + self.shift;
            let first = padded.floor().clamp(0.0, self.last[d]);
            t[d] = padded - first;
            base += first as usize * self.strides[d];
        }
        (base, t)
    }
}

/// Places of a padded lattice: nodes that name one configuration are one place.
struct Places {
    /// One number per node: of the node that holds the value of its place.
    of: Vec<usize>,
    /// The nodes of the box, in the order of the lattice.
    inside: Vec<usize>,
    /// The nodes beyond it that are places of their own.
    outside: Vec<usize>,
}

impl Places {
    fn new<const D: usize>(
        parametrization: &dyn Parametrization,
        lattice: &Lattice,
        table: &Padded<D>,
    ) -> Self {
        let nodes = table.shape.iter().product();
        let mut places = Self {
            of: (0..nodes).collect(),
            inside: Vec::with_capacity(lattice.pose.len()),
            outside: Vec::new(),
        };
        // Nodes of the box that share a pose: the azimuths of a pole, light and sensor exchanged.
        let mut first = vec![None; lattice.pose.len()];
        let mut index = [0i64; D];
        let mut node = 0;
        for_each_node(&table.shape, |padded| {
            for (index, &i) in index.iter_mut().zip(padded) {
                *index = i - table.pad as i64;
            }
            let mut along = index.iter().zip(&lattice.axes);
            if along.all(|(i, axis)| (0..axis.n as i64).contains(i)) {
                if let Some(pose) = lattice.pose[places.inside.len()] {
                    places.of[node] = *first[pose as usize].get_or_insert(node);
                }
                places.inside.push(node);
            } else {
                let home = home(parametrization, lattice, &index);
                places.of[node] = home.and_then(|home| table.node(&home)).unwrap_or(node);
            }
            node += 1;
        });
        // A home may share its pose with another node.
        for node in 0..nodes {
            let place = places.of[places.of[node]];
            places.of[node] = if places.of[place] == place {
                place
            } else {
                node
            };
        }
        let mut inside = places.inside.iter().peekable();
        for node in 0..nodes {
            if inside.next_if(|&&i| i == node).is_none() && places.of[node] == node {
                places.outside.push(node);
            }
        }
        places
    }
}

/// The index, inside the box, of the configuration at `index`. Past the far end of a radial axis,
/// where there is none, azimuths and poles still fold: the index as far past the end in the
/// folded box. `None` if no node is there (an exchange between axes of different steps).
fn home<const D: usize>(
    parametrization: &dyn Parametrization,
    lattice: &Lattice,
    index: &[i64; D],
) -> Option<[i64; D]> {
    let mut coords = [0.0; 4];
    // Stand-ins for coordinates past the end, and what they stand for: they fold in their place.
    let mut past_end = [(f64::NAN, 0.0); D];
    for d in 0..D {
        let axis = &parametrization.axes()[d];
        coords[d] = lattice.axes[d].value(index[d] as f64);
        if axis.kind != AxisKind::Radial {
            continue;
        }
        let [_, max] = axis.range;
        let (size, sign) = (coords[d].abs(), 1f64.copysign(coords[d]));
        if size > max * (1.0 + ON_NODE) {
            past_end[d] = (max * STAND_IN[d], size);
            coords[d] = sign * past_end[d].0;
        } else {
            // At the pole itself azimuths are lost; right beside it they are not.
            coords[d] = sign * size.clamp(BESIDE_POLE * max, max);
        }
    }
    let canonical = parametrization.canonical(&coords)?;
    let images = parametrization.images(&canonical);
    images.iter().find_map(|image| {
        let mut home = [0; D];
        for (d, (home, axis)) in home.iter_mut().zip(&lattice.axes).enumerate() {
            let stands = |p: &&(f64, f64)| (image[d] - p.0).abs() < ON_NODE * axis.step;
            let beyond = past_end.iter().find(stands);
            let x = axis.index(beyond.map_or(image[d], |p| p.1));
            if (x - x.round()).abs() > ON_NODE {
                return None;
            }
            let n = axis.n as i64;
            *home = x.round() as i64;
            if axis.periodic {
                *home = home.rem_euclid(n);
            }
            if beyond.is_none() && !(0..n).contains(home) {
                return None;
            }
        }
        Some(home)
    })
}

/// Shares of a radial axis that stand for what lies past its end, by axis: between nodes, and not
/// to be mistaken for each other.
const STAND_IN: [f64; 4] = [0.986_127_183, 0.973_183_049, 0.961_549_327, 0.952_718_281];

/// Tolerance of coordinates on a node, steps.
const ON_NODE: f64 = 1e-6;

/// Share of a radial axis that is beside the pole: far less than [`ON_NODE`] of a step.
const BESIDE_POLE: f64 = 1e-12;

/// An interpolation rule in index coordinates.
pub(super) trait Rule<const D: usize>: Send + Sync {
    /// Writes the transformed value of each channel at index coordinates `x` (of the unpadded
    /// lattice, half a node beyond it at most).
    fn interpolate(&self, x: &[f64; D], out: &mut [f64]);
}

/// A rule on a lattice.
pub(super) struct GridInterpolant<R, const D: usize> {
    /// The rule.
    pub rule: R,
    parametrization: Arc<dyn Parametrization>,
    axes: [LatticeAxis; D],
    transform: Transform,
    width: usize,
}

/// Pairs per call of `forward_batch`: their coordinates stay in the first-level cache.
const BATCH: usize = 128;

impl<R: Rule<D>, const D: usize> GridInterpolant<R, D> {
    /// The interpolant of `rule` on the grid of readings.
    pub(crate) fn new(rule: R, readings: &Readings<'_>, transform: Transform) -> Self {
        let schedule = readings.schedule;
        let axis = |d: usize| match &schedule.lattice {
            Some(lattice) => lattice.axes[d],
            None => unreachable!("Padded::new refused a schedule without a lattice"),
        };
        Self {
            rule,
            parametrization: Arc::clone(&schedule.parametrization),
            axes: std::array::from_fn(axis),
            transform,
            width: readings.width,
        }
    }

    /// This lattice with another rule, of `width` values per node.
    pub(crate) fn with<S: Rule<D>>(&self, rule: S, width: usize) -> GridInterpolant<S, D> {
        GridInterpolant {
            rule,
            parametrization: Arc::clone(&self.parametrization),
            axes: self.axes,
            transform: self.transform,
            width,
        }
    }

    /// Writes the values at pairs: transformed, also of those below the horizon, or taken back by `back`, and 0 there.
    pub(crate) fn batch(&self, pairs: &[DirectionPair], out: &mut [f64], back: Option<Transform>) {
        let n = self.width;
        let mut coords = [[0.0; 4]; BATCH];
        for (pairs, out) in pairs.chunks(BATCH).zip(out.chunks_mut(BATCH * n)) {
            let coords = &mut coords[..pairs.len()];
            self.parametrization.forward_batch(pairs, coords);
            vectorised!(self.look_up(coords, out, back));
            if back.is_some() {
                let places = pairs.iter().zip(out.chunks_exact_mut(n));
                let below = places.filter(|(pair, _)| !pair.is_above_horizon());
                below.for_each(|(_, out)| out.fill(0.0));
            }
        }
    }

    /// Writes the values at coordinates, transformed, or taken back by `back`.
    #[inline(always)]
    fn look_up(&self, coords: &[Coords], out: &mut [f64], back: Option<Transform>) {
        for (coords, out) in coords.iter().zip(out.chunks_exact_mut(self.width)) {
            let x = std::array::from_fn(|d| self.axes[d].index(coords[d]));
            self.rule.interpolate(&x, out);
        }
        if let Some(back) = back {
            back.inverse_all(out);
        }
    }
}

impl<R: Rule<D>, const D: usize> Interpolant for GridInterpolant<R, D> {
    fn width(&self) -> usize {
        self.width
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        self.batch(pairs, out, Some(self.transform));
    }
}
