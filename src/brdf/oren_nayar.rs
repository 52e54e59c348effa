//! Oren and Nayar's rough diffuse reflector (SIGGRAPH 1994), the *qualitative* model of their
//! section 4.3: single scattering only, without the interreflection term of the full model.
//!
//! f_r = rho/π (A + B max(0, cos(φ_i − φ_o)) sin α tan β),
//! A = 1 − σ²/(2 (σ² + 0.33)), B = 0.45 σ²/(σ² + 0.09), α = max(θ_i, θ_o), β = min(θ_i, θ_o).
//!
//! `rho` is the facets' albedo in [0, 1], σ (rad) the standard deviation of their slope angle,
//! 0° to 90°; σ = 0 is Lambert. No angle is needed: cos(φ_i − φ_o) sin θ_i sin θ_o is the dot product
//! of the tangent-plane parts, so that
//!
//! f_r = rho/π (A + B max(0, ω̄_i·ω̄_o)/max(cos θ_i, cos θ_o)).
//!
//! It diverges at grazing retro-reflection, where tan β does (kept finite by the floor on the
//! denominator). The directional albedo has a closed form, rho (A + B G(θ_o)/π) with
//! G = sin θ (θ − sin θ cos θ) + (2/3) tan θ (1 − sin³θ), which grows from 0 to π/2 at the horizon: the
//! supremum rho (A + B/2) exceeds 1 for white facets with σ below 18.7° (by 1.5 % at most, at
//! σ = 11.4°), so energy conservation is declared from that number.

use super::spectrum::{planes, scaled};
use super::{Brdf, BrdfSpec, BuildError, Channels, Presence, SampleBrdf, Spectrum, Tables};
use crate::error::in_closed;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use crate::registry::{self, Entry};
use crate::sampling;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_PI;

const KIND: &str = "oren-nayar";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "rough diffuse reflector, the qualitative model of Oren and Nayar 1994",
    examples: &[
        "albedo = 0.5\nsigma_deg = 30.0",
        "albedo = [1.0, 0.9, 0.2]\nsigma_deg = 90.0",
        "albedo = 1.0\nsigma_deg = 10.0",
    ],
    read: |table| Ok(Box::new(registry::parse::<OrenNayarSpec>(table)?)),
};

/// Oren and Nayar's model, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OrenNayarSpec {
    /// Albedo of the facets in [0, 1].
    pub albedo: Spectrum,
    /// Standard deviation of the facets' slope angle (degrees), 0 to 90.
    pub sigma_deg: f64,
}

impl Default for OrenNayarSpec {
    fn default() -> Self {
        Self {
            albedo: Spectrum::Grey(0.5),
            sigma_deg: 20.0,
        }
    }
}

impl BrdfSpec for OrenNayarSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        format!("{KIND}-{}", self.sigma_deg)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.albedo.check("albedo", 0.0, 1.0, channels)?;
        in_closed("sigma_deg", self.sigma_deg, 0.0, 90.0)?;
        Ok(())
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        let sigma = self.sigma_deg.to_radians();
        Ok(Box::new(OrenNayar::new(
            self.albedo.clone(),
            sigma,
            channels,
        )))
    }

    fn tables(&self) -> Tables {
        Tables::NONE
    }
}

/// The qualitative Oren–Nayar BRDF.
#[derive(Clone, Debug)]
pub struct OrenNayar {
    channels: Channels,
    /// rho/π.
    value: Vec<f64>,
    a: f64,
    b: f64,
    conserves_energy: bool,
}

impl OrenNayar {
    /// Facets of the given albedo whose slope angles have standard deviation `sigma` (rad).
    pub fn new(albedo: Spectrum, sigma: f64, channels: Channels) -> Self {
        let s2 = sigma * sigma;
        let a = 1.0 - 0.5 * s2 / (s2 + 0.33);
        let b = 0.45 * s2 / (s2 + 0.09);
        let conserves_energy = planes([&albedo], &channels).all(|[rho]| rho * (a + 0.5 * b) <= 1.0);
        Self {
            value: scaled(&albedo, &channels, FRAC_1_PI),
            channels,
            a,
            b,
            conserves_energy,
        }
    }
}

impl Brdf for OrenNayar {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::FULL
    }

    fn conserves_energy(&self) -> bool {
        self.conserves_energy
    }

    fn is_mirrored(&self) -> bool {
        true
    }

    #[inline]
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let shape = if pair.is_above_horizon() {
            let (i, o) = (pair.omega_i.vector(), pair.omega_o.vector());
            let azimuthal = (i.x * o.x + i.y * o.y).max(0.0);
            self.a + self.b * azimuthal / i.z.max(o.z).max(DENOMINATOR_FLOOR)
        } else {
            0.0
        };
        for (out, value) in out.iter_mut().zip(&self.value) {
            *out = value * shape;
        }
        Presence::Present
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        Some(self)
    }
}

impl SampleBrdf for OrenNayar {
    fn sample(&self, _omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        Some(sampling::cosine_hemisphere(u))
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        sampling::cosine_hemisphere_pdf(pair.omega_i)
    }
}
