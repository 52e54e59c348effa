//! A BRDF in the channels of a scene.

use super::{Brdf, ChannelValues, Channels, EstimatedBrdf, Presence, forwarded};
use crate::geometry::{DirectionPair, Symmetry};
use std::sync::Arc;

/// A BRDF in its own channels, else its luminance in every channel of a scene: of colours in a scene of luminance, and of
/// luminance in a scene of colours.
pub struct InChannels {
    brdf: Arc<dyn Brdf>,
    channels: Channels,
}

impl InChannels {
    /// A BRDF in these channels.
    pub fn new(brdf: Arc<dyn Brdf>, channels: Channels) -> Self {
        Self { brdf, channels }
    }
}

impl Brdf for InChannels {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    forwarded! {
        brdf: symmetry -> Symmetry, conserves_energy -> bool, is_mirrored -> bool,
        remarks -> Vec<String>, as_estimated -> Option<&dyn EstimatedBrdf>
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let own = self.brdf.channels();
        if *own == self.channels {
            return self.brdf.eval(pair, out);
        }
        let mut values = ChannelValues::from_elem(0.0, own.count());
        let presence = self.brdf.eval(pair, &mut values);
        out.fill(own.luminance(&values));
        presence
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let own = self.brdf.channels();
        if *own == self.channels {
            return self.brdf.eval_batch(pairs, out, presence);
        }
        let mut values = vec![0.0; pairs.len() * own.count()];
        self.brdf.eval_batch(pairs, &mut values, presence);
        let out = out.chunks_exact_mut(self.channels.count());
        for (out, values) in out.zip(values.chunks_exact(own.count())) {
            out.fill(own.luminance(values));
        }
    }
}
