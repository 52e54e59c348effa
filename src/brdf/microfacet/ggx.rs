//! GGX normals (Trowbridge and Reitz 1975; Walter et al. 2007; anisotropic form Heitz 2014).
//!
//! D(h) = 1 / (π alpha_x alpha_y (x²/alpha_x² + y²/alpha_y² + z²)²),  h = (x, y, z) unit;
//! m(ω) = sqrt(z² + alpha_x² x² + alpha_y² y²).
//!
//! No transcendental function, no guard: with alpha in [1e-6, 10] every term stays between 1e-14
//! and 1e25. Sampling is of the visible normals, by spherical caps (Dupuy and Benyoub 2023), with density
//! G₁ D ⟨ω_o·h⟩/cos θ_o = 2 D ⟨ω_o·h⟩/(m(ω_o) + cos θ_o).

use super::{Distribution, MicrofacetSpec};
use crate::brdf::{BrdfSpec, Roughness};
use crate::numeric::safe_sqrt;
use crate::registry::Entry;
use crate::sampling::RandomStream;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: Ggx::KIND,
    summary: "microfacets with GGX normals and height-correlated Smith shadowing",
    examples: &[
        "alpha = 0.3",
        "alpha = [0.1, 0.4]",
        "alpha = 0.05\nfresnel = { kind = \"conductor\", eta = [0.14, 0.38, 1.44], kappa = [3.98, 2.39, 1.6] }",
        "alpha = 0.2\nfresnel = { kind = \"dielectric\", ior = 1.5 }",
        "alpha = 1.0\nfresnel = { kind = \"none\" }",
    ],
    read: MicrofacetSpec::<Ggx>::read,
};

/// GGX normals of some roughness.
#[derive(Clone, Debug)]
pub struct Ggx {
    alpha: [f64; 2],
    inverse_alpha: [f64; 2],
    /// 1/(π alpha_x alpha_y).
    scale: f64,
}

impl Distribution for Ggx {
    const KIND: &'static str = "ggx";

    fn new(alpha: Roughness) -> Self {
        let [x, y] = alpha.xy();
        Self {
            alpha: [x, y],
            inverse_alpha: [1.0 / x, 1.0 / y],
            scale: 1.0 / (PI * x * y),
        }
    }

    #[inline(always)]
    fn density(&self, h: DVec3) -> f64 {
        let (x, y) = (h.x * self.inverse_alpha[0], h.y * self.inverse_alpha[1]);
        let s = h.length_squared() / (x * x + y * y + h.z * h.z);
        self.scale * (s * s)
    }

    #[inline(always)]
    fn projected_area(&self, omega: DVec3) -> f64 {
        let (x, y) = (omega.x * self.alpha[0], omega.y * self.alpha[1]);
        (x * x + y * y + omega.z * omega.z).sqrt()
    }

    #[inline]
    fn seen_area(&self, omega: DVec3) -> f64 {
        let m = self.projected_area(omega);
        if omega.z >= 0.0 {
            return 0.5 * (m + omega.z);
        }
        // m² − z² without the cancellation of m − |z|.
        let (x, y) = (omega.x * self.alpha[0], omega.y * self.alpha[1]);
        0.5 * (x * x + y * y) / (m - omega.z)
    }

    #[inline]
    fn visible_normal(&self, omega: DVec3, random: &mut RandomStream) -> DVec3 {
        // The cap is as right for a view from below.
        self.sample_normal(omega, [random.next(), random.next()])
    }

    #[inline]
    fn sample_normal(&self, omega_o: DVec3, u: [f64; 2]) -> DVec3 {
        let [ax, ay] = self.alpha;
        // Stretched by alpha the facets are a hemisphere; the normals seen from o are halfway
        // between o and a uniform point of the cap z > −o_z.
        let o = DVec3::new(omega_o.x * ax, omega_o.y * ay, omega_o.z).normalize();
        let z = (1.0 - u[0]) * (1.0 + o.z) - o.z;
        let sin = safe_sqrt((1.0 - z) * (1.0 + z));
        let (s, c) = (TAU * u[1]).sin_cos();
        // z + o.z without the cancellation, so that the normal never dips below the horizon.
        let h = DVec3::new(sin * c + o.x, sin * s + o.y, (1.0 - u[0]) * (1.0 + o.z));
        DVec3::new(h.x * ax, h.y * ay, h.z).normalize()
    }

    #[inline]
    fn reflected_pdf(&self, h: DVec3, _cos_d: f64, omega_o: DVec3) -> f64 {
        // 2 D ⟨ω_o·h⟩/(m + cos) over the Jacobian 4 ⟨ω_o·h⟩: the cosine cancels.
        self.density(h) / (2.0 * (self.projected_area(omega_o) + omega_o.z))
    }
}
