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

use super::formula::formula;
use super::shape::{BLACK, Shape, Shaped};
use super::spectrum::{Limited, planes};
use super::{Channels, Spectrum};
use crate::geometry::DirectionPair;
use crate::numeric::DENOMINATOR_FLOOR;
use std::f64::consts::FRAC_1_PI;

formula! {
    "oren-nayar": "rough diffuse reflector, the qualitative model of Oren and Nayar 1994", [
        "albedo = 0.5\nsigma_deg = 30.0",
        "albedo = [1.0, 0.9, 0.2]\nsigma_deg = 90.0",
        "albedo = 1.0\nsigma_deg = 10.0",
    ]
    /// Oren and Nayar's model, as a config writes it.
    pub struct OrenNayarSpec {
        /// Albedo of the facets.
        albedo: Spectrum = Spectrum::Grey(0.5), in 0.0..=1.0;
        /// Standard deviation of the facets' slope angle (degrees).
        sigma_deg: f64 = 20.0, in 0.0..=90.0;
    }
    label: [sigma_deg],
    favours: Neither,
    build: OrenNayar::new,
}

/// The qualitative Oren–Nayar BRDF.
pub type OrenNayar = Shaped<Grooves>;

/// A + B max(0, ω̄_i·ω̄_o)/max(cos θ_i, cos θ_o).
#[derive(Clone, Debug)]
pub struct Grooves {
    a: f64,
    b: f64,
    conserves_energy: bool,
}

impl OrenNayar {
    /// The facets of a checked spec.
    pub fn new(spec: &OrenNayarSpec, channels: Channels) -> Self {
        let (albedo, sigma) = (&spec.albedo, spec.sigma_deg.to_radians());
        let s2 = sigma * sigma;
        let a = 1.0 - 0.5 * s2 / (s2 + 0.33);
        let b = 0.45 * s2 / (s2 + 0.09);
        let grooves = Grooves {
            a,
            b,
            conserves_energy: planes([albedo], &channels).all(|[rho]| rho * (a + 0.5 * b) <= 1.0),
        };
        Self::on_base(BLACK, (albedo, FRAC_1_PI), grooves, channels)
    }
}

impl Shape for Grooves {
    fn conserves_energy(&self) -> bool {
        self.conserves_energy
    }

    #[inline]
    fn value(&self, pair: &DirectionPair) -> f64 {
        let [i, o] = pair.vectors();
        let azimuthal = (i.x * o.x + i.y * o.y).max(0.0);
        self.a + self.b * azimuthal / i.z.max(o.z).max(DENOMINATOR_FLOOR)
    }
}
