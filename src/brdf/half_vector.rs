//! Functions of all models on the half vector: its safe normalisation, the reflection of a view
//! about it, and sampling of a lobe above a diffuse base.

use super::Spectrum;
use crate::geometry::{Direction, DirectionPair};
use crate::numeric::DENOMINATOR_FLOOR;
use crate::sampling;
use glam::DVec3;

/// The unit half vector, and |h| = cos θ_d in `[0, 1]`.
///
/// For a pair above the horizon h_z ≥ 0. At opposed grazing |h|² underflows long before h does,
/// and h = 0 has no direction: there the normal is as right as any other.
#[inline]
pub(super) fn unit_half(pair: &DirectionPair) -> (DVec3, f64) {
    let (h, _) = pair.half_and_back();
    let hh = h.length_squared();
    if hh > 1e-200 {
        let cos_d = hh.sqrt();
        return (h / cos_d, cos_d.min(1.0));
    }
    match Direction::try_new(h) {
        Some(unit) => (unit.vector(), h.abs().max_element()),
        None => (DVec3::Z, 0.0),
    }
}

/// [`unit_half`] of a pair above the horizon; `None` of any other.
#[inline]
pub(super) fn half_above(pair: &DirectionPair) -> Option<(DVec3, f64)> {
    pair.is_above_horizon().then(|| unit_half(pair))
}

/// `(x/alpha_x)² + (y/alpha_y)²` over `z²`: the squared slope in units of the roughness.
/// Infinite for a vector in the tangent plane, where every slope density is 0.
#[inline]
pub(super) fn scaled_slope2(v: DVec3, inverse_alpha: [f64; 2]) -> f64 {
    let (x, y) = (v.x * inverse_alpha[0], v.y * inverse_alpha[1]);
    (x * x + y * y) / (v.z * v.z)
}

/// The unit vector with slope of length `slope`, at azimuth `2π u`, stretched by alpha.
#[inline]
pub(super) fn from_scaled_slope(slope: f64, u: f64, alpha: [f64; 2]) -> DVec3 {
    let (s, c) = (std::f64::consts::TAU * u).sin_cos();
    DVec3::new(slope * c * alpha[0], slope * s * alpha[1], 1.0).normalize()
}

/// `omega_o` mirrored at the unit vector `h`; `None` if that is below the horizon.
#[inline]
pub(super) fn reflect(omega_o: Direction, h: DVec3) -> Option<Direction> {
    let o = omega_o.vector();
    let v = 2.0 * o.dot(h) * h - o;
    if v.z > 0.0 {
        Direction::try_new(v)
    } else {
        None
    }
}

/// Density of a reflected direction from the density of its half vector, d omega_h = d omega_i/(4 cos θ_d).
#[inline]
pub(super) fn reflected_pdf(half_pdf: f64, cos_d: f64) -> f64 {
    half_pdf / (4.0 * cos_d).max(DENOMINATOR_FLOOR)
}

/// Sampling of a half-vector lobe above a cosine-distributed base, each chosen in proportion to
/// its reflectance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mixture {
    /// Probability of the diffuse base.
    diffuse: f64,
}

impl Mixture {
    /// From the two reflectances; all diffuse if both are black.
    pub(super) fn new(rho_d: &Spectrum, rho_s: &Spectrum) -> Self {
        let [d, s] = [rho_d, rho_s].map(Spectrum::luminance);
        let diffuse = if d + s > 0.0 { d / (d + s) } else { 1.0 };
        Self { diffuse }
    }

    /// Draws omega_i; `half` draws the half vector of the lobe. `None` below the horizon.
    #[inline]
    pub(super) fn sample(
        self,
        omega_o: Direction,
        [u, v]: [f64; 2],
        half: impl FnOnce([f64; 2]) -> DVec3,
    ) -> Option<Direction> {
        // What is left of u after the choice is again uniform.
        if u < self.diffuse {
            Some(sampling::cosine_hemisphere([u / self.diffuse, v]))
        } else {
            let u = (u - self.diffuse) / (1.0 - self.diffuse);
            reflect(omega_o, half([u, v]))
        }
    }

    /// Density per steradian of omega_i; `half_pdf` is the density of the lobe's half vector.
    #[inline]
    pub(super) fn pdf(self, pair: &DirectionPair, half_pdf: impl FnOnce(DVec3) -> f64) -> f64 {
        if !pair.is_above_horizon() {
            return 0.0;
        }
        let (h, cos_d) = unit_half(pair);
        let diffuse = sampling::cosine_hemisphere_pdf(pair.omega_i);
        let lobe = reflected_pdf(half_pdf(h), cos_d);
        self.diffuse * diffuse + (1.0 - self.diffuse) * lobe
    }
}
