//! The two ABC models of Löw, Kronander, Ynnerman and Unger (ACM TOG 2012).
//!
//! Microfacet, `low-abc`:
//!
//! f_r = k_d/π + F D G/(π cos θ_i cos θ_o),  D = A/(1 + B (1 − cos θ_h))^C,
//! G = min(1, 2 cos θ_h cos θ_i/cos θ_d, 2 cos θ_h cos θ_o/cos θ_d)   (V-cavities).
//!
//! Smooth surface (after Rayleigh–Rice), `low-abc-smooth`:
//!
//! f_r = k_d/π + F S,  S = A/(1 + B |h̄|²)^C,
//!
//! h̄ the tangent-plane part of the unnormalised half vector: constant along an axis of the orthographic
//! and hybrid parametrizations. The paper writes S with the projected deviation vector D_p = 2 h̄, so
//! its B is a quarter of the one here.
//!
//! B is one number, or one along t and one along b for a surface whose roughness has a direction: B x then is
//! (B_x cos²φ_h + B_y sin²φ_h) x, the spectrum of a surface with elliptical correlation. (The paper's are
//! isotropic.)
//!
//! F is the unpolarised dielectric reflectance at θ_d, whatever the material. k_d in [0, 1] and A ≥ 0 (sr⁻¹ in
//! `low-abc-smooth`) are grey or R, G, B; B ≥ 0, C ≥ 0 and ior ≥ 1 are not, so luminance
//! costs one channel. 1 − cos θ_h is computed as sin²θ_h/(1 + cos θ_h), and
//! G/(cos θ_i cos θ_o) = min(1/(cos θ_i cos θ_o), 2 cos θ_h/(cos θ_d max(cos θ_i, cos θ_o))), finite at the horizon
//! except where h vanishes too (the floor on the denominator holds it there). A is a fitted
//! height, not a normalisation: energy conservation is not declared.

use super::half_vector::unit_half;
use super::microfacet::fresnel;
use super::shape::{Shape, Shaped};
use super::spectrum::Limited;
use super::{Brdf, BrdfSpec, BuildError, Channels, Favours, Roughness, Spectrum};
use crate::geometry::{DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use crate::registry::{self, Entry, keys, named};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use std::f64::consts::FRAC_1_PI;

named! {
    /// Kind of surface: one of the two models.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Surface {
        /// Facets: a function of θ_h, with shadowing.
        Microfacet = "low-abc": "ABC microfacet model of Löw et al. 2012",
        /// A smooth surface that diffracts: a function of |h̄|.
        Smooth = "low-abc-smooth": "ABC smooth-surface model of Löw et al. 2012, a function of |h_bar|",
    }
}

/// The registry entry of model `I` of both.
pub fn entry<const I: usize>() -> Entry<dyn BrdfSpec> {
    Entry {
        kind: Surface::ALL[I].name(),
        summary: Surface::ALL[I].summary(),
        examples: match Surface::ALL[I] {
            Surface::Microfacet => &[
                "k_d = [0.150463, 0.080224, 0.022239]\na = [1.010258, 0.811582, 0.504538]\nb = 46.942558\nc = 1.75667\nior = 7.93611",
                "k_d = 0.0017\na = 800.0\nb = 64661.0\nc = 1.9\nior = 99.9",
            ],
            Surface::Smooth => &[
                "k_d = 0.1\na = 5.0\nb = 300.0\nc = 1.5\nior = 1.6",
                "k_d = [0.2, 0.1, 0.05]\na = [2.0, 1.5, 1.0]\nb = 30.0\nc = 1.0\nior = 3.0",
                "k_d = 0.1\na = 2.0\nb = [30.0, 300.0]\nc = 1.2\nior = 1.6",
            ],
        },
        read: |table| {
            Ok(Box::new(LowAbcSpec {
                surface: Surface::ALL[I],
                parameters: registry::parse(table)?,
            }))
        },
    }
}

/// An ABC model, as a config writes it.
#[derive(Clone, Debug)]
pub struct LowAbcSpec {
    /// Kind of surface: microfacets, or smooth.
    pub surface: Surface,
    /// Its parameters.
    pub parameters: LowAbcParameters,
}

keys! {
    /// The parameters of either model; the defaults are the published microfacet fit to MERL's gold-paint. Published
    /// fits reach a = 6e3 and b = 8e6; the ranges only keep products finite.
    pub struct LowAbcParameters(channels: &Channels) {
        /// Diffuse albedo.
        k_d: Spectrum = Spectrum::Rgb([0.150463, 0.080224, 0.022239]), in 0.0..=1.0;
        /// Height of the peak.
        a: Spectrum = Spectrum::Rgb([1.010258, 0.811582, 0.504538]), in 0.0..=1e12;
        /// Inverse squared width of the peak; one number or [along t, along b].
        #[serde(deserialize_with = "inverse_width")]
        b: Roughness = Roughness::Isotropic(46.942558), in 0.0..=1e12;
        /// Fall-off of the tail.
        c: f64 = 1.75667, in 0.0..=100.0;
        /// Index of refraction.
        ior: f64 = 7.93611, in 1.0..=1e3;
    }
}

/// A number or two, with a message of its own.
fn inverse_width<'de, D: Deserializer<'de>>(from: D) -> Result<Roughness, D::Error> {
    Roughness::deserialize(from)
        .map_err(|_| D::Error::custom("b: allowed is a number or two numbers [b_x, b_y]"))
}

impl BrdfSpec for LowAbcSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(self.surface.name(), &self.parameters)
    }

    fn label(&self) -> String {
        let LowAbcParameters { b, c, .. } = self.parameters;
        format!("{}-{b}-{c}", self.surface.name())
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        Ok(self.parameters.check_keys(channels)?)
    }

    fn favours(&self) -> Favours {
        match self.surface {
            Surface::Microfacet => Favours::HalfAngle,
            Surface::Smooth => Favours::ProjectedHalf,
        }
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        Ok(Box::new(LowAbc::new(self, channels)))
    }
}

/// An ABC BRDF.
pub type LowAbc = Shaped<Abc>;

/// F times the fall-off of a peak of height 1, and G/(cos θ_i cos θ_o) of facets.
#[derive(Clone, Debug)]
pub struct Abc {
    surface: Surface,
    /// B along t and along b.
    b: [f64; 2],
    symmetry: Symmetry,
    c: f64,
    /// ior² − 1.
    excess: f64,
}

impl LowAbc {
    /// The BRDF of a checked spec.
    pub fn new(spec: &LowAbcSpec, channels: Channels) -> Self {
        let (surface, p) = (spec.surface, &spec.parameters);
        let scale = match surface {
            Surface::Microfacet => FRAC_1_PI,
            Surface::Smooth => 1.0,
        };
        let abc = Abc {
            surface,
            b: p.b.xy(),
            symmetry: p.b.symmetry(),
            c: p.c,
            excess: fresnel::excess(p.ior),
        };
        Self::on_base((&p.k_d, FRAC_1_PI), (&p.a, scale), abc, channels)
    }
}

impl Abc {
    /// (1 + B x)^−C.
    #[inline]
    fn fall_off(&self, b_x: f64) -> f64 {
        (-self.c * b_x.ln_1p()).exp()
    }
}

impl Shape for Abc {
    const IS_SAMPLED: bool = false;

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    #[inline]
    fn value(&self, pair: &DirectionPair) -> f64 {
        let (h, cos_d) = unit_half(pair);
        // B sin²θ_h.
        let [b_x, b_y] = self.b;
        let b_sin2 = b_x * (h.x * h.x) + b_y * (h.y * h.y);
        let shape = match self.surface {
            Surface::Microfacet => {
                let (i, o) = (pair.omega_i.cos_theta(), pair.omega_o.cos_theta());
                let valley = 2.0 * h.z / (cos_d * i.max(o)).max(DENOMINATOR_FLOOR);
                let shadowing = valley.min(1.0 / (i * o).max(DENOMINATOR_FLOOR));
                self.fall_off(b_sin2 / (1.0 + h.z)) * shadowing
            }
            Surface::Smooth => self.fall_off(b_sin2 * cos_d * cos_d),
        };
        shape * fresnel::dielectric(self.excess, cos_d)
    }
}
