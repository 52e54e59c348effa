//! Readings, interpolants through them, these as BRDFs, and the errors that they expect of themselves.
//!
//! The neighbours of a pair and their weights depend on the poses of the readings and not on their
//! values. So several values per pose (the channels of one material, or many materials at the same
//! poses) are interpolated together, for one search and one set of weights per pair.

use super::transform::EPSILON;

use crate::geometry::DirectionPair;
use crate::measurement::{Measurement, Outcome};
use crate::numeric::upper_median;
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
    /// Those of a measurement.
    pub(crate) fn new(
        measurement: &'a Measurement,
        present: &'a [bool],
        noise: Option<&'a [f64]>,
    ) -> Self {
        Self {
            schedule: &measurement.schedule,
            width: measurement.channels.count(),
            values: &measurement.values,
            present,
            noise,
            half_angles_deg: measurement.half_angles_deg,
        }
    }

    /// The values of pose `i`, `None` if there is no reading.
    #[inline]
    pub fn value(&self, i: usize) -> Option<&'a [f64]> {
        let values = &self.values[i * self.width..(i + 1) * self.width];
        self.present[i].then_some(values)
    }

    /// The uncertainty of type A of pose `i` as a share of its values plus `epsilon` (sr⁻¹), over all its
    /// values; 0 if it is not stated.
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

/// The uncertainties of type A of a measurement, where it has some. Of a reading that states none in some channels, where most readings
/// state one, these have the share of their values plus [`EPSILON`] that its other channels state, or else the median over all
/// readings of the channel, or of all channels.
pub fn noise(measurement: &Measurement) -> Option<Cow<'_, [f64]>> {
    let type_a = &*measurement.details.as_ref()?.type_a;
    let n = measurement.channels.count();
    let of = |k: usize| measurement.values[k].max(0.0) + EPSILON;
    let share = |k: usize| (type_a[k] > 0.0).then(|| type_a[k] / of(k));
    let read = (0..measurement.outcomes.len()).filter(|&i| measurement.value(i).is_some());
    let read: Vec<usize> = read.collect();
    let states = |i: &&usize| (0..n).any(|c| type_a[*i * n + c] > 0.0);
    let known = |i: &usize| (0..n).all(|c| type_a[i * n + c] > 0.0);
    let stating = read.iter().filter(states).count();
    if 2 * stating <= read.len() || read.iter().all(known) {
        return Some(Cow::Borrowed(type_a));
    }
    let median = |channels: std::ops::Range<usize>| {
        let all = read
            .iter()
            .flat_map(|i| channels.clone().map(move |c| i * n + c));
        upper_median(&mut all.filter_map(share).collect::<Vec<f64>>())
    };
    let all = median(0..n).unwrap_or(0.0);
    let medians: Vec<f64> = (0..n).map(|c| median(c..c + 1).unwrap_or(all)).collect();
    let mut noise = type_a.to_vec();
    for i in read {
        let stated: Vec<f64> = (0..n).filter_map(|c| share(i * n + c)).collect();
        let mean = stated.iter().sum::<f64>() / stated.len() as f64;
        for (c, median) in medians.iter().enumerate() {
            if type_a[i * n + c] == 0.0 {
                let share = if stated.is_empty() { *median } else { mean };
                noise[i * n + c] = share * of(i * n + c);
            }
        }
    }
    Some(Cow::Owned(noise))
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

    /// Writes the values at pairs, pair-major (`pairs × width`).
    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]);

    /// True if ln(f + ε) has no steps and no bends, so that polynomials converge.
    fn is_smooth(&self) -> bool {
        false
    }

    /// Writes the values at a pair (length `width`).
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) {
        self.eval_batch(std::slice::from_ref(pair), out);
    }

    /// Remarks for the user, a sentence each.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
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

/// What is known of the luminance f at a pair: ln(f + ε) as a normal variable, ε = 10⁻³ sr⁻¹.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LogNormal {
    /// Mean of ln(f + ε).
    pub mean: f64,
    /// Variance of ln(f + ε).
    pub variance: f64,
    /// The part of the variance that is of errors which all readings share: one draw of them is the error everywhere.
    pub shared: f64,
}

/// A reading that all others contradict, and that is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspect {
    /// The number of its pose.
    pub pose: usize,
    /// Its luminance f, sr⁻¹.
    pub value: f64,
    /// What the others predict of that.
    pub expected: f64,
    /// The standard uncertainty (k = 1) of the prediction, sr⁻¹.
    pub uncertainty: f64,
}

/// A reconstruction with a predictive distribution between readings.
pub trait Predictive: Send + Sync {
    /// What is known at pairs.
    fn predict(&self, pairs: &[DirectionPair]) -> Vec<LogNormal>;

    /// Variances of sums Σ w ln(f + ε) over some pairs, whose errors are not independent: a list of weights for each sum.
    fn variances_of_sums(&self, pairs: &[DirectionPair], weights: &[Vec<f64>]) -> Vec<f64>;

    /// The readings that it leaves out, in the order of the schedule.
    fn suspects(&self) -> &[Suspect] {
        &[]
    }
}
