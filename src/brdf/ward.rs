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

use super::half_vector::{Mixture, from_scaled_slope, half_above, scaled_slope2};
use super::spectrum::scaled;
use super::{
    Brdf, BrdfSpec, BuildError, Channels, Favours, Presence, Roughness, SampleBrdf, Spectrum,
    Tables,
};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use crate::registry::{self, Entry};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_PI, PI};

const KIND: &str = "ward";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "Lambert plus an elliptical Gaussian lobe, Ward 1992",
    examples: &[
        "rho_d = 0.2\nrho_s = 0.3\nalpha = 0.15",
        "rho_d = [0.2, 0.1, 0.05]\nrho_s = 0.3\nalpha = [0.05, 0.2]",
    ],
    read: |table| Ok(Box::new(registry::parse::<WardSpec>(table)?)),
};

/// Ward's model, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WardSpec {
    /// Albedo of the diffuse base in [0, 1].
    pub rho_d: Spectrum,
    /// Reflectance of the lobe in [0, 1].
    pub rho_s: Spectrum,
    /// Roughness, one number or [alpha_x, alpha_y].
    pub alpha: Roughness,
}

impl Default for WardSpec {
    fn default() -> Self {
        Self {
            rho_d: Spectrum::Grey(0.2),
            rho_s: Spectrum::Grey(0.3),
            alpha: Roughness::Isotropic(0.15),
        }
    }
}

impl BrdfSpec for WardSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        format!("{KIND}-{}", self.alpha)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.rho_d.check("rho_d", 0.0, 1.0, channels)?;
        self.rho_s.check("rho_s", 0.0, 1.0, channels)?;
        self.alpha.check("alpha")?;
        Ok(())
    }

    fn favours(&self) -> Favours {
        Favours::HalfAngle
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        Ok(Box::new(Ward::new(
            self.rho_d.clone(),
            self.rho_s.clone(),
            self.alpha,
            channels,
        )))
    }

    fn tables(&self) -> Tables {
        Tables::NONE
    }
}

/// Ward's BRDF.
#[derive(Clone, Debug)]
pub struct Ward {
    channels: Channels,
    isotropic: bool,
    alpha: [f64; 2],
    inverse_alpha: [f64; 2],
    /// rho_d/π.
    diffuse: Vec<f64>,
    /// rho_s/(4π alpha_x alpha_y).
    lobe: Vec<f64>,
    mixture: Mixture,
}

impl Ward {
    /// A Gaussian lobe of reflectance `rho_s` above a diffuse base of albedo `rho_d`.
    pub fn new(rho_d: Spectrum, rho_s: Spectrum, alpha: Roughness, channels: Channels) -> Self {
        let [ax, ay] = alpha.xy();
        let scale = 1.0 / (4.0 * PI * ax * ay);
        Self {
            isotropic: alpha.is_isotropic(),
            alpha: [ax, ay],
            inverse_alpha: [1.0 / ax, 1.0 / ay],
            diffuse: scaled(&rho_d, &channels, FRAC_1_PI),
            lobe: scaled(&rho_s, &channels, scale),
            mixture: Mixture::new(&rho_d, &rho_s),
            channels,
        }
    }
}

impl Brdf for Ward {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry {
            isotropic: self.isotropic,
            ..Symmetry::ORTHOTROPIC
        }
    }

    fn conserves_energy(&self) -> bool {
        false
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
        // The root of each cosine: their product underflows when both graze.
        let root = pair.omega_i.cos_theta().sqrt() * pair.omega_o.cos_theta().sqrt();
        let gaussian = (-scaled_slope2(h, self.inverse_alpha)).exp() / root.max(DENOMINATOR_FLOOR);
        for ((out, diffuse), lobe) in out.iter_mut().zip(&self.diffuse).zip(&self.lobe) {
            *out = diffuse + lobe * gaussian;
        }
        Presence::Present
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        Some(self)
    }
}

impl SampleBrdf for Ward {
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
