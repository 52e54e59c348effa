//! Many pairs as arrays of components, which loops read as vectors.

use super::{Direction, DirectionPair};
use glam::DVec3;

/// Pairs of a block.
pub(crate) const BLOCK: usize = 64;

/// Pairs up to which a block is not worth filling: one after the other they take less time, and give the same bits.
pub(crate) const FEW: usize = 8;

/// Components of the directions of [`BLOCK`] pairs.
pub(crate) struct PairBlock {
    components: [[f64; BLOCK]; 6],
}

impl PairBlock {
    /// A block of any pairs.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            components: [[0.0; BLOCK]; 6],
        }
    }

    /// Takes up at most [`BLOCK`] pairs; behind them the block is filled with normals.
    #[inline(always)]
    pub fn load(&mut self, pairs: &[DirectionPair]) {
        let normal = DirectionPair::new(Direction::NORMAL, Direction::NORMAL);
        if let Ok(pairs) = <&[DirectionPair; BLOCK]>::try_from(pairs) {
            self.fill(pairs);
        } else {
            let mut filled = [normal; BLOCK];
            filled[..pairs.len()].copy_from_slice(pairs);
            self.fill(&filled);
        }
    }

    #[inline(always)]
    fn fill(&mut self, pairs: &[DirectionPair; BLOCK]) {
        let [ix, iy, iz, ox, oy, oz] = &mut self.components;
        for (j, pair) in pairs.iter().enumerate() {
            let (i, o) = (pair.omega_i.vector(), pair.omega_o.vector());
            (ix[j], iy[j], iz[j]) = (i.x, i.y, i.z);
            (ox[j], oy[j], oz[j]) = (o.x, o.y, o.z);
        }
    }

    /// True if a direction of pair `j` is not above the horizon.
    #[inline(always)]
    pub(crate) fn is_below(&self, j: usize) -> bool {
        let [_, _, iz, _, _, oz] = &self.components;
        !((iz[j] > 0.0) & (oz[j] > 0.0))
    }

    /// ω_i and ω_o of pair `j`.
    #[inline(always)]
    pub(crate) fn vectors(&self, j: usize) -> [DVec3; 2] {
        let [ix, iy, iz, ox, oy, oz] = &self.components;
        [
            DVec3::new(ix[j], iy[j], iz[j]),
            DVec3::new(ox[j], oy[j], oz[j]),
        ]
    }
}
