//! How uncertain a reconstruction is that is made of uncertain readings.
//!
//! Neighbours of a pair and their weights depend on poses alone ([`super::interpolant`]), so readings that
//! erred otherwise are interpolated in the same call as those that were taken, whatever the method and its
//! transform:
//!
//! * type B is shared by all readings: one more set of them is all too large by it (k = 1), and what the
//!   reconstruction changes by is its uncertainty of type B;
//! * type A differs between readings: in sixteen more sets each errs by its own, independently of the others
//!   and alike in all its channels, and the root of the mean square of what the reconstruction changes by is
//!   its uncertainty of type A. The sixteen errors of a reading have the mean 0 and the mean square 1, so the
//!   uncertainty of a single reading comes back as it is; that of many is known to a fifth.
//!
//! That is what the errors of readings do to the reconstruction, and not what lies between readings. A method that is
//! [`Predictive`] has both: its type A is what its readings leave open, by their scatter and between them, and its type B what they
//! share.

use super::interpolant::{Readings, noise, present, values_at};
use super::{Cover, Coverage, EPSILON, Interpolant, Predictive, Reconstruct, ReconstructError};
use crate::brdf::{Brdf, Channels, EstimatedBrdf, Presence, SampleBrdf, of_wrapped};
use crate::geometry::DirectionPair;
use crate::measurement::{Details, Flags, Measurement, Outcome};
use crate::registry::forwarded;
use crate::sampling::Random;
use crate::schedule::Schedule;
use rand_distr::{Distribution, StandardNormal};
use std::sync::{Arc, OnceLock};

/// Sets of readings with errors of type A.
const REPLICAS: usize = 16;

/// All sets: as they are, with the error of type B, with errors of type A.
const SETS: usize = 2 + REPLICAS;

/// Seed of the errors.
const SEED: u64 = 0;

/// The luminance or a channel of a reconstruction at a pair, with its standard uncertainties (k = 1), sr⁻¹.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uncertain {
    /// f_r, without the cosine.
    pub value: f64,
    /// What the scatter of readings makes of it and, of a method that is [`Predictive`], what is open between them.
    pub type_a: f64,
    /// What readings share.
    pub type_b: f64,
}

impl Uncertain {
    /// Both types together: the root of the sum of their squares, sr⁻¹.
    pub fn uncertainty(&self) -> f64 {
        self.type_a.hypot(self.type_b)
    }

    /// An uncertainty as a share of the value; infinite where that is black and yet uncertain.
    pub(crate) fn share(&self, uncertainty: f64) -> f64 {
        match uncertainty {
            0.0 => 0.0,
            u => u / self.value,
        }
    }
}

/// A reconstruction together with those of readings that erred otherwise.
pub struct Replicated {
    /// Values of a pair: one set of channels after the other.
    interpolant: Box<dyn Interpolant>,
    channels: Channels,
    /// The predictive distribution of the method, if it has one.
    known: Option<Box<dyn Predictive>>,
    /// The least cosine of an elevation that was read.
    reach: f64,
}

/// The least cosine of an elevation among some poses that have a reading.
fn reach(measurement: &Measurement, present: &[bool]) -> f64 {
    let poses = measurement.schedule.poses.iter().zip(present).enumerate();
    let read = poses.filter(|(i, (_, present))| **present && measurement.value(*i).is_some());
    read.map(|(_, (pose, _))| pose.pair.least_cosine())
        .fold(1.0, f64::min)
}

/// What a value beyond the elevations that were read may be off by, as a share of it: nothing was read that says how a BRDF goes on
/// towards the horizon. In sums all of these errors count to one side: which way they lean is as unknown.
const BEYOND: f64 = 0.5;

/// True if at least half of the readings have an uncertainty: a few poses that were repeated say nothing of the others.
pub(crate) fn states_uncertainties(measurement: &Measurement) -> bool {
    let n = measurement.channels.count();
    let uncertain = |i: usize| {
        let details = measurement.details.as_ref()?;
        let of = [&details.type_a, &details.type_b].map(|u| &u[i * n..(i + 1) * n]);
        let is_uncertain = of.into_iter().flatten().any(|u| *u > 0.0);
        measurement.value(i).map(|_| is_uncertain)
    };
    let poses = 0..measurement.outcomes.len();
    let stated: Vec<bool> = poses.filter_map(uncertain).collect();
    let uncertain = stated.iter().filter(|is| **is).count();
    uncertain > 0 && 2 * uncertain >= stated.len()
}

/// Readings up to which the errors of a method that is predictive are asked for: that takes as long as the BRDF.
pub const MOST_PREDICTED: usize = 2000;

impl Replicated {
    /// What `method` makes of a measurement; `None` if more than half of its readings have no uncertainty, unless the method is
    /// [`Predictive`] and has up to [`MOST_PREDICTED`] readings.
    ///
    /// # Errors
    /// As [`Reconstruct::interpolate`].
    pub fn of(
        measurement: &Measurement,
        method: &dyn Reconstruct,
    ) -> Result<Option<Self>, ReconstructError> {
        let present = present(measurement);
        match Self::predicted(measurement, &present, method)? {
            None => Self::of_some(measurement, &present, method),
            predicted => Ok(predicted),
        }
    }

    /// What a method that is predictive makes of some readings.
    fn predicted(
        measurement: &Measurement,
        present: &[bool],
        method: &dyn Reconstruct,
    ) -> Result<Option<Self>, ReconstructError> {
        let read = (0..present.len()).filter(|&i| present[i] && measurement.value(i).is_some());
        if !(1..=MOST_PREDICTED).contains(&read.count()) {
            return Ok(None);
        }
        let others = (0..present.len()).filter(|&i| !present[i]);
        let some = measurement.clone().without(others);
        let Some(known) = method.predictive(&some)? else {
            return Ok(None);
        };
        let noise = noise(&some);
        let interpolant = method.interpolate(&Readings::new(&some, present, noise.as_deref()))?;
        Ok(Some(Self {
            interpolant,
            reach: reach(&some, present),
            channels: some.channels,
            known: Some(known),
        }))
    }

    /// What `method` makes of some readings of a measurement, one flag per pose that is true of those; `None` if more than half
    /// of all have no uncertainty.
    ///
    /// # Errors
    /// As [`Reconstruct::interpolate`].
    ///
    /// # Panics
    /// If there is another number of flags.
    pub(crate) fn of_some(
        measurement: &Measurement,
        present: &[bool],
        method: &dyn Reconstruct,
    ) -> Result<Option<Self>, ReconstructError> {
        assert_eq!(present.len(), measurement.outcomes.len());
        if !states_uncertainties(measurement) {
            return Ok(None);
        }
        if let Some(predicted) = Self::predicted(measurement, present, method)? {
            return Ok(Some(predicted));
        }
        let n = measurement.channels.count();
        // Every set is as noisy as the first.
        let type_a = noise(measurement).unwrap_or_default();
        let width = n * SETS;
        let mut values = vec![0.0; measurement.outcomes.len() * width];
        let random = Random::new(SEED);
        for (i, sets) in values.chunks_exact_mut(width).enumerate() {
            let (Some(value), Some(details)) = (measurement.value(i), &measurement.details) else {
                continue;
            };
            let [a, b] = [&*type_a, &*details.type_b].map(|u| &u[i * n..(i + 1) * n]);
            let errors = errors(&random, i);
            for (s, set) in sets.chunks_exact_mut(n).enumerate() {
                for (c, out) in set.iter_mut().enumerate() {
                    *out = value[c]
                        + match s {
                            0 => 0.0,
                            1 => b[c],
                            _ => a[c] * errors[s - 2],
                        };
                }
            }
        }
        let noise = type_a.chunks_exact(n);
        let noise: Vec<f64> = noise.flat_map(|of| of.repeat(SETS)).collect();
        let interpolant = method.interpolate(&Readings {
            width,
            values: &values,
            ..Readings::new(measurement, present, Some(&noise))
        })?;
        Ok(Some(Self {
            interpolant,
            channels: measurement.channels.clone(),
            known: None,
            reach: reach(measurement, present),
        }))
    }

    /// Luminance and its uncertainties at many pairs, in parallel.
    pub fn luminance_at(&self, pairs: &[DirectionPair]) -> Vec<Uncertain> {
        self.each(pairs, 1, |values, out| {
            out.push(self.channels.luminance(values));
        })
    }

    /// Every channel and its uncertainties at many pairs, pair after pair, in parallel.
    pub fn channels_at(&self, pairs: &[DirectionPair]) -> Vec<Uncertain> {
        self.each(pairs, self.channels.count(), |values, out| {
            out.extend(values);
        })
    }

    /// Standard uncertainties of sums of luminance Σ w f over some pairs, with a list of weights for each sum: of both types, of a
    /// method that is [`Predictive`] of what is open between readings, and of half of what is beyond the elevations that were read; infinite if most of the sum is.
    pub(crate) fn uncertainties_of_sums(
        &self,
        pairs: &[DirectionPair],
        weights: &[Vec<f64>],
    ) -> Vec<f64> {
        let values = values_at(&*self.interpolant, pairs);
        let sets = values.chunks_exact(self.channels.count());
        let luminance: Vec<f64> = sets.map(|set| self.channels.luminance(set)).collect();
        let width = luminance.len() / pairs.len().max(1);
        let value = |k: usize| luminance[k * width];
        let read: Vec<f64> = match &self.known {
            Some(known) => {
                // A share of f + ε is what ln(f + ε) errs by.
                let of = |w: &Vec<f64>| {
                    let each = w.iter().enumerate();
                    each.map(|(k, w)| w * (value(k) + EPSILON)).collect()
                };
                let weights: Vec<Vec<f64>> = weights.iter().map(of).collect();
                let variances = known.variances_of_sums(pairs, &weights).into_iter();
                variances.map(f64::sqrt).collect()
            }
            None => {
                let of = |weights: &Vec<f64>| {
                    let mut sums = [0.0; SETS];
                    for (w, sets) in weights.iter().zip(luminance.chunks_exact(SETS)) {
                        sums.iter_mut().zip(sets).for_each(|(sum, f)| *sum += w * f);
                    }
                    uncertain(&sums, 1, 0).uncertainty()
                };
                weights.iter().map(of).collect()
            }
        };
        let beyond = |weights: &Vec<f64>| {
            let (mut all, mut beyond) = (0.0, 0.0);
            for (k, (w, pair)) in weights.iter().zip(pairs).enumerate() {
                let size = (w * value(k)).abs();
                all += size;
                beyond += if pair.least_cosine() < self.reach {
                    size
                } else {
                    0.0
                };
            }
            match beyond > 0.5 * all {
                true => f64::INFINITY,
                false => BEYOND * beyond,
            }
        };
        let both = read.into_iter().zip(weights.iter().map(beyond));
        both.map(|(read, beyond)| read.hypot(beyond)).collect()
    }

    /// Every channel and its uncertainties at the poses of a schedule, as readings; none where no reading is near.
    pub(crate) fn readings(&self, schedule: Arc<Schedule>, cover: &Cover) -> Measurement {
        let pairs: Vec<DirectionPair> = schedule.poses.iter().map(|pose| pose.pair).collect();
        let all = self.channels_at(&pairs);
        let outcome = |coverage| match coverage {
            Coverage::Unknown => Outcome::NoData,
            _ => Outcome::Reading,
        };
        let of = |u: fn(&Uncertain) -> f64| all.iter().map(u).collect::<Vec<_>>();
        Measurement {
            channels: self.channels.clone(),
            values: of(|u| u.value),
            outcomes: cover.coverages(&pairs).into_iter().map(outcome).collect(),
            details: Some(Details {
                type_a: of(|u| u.type_a),
                type_b: of(|u| u.type_b),
                flags: vec![Flags::NONE; pairs.len()],
            }),
            half_angles_deg: [0.0; 2],
            places: Vec::new(),
            schedule,
        }
    }

    /// What `of` makes of the channels at many pairs, `width` numbers of each, with their uncertainties.
    fn each(
        &self,
        pairs: &[DirectionPair],
        width: usize,
        of: impl Fn(&[f64], &mut Vec<f64>),
    ) -> Vec<Uncertain> {
        let values = values_at(&*self.interpolant, pairs);
        let mut all = Vec::with_capacity(values.len());
        let sets = values.chunks_exact(self.channels.count());
        sets.for_each(|set| of(set, &mut all));
        let Some(known) = &self.known else {
            let of_pair = |sets: &[f64]| -> Vec<Uncertain> {
                (0..width).map(|c| uncertain(sets, width, c)).collect()
            };
            return all.chunks_exact(width * SETS).flat_map(of_pair).collect();
        };
        let known = known.predict(pairs).into_iter();
        let known = known.flat_map(|k| std::iter::repeat_n(k, width));
        let each = all.into_iter().zip(known).map(|(value, known)| {
            let of = |variance: f64| (value + EPSILON) * variance.max(0.0).sqrt();
            Uncertain {
                value,
                type_a: of(known.variance - known.shared),
                type_b: of(known.shared),
            }
        });
        each.collect()
    }

    /// Standard uncertainties of the luminance at many pairs, sr⁻¹, in parallel.
    pub(crate) fn uncertainties(&self, pairs: &[DirectionPair]) -> Vec<f64> {
        self.luminance_at(pairs)
            .iter()
            .map(Uncertain::uncertainty)
            .collect()
    }
}

/// A reconstruction with the readings that it is made of, from which its uncertainties follow.
pub struct Estimated {
    brdf: Box<dyn Brdf>,
    method: Arc<dyn Reconstruct>,
    measurement: Measurement,
    /// Made where uncertainties are asked for; `None` if nothing is known of them.
    replicated: OnceLock<Option<Replicated>>,
}

impl Estimated {
    /// What `method` makes of a measurement.
    ///
    /// # Errors
    /// As [`Reconstruct::reconstruct`].
    pub fn new(
        method: Arc<dyn Reconstruct>,
        measurement: Measurement,
    ) -> Result<Self, ReconstructError> {
        Ok(Self {
            brdf: method.reconstruct(&measurement)?,
            method,
            measurement,
            replicated: OnceLock::new(),
        })
    }
}

impl Estimated {
    fn replicated(&self) -> Option<&Replicated> {
        if self.replicated.get().is_none() {
            // The reconstruction of the readings alone succeeded. Two threads may make it at once: one that waited for the other
            // could hold a part of the other's work.
            let made = Replicated::of(&self.measurement, &*self.method)
                .ok()
                .flatten();
            _ = self.replicated.set(made);
        }
        self.replicated.get()?.as_ref()
    }
}

impl Brdf for Estimated {
    of_wrapped! {
        brdf, is_mirrored -> bool, remarks -> Vec<String>, as_sample -> Option<&dyn SampleBrdf>
    }

    forwarded! {
        brdf: eval(pair: &DirectionPair, out: &mut [f64]) -> Presence,
        eval_batch(pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) -> (),
    }

    fn as_estimated(&self) -> Option<&dyn EstimatedBrdf> {
        Some(self)
    }
}

impl EstimatedBrdf for Estimated {
    fn uncertainties_of_sums(
        &self,
        pairs: &[DirectionPair],
        weights: &[Vec<f64>],
    ) -> Option<Vec<f64>> {
        let replicated = self.replicated()?;
        Some(replicated.uncertainties_of_sums(pairs, weights))
    }

    fn prepare(&self) {
        self.replicated();
    }
}

/// What the sets of a pair say of number `c` of `width` in each.
fn uncertain(sets: &[f64], width: usize, c: usize) -> Uncertain {
    let set = |s: usize| sets[s * width + c];
    let value = set(0);
    let square: f64 = (2..SETS).map(|s| (set(s) - value).powi(2)).sum();
    Uncertain {
        value,
        type_a: (square / REPLICAS as f64).sqrt(),
        type_b: (set(1) - value).abs(),
    }
}

/// The errors of a reading in each set, in units of its uncertainty: normal, with mean 0 and mean square 1.
fn errors(random: &Random, pose: usize) -> [f64; REPLICAS] {
    let mut stream = random.stream(pose as u64);
    let drawn: [f64; REPLICAS] = std::array::from_fn(|_| StandardNormal.sample(&mut stream));
    let mean = drawn.iter().sum::<f64>() / REPLICAS as f64;
    let square = drawn.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / REPLICAS as f64;
    drawn.map(|z| (z - mean) / square.sqrt())
}
