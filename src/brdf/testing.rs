//! BRDFs made of a function, for tests and for checks of stability.

use super::{Brdf, Channels, Presence};
use crate::geometry::{DirectionPair, Symmetry};

struct Made<F> {
    channels: Channels,
    symmetry: Symmetry,
    f: F,
}

impl<const N: usize, F> Brdf for Made<F>
where
    F: Fn(&DirectionPair) -> Option<[f64; N]> + Send + Sync,
{
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let values = (self.f)(pair);
        out.copy_from_slice(&values.unwrap_or([0.0; N]));
        Presence::of(values.is_some())
    }
}

/// A BRDF of one grey channel, or of R, G and B, that declares a symmetry; `None`: no data.
pub(crate) fn made<const N: usize>(
    symmetry: Symmetry,
    f: impl Fn(&DirectionPair) -> Option<[f64; N]> + Send + Sync,
) -> impl Brdf {
    let channels = match N {
        1 => Channels::Luminance,
        _ => Channels::Rgb,
    };
    Made {
        channels,
        symmetry,
        f,
    }
}
