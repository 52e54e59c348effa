//! Sums over many pairs, evaluated in one call.

use crate::brdf::{Brdf, ChannelValues, Presence};
use crate::geometry::DirectionPair;
use glam::DVec3;
use smallvec::SmallVec;

/// Σ w f cos θ_i of every channel, then Σ w cos θ_i. Luminance and R, G, B need no memory of their
/// own.
pub(super) type Sums = SmallVec<[f64; 4]>;

/// Sums of nothing.
pub(super) fn zeros(channels: usize) -> Sums {
    Sums::from_elem(0.0, channels + 1)
}

/// Adds `factor` times others to sums.
#[inline]
pub(super) fn add(sums: &mut [f64], factor: f64, others: &[f64]) {
    // Luminance, of which there is most, without a loop.
    if let ([value, weight], [x, w]) = (&mut *sums, others) {
        *value += factor * x;
        *weight += factor * w;
        return;
    }
    for (sum, x) in sums.iter_mut().zip(others) {
        *sum += factor * x;
    }
}

/// Σ w cos θ_i.
#[inline]
pub(super) fn weight(sums: &[f64]) -> f64 {
    sums[sums.len() - 1]
}

/// The average of a channel, 0 without weight.
#[inline]
pub(super) fn ratio(sums: &[f64], channel: usize) -> f64 {
    match weight(sums) {
        0.0 => 0.0,
        weight => sums[channel] / weight,
    }
}

/// The averages of all channels.
pub(super) fn ratios(sums: &[f64]) -> ChannelValues {
    (0..sums.len() - 1).map(|c| ratio(sums, c)).collect()
}

/// Buffers that readings share, one per thread.
#[derive(Debug, Default)]
pub struct Workspace {
    pairs: Vec<DirectionPair>,
    weights: Vec<f64>,
    groups: Vec<u16>,
    values: Vec<f64>,
    presence: Vec<Presence>,
    /// Laid out as [`Sums`], group after group.
    sums: Vec<f64>,
    /// Evaluations of the BRDF since it was made.
    pub(super) evaluations: usize,
    /// True if a value was missing in the average that is being made.
    pub(super) missing: bool,
}

impl Workspace {
    /// The value of one pair.
    pub(super) fn single(
        &mut self,
        brdf: &dyn Brdf,
        pair: &DirectionPair,
    ) -> Option<ChannelValues> {
        let mut value = ChannelValues::from_elem(0.0, brdf.channels().count());
        self.evaluations += 1;
        match brdf.eval(pair, &mut value) {
            Presence::Present => Some(value),
            Presence::Missing => None,
        }
    }

    /// Adds a pair with its weight (without the cosine) to a group. Below the horizon it counts as
    /// nothing in both sums.
    #[inline]
    pub(super) fn push(&mut self, omega_i: DVec3, omega_o: DVec3, weight: f64, group: usize) {
        if omega_i.z > 0.0 && omega_o.z > 0.0 {
            self.pairs
                .push(DirectionPair::from_unit([omega_i, omega_o]));
            self.weights.push(weight * omega_i.z);
            self.groups.push(group as u16);
        }
    }

    /// Evaluates all pairs and gives the sums of every group, in their order; no pair is left.
    pub(super) fn evaluate(&mut self, brdf: &dyn Brdf, groups: usize) -> Vec<&[f64]> {
        let (n, channels) = (self.pairs.len(), brdf.channels().count());
        self.values.clear();
        self.values.resize(n * channels, 0.0);
        self.presence.clear();
        self.presence.resize(n, Presence::Present);
        brdf.eval_batch(&self.pairs, &mut self.values, &mut self.presence);
        self.evaluations += n;
        let stride = channels + 1;
        self.sums.clear();
        self.sums.resize(groups * stride, 0.0);
        match channels {
            // A constant makes loops over channels disappear.
            1 => self.sum(1),
            n => self.sum(n),
        }
        self.pairs.clear();
        self.weights.clear();
        self.groups.clear();
        self.sums.chunks_exact(stride).collect()
    }

    /// Adds what was evaluated to the sums of its groups.
    #[inline(always)]
    fn sum(&mut self, channels: usize) {
        let stride = channels + 1;
        let values = self.values.chunks_exact(channels);
        let nodes = self.weights.iter().zip(&self.groups).zip(&self.presence);
        for (values, ((weight, group), presence)) in values.zip(nodes) {
            if *presence == Presence::Missing {
                self.missing = true;
                continue;
            }
            let sums = &mut self.sums[usize::from(*group) * stride..][..stride];
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * value;
            }
            sums[channels] += weight;
        }
    }
}
