//! Ward's Gaussian reflectance model, isotropic and elliptical, in the form of Ward 1992.
//!
//! f_r = rho_d/π + rho_s exp(−tan²θ_h (cos²φ_h/alpha_x² + sin²φ_h/alpha_y²))
//!       / (4π alpha_x alpha_y sqrt(cos θ_i cos θ_o)).
//!
//! `rho_d` and `rho_s` in [0, 1]; alpha the standard deviation of the slope along t and b times √2,
//! without unit. The exponent is that of the half vector, without approximation.
//!
//! Towards the horizon 1/sqrt(cos θ_i cos θ_o) diverges (kept finite by the floor on the denominator).
//! With rho_s = 1 the lobe's directional albedo falls from 0.99 (alpha 0.05) or 0.59 (alpha 0.5) at the
//! normal to 0.18 or 0.27 at 80°, then grows as 1/sqrt(cos θ_o) and exceeds 1 in the last quarter of a
//! degree above the horizon, without bound. So energy conservation is not declared.

use super::formula::formula;
use super::half_vector::{Mixture, from_scaled_slope, scaled_slope2, unit_half};
use super::shape::{Shape, Shaped};
use super::{Channels, Roughness, Spectrum};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use std::f64::consts::{FRAC_1_PI, PI};

formula! {
    "ward": "Lambert plus an elliptical Gaussian lobe, Ward 1992", [
        "rho_d = 0.2\nrho_s = 0.3\nalpha = 0.15",
        "rho_d = [0.2, 0.1, 0.05]\nrho_s = 0.3\nalpha = [0.05, 0.2]",
    ]
    /// Ward's model, as a config writes it.
    pub struct WardSpec {
        /// Albedo of the diffuse base.
        rho_d: Spectrum = Spectrum::Grey(0.2), in 0.0..=1.0;
        /// Reflectance of the lobe.
        rho_s: Spectrum = Spectrum::Grey(0.3), in 0.0..=1.0;
        /// Roughness, one number or [alpha_x, alpha_y].
        alpha: Roughness = Roughness::Isotropic(0.15), in Roughness::RANGE;
    }
    label: [alpha],
    favours: HalfAngle,
    build: Ward::new,
}

/// Ward's BRDF.
pub type Ward = Shaped<Gaussian>;

/// exp(−tan²θ_h (cos²φ_h/alpha_x² + sin²φ_h/alpha_y²))/sqrt(cos θ_i cos θ_o), above a diffuse base.
#[derive(Clone, Debug)]
pub struct Gaussian {
    symmetry: Symmetry,
    alpha: [f64; 2],
    inverse_alpha: [f64; 2],
    mixture: Mixture,
}

impl Ward {
    /// The lobe of a checked spec above its diffuse base.
    pub fn new(spec: &WardSpec, channels: Channels) -> Self {
        let (rho_d, rho_s, alpha) = (&spec.rho_d, &spec.rho_s, spec.alpha);
        let [ax, ay] = alpha.xy();
        let gaussian = Gaussian {
            symmetry: alpha.symmetry(),
            alpha: [ax, ay],
            inverse_alpha: [1.0 / ax, 1.0 / ay],
            mixture: Mixture::new(rho_d, rho_s),
        };
        let scale = 1.0 / (4.0 * PI * ax * ay);
        Self::on_base((rho_d, FRAC_1_PI), (rho_s, scale), gaussian, channels)
    }
}

impl Shape for Gaussian {
    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    #[inline]
    fn value(&self, pair: &DirectionPair) -> f64 {
        let (h, _) = unit_half(pair);
        // The root of each cosine: their product underflows when both graze.
        let root = pair.omega_i.cos_theta().sqrt() * pair.omega_o.cos_theta().sqrt();
        (-scaled_slope2(h, self.inverse_alpha)).exp() / root.max(DENOMINATOR_FLOOR)
    }

    /// The half vector is drawn from the Gaussian of its slopes.
    fn sample(&self, omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        self.mixture.sample(omega_o, u, |[u, v]| {
            from_scaled_slope((-(-u).ln_1p()).sqrt(), v, self.alpha)
        })
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        let [ax, ay] = self.alpha;
        self.mixture.pdf(pair, |h| {
            let slope2 = scaled_slope2(h, self.inverse_alpha);
            // exp(−745) is the last number above 0; beyond it cos³θ_h may underflow too.
            if slope2 > 745.0 {
                return 0.0;
            }
            (-slope2).exp() / (PI * ax * ay * h.z * h.z * h.z)
        })
    }
}
