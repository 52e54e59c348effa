//! Sums over many pairs, evaluated in one call.

use crate::brdf::{Brdf, ChannelValues, Presence};
use crate::geometry::DirectionPair;
use glam::DVec3;
use smallvec::SmallVec;

/// Σ w f cos θ_i of every channel, then Σ w cos θ_i. Luminance and R, G, B need no memory of their
/// own.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sums(SmallVec<[f64; 4]>);

impl Sums {
    /// Nothing yet.
    pub(super) fn new(channels: usize) -> Self {
        Self(SmallVec::from_elem(0.0, channels + 1))
    }

    /// Adds `factor` times others.
    #[inline]
    pub(super) fn add(&mut self, factor: f64, others: View<'_>) {
        // Luminance, of which there is most, without a loop.
        if let ([value, weight], [x, w]) = (&mut self.0[..], others.0) {
            *value += factor * x;
            *weight += factor * w;
            return;
        }
        for (sum, x) in self.0.iter_mut().zip(others.0) {
            *sum += factor * x;
        }
    }

    /// A borrowed view of these sums.
    #[inline]
    pub(super) fn view(&self) -> View<'_> {
        View(&self.0)
    }

    /// Back to nothing.
    pub(super) fn clear(&mut self) {
        self.0.fill(0.0);
    }
}

/// [`Sums`], to be read.
#[derive(Clone, Copy)]
pub(super) struct View<'a>(&'a [f64]);

impl View<'_> {
    /// A copy that lasts.
    pub(super) fn to_sums(self) -> Sums {
        Sums(SmallVec::from_slice(self.0))
    }

    /// Number of channels.
    pub(super) fn channels(self) -> usize {
        self.0.len() - 1
    }

    /// Σ w cos θ_i.
    #[inline]
    pub(super) fn weight(self) -> f64 {
        self.0[self.channels()]
    }

    /// The average of a channel, 0 without weight.
    #[inline]
    pub(super) fn ratio(self, channel: usize) -> f64 {
        let weight = self.weight();
        if weight == 0.0 {
            return 0.0;
        }
        self.0[channel] / weight
    }

    /// The averages of all channels.
    pub(super) fn ratios(self) -> ChannelValues {
        (0..self.channels()).map(|c| self.ratio(c)).collect()
    }

    /// How much an error `self` of both sums changes an average `value` of a channel over `weight`.
    #[inline]
    pub(super) fn effect(self, channel: usize, value: f64, weight: f64) -> f64 {
        ((self.0[channel] - value * self.weight()) / weight).abs()
    }
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
    /// True if a value was missing since the last reset.
    pub(super) missing: bool,
}

impl Workspace {
    pub(super) fn reset(&mut self) {
        self.missing = false;
        self.pairs.clear();
        self.weights.clear();
        self.groups.clear();
    }

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
    pub(super) fn evaluate(&mut self, brdf: &dyn Brdf, groups: usize) -> Vec<View<'_>> {
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
        self.sums.chunks_exact(stride).map(View).collect()
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
