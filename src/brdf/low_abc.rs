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

use super::half_vector::half_above;
use super::microfacet::fresnel;
use super::spectrum::scaled;
use super::{Brdf, BrdfSpec, BuildError, Channels, Favours, Presence, Roughness, Spectrum, Tables};
use crate::error::in_closed;
use crate::geometry::{DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use crate::registry::{self, Entry, ReadError, Table};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::f64::consts::FRAC_1_PI;

/// The microfacet model.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: "low-abc",
    summary: "ABC microfacet model of Löw et al. 2012",
    examples: &[
        "k_d = [0.150463, 0.080224, 0.022239]\na = [1.010258, 0.811582, 0.504538]\nb = 46.942558\nc = 1.75667\nior = 7.93611",
        "k_d = 0.0017\na = 800.0\nb = 64661.0\nc = 1.9\nior = 99.9",
    ],
    read: |table| read(table, Surface::Microfacet),
};

/// The smooth-surface model.
pub const SMOOTH: Entry<dyn BrdfSpec> = Entry {
    kind: "low-abc-smooth",
    summary: "ABC smooth-surface model of Löw et al. 2012, a function of |h_bar|",
    examples: &[
        "k_d = 0.1\na = 5.0\nb = 300.0\nc = 1.5\nior = 1.6",
        "k_d = [0.2, 0.1, 0.05]\na = [2.0, 1.5, 1.0]\nb = 30.0\nc = 1.0\nior = 3.0",
        "k_d = 0.1\na = 2.0\nb = [30.0, 300.0]\nc = 1.2\nior = 1.6",
    ],
    read: |table| read(table, Surface::Smooth),
};

fn read(table: Table<'_>, surface: Surface) -> Result<Box<dyn BrdfSpec>, ReadError> {
    let parameters = registry::parse(table)?;
    Ok(Box::new(LowAbcSpec {
        surface,
        parameters,
    }))
}

/// Kind of surface: one of the two models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// Facets: a function of θ_h, with shadowing.
    Microfacet,
    /// A smooth surface that diffracts: a function of |h̄|.
    Smooth,
}

/// An ABC model, as a config writes it.
#[derive(Clone, Debug)]
pub struct LowAbcSpec {
    /// Kind of surface: microfacets, or smooth.
    pub surface: Surface,
    /// Its parameters.
    pub parameters: LowAbcParameters,
}

/// The parameters of either model; the defaults are the published microfacet fit to MERL's gold-paint.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LowAbcParameters {
    /// Diffuse albedo in [0, 1].
    pub k_d: Spectrum,
    /// Height of the peak, 0 or more.
    pub a: Spectrum,
    /// Inverse squared width of the peak, 0 or more; one number or [along t, along b].
    #[serde(deserialize_with = "inverse_width")]
    pub b: Roughness,
    /// Fall-off of the tail, 0 to 100.
    pub c: f64,
    /// Index of refraction, 1 to 1000.
    pub ior: f64,
}

impl Default for LowAbcParameters {
    fn default() -> Self {
        Self {
            k_d: Spectrum::Rgb([0.150463, 0.080224, 0.022239]),
            a: Spectrum::Rgb([1.010258, 0.811582, 0.504538]),
            b: Roughness::Isotropic(46.942558),
            c: 1.75667,
            ior: 7.93611,
        }
    }
}

/// A number or two, with a message of its own.
fn inverse_width<'de, D: Deserializer<'de>>(from: D) -> Result<Roughness, D::Error> {
    Roughness::deserialize(from)
        .map_err(|_| D::Error::custom("b: allowed is a number or two numbers [b_x, b_y]"))
}

impl LowAbcSpec {
    fn kind(&self) -> &'static str {
        match self.surface {
            Surface::Microfacet => ENTRY.kind,
            Surface::Smooth => SMOOTH.kind,
        }
    }
}

impl BrdfSpec for LowAbcSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(self.kind(), &self.parameters)
    }

    fn label(&self) -> String {
        let LowAbcParameters { b, c, .. } = self.parameters;
        format!("{}-{b}-{c}", self.kind())
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        let p = &self.parameters;
        p.k_d.check("k_d", 0.0, 1.0, channels)?;
        // Published fits reach a = 6e3 and b = 8e6; the limits only keep products finite.
        p.a.check("a", 0.0, 1e12, channels)?;
        for b in p.b.xy() {
            in_closed("b", b, 0.0, 1e12)?;
        }
        in_closed("c", p.c, 0.0, 100.0)?;
        in_closed("ior", p.ior, 1.0, 1e3)?;
        Ok(())
    }

    fn favours(&self) -> Favours {
        match self.surface {
            Surface::Microfacet => Favours::HalfAngle,
            Surface::Smooth => Favours::ProjectedHalf,
        }
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        Ok(Box::new(LowAbc::new(
            self.surface,
            &self.parameters,
            channels,
        )))
    }

    fn tables(&self) -> Tables {
        Tables::NONE
    }
}

/// An ABC BRDF.
#[derive(Clone, Debug)]
pub struct LowAbc {
    channels: Channels,
    surface: Surface,
    /// k_d/π.
    diffuse: Vec<f64>,
    /// A/π with facets, A without.
    peak: Vec<f64>,
    /// B along t and along b.
    b: [f64; 2],
    isotropic: bool,
    c: f64,
    /// ior² − 1.
    excess: f64,
}

impl LowAbc {
    /// The BRDF of checked parameters.
    pub fn new(surface: Surface, p: &LowAbcParameters, channels: Channels) -> Self {
        let scale = match surface {
            Surface::Microfacet => FRAC_1_PI,
            Surface::Smooth => 1.0,
        };
        Self {
            surface,
            diffuse: scaled(&p.k_d, &channels, FRAC_1_PI),
            peak: scaled(&p.a, &channels, scale),
            channels,
            b: p.b.xy(),
            isotropic: p.b.is_isotropic(),
            c: p.c,
            excess: fresnel::excess(p.ior),
        }
    }

    /// (1 + B x)^−C.
    #[inline]
    fn fall_off(&self, b_x: f64) -> f64 {
        (-self.c * b_x.ln_1p()).exp()
    }
}

impl Brdf for LowAbc {
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
        let Some((h, cos_d)) = half_above(pair) else {
            out.fill(0.0);
            return Presence::Present;
        };
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
        let lobe = shape * fresnel::dielectric(self.excess, cos_d);
        for ((out, diffuse), peak) in out.iter_mut().zip(&self.diffuse).zip(&self.peak) {
            *out = diffuse + peak * lobe;
        }
        Presence::Present
    }
}
