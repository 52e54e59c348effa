//! A monotone warp on any axis of any parametrization, so that "uniform in the parametrization"
//! and "uniform in the warped parametrization" are the same code.

use super::{Axis, AxisKind, Coords, Parametrization, Unit, WarpError, WarpProblem};
use crate::geometry::{DirectionPair, Symmetry};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

/// The warps a config can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WarpName {
    /// u = sqrt(x / x_max) in [0, 1]: fine near the pole; any radial axis.
    SquareRoot,
    /// u = 90 sqrt(theta_h / 90°) in [0, 90], the row index of a MERL table; theta_h only.
    Merl,
    /// u = asin x in [0, π/2], e.g. |k| → theta_d; h_bar, k_bar and k only.
    Arcsine,
}

impl WarpName {
    /// Every warp.
    pub const ALL: [WarpName; 3] = [WarpName::SquareRoot, WarpName::Merl, WarpName::Arcsine];

    /// Name in configs and result files.
    pub fn name(self) -> &'static str {
        match self {
            WarpName::SquareRoot => "square-root",
            WarpName::Merl => "merl",
            WarpName::Arcsine => "arcsine",
        }
    }

    /// One line for lists.
    pub fn summary(self) -> &'static str {
        match self {
            WarpName::SquareRoot => {
                "sqrt(x / x_max), in [0, 1]: fine near the pole; any radial axis"
            }
            WarpName::Merl => {
                "90 sqrt(theta_h / 90°), in [0, 90]: the rows of a MERL table; theta_h"
            }
            WarpName::Arcsine => "asin x, in degrees: lengths in [0, 1], e.g. |k| becomes theta_d",
        }
    }

    /// The warp of an axis, if it can have it.
    fn on(self, axis: &Axis) -> Result<Warp, WarpProblem> {
        let [lo, max] = axis.range;
        if axis.kind != AxisKind::Radial || lo != 0.0 {
            return Err(WarpProblem::Azimuth);
        }
        match self {
            WarpName::SquareRoot => Ok(Warp::Power { top: 1.0, max }),
            WarpName::Merl if axis.symbol == "theta_h" => Ok(Warp::Power { top: 90.0, max }),
            WarpName::Merl => Err(WarpProblem::NotThetaH),
            WarpName::Arcsine if ["h_bar", "k_bar", "k"].contains(&axis.symbol) => {
                Ok(Warp::Arcsine)
            }
            WarpName::Arcsine => Err(WarpProblem::NoLength),
        }
    }
}

/// A monotone map of one axis; odd, so that it extends through the pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Warp {
    /// u = x.
    Identity,
    /// u = top · sqrt(x/max).
    Power {
        /// Largest warped value.
        top: f64,
        /// Largest plain value.
        max: f64,
    },
    /// u = asin x.
    Arcsine,
}

impl Warp {
    /// Plain to warped.
    #[inline]
    pub fn forward(self, x: f64) -> f64 {
        match self {
            Warp::Identity => x,
            Warp::Power { top, max } => (top * (x.abs() / max).sqrt()).copysign(x),
            Warp::Arcsine => x.asin(),
        }
    }

    /// Warped to plain.
    #[inline]
    pub fn inverse(self, u: f64) -> f64 {
        match self {
            Warp::Identity => u,
            Warp::Power { top, max } => {
                let t = u / top;
                // (1 + ulp)² · max would leave the axis. Not `min`: that would lose NaN.
                let t2 = if t * t > 1.0 { 1.0 } else { t * t };
                (t2 * max).copysign(u)
            }
            Warp::Arcsine => u.sin(),
        }
    }

    /// dx/du at `u`.
    #[inline]
    pub fn slope(self, u: f64) -> f64 {
        match self {
            Warp::Identity => 1.0,
            Warp::Power { top, max } => 2.0 * max * u.abs() / (top * top),
            Warp::Arcsine => u.cos(),
        }
    }
}

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
    pub fn new(inner: P, names: &BTreeMap<String, WarpName>) -> Result<Self, WarpError> {
        let mut axes = inner.axes().to_vec();
        let mut warps = [Warp::Identity; 4];
        for (symbol, &name) in names {
            let error = |problem| WarpError {
                axis: symbol.clone(),
                problem,
            };
            let Some(i) = axes.iter().position(|a| a.symbol == symbol) else {
                let allowed: Vec<_> = axes.iter().map(|a| a.symbol).collect();
                return Err(error(WarpProblem::NoAxis {
                    parametrization: inner.name(),
                    axes: allowed.join(", "),
                }));
            };
            let warp = name.on(&axes[i]).map_err(error)?;
            let top = match warp {
                Warp::Identity => axes[i].range[1],
                Warp::Power { top, .. } => top,
                Warp::Arcsine => FRAC_PI_2,
            };
            warps[i] = warp;
            axes[i].range = [0.0, top];
            axes[i].warp = Some(name);
            axes[i].unit = match name {
                WarpName::Arcsine => Unit::Radian,
                WarpName::SquareRoot | WarpName::Merl => Unit::One,
            };
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
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn symmetry(&self) -> Symmetry {
        self.inner.symmetry()
    }

    #[inline]
    fn forward(&self, pair: &DirectionPair) -> Coords {
        self.bent(&self.inner.forward(pair))
    }

    #[inline]
    fn inverse(&self, coords: &Coords) -> Option<DirectionPair> {
        if !self.within(coords) {
            return None;
        }
        self.inner.inverse(&self.plain(coords))
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

    fn nested(&self) -> bool {
        self.inner.nested()
    }

    fn images(&self, coords: &Coords) -> Vec<Coords> {
        let mut images = self.inner.images(&self.plain(coords));
        for c in &mut images {
            *c = self.bent(c);
        }
        images
    }
}
