//! An interpolant as a BRDF.

use super::interpolant::Interpolant;
use super::row;
use crate::brdf::{Brdf, Channels, Presence};
use crate::geometry::{DirectionPair, Symmetry};

/// An interpolant whose values are the channels of one material.
pub(super) struct Interpolated {
    pub interpolant: Box<dyn Interpolant>,
    pub channels: Channels,
    pub symmetry: Symmetry,
}

impl Brdf for Interpolated {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn remarks(&self) -> Vec<String> {
        self.interpolant.remarks()
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        self.interpolant.eval(pair, out);
        Presence::Present
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        self.interpolant.eval_batch(pairs, out);
        presence.fill(Presence::Present);
    }

    fn eval_row(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let is_polynomial = self.interpolant.is_smooth() && self.symmetry == Symmetry::FULL;
        if !(is_polynomial && row::along(&*self.interpolant, pairs, out)) {
            self.interpolant.eval_batch(pairs, out);
        }
        presence.fill(Presence::Present);
    }
}
