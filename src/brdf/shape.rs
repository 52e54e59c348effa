//! BRDFs of one function of the pair, which every channel scales and puts on a base.

use super::spectrum::scaled;
use super::{Brdf, Channels, Presence, SampleBrdf, Spectrum, forwarded};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use std::fmt::Debug;

/// A function of pairs above the horizon.
pub trait Shape: Clone + Debug + Send + Sync + 'static {
    /// True if directions can be drawn in proportion (roughly) to a BRDF of this shape.
    const IS_SAMPLED: bool = true;

    /// The symmetries it has.
    fn symmetry(&self) -> Symmetry {
        Symmetry::FULL
    }

    /// True if the BRDF of it conserves energy by construction.
    fn conserves_energy(&self) -> bool {
        false
    }

    /// The value at a pair above the horizon.
    fn value(&self, pair: &DirectionPair) -> f64;

    /// See [`SampleBrdf::sample`]; by default as light leaves a diffuse surface.
    fn sample(&self, _omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        Some(cosine_hemisphere(u))
    }

    /// See [`SampleBrdf::pdf`].
    fn pdf(&self, pair: &DirectionPair) -> f64 {
        cosine_hemisphere_pdf(pair.omega_i)
    }
}

/// f_r = base + scale · shape above the horizon, base and scale one number a channel.
#[derive(Clone, Debug)]
pub struct Shaped<S> {
    channels: Channels,
    base: Vec<f64>,
    scale: Vec<f64>,
    shape: S,
}

impl<S: Shape> Shaped<S> {
    /// Of a base and a scale, each a spectrum that f_r is linear in, times a factor.
    pub(super) fn on_base(
        base: (&Spectrum, f64),
        scale: (&Spectrum, f64),
        shape: S,
        channels: Channels,
    ) -> Self {
        let [base, scale] = [base, scale].map(|(s, factor)| scaled(s, &channels, factor));
        Self {
            channels,
            base,
            scale,
            shape,
        }
    }
}

/// No base.
pub(super) const BLACK: (&Spectrum, f64) = (&Spectrum::Grey(0.0), 0.0);

impl<S: Shape> Brdf for Shaped<S> {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    forwarded!(shape: symmetry -> Symmetry, conserves_energy -> bool);

    fn is_mirrored(&self) -> bool {
        true
    }

    #[inline]
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        if !pair.is_above_horizon() {
            out.fill(0.0);
            return Presence::Present;
        }
        let shape = self.shape.value(pair);
        for ((out, base), scale) in out.iter_mut().zip(&self.base).zip(&self.scale) {
            *out = base + scale * shape;
        }
        Presence::Present
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        S::IS_SAMPLED.then_some(self)
    }
}

impl<S: Shape> SampleBrdf for Shaped<S> {
    forwarded! {
        shape: sample(omega_o: Direction, u: [f64; 2]) -> Option<Direction>,
        pdf(pair: &DirectionPair) -> f64,
    }
}
