//! The sensor: from light to electrons to a value.
//!
//! The signal S = ⟨f_r cos θ_i⟩ frees S · `reference_rate` / f_tile electrons a second, f_tile =
//! reflectance/π: the rate is that of the tile with light and sensor at the normal. An exposure of
//! t seconds counts
//!
//! e = Poisson((rate + dark) t) + N(0, read²),
//!
//! stops at full scale and is rounded to steps of full scale / 2^bits. The converter begins a
//! pedestal below zero, which is subtracted: counts may be negative, and read noise is not
//! rectified.
//!
//! # How exposures are merged
//!
//! Exposure k estimates the rate as e_k/t_k − dark, with the variance ((rate + dark) t_k + read² +
//! step²/12)/t_k². The mean weighted by the inverse variances is used. Without read noise it is all
//! electrons over all time, which is the maximum of the likelihood. The rate in the variances is that
//! pilot, the same for all: a weight from an exposure's own count would favour low counts.
//!
//! An exposure is used if it and all shorter ones stay below 80 % of full scale; the shortest, if it does
//! not touch full scale. Its own count decides, which favours low ones where the mean is just there:
//! by less than half the scatter of that exposure. To decide by the shorter ones favours high ones by half
//! *their* scatter, which is many times larger.

use super::motion::exposures;
use super::spec::{DetectorSpec, InstrumentSpec};
use crate::sampling::RandomStream;
use rand::RngExt;
use rand_distr::{Distribution, Poisson, StandardNormal};
use smallvec::SmallVec;
use std::f64::consts::PI;

/// Share of full scale that an exposure may fill, unless it is the shortest.
const HEADROOM: f64 = 0.8;

/// A sensor with its converter and its exposures.
#[derive(Clone, Debug)]
pub(super) struct Detector {
    spec: DetectorSpec,
    /// Electrons a second for S = 1 sr⁻¹.
    gain: f64,
    step: f64,
    exposures: Vec<f64>,
}

/// Factors by which a fault multiplies or divides a reading, from the least to the largest.
const FAULT: [f64; 2] = [1.5, 5.0];

/// A sensor's estimate of a signal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signal {
    /// ⟨f_r cos θ_i⟩, sr⁻¹; a lower bound if saturated.
    pub value: f64,
    /// Variance of its scatter, sr⁻², estimated from the count.
    pub variance: f64,
    pub saturated: bool,
}

impl Detector {
    pub(super) fn new(spec: &InstrumentSpec) -> Self {
        let detector = &spec.detector;
        Self {
            gain: detector.reference_rate * PI / spec.calibration.reflectance,
            step: detector.full_scale / 2.0_f64.powi(detector.bits as i32),
            exposures: exposures(detector).collect(),
            spec: detector.clone(),
        }
    }

    /// Electrons counted in one exposure of this mean, on average over so many pixels: with noise, rounded, at most full scale.
    fn count(&self, mean: f64, pixels: f64, noise: &mut RandomStream) -> f64 {
        // Far beyond full scale every mean gives the same count.
        let mean = mean.clamp(0.0, 4.0 * self.spec.full_scale + 1000.0);
        let mut electrons = mean;
        if self.spec.shot_noise
            && let Ok(poisson) = Poisson::new(mean * pixels)
        {
            electrons = poisson.sample(noise) / pixels;
        }
        if self.spec.read_noise > 0.0 {
            let z: f64 = StandardNormal.sample(noise);
            electrons += self.spec.read_noise / pixels.sqrt() * z;
        }
        // Each pixel is rounded, and noise makes their mean as fine as their number.
        let step = self.step / pixels;
        ((electrons / step).round() * step).min(self.spec.full_scale)
    }

    /// What a fault multiplies the next reading by, 1 if there is none; of a sensor without faults no random number is taken.
    pub(super) fn fault(&self, noise: &mut RandomStream) -> f64 {
        if self.spec.outliers == 0.0 || noise.random::<f64>() >= self.spec.outliers {
            return 1.0;
        }
        let [least, most] = FAULT.map(f64::ln);
        let log: f64 = noise.random_range(least..most);
        if noise.random() {
            log.exp()
        } else {
            (-log).exp()
        }
    }

    /// The estimate of a signal by the mean of so many pixels.
    pub(super) fn read(&self, signal: f64, pixels: f64, noise: &mut RandomStream) -> Signal {
        // Without noise all pixels are rounded alike, and their mean is no finer than one.
        let noisy = self.spec.shot_noise || self.spec.read_noise > 0.0;
        let pixels = if noisy { pixels } else { 1.0 };
        let rate = self.gain * signal + self.spec.dark_rate;
        // Variances are those of one pixel, which the number of pixels divides at last.
        let constant = self.spec.read_noise * self.spec.read_noise + self.step * self.step / 12.0;
        // Times and electrons of the exposures that are used.
        let mut counts = SmallVec::<[(f64, f64); 8]>::new();
        for (k, &t) in self.exposures.iter().enumerate() {
            // Every exposure is made: the numbers of the stream do not depend on the others.
            let e = self.count(rate * t, pixels, noise);
            let most = if k == 0 { 1.0 } else { HEADROOM };
            if counts.len() == k && e < most * self.spec.full_scale {
                counts.push((t, e));
            }
        }
        let shortest = self.exposures.first().copied().unwrap_or(1.0);
        if counts.is_empty() {
            let rate = self.spec.full_scale / shortest - self.spec.dark_rate;
            let variance = (self.spec.full_scale * f64::from(self.spec.shot_noise) + constant)
                / (shortest * shortest * self.gain * self.gain * pixels);
            return Signal {
                value: rate / self.gain,
                variance,
                saturated: true,
            };
        }
        let add = |(time, electrons), (t, e): &(f64, f64)| (time + t, electrons + e);
        let (time, electrons) = counts.iter().fold((0.0, 0.0), add);
        let pilot = match self.spec.shot_noise {
            true => (electrons / time).max(0.0),
            false => 0.0,
        };
        let (mut weights, mut sum) = (0.0, 0.0);
        for (t, e) in &counts {
            // A dark sensor without any noise: exposures then count by their time.
            let variance = (pilot * t + constant).max(f64::MIN_POSITIVE);
            let weight = t * t / variance;
            weights += weight;
            sum += weight * (e / t);
        }
        Signal {
            value: (sum / weights - self.spec.dark_rate) / self.gain,
            variance: 1.0 / (weights * self.gain * self.gain * pixels),
            saturated: false,
        }
    }
}
