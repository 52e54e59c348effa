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

use super::half_vector::half_above;
use super::spectrum::scaled;
use super::{
    Brdf, BrdfSpec, BuildError, Channels, Favours, Presence, SampleBrdf, Spectrum, Tables,
};
use crate::error::in_closed;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use crate::registry::{self, Entry};
use crate::sampling;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

const KIND: &str = "sheen";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "rim of upright fibres, Estevez and Kulla 2017; no peak at the mirror direction",
    examples: &["alpha = 0.3", "rho = [0.5, 0.1, 0.3]\nalpha = 0.8"],
    read: |table| Ok(Box::new(registry::parse::<SheenSpec>(table)?)),
};

/// Sheen, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SheenSpec {
    /// Scale of the rim in [0, 1].
    pub rho: Spectrum,
    /// Roughness of the fibres, 0.001 to 1.
    pub alpha: f64,
}

impl Default for SheenSpec {
    fn default() -> Self {
        Self {
            rho: Spectrum::Grey(1.0),
            alpha: 0.3,
        }
    }
}

impl BrdfSpec for SheenSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        format!("{KIND}-{}", self.alpha)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.rho.check("rho", 0.0, 1.0, channels)?;
        in_closed("alpha", self.alpha, 1e-3, 1.0)?;
        Ok(())
    }

    fn favours(&self) -> Favours {
        // V spans a factor of ten, D many decades.
        Favours::HalfAngle
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        Ok(Box::new(Sheen::new(self.rho.clone(), self.alpha, channels)))
    }

    fn tables(&self) -> Tables {
        Tables::NONE
    }
}

/// The sheen BRDF.
#[derive(Clone, Debug)]
pub struct Sheen {
    channels: Channels,
    /// rho (2 + n)/(8π).
    scale: Vec<f64>,
    /// n/2: the power of sin²θ_h.
    half_exponent: f64,
}

impl Sheen {
    /// A rim of scale `rho` from fibres of roughness `alpha`.
    pub fn new(rho: Spectrum, alpha: f64, channels: Channels) -> Self {
        let n = 1.0 / alpha;
        let scale = (2.0 + n) / (8.0 * PI);
        Self {
            scale: scaled(&rho, &channels, scale),
            channels,
            half_exponent: 0.5 * n,
        }
    }
}

impl Brdf for Sheen {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::FULL
    }

    fn conserves_energy(&self) -> bool {
        false
    }

    fn is_mirrored(&self) -> bool {
        true
    }

    #[inline]
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let shape = if let Some((h, _)) = half_above(pair) {
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
        } else {
            0.0
        };
        for (out, scale) in out.iter_mut().zip(&self.scale) {
            *out = scale * shape;
        }
        Presence::Present
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        Some(self)
    }
}

impl SampleBrdf for Sheen {
    fn sample(&self, _omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        Some(sampling::cosine_hemisphere(u))
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        sampling::cosine_hemisphere_pdf(pair.omega_i)
    }
}
