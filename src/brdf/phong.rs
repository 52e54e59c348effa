//! Blinn's half-vector form of Phong's lobe, normalised and reciprocal.
//!
//! f_r = rho_d/π + rho_s C(n) cos^n θ_h,  C(n) = (n + 2)(n + 4) / (8π (2^(−n/2) + n)).
//!
//! Blinn 1977; the normalisation is the exact one (Giesen 2009). `rho_d` and `rho_s` in [0, 1];
//! the exponent n ≥ 0 has no unit, n = 0 is Lambert with albedo rho_d + rho_s.
//!
//! There is no 1/cos factor, so the model darkens towards grazing. With z = cos θ_h the lobe's
//! directional albedo is rho_s C ∫ zⁿ T(z, θ_o) dz, T ≥ 0. At the normal it is rho_s for every n, by
//! choice of C. At other views T(z, 0) − T(z, θ_o) is negative below one z and positive above it (a
//! test walks the grid), and its integral is 0 (n = 0 is Lambert, whose albedo is the same for every
//! view); a weight zⁿ that grows with z can then only favour the normal. So the albedo is at most
//! rho_d + rho_s, and energy is conserved exactly when that is at most 1 in every channel.

use super::half_vector::{Mixture, half_above};
use super::spectrum::{planes, scaled};
use super::{
    Brdf, BrdfSpec, BuildError, Channels, Favours, Presence, SampleBrdf, Spectrum, Tables,
};
use crate::error::in_closed;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::registry::{self, Entry};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

const KIND: &str = "phong";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "normalised Blinn-Phong: Lambert plus a cosine power of the half vector",
    examples: &[
        "rho_d = 0.3\nrho_s = 0.7\nexponent = 50.0",
        "rho_d = [0.4, 0.1, 0.0]\nrho_s = 0.2\nexponent = 1000.0",
        "rho_d = 0.0\nrho_s = 1.0\nexponent = 2.0",
    ],
    read: |table| Ok(Box::new(registry::parse::<PhongSpec>(table)?)),
};

/// The normalised Blinn–Phong model, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PhongSpec {
    /// Albedo of the diffuse base in [0, 1].
    pub rho_d: Spectrum,
    /// Albedo of the lobe at the normal, in [0, 1].
    pub rho_s: Spectrum,
    /// Exponent of cos θ_h, 0 to 10⁶.
    pub exponent: f64,
}

impl Default for PhongSpec {
    fn default() -> Self {
        Self {
            rho_d: Spectrum::Grey(0.3),
            rho_s: Spectrum::Grey(0.5),
            exponent: 50.0,
        }
    }
}

impl BrdfSpec for PhongSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        format!("{KIND}-{}", self.exponent)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.rho_d.check("rho_d", 0.0, 1.0, channels)?;
        self.rho_s.check("rho_s", 0.0, 1.0, channels)?;
        // The unit half vector is good to 1e-16: at n = 10⁶ the power still has 10 digits.
        in_closed("exponent", self.exponent, 0.0, 1e6)?;
        Ok(())
    }

    fn favours(&self) -> Favours {
        Favours::HalfAngle
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        Ok(Box::new(Phong::new(
            self.rho_d.clone(),
            self.rho_s.clone(),
            self.exponent,
            channels,
        )))
    }

    fn tables(&self) -> Tables {
        Tables::NONE
    }
}

/// The normalised Blinn–Phong BRDF.
#[derive(Clone, Debug)]
pub struct Phong {
    channels: Channels,
    /// rho_d/π.
    diffuse: Vec<f64>,
    /// rho_s C(n).
    lobe: Vec<f64>,
    exponent: f64,
    mixture: Mixture,
    conserves_energy: bool,
}

impl Phong {
    /// A lobe of albedo `rho_s` at the normal, above a diffuse base of albedo `rho_d`.
    pub fn new(rho_d: Spectrum, rho_s: Spectrum, exponent: f64, channels: Channels) -> Self {
        let n = exponent;
        let c = (n + 2.0) * (n + 4.0) / (8.0 * PI * ((-0.5 * n).exp2() + n));
        let conserves_energy = planes([&rho_d, &rho_s], &channels).all(|[d, s]| d + s <= 1.0);
        Self {
            diffuse: scaled(&rho_d, &channels, FRAC_1_PI),
            lobe: scaled(&rho_s, &channels, c),
            exponent,
            mixture: Mixture::new(&rho_d, &rho_s),
            conserves_energy,
            channels,
        }
    }
}

impl Brdf for Phong {
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
        let Some((h, _)) = half_above(pair) else {
            out.fill(0.0);
            return Presence::Present;
        };
        let power = h.z.min(1.0).powf(self.exponent);
        for ((out, diffuse), lobe) in out.iter_mut().zip(&self.diffuse).zip(&self.lobe) {
            *out = diffuse + lobe * power;
        }
        Presence::Present
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        Some(self)
    }
}

impl SampleBrdf for Phong {
    /// The half vector is drawn with density (n + 2)/(2π) cos^(n+1) θ_h.
    fn sample(&self, omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        self.mixture.sample(omega_o, u, |[u, v]| {
            // cos^(n+2) θ_h = 1 − u; sin² through expm1 keeps its digits near the peak.
            let log_cos2 = 2.0 * (-u).ln_1p() / (self.exponent + 2.0);
            let sin = (-log_cos2.exp_m1()).sqrt();
            let (s, c) = (TAU * v).sin_cos();
            DVec3::new(sin * c, sin * s, (0.5 * log_cos2).exp())
        })
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        let n = self.exponent;
        self.mixture.pdf(pair, |h| {
            (n + 2.0) / TAU * h.z.clamp(0.0, 1.0).powf(n + 1.0)
        })
    }
}
