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

use super::formula::formula;
use super::half_vector::{Mixture, unit_half};
use super::shape::{Shape, Shaped};
use super::spectrum::{Limited, planes};
use super::{Channels, Spectrum};
use crate::geometry::{Direction, DirectionPair};
use glam::DVec3;
use std::f64::consts::{FRAC_1_PI, PI, TAU};

formula! {
    "phong": "normalised Blinn-Phong: Lambert plus a cosine power of the half vector", [
        "rho_d = 0.3\nrho_s = 0.7\nexponent = 50.0",
        "rho_d = [0.4, 0.1, 0.0]\nrho_s = 0.2\nexponent = 1000.0",
        "rho_d = 0.0\nrho_s = 1.0\nexponent = 2.0",
    ]
    /// The normalised Blinn–Phong model, as a config writes it.
    pub struct PhongSpec {
        /// Albedo of the diffuse base.
        rho_d: Spectrum = Spectrum::Grey(0.3), in 0.0..=1.0;
        /// Albedo of the lobe at the normal.
        rho_s: Spectrum = Spectrum::Grey(0.5), in 0.0..=1.0;
        /// Exponent of cos θ_h. The unit half vector is good to 1e-16: at 10⁶ the power still has 10 digits.
        exponent: f64 = 50.0, in 0.0..=1e6;
    }
    label: [exponent],
    favours: HalfAngle,
    build: Phong::new,
}

/// The normalised Blinn–Phong BRDF.
pub type Phong = Shaped<CosinePower>;

/// cosⁿ θ_h, above a diffuse base.
#[derive(Clone, Debug)]
pub struct CosinePower {
    exponent: f64,
    mixture: Mixture,
    conserves_energy: bool,
}

impl Phong {
    /// The lobe of a checked spec above its diffuse base.
    pub fn new(spec: &PhongSpec, channels: Channels) -> Self {
        let (rho_d, rho_s, n) = (&spec.rho_d, &spec.rho_s, spec.exponent);
        let c = (n + 2.0) * (n + 4.0) / (8.0 * PI * ((-0.5 * n).exp2() + n));
        let power = CosinePower {
            exponent: n,
            mixture: Mixture::new(rho_d, rho_s),
            conserves_energy: planes([rho_d, rho_s], &channels).all(|[d, s]| d + s <= 1.0),
        };
        Self::on_base((rho_d, FRAC_1_PI), (rho_s, c), power, channels)
    }
}

impl Shape for CosinePower {
    fn conserves_energy(&self) -> bool {
        self.conserves_energy
    }

    #[inline]
    fn value(&self, pair: &DirectionPair) -> f64 {
        let (h, _) = unit_half(pair);
        h.z.min(1.0).powf(self.exponent)
    }

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
