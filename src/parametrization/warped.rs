//! A monotone warp on any axis of any parametrization, so that "uniform in the parametrization"
//! and "uniform in the warped parametrization" are the same code.

use super::{Axis, Coords, Facts, Images, Parametrization, Warp, WarpError, WarpProblem, Warps};
use crate::error::one_of;
use crate::geometry::{BLOCK, DirectionPair, Symmetry};
use crate::registry::forwarded;

/// A parametrization with warped axes.
#[derive(Clone, Debug)]
pub struct Warped<P> {
    inner: P,
    warps: [Warp; 4],
    axes: Vec<Axis>,
}

impl<P: Parametrization> Warped<P> {
    /// `inner` with warps on the axes named by symbol.
    ///
    /// # Errors
    /// If a name is no axis of `inner`, or its axis cannot have that warp.
    pub fn new(inner: P, by_symbol: &Warps) -> Result<Self, WarpError> {
        let mut axes = inner.axes().to_vec();
        let mut warps = [Warp::Identity; 4];
        for (symbol, warp) in by_symbol {
            let error = |problem| WarpError {
                axis: symbol.clone(),
                problem,
            };
            let Some(i) = axes.iter().position(|a| a.symbol == symbol) else {
                return Err(error(WarpProblem::NoAxis {
                    parametrization: inner.name(),
                    axes: one_of(symbol, axes.iter().map(|a| a.symbol)),
                }));
            };
            (warps[i], axes[i]) = warp.on(&axes[i]).map_err(error)?;
        }
        Ok(Self { inner, warps, axes })
    }

    #[inline]
    fn plain(&self, c: &Coords) -> Coords {
        std::array::from_fn(|i| self.warps[i].inverse(c[i]))
    }

    #[inline]
    fn bent(&self, c: &Coords) -> Coords {
        std::array::from_fn(|i| self.warps[i].forward(c[i]))
    }

    /// True if every warped coordinate is inside its axis, or NaN (the inner chart refuses that).
    #[inline]
    fn within(&self, c: &Coords) -> bool {
        let mut pairs = self.axes.iter().zip(&self.warps).zip(c);
        !pairs.any(|((axis, warp), c)| *warp != Warp::Identity && c.abs() > axis.range[1])
    }
}

impl<P: Parametrization> Parametrization for Warped<P> {
    forwarded!(inner: name -> &'static str, symmetry -> Symmetry, facts -> Facts);

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    #[inline]
    fn forward(&self, pair: &DirectionPair) -> Coords {
        self.bent(&self.inner.forward(pair))
    }

    fn forward_batch(&self, pairs: &[DirectionPair], out: &mut [Coords]) {
        self.inner.forward_batch(pairs, out);
        for (i, warp) in self.warps.iter().enumerate() {
            warp.forward_all(out.iter_mut().map(|c| &mut c[i]));
        }
    }

    #[inline]
    fn inverse(&self, coords: &Coords) -> Option<DirectionPair> {
        if !self.within(coords) {
            return None;
        }
        self.inner.inverse(&self.plain(coords))
    }

    fn inverse_batch(&self, coords: &[Coords], out: &mut [Option<DirectionPair>]) {
        let mut plain = [[0.0; 4]; BLOCK];
        for (coords, out) in coords.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            let plain = &mut plain[..coords.len()];
            for (plain, coords) in plain.iter_mut().zip(coords) {
                *plain = self.plain(coords);
            }
            self.inner.inverse_batch(plain, out);
            for (coords, out) in coords.iter().zip(out) {
                *out = out.filter(|_| self.within(coords));
            }
        }
    }

    fn canonical(&self, coords: &Coords) -> Option<Coords> {
        if !self.within(coords) {
            return None;
        }
        Some(self.bent(&self.inner.canonical(&self.plain(coords))?))
    }

    fn jacobian(&self, coords: &Coords) -> f64 {
        let slopes: f64 = (0..self.axes.len())
            .map(|i| self.warps[i].slope(coords[i]))
            .product();
        // 0 · ∞ where a warped axis meets a singular Jacobian: the measure there is 0.
        if slopes == 0.0 {
            0.0
        } else {
            slopes * self.inner.jacobian(&self.plain(coords))
        }
    }

    fn warp_name(&self) -> String {
        let names: Vec<_> = self
            .axes
            .iter()
            .filter_map(|a| Some(format!("{}:{}", a.symbol, a.warp?.name())))
            .collect();
        if names.is_empty() {
            "none".into()
        } else {
            names.join(";")
        }
    }

    fn plane_labels(&self) -> [&'static str; 2] {
        self.inner.plane_labels()
    }

    fn images(&self, coords: &Coords) -> Images {
        let mut images = self.inner.images(&self.plain(coords));
        for c in &mut images {
            *c = self.bent(c);
        }
        images
    }
}
