//! A BRDF slice: the view fixed, one number per light direction.

use crate::brdf::{Brdf, ChannelValues, Channels, Presence};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair};
use crate::parametrization::view_centered;
use crate::registry::named;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

named! {
    /// The number of a BRDF that a slice shows.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Channel {
        /// Rec. 709 luminance, or the mean over the wavelengths ([`Channels::luminance`]).
        #[default]
        Luminance = "luminance",
        /// (R + G + B)/3.
        Average = "average",
        /// Linear R.
        Red = "red",
        /// Linear G.
        Green = "green",
        /// Linear B.
        Blue = "blue",
    }
}

impl Channel {
    /// Every name, for messages.
    pub fn names() -> String {
        Self::ALL.map(Self::name).join(", ")
    }

    /// Channels that a BRDF must have been built for.
    pub(crate) fn needs(self) -> Channels {
        match self {
            Channel::Luminance => Channels::Luminance,
            _ => Channels::Rgb,
        }
    }

    /// The channel's number from the values of one evaluation.
    #[inline]
    pub(super) fn select(self, channels: &Channels, values: &[f64]) -> f64 {
        match self {
            Channel::Luminance => channels.luminance(values),
            Channel::Average => (values[0] + values[1] + values[2]) / 3.0,
            Channel::Red => values[0],
            Channel::Green => values[1],
            Channel::Blue => values[2],
        }
    }
}

/// Kind of a slice's value at a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A value.
    Value,
    /// A value below the diffuse part, read as 0.
    Clamped,
    /// No data; read as 0, and the direction is left out.
    Missing,
}

/// ρ_θo(θ, φ) = ρ(m(θ_o, 0), m(θ, φ)) − diffuse, at least 0 (sr⁻¹, no cosine); m is
/// [`view_centered`], turned about the normal by the azimuth of the view.
#[derive(Clone, Copy)]
pub struct Slice<'a> {
    /// The BRDF.
    pub(super) brdf: &'a dyn Brdf,
    /// Its channel.
    pub(super) channel: Channel,
    /// View elevation, rad.
    pub(crate) theta_o: f64,
    /// The direction of the view.
    pub(super) omega_o: Direction,
    /// Sine and cosine of its azimuth, by which the chart is turned about the normal.
    turn: [f64; 2],
    /// Diffuse part that is subtracted, sr⁻¹.
    pub(super) diffuse: f64,
}

impl<'a> Slice<'a> {
    /// The slice at view elevation `theta_o` (rad, in [0, π/2)).
    ///
    /// # Errors
    /// If the BRDF was not built for the channel, or `theta_o` is not in its range.
    pub fn new(brdf: &'a dyn Brdf, channel: Channel, theta_o: f64) -> Result<Self, ParameterError> {
        if channel.needs() == Channels::Rgb && *brdf.channels() != Channels::Rgb {
            let allowed = "luminance for a BRDF that was not built for R, G, B";
            return Err(ParameterError::new("channel", channel.name(), allowed));
        }
        if !(0.0..FRAC_PI_2).contains(&theta_o) {
            let allowed = "an angle in [0, π/2)";
            return Err(ParameterError::new("theta_o", theta_o, allowed));
        }
        let omega_o = view_centered(theta_o, 0.0);
        Ok(Self {
            brdf,
            channel,
            theta_o,
            omega_o,
            turn: [0.0, 1.0],
            diffuse: 0.0,
        })
    }

    /// The slice of a view at azimuth `azimuth` (rad), about which the chart turns: θ stays in the plane of incidence.
    #[must_use]
    pub fn at_azimuth(self, azimuth: f64) -> Self {
        let turned = Self {
            turn: azimuth.sin_cos().into(),
            ..self
        };
        Self {
            omega_o: turned.turned(view_centered(self.theta_o, 0.0)),
            ..turned
        }
    }

    /// A direction of the chart about the normal as it is on the material.
    fn turned(&self, direction: Direction) -> Direction {
        let [sin, cos] = self.turn;
        if sin == 0.0 && cos == 1.0 {
            return direction;
        }
        let v = direction.vector();
        Direction::from_unit(DVec3::new(
            v.x * cos - v.y * sin,
            v.x * sin + v.y * cos,
            v.z,
        ))
    }

    /// The pair at angles θ, φ (rad).
    pub(super) fn pair(&self, [theta, phi]: [f64; 2]) -> DirectionPair {
        DirectionPair::new(self.turned(view_centered(theta, phi)), self.omega_o)
    }

    /// True if it is the same at φ and −φ.
    pub(super) fn is_mirrored(&self) -> bool {
        let is_turned = self.turn[0] != 0.0 && !self.brdf.symmetry().isotropic;
        self.brdf.is_mirrored() && !is_turned
    }

    /// The slice without a Lambertian part of `diffuse` (sr⁻¹, ≥ 0).
    #[must_use]
    pub fn without(mut self, diffuse: f64) -> Self {
        self.diffuse = diffuse;
        self
    }

    /// The channel's number over the luminance, at a pair.
    pub(super) fn of_luminance(&self, pair: &DirectionPair) -> f64 {
        if self.channel == Channel::Luminance {
            return 1.0;
        }
        let channels = self.brdf.channels();
        let mut values = ChannelValues::from_elem(0.0, channels.count());
        let presence = self.brdf.eval(pair, &mut values);
        let luminance = channels.luminance(&values);
        match presence == Presence::Present && luminance > 0.0 {
            true => self.channel.select(channels, &values) / luminance,
            false => 1.0,
        }
    }

    /// Evaluates the directions of a batch.
    pub fn evaluate(&self, batch: &mut Batch) {
        let channels = self.brdf.channels();
        let n = channels.count();
        let len = batch.pairs.len();
        batch.raw.resize(n * len, 0.0);
        batch.presence.resize(len, Presence::Missing);
        self.brdf
            .eval_batch(&batch.pairs, &mut batch.raw, &mut batch.presence);
        batch.values.resize(len, 0.0);
        batch.kinds.resize(len, Kind::Missing);
        let judged = |value: f64, presence| {
            // A value that breaks the promise of `Brdf` (finite, ≥ 0) would spoil every sum; it is
            // left out like a missing one.
            let is_there = presence == Presence::Present && value >= 0.0 && value.is_finite();
            let rest = value - self.diffuse;
            match (is_there, rest >= 0.0) {
                (true, true) => (rest, Kind::Value),
                (true, false) => (0.0, Kind::Clamped),
                (false, _) => (0.0, Kind::Missing),
            }
        };
        if *channels == Channels::Luminance {
            batch.values.copy_from_slice(&batch.raw);
        } else {
            for (value, raw) in batch.values.iter_mut().zip(batch.raw.chunks_exact(n)) {
                *value = self.channel.select(channels, raw);
            }
        }
        // Most often all are values, and none needs a choice.
        let are_there = batch.presence.iter();
        let are_there = are_there.fold(true, |all, p| all & (*p == Presence::Present));
        let is_value = |v: &f64| (*v >= self.diffuse) & (*v < f64::INFINITY);
        if are_there && batch.values.iter().fold(true, |all, v| all & is_value(v)) {
            batch.values.iter_mut().for_each(|v| *v -= self.diffuse);
            batch.kinds.fill(Kind::Value);
            return;
        }
        let both = batch.values.iter_mut().zip(&mut batch.kinds);
        for ((value, kind), &presence) in both.zip(&batch.presence) {
            (*value, *kind) = judged(*value, presence);
        }
    }

    /// Value at angles θ, φ (rad), `None` without data. For single look-ups; batches are faster.
    pub fn value(&self, theta: f64, phi: f64) -> Option<f64> {
        let mut batch = Batch::default();
        batch.push(self, view_centered(theta, phi));
        self.evaluate(&mut batch);
        (batch.kinds[0] != Kind::Missing).then(|| batch.values[0])
    }
}

/// Directions to be evaluated together, with their values; reused, it allocates once.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    pairs: Vec<DirectionPair>,
    raw: Vec<f64>,
    presence: Vec<Presence>,
    values: Vec<f64>,
    kinds: Vec<Kind>,
}

impl Batch {
    /// Forgets every direction.
    pub(crate) fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Adds a light direction.
    #[inline]
    pub fn push(&mut self, slice: &Slice<'_>, omega_i: Direction) {
        let omega_i = slice.turned(omega_i);
        self.pairs.push(DirectionPair::new(omega_i, slice.omega_o));
    }

    /// Adds light directions.
    #[inline]
    pub(crate) fn extend(&mut self, slice: &Slice<'_>, lights: &[Direction]) {
        let before = self.pairs.len();
        let both = DirectionPair::new(slice.omega_o, slice.omega_o);
        self.pairs.resize(before + lights.len(), both);
        for (pair, light) in self.pairs[before..].iter_mut().zip(lights) {
            pair.omega_i = slice.turned(*light);
        }
    }

    /// Values of the last evaluation (sr⁻¹, ≥ 0), one per direction.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Kind of each value.
    pub fn kinds(&self) -> &[Kind] {
        &self.kinds
    }
}
