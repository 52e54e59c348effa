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
use super::{EPSILON, Interpolant, Predictive, Reconstruct, ReconstructError};
use crate::brdf::Channels;
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::sampling::Random;
use rand_distr::{Distribution, StandardNormal};

/// Sets of readings with errors of type A.
const REPLICAS: usize = 16;

/// All sets: as they are, with the error of type B, with errors of type A.
const SETS: usize = 2 + REPLICAS;

/// Seed of the errors.
const SEED: u64 = 0;

/// The luminance of a reconstruction at a pair, with its standard uncertainties (k = 1), sr⁻¹.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uncertain {
    /// f_r, without the cosine.
    pub value: f64,
    /// What the scatter of readings makes of it.
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
    pub fn share(&self, uncertainty: f64) -> f64 {
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
    /// What the method says of its errors, if it does.
    known: Option<Box<dyn Predictive>>,
}

/// Readings up to which the errors of a method that is predictive are asked for: that takes as long as the BRDF.
pub const TOLD: usize = 2000;

impl Replicated {
    /// What `method` makes of a measurement; `None` if more than half of its readings have no uncertainty.
    ///
    /// # Errors
    /// As [`Reconstruct::interpolate`].
    pub fn of(
        measurement: &Measurement,
        method: &dyn Reconstruct,
    ) -> Result<Option<Self>, ReconstructError> {
        Self::of_some(measurement, &present(measurement), method)
    }

    /// The same of some of its readings: one flag per pose, true of those.
    ///
    /// # Errors
    /// As [`Reconstruct::interpolate`].
    ///
    /// # Panics
    /// If there is another number of flags.
    pub fn of_some(
        measurement: &Measurement,
        present: &[bool],
        method: &dyn Reconstruct,
    ) -> Result<Option<Self>, ReconstructError> {
        assert_eq!(present.len(), measurement.outcomes.len());
        let n = measurement.channels.count();
        let uncertain = |i: usize| {
            let details = measurement.details.as_ref()?;
            let of = [&details.type_a, &details.type_b].map(|u| &u[i * n..(i + 1) * n]);
            let is_uncertain = of.into_iter().flatten().any(|u| *u > 0.0);
            measurement.value(i).map(|_| is_uncertain)
        };
        let stated: Vec<bool> = (0..present.len()).filter_map(uncertain).collect();
        let (readings, uncertain) = (stated.len(), stated.iter().filter(|is| **is).count());
        // A few poses that were repeated say nothing of the others.
        if uncertain == 0 || 2 * uncertain < readings {
            return Ok(None);
        }
        let channels = measurement.channels.clone();
        if (1..=TOLD).contains(&readings) {
            let others = (0..present.len()).filter(|&i| !present[i]);
            let some = measurement.clone().without(others);
            if let Some(known) = method.predictive(&some)? {
                let interpolant = method.interpolate(&Readings {
                    schedule: &some.schedule,
                    width: n,
                    values: &some.values,
                    present,
                    noise: noise(&some),
                    half_angles_deg: some.half_angles_deg,
                })?;
                return Ok(Some(Self {
                    interpolant,
                    channels,
                    known: Some(known),
                }));
            }
        }
        let width = n * SETS;
        let mut values = vec![0.0; measurement.outcomes.len() * width];
        let random = Random::new(SEED);
        for (i, sets) in values.chunks_exact_mut(width).enumerate() {
            let (Some(value), Some(details)) = (measurement.value(i), &measurement.details) else {
                continue;
            };
            let [a, b] = [&details.type_a, &details.type_b].map(|u| &u[i * n..(i + 1) * n]);
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
        // Every set is as noisy as the first.
        let noise = noise(measurement).unwrap_or_default().chunks_exact(n);
        let noise: Vec<f64> = noise.flat_map(|of| of.repeat(SETS)).collect();
        let interpolant = method.interpolate(&Readings {
            schedule: &measurement.schedule,
            width,
            values: &values,
            present,
            noise: Some(&noise),
            half_angles_deg: measurement.half_angles_deg,
        })?;
        Ok(Some(Self {
            interpolant,
            channels,
            known: None,
        }))
    }

    /// Luminance and its uncertainties at many pairs, in parallel.
    pub fn at(&self, pairs: &[DirectionPair]) -> Vec<Uncertain> {
        let values = values_at(&*self.interpolant, pairs);
        let of_pairs = values.chunks_exact(self.interpolant.width());
        match &self.known {
            None => of_pairs.map(|v| self.uncertain(v)).collect(),
            Some(known) => {
                let known = known.predict(pairs).into_iter();
                let each = of_pairs.map(|v| self.channels.luminance(v)).zip(known);
                let each = each.map(|(value, known)| {
                    let of = |variance: f64| (value + EPSILON) * variance.max(0.0).sqrt();
                    Uncertain {
                        value,
                        type_a: of(known.variance - known.shared),
                        type_b: of(known.shared),
                    }
                });
                each.collect()
            }
        }
    }

    /// Standard uncertainties of the luminance at many pairs, sr⁻¹, in parallel.
    pub fn uncertainties(&self, pairs: &[DirectionPair]) -> Vec<f64> {
        self.at(pairs).iter().map(Uncertain::uncertainty).collect()
    }

    /// What the values of a pair say.
    fn uncertain(&self, values: &[f64]) -> Uncertain {
        let mut sets = values.chunks_exact(self.channels.count());
        let mut next = || sets.next().map_or(0.0, |v| self.channels.luminance(v));
        let (value, shifted) = (next(), next());
        let square: f64 = (0..REPLICAS).map(|_| (next() - value).powi(2)).sum();
        Uncertain {
            value,
            type_a: (square / REPLICAS as f64).sqrt(),
            type_b: (shifted - value).abs(),
        }
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
