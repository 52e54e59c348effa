//! Sums over many pairs, evaluated in one call.

use crate::brdf::{Brdf, Presence};
use crate::geometry::{Direction, DirectionPair};
use glam::DVec3;

/// Σ w f cos θ_i of three channels and Σ w cos θ_i.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums([f64; 4]);

impl Sums {
    /// Adds `factor` times another.
    pub(super) fn add(&mut self, factor: f64, other: &Sums) {
        for (sum, x) in self.0.iter_mut().zip(other.0) {
            *sum += factor * x;
        }
    }

    /// Σ w cos θ_i.
    pub(super) fn weight(&self) -> f64 {
        self.0[3]
    }

    /// The averages of the channels.
    pub(super) fn ratio(&self) -> [f64; 3] {
        let weight = self.0[3];
        if weight == 0.0 {
            return [0.0; 3];
        }
        [0, 1, 2].map(|c| self.0[c] / weight)
    }

    /// How much an error `self` of both sums changes an average `value` over `weight`.
    pub(super) fn effect(&self, value: [f64; 3], weight: f64) -> [f64; 3] {
        [0, 1, 2].map(|c| ((self.0[c] - value[c] * self.0[3]) / weight).abs())
    }
}

/// Memory that readings share, one a thread.
#[derive(Debug, Default)]
pub struct Workspace {
    pairs: Vec<DirectionPair>,
    weights: Vec<f64>,
    groups: Vec<u16>,
    values: Vec<f64>,
    presence: Vec<Presence>,
    sums: Vec<Sums>,
    evaluations: usize,
    missing: bool,
}

impl Workspace {
    /// Values of the BRDF since it was made.
    pub(super) fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// True if a value was missing since the last reset.
    pub(super) fn missing(&self) -> bool {
        self.missing
    }

    pub(super) fn reset(&mut self) {
        self.missing = false;
        self.pairs.clear();
        self.weights.clear();
        self.groups.clear();
    }

    /// The value of one pair.
    pub(super) fn single(&mut self, brdf: &dyn Brdf, pair: &DirectionPair) -> Option<[f64; 3]> {
        let mut value = [0.0; 3];
        self.evaluations += 1;
        match brdf.eval(pair, &mut value[..brdf.channels().count()]) {
            Presence::Present => Some(value),
            Presence::Missing => None,
        }
    }

    /// Adds a pair with its weight (without the cosine) to a group. Below the horizon it counts as
    /// nothing in both sums.
    #[inline]
    pub(super) fn push(&mut self, omega_i: DVec3, omega_o: DVec3, weight: f64, group: usize) {
        if omega_i.z > 0.0 && omega_o.z > 0.0 {
            let [i, o] = [omega_i, omega_o].map(Direction::from_unit);
            self.pairs.push(DirectionPair::new(i, o));
            self.weights.push(weight * omega_i.z);
            self.groups.push(group as u16);
        }
    }

    /// Evaluates all pairs and gives the sums of every group; no pair is left.
    pub(super) fn evaluate(&mut self, brdf: &dyn Brdf, groups: usize) -> &[Sums] {
        let (n, channels) = (self.pairs.len(), brdf.channels().count());
        self.values.clear();
        self.values.resize(n * channels, 0.0);
        self.presence.clear();
        self.presence.resize(n, Presence::Present);
        brdf.eval_batch(&self.pairs, &mut self.values, &mut self.presence);
        self.evaluations += n;
        self.sums.clear();
        self.sums.resize(groups, Sums::default());
        let values = self.values.chunks_exact(channels);
        let nodes = self.weights.iter().zip(&self.groups).zip(&self.presence);
        for (values, ((weight, group), presence)) in values.zip(nodes) {
            if *presence == Presence::Missing {
                self.missing = true;
                continue;
            }
            let sums = &mut self.sums[usize::from(*group)];
            for (sum, value) in sums.0.iter_mut().zip(values) {
                *sum += weight * value;
            }
            sums.0[3] += weight;
        }
        self.pairs.clear();
        self.weights.clear();
        self.groups.clear();
        &self.sums
    }
}
