//! Distributions of pairs that test pairs are drawn from, inside a window.

use crate::geometry::{Direction, DirectionPair};
use crate::sampling::{cosine_hemisphere, ggx_half_vector, ggx_half_vector_pdf};
use glam::DVec2;
use std::f64::consts::{FRAC_1_PI, TAU};

/// Roughnesses of the lobes in the measure `lobe`, equally often.
pub(super) const LOBE_ALPHAS: [f64; 4] = [0.3, 0.1, 0.03, 0.01];

/// The parts of the mixture: the first has half of it, the others have equal shares.
pub(super) const MIXTURE: [Part; 17] = [
    Part::Cosine,
    // These four are the lobes of the measure `lobe`.
    Part::HalfVector(LOBE_ALPHAS[0]),
    Part::HalfVector(LOBE_ALPHAS[1]),
    Part::HalfVector(LOBE_ALPHAS[2]),
    Part::HalfVector(LOBE_ALPHAS[3]),
    Part::HalfVector(0.003),
    Part::HalfVector(0.001),
    Part::Half(0.1),
    Part::Half(0.03),
    Part::Half(0.01),
    Part::Half(0.003),
    Part::Half(0.001),
    Part::Back(0.1),
    Part::Back(0.03),
    Part::Back(0.01),
    Part::Back(0.003),
    Part::Uniform,
];

#[derive(Clone, Copy)]
pub(super) enum Part {
    Cosine,
    HalfVector(f64),
    Half(f64),
    Back(f64),
    Uniform,
}

impl Part {
    /// A candidate from a point of the unit cube; `None` if there is no such pair.
    pub(crate) fn candidate(self, u: [f64; 4], window: &Window) -> Option<DirectionPair> {
        let cosine = |u: [f64; 2]| cosine_hemisphere([u[0] * window.sin2_mask, u[1]]);
        let omega_o = cosine([u[0], u[1]]);
        // omega_i at the point of the unit disc that the sensor's is taken to.
        let offset = |scale: f64, sign: f64| {
            let (sin, cos) = (TAU * u[3]).sin_cos();
            let v = u[2] * window.sin2_mask / (scale * scale + window.sin2_mask);
            let radius = scale * (v / (1.0 - v)).sqrt();
            let at = 2.0 * radius * DVec2::new(cos, sin) + sign * omega_o.vector().truncate();
            let sin2 = at.length_squared();
            (sin2 < 1.0).then(|| Direction::from_unit(at.extend((1.0 - sin2).sqrt())))
        };
        let omega_i = match self {
            Part::Cosine => cosine([u[2], u[3]]),
            Part::HalfVector(alpha) => {
                let h = ggx_half_vector(alpha, [u[2] * window.share(alpha), u[3]]).vector();
                Direction::from_unit(2.0 * omega_o.vector().dot(h) * h - omega_o.vector())
            }
            Part::Half(scale) => offset(scale, -1.0)?,
            Part::Back(scale) => offset(scale, 1.0)?,
            Part::Uniform => {
                let uniform = |u: [f64; 2]| {
                    let cos = 1.0 - u[0] * (1.0 - window.cos_mask);
                    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
                    let (s, c) = (TAU * u[1]).sin_cos();
                    Direction::from_unit(glam::DVec3::new(sin * c, sin * s, cos))
                };
                let [a, b] = [[u[0], u[1]], [u[2], u[3]]].map(uniform);
                return Some(DirectionPair::new(a, b));
            }
        };
        Some(DirectionPair::new(omega_i, omega_o))
    }

    /// Density of the candidates inside the mask, sr⁻².
    pub(crate) fn density(self, facts: &Facts, window: &Window) -> f64 {
        let cosine = |cos: f64| cos * FRAC_1_PI / window.sin2_mask;
        let [cos_i, cos_o] = facts.cos;
        // Of a point of the disc; a point of omega_i's disc is four of them, and cos θ_i of a steradian.
        let offset = |scale: f64, r2: f64| {
            let s2 = scale * scale;
            let share = window.sin2_mask / (s2 + window.sin2_mask);
            s2 * FRAC_1_PI / ((s2 + r2) * (s2 + r2)) / share * 0.25 * cos_i
        };
        match self {
            Part::Cosine => cosine(cos_i) * cosine(cos_o),
            Part::HalfVector(alpha) => {
                let normals = ggx_half_vector_pdf(alpha, facts.half) / window.share(alpha);
                cosine(cos_o) * normals / (4.0 * facts.cos_d)
            }
            Part::Half(scale) => cosine(cos_o) * offset(scale, facts.half2),
            Part::Back(scale) => cosine(cos_o) * offset(scale, facts.back2),
            Part::Uniform => (TAU * (1.0 - window.cos_mask)).powi(-2),
        }
    }
}

/// What densities need of a pair.
pub(super) struct Facts {
    /// cos θ_i, cos θ_o.
    cos: [f64; 2],
    half: Direction,
    /// cos θ_d.
    cos_d: f64,
    /// |h_bar|² and |k_bar|².
    half2: f64,
    back2: f64,
}

impl Facts {
    pub(crate) fn of(pair: &DirectionPair) -> Self {
        let (h, k) = pair.half_and_back();
        Self {
            cos: [pair.omega_i.cos_theta(), pair.omega_o.cos_theta()],
            half: Direction::from_unit(h / h.length()),
            cos_d: h.length(),
            half2: h.truncate().length_squared(),
            back2: k.truncate().length_squared(),
        }
    }
}

/// Condition on the pairs that are kept.
pub(super) struct Window {
    /// Both cosines are above this.
    pub cos_mask: f64,
    pub sin2_mask: f64,
    /// Smallest angle between light and sensor, rad.
    min_separation: f64,
}

impl Window {
    /// Elevations up to a mask, and a smallest angle between light and sensor, degrees.
    pub(crate) fn new(mask_deg: f64, min_separation_deg: f64) -> Self {
        let (sin, cos) = mask_deg.to_radians().sin_cos();
        Self {
            // cos 90° is 6e-17 in `f64`; a mask of 90° means the horizon itself.
            cos_mask: if mask_deg == 90.0 { 0.0 } else { cos },
            sin2_mask: sin * sin,
            min_separation: min_separation_deg.to_radians(),
        }
    }

    /// The share within the mask of half vectors with the density of GGX: tan²θ_h = α² u/(1 − u), solved for u.
    pub(crate) fn share(&self, alpha: f64) -> f64 {
        self.sin2_mask / (self.sin2_mask + alpha * alpha * (1.0 - self.sin2_mask))
    }

    pub(crate) fn keeps(&self, pair: &DirectionPair) -> bool {
        pair.omega_i.cos_theta() > self.cos_mask
            && pair.omega_o.cos_theta() > self.cos_mask
            && (self.min_separation == 0.0 || pair.separation() >= self.min_separation)
    }
}
