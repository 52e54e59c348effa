//! Distributions of pairs that test pairs are drawn from, inside a window.

use crate::geometry::{Direction, DirectionPair};
use crate::sampling::{cosine_hemisphere, ggx_half_vector, ggx_half_vector_pdf};
use glam::DVec2;
use std::f64::consts::{FRAC_1_PI, TAU};

/// The distributions that measures are made of: the first is that of `cosine`, the others are the lobes of `lobe`, equally often.
pub(super) const MEASURED: [Part; 5] = [COSINE, lobe(0.3), lobe(0.1), lobe(0.03), lobe(0.01)];

/// The distributions that test pairs are of, and their shares in 32nds, powers of two as Sobol points want them. They are near those
/// that minimise how many pairs the averages of reconstructions of measured tables and of narrow formulas need (variances of mixtures:
/// Owen & Zhou 2000, *Safe and effective importance sampling*).
pub(super) const MIXTURE: [(Part, usize); 14] = [
    (COSINE, 2),
    (uniform(Lights::Views), 8),
    (uniform(Lights::HalfVector(0.3)), 1),
    (uniform(Lights::HalfVector(0.1)), 4),
    (uniform(Lights::HalfVector(0.03)), 4),
    (uniform(Lights::HalfVector(0.01)), 4),
    (uniform(Lights::HalfVector(0.003)), 2),
    (uniform(Lights::HalfVector(0.001)), 1),
    (uniform(Lights::Half(0.1)), 1),
    (uniform(Lights::Half(0.03)), 1),
    (uniform(Lights::Half(0.01)), 1),
    (uniform(Lights::Back(0.1)), 1),
    (uniform(Lights::Back(0.03)), 1),
    (uniform(Lights::Back(0.01)), 1),
];

/// Both directions cosine-distributed.
const COSINE: Part = Part {
    views: Views::Cosine,
    lights: Lights::Views,
};

/// omega_o cosine-distributed, half vectors of GGX.
const fn lobe(alpha: f64) -> Part {
    Part {
        views: Views::Cosine,
        lights: Lights::HalfVector(alpha),
    }
}

const fn uniform(lights: Lights) -> Part {
    Part {
        views: Views::Uniform,
        lights,
    }
}

/// A distribution of pairs.
#[derive(Clone, Copy)]
pub(super) struct Part {
    views: Views,
    lights: Lights,
}

/// Distribution of omega_o inside the mask: density ∝ cos θ_o, or uniform in solid angle.
#[derive(Clone, Copy)]
enum Views {
    Cosine,
    Uniform,
}

/// Distribution of omega_i, given omega_o.
#[derive(Clone, Copy)]
enum Lights {
    /// That of omega_o, independent of it.
    Views,
    /// Half vectors with density D(θ_h) cos θ_h of GGX, alpha.
    HalfVector(f64),
    /// |h_bar| with density s² / (π (s² + |h_bar|²)²).
    Half(f64),
    /// The same of |k_bar|.
    Back(f64),
}

impl Views {
    fn direction(self, u: [f64; 2], window: &Window) -> Direction {
        match self {
            Views::Cosine => cosine_hemisphere([u[0] * window.sin2_mask, u[1]]),
            Views::Uniform => {
                let cos = 1.0 - u[0] * (1.0 - window.cos_mask);
                let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
                let (s, c) = (TAU * u[1]).sin_cos();
                Direction::from_unit(glam::DVec3::new(sin * c, sin * s, cos))
            }
        }
    }

    /// Density, sr⁻¹.
    fn density(self, cos: f64, window: &Window) -> f64 {
        match self {
            Views::Cosine => cos * FRAC_1_PI / window.sin2_mask,
            Views::Uniform => 1.0 / (TAU * (1.0 - window.cos_mask)),
        }
    }
}

impl Part {
    /// A candidate from a point of the unit cube; `None` if there is no such pair.
    pub(crate) fn candidate(self, u: [f64; 4], window: &Window) -> Option<DirectionPair> {
        let omega_o = self.views.direction([u[0], u[1]], window);
        // omega_i at the point of the unit disc that the sensor's is taken to.
        let offset = |scale: f64, sign: f64| {
            let (sin, cos) = (TAU * u[3]).sin_cos();
            let v = u[2] * window.sin2_mask / (scale * scale + window.sin2_mask);
            let radius = scale * (v / (1.0 - v)).sqrt();
            let at = 2.0 * radius * DVec2::new(cos, sin) + sign * omega_o.vector().truncate();
            let sin2 = at.length_squared();
            (sin2 < 1.0).then(|| Direction::from_unit(at.extend((1.0 - sin2).sqrt())))
        };
        let omega_i = match self.lights {
            Lights::Views => self.views.direction([u[2], u[3]], window),
            Lights::HalfVector(alpha) => {
                let h = ggx_half_vector(alpha, [u[2] * window.share(alpha), u[3]]).vector();
                Direction::from_unit(2.0 * omega_o.vector().dot(h) * h - omega_o.vector())
            }
            Lights::Half(scale) => offset(scale, -1.0)?,
            Lights::Back(scale) => offset(scale, 1.0)?,
        };
        Some(DirectionPair::new(omega_i, omega_o))
    }

    /// Density of the candidates inside the mask, sr⁻².
    pub(crate) fn density(self, facts: &Facts, window: &Window) -> f64 {
        let [cos_i, cos_o] = facts.cos;
        // Of a point of the disc; a point of omega_i's disc is four of them, and cos θ_i of a steradian.
        let offset = |scale: f64, r2: f64| {
            let s2 = scale * scale;
            let share = window.sin2_mask / (s2 + window.sin2_mask);
            s2 * FRAC_1_PI / ((s2 + r2) * (s2 + r2)) / share * 0.25 * cos_i
        };
        let lights = match self.lights {
            Lights::Views => self.views.density(cos_i, window),
            Lights::HalfVector(alpha) => {
                let normals = ggx_half_vector_pdf(alpha, facts.half) / window.share(alpha);
                normals / (4.0 * facts.cos_d)
            }
            Lights::Half(scale) => offset(scale, facts.half2),
            Lights::Back(scale) => offset(scale, facts.back2),
        };
        self.views.density(cos_o, window) * lights
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
