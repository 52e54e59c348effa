//! Sheen of cloth: fibres that stand up from the surface (Estevez and Kulla 2017).
//!
//! f_r = rho D(θ_h) V,  D = (2 + n) sinⁿθ_h/(2π),  n = 1/alpha,
//! V = 1/(4 (cos θ_i + cos θ_o − cos θ_i cos θ_o))   (Neubelt and Pettineo 2013).
//!
//! D has no peak at the normal but is 0 there and largest at θ_h = 90°: the lobe is a rim along the
//! horizon, towards the light and away from it alike. ∫ D cos θ_h dω_h = 1 for every alpha.
//! `rho` in [0, 1] scales it; alpha in [0.001, 1], without unit, is the fibres' roughness.
//!
//! At the normal V is 1/4 and the directional albedo rho 2^(−n/2)/(n + 4), at most 0.14. Towards
//! grazing views it grows: on the horizon it is 0.64 rho for alpha 1, 0.88 for 0.3, 1.02 for 0.2, and
//! goes as sqrt(n/2π) from there. So energy conservation is not declared. Where both cosines
//! vanish V diverges (the floor on the denominator holds it).

use super::formula::formula;
use super::half_vector::unit_half;
use super::shape::{BLACK, Shape, Shaped};
use super::spectrum::Limited;
use super::{Channels, Spectrum};
use crate::geometry::DirectionPair;
use crate::numeric::DENOMINATOR_FLOOR;
use std::f64::consts::PI;

formula! {
    "sheen": "rim of upright fibres, Estevez and Kulla 2017; no peak at the mirror direction", [
        "alpha = 0.3",
        "rho = [0.5, 0.1, 0.3]\nalpha = 0.8",
    ]
    /// Sheen, as a config writes it.
    pub struct SheenSpec {
        /// Scale of the rim.
        rho: Spectrum = Spectrum::Grey(1.0), in 0.0..=1.0;
        /// Roughness of the fibres.
        alpha: f64 = 0.3, in 1e-3..=1.0;
    }
    label: [alpha],
    // V spans a factor of ten, D many decades.
    favours: HalfAngle,
    build: Sheen::new,
}

/// The sheen BRDF.
pub type Sheen = Shaped<Rim>;

/// sinⁿθ_h/(cos θ_i + cos θ_o − cos θ_i cos θ_o).
#[derive(Clone, Debug)]
pub struct Rim {
    /// n/2: the power of sin²θ_h.
    half_exponent: f64,
}

impl Sheen {
    /// The rim of a checked spec.
    pub fn new(spec: &SheenSpec, channels: Channels) -> Self {
        let n = 1.0 / spec.alpha;
        let scale = (2.0 + n) / (8.0 * PI);
        let rim = Rim {
            half_exponent: 0.5 * n,
        };
        Self::on_base(BLACK, (&spec.rho, scale), rim, channels)
    }
}

impl Shape for Rim {
    #[inline]
    fn value(&self, pair: &DirectionPair) -> f64 {
        let (h, _) = unit_half(pair);
        // sinⁿ at its largest, on the horizon, where a rounding of sin² would count n/2 times.
        let (sin2, cos2) = (h.x * h.x + h.y * h.y, h.z * h.z);
        let log = if cos2 < 0.5 {
            (-cos2).ln_1p()
        } else {
            sin2.ln()
        };
        let (i, o) = (pair.omega_i.cos_theta(), pair.omega_o.cos_theta());
        let visibility = i + o - i * o;
        (self.half_exponent * log).exp() / visibility.max(DENOMINATOR_FLOOR)
    }
}
