//! Beckmann normals: Gaussian slopes (Beckmann and Spizzichino 1963; Walter et al. 2007).
//!
//! D(h) = exp(−t) / (π alpha_x alpha_y cos⁴θ_h),  t = (x²/alpha_x² + y²/alpha_y²)/z²,  h = (x, y, z) unit;
//! m(ω) = z erf(a) + s exp(−a²)/√π,  s = sqrt(alpha_x² x² + alpha_y² y²),  a = z/s.
//!
//! m is exact (`libm::erf`, below 1 ulp), not Walter's rational fit, whose 0.35 % would break the
//! furnace test. Degenerate cases: s = 0 (ω at the normal) gives m = z; t above 745 gives D = 0 before
//! cos⁴θ_h can underflow. Sampling draws the half vector from D cos θ_h.

use super::{Distribution, MicrofacetSpec};
use crate::brdf::half_vector::{from_scaled_slope, reflected_pdf, scaled_slope2};
use crate::brdf::{BrdfSpec, Roughness};
use crate::registry::Entry;
use crate::sampling::RandomStream;
use glam::DVec3;
use std::f64::consts::{FRAC_2_SQRT_PI, PI, TAU};

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: Beckmann::KIND,
    summary: "microfacets with Gaussian slopes and height-correlated Smith shadowing",
    examples: &[
        "alpha = 0.3",
        "alpha = [0.1, 0.4]",
        "alpha = 0.2\nfresnel = { kind = \"schlick\", f0 = [0.9, 0.6, 0.2] }",
        "alpha = 0.8\nfresnel = { kind = \"none\" }",
    ],
    read: MicrofacetSpec::<Beckmann>::read,
};

/// Gaussian slopes of some roughness.
#[derive(Clone, Debug)]
pub struct Beckmann {
    alpha: [f64; 2],
    inverse_alpha: [f64; 2],
    /// 1/(π alpha_x alpha_y).
    scale: f64,
}

impl Distribution for Beckmann {
    const KIND: &'static str = "beckmann";

    fn new(alpha: Roughness) -> Self {
        let [x, y] = alpha.xy();
        Self {
            alpha: [x, y],
            inverse_alpha: [1.0 / x, 1.0 / y],
            scale: 1.0 / (PI * x * y),
        }
    }

    #[inline]
    fn density(&self, h: DVec3) -> f64 {
        let t = scaled_slope2(h, self.inverse_alpha);
        if t > 745.0 {
            return 0.0;
        }
        let s = h.length_squared() / (h.z * h.z);
        self.scale * (-t).exp() * (s * s)
    }

    #[inline]
    fn projected_area(&self, omega: DVec3) -> f64 {
        let (x, y) = (omega.x * self.alpha[0], omega.y * self.alpha[1]);
        let s = (x * x + y * y).sqrt();
        // erfc(6) = 2e-17: from here on m = z to the last bit, and most pairs of a smooth surface
        // are here.
        if omega.z >= 6.0 * s {
            return omega.z;
        }
        let a = omega.z / s;
        omega.z * libm::erf(a) + 0.5 * FRAC_2_SQRT_PI * s * (-a * a).exp()
    }

    #[inline]
    fn seen_area(&self, omega: DVec3) -> f64 {
        if omega.z >= 0.0 {
            return 0.5 * (self.projected_area(omega) + omega.z);
        }
        let (x, y) = (omega.x * self.alpha[0], omega.y * self.alpha[1]);
        let s = (x * x + y * y).sqrt();
        // erfc(26) is the last that is no 0; of a view along −n there is nothing.
        if -omega.z >= 26.0 * s {
            return 0.0;
        }
        let a = -omega.z / s;
        let seen = 0.5 * FRAC_2_SQRT_PI * s * (-a * a).exp() + omega.z * libm::erfc(a);
        (0.5 * seen).max(0.0)
    }

    /// The slope along the view has the density (a + r)⁺ exp(−r²) in units of the roughness, a = z/s, drawn by rejection;
    /// the slope across it is Gaussian.
    fn visible_normal(&self, omega: DVec3, random: &mut RandomStream) -> DVec3 {
        let (x, y) = (omega.x * self.alpha[0], omega.y * self.alpha[1]);
        let s = (x * x + y * y).sqrt();
        let (cos, sin) = if s > 0.0 { (x / s, y / s) } else { (1.0, 0.0) };
        let along = visible_slope(omega.z / s.max(f64::MIN_POSITIVE), random);
        let across = gaussian(random);
        DVec3::new(
            self.alpha[0] * (along * cos - across * sin),
            self.alpha[1] * (along * sin + across * cos),
            1.0,
        )
        .normalize()
    }

    #[inline]
    fn sample_normal(&self, _omega_o: DVec3, u: [f64; 2]) -> DVec3 {
        from_scaled_slope((-(-u[0]).ln_1p()).sqrt(), u[1], self.alpha)
    }

    #[inline]
    fn reflected_pdf(&self, h: DVec3, cos_d: f64, _omega_o: DVec3) -> f64 {
        reflected_pdf(self.density(h) * h.z, cos_d)
    }
}

/// A number of density exp(−x²)/√π.
fn gaussian(random: &mut RandomStream) -> f64 {
    let radius = (-(-random.next()).ln_1p()).sqrt();
    radius * (TAU * random.next()).cos()
}

/// A number of density ∝ (a + r)⁺ exp(−r²).
fn visible_slope(a: f64, random: &mut RandomStream) -> f64 {
    let rayleigh = |random: &mut RandomStream| (-(-random.next()).ln_1p()).sqrt();
    loop {
        if a >= 0.0 {
            // Of a exp(−r²) + |r| exp(−r²).
            let flat = 1.0 / (1.0 + 1.0 / (a * PI.sqrt()));
            let r = if random.next() < flat {
                gaussian(random)
            } else if random.next() < 0.5 {
                rayleigh(random)
            } else {
                -rayleigh(random)
            };
            if random.next() * (a + r.abs()) < a + r || a.is_infinite() {
                return r;
            }
        } else if a > -0.5 {
            // r = y − a, of y exp(−y²), which misses exp(2ay).
            let y = rayleigh(random);
            if random.next() < (2.0 * a * y).exp() {
                return y - a;
            }
        } else {
            // Of y exp(2ay), which misses exp(−y²).
            let y = (((-random.next()).ln_1p()) + (-random.next()).ln_1p()) / (2.0 * a);
            if random.next() < (-y * y).exp() {
                return y - a;
            }
        }
    }
}
