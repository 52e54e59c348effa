//! Readings, interpolants through them, and these as BRDFs.
//!
//! The neighbours of a pair and their weights depend on the poses of the readings and not on their
//! values. So several values per pose (the channels of one material, or many materials at the same
//! poses) are interpolated together, for one search and one set of weights per pair.

use super::transform::EPSILON;
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::{Measurement, Outcome};
use crate::schedule::Schedule;
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

/// Values at the poses of a schedule.
#[derive(Clone, Copy)]
pub struct Readings<'a> {
    /// The poses.
    pub schedule: &'a Arc<Schedule>,
    /// Values per pose.
    pub width: usize,
    /// f_r in sr⁻¹, pose-major (`poses × width`); meaningless where there is no reading.
    pub values: &'a [f64],
    /// One flag per pose: true if it has a reading.
    pub present: &'a [bool],
    /// Standard uncertainty of type A of each value, sr⁻¹, laid out as `values`; `None` of values that are
    /// taken as they are.
    pub noise: Option<&'a [f64]>,
    /// Half-angles of source and sensor over which values are means, see [`Measurement::half_angles_deg`].
    pub half_angles_deg: [f64; 2],
}

impl<'a> Readings<'a> {
    /// The values of pose `i`, `None` if there is no reading.
    #[inline]
    pub fn value(&self, i: usize) -> Option<&'a [f64]> {
        let values = &self.values[i * self.width..(i + 1) * self.width];
        self.present[i].then_some(values)
    }

    /// The uncertainty of type A of pose `i` as a share of its values plus `epsilon` (sr⁻¹), over all its
    /// values; 0 if nothing says it.
    pub(super) fn relative_noise(&self, i: usize, epsilon: f64) -> f64 {
        let of = i * self.width..(i + 1) * self.width;
        let Some(noise) = self.noise.map(|noise| &noise[of.clone()]) else {
            return 0.0;
        };
        let values = self.values[of].iter().map(|f| f.max(0.0) + epsilon);
        noise.iter().sum::<f64>() / values.sum::<f64>()
    }

    /// Number of poses with a reading.
    pub fn count(&self) -> usize {
        self.present.iter().filter(|p| **p).count()
    }
}

/// The uncertainties of type A of a measurement, where it has some. Where most readings of a channel state one, the others have the
/// median of what these state, as a share of their values plus [`EPSILON`].
pub fn noise(measurement: &Measurement) -> Option<Cow<'_, [f64]>> {
    let mut noise = Cow::Borrowed(&*measurement.details.as_ref()?.type_a);
    let n = measurement.channels.count();
    for c in 0..n {
        let read = (0..measurement.outcomes.len()).map(|i| i * n + c);
        let read: Vec<usize> = read
            .filter(|k| measurement.value(k / n).is_some())
            .collect();
        let of = |k: usize| measurement.values[k].max(0.0) + EPSILON;
        let known = read.iter().filter(|&&k| noise[k] > 0.0);
        let mut shares: Vec<f64> = known.map(|&k| noise[k] / of(k)).collect();
        if shares.len() == read.len() || 2 * shares.len() <= read.len() {
            continue;
        }
        let middle = shares.len() / 2;
        let (_, median, _) = shares.select_nth_unstable_by(middle, f64::total_cmp);
        let unknown: Vec<usize> = read.into_iter().filter(|&k| noise[k] == 0.0).collect();
        unknown
            .into_iter()
            .for_each(|k| noise.to_mut()[k] = *median * of(k));
    }
    Some(noise)
}

/// One flag per pose of a measurement: true if it has a reading.
pub fn present(measurement: &Measurement) -> Vec<bool> {
    let outcomes = measurement.outcomes.iter();
    outcomes.map(|&o| o == Outcome::Reading).collect()
}

/// A function of a pair through (or near) readings: f_r in sr⁻¹, without the cosine, `width` values
/// per pair, finite and ≥ 0 above the horizon and 0 below.
pub trait Interpolant: Send + Sync {
    /// Values per pair.
    fn width(&self) -> usize;

    /// Writes the values at a pair (length `width`).
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]);

    /// What should be told of it, a sentence each.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// [`eval`](Self::eval) for many pairs: `out` is pair-major (`pairs × width`). One virtual call
    /// per batch.
    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        for (pair, out) in pairs.iter().zip(out.chunks_exact_mut(self.width())) {
            self.eval(pair, out);
        }
    }
}

/// Pairs that an interpolant is given at a time.
const BATCH: usize = 256;

/// The values of an interpolant at pairs, pair-major (`pairs × width`), in parallel.
pub fn values_at(interpolant: &dyn Interpolant, pairs: &[DirectionPair]) -> Vec<f64> {
    let width = interpolant.width();
    let mut values = vec![0.0; pairs.len() * width];
    pairs
        .par_chunks(BATCH)
        .zip(values.par_chunks_mut(BATCH * width))
        .for_each(|(pairs, out)| interpolant.eval_batch(pairs, out));
    values
}

/// An interpolant whose values are the channels of one material.
pub(super) struct Interpolated {
    pub interpolant: Box<dyn Interpolant>,
    pub channels: Channels,
    pub symmetry: Symmetry,
}

impl Brdf for Interpolated {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn remarks(&self) -> Vec<String> {
        self.interpolant.remarks()
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        self.interpolant.eval(pair, out);
        Presence::Present
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        self.interpolant.eval_batch(pairs, out);
        presence.fill(Presence::Present);
    }
}
