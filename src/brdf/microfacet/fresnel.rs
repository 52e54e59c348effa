//! Reflectance of a smooth facet for unpolarised light, as a function of c = cos θ_d.
//!
//! | kind | equation | parameters |
//! |---|---|---|
//! | `conductor` | exact, complex index η + iκ | `eta` in [1e-3, 1e3], `kappa` in [0, 1e3] |
//! | `dielectric` | exact, real index | `ior` in [1, 1e3], light arriving from the thinner side |
//! | `schlick` | f0 + (1 − f0)(1 − c)⁵ (Schlick 1994) | `f0` in [0, 1] |
//! | `none` | 1 | none |
//!
//! Every parameter is grey, R, G, B or a sampled spectrum. F is in [0, 1] and 1 at c = 0 (but for
//! ior = 1, where it is 0). Grey indices cost one evaluation in any channels, Schlick's F is linear in
//! f0 and costs one in luminance; coloured indices cost three, and luminance is taken of the result;
//! sampled ones cost one a wavelength.

use crate::brdf::spectrum::{planes, spread};
use crate::brdf::{Channels, Spectrum};
use crate::error::ParameterError;
use crate::numeric::DENOMINATOR_FLOOR;
use crate::registry::{self, Entry, NoKeys, ReadError, Table, keys};

const CONDUCTOR: Entry<FresnelSpec> = Entry {
    kind: "conductor",
    summary: "metal of complex index eta + i kappa",
    examples: &[
        "eta = 0.2\nkappa = 3.0",
        "eta = [0.14, 0.38, 1.44]\nkappa = [3.98, 2.39, 1.6]",
    ],
    read: |table| Ok(Box::new(FresnelSpec::Conductor(registry::parse(table)?))),
};

const DIELECTRIC: Entry<FresnelSpec> = Entry {
    kind: "dielectric",
    summary: "glass, lacquer or plastic of real index ior",
    examples: &["ior = 1.5"],
    read: |table| Ok(Box::new(FresnelSpec::Dielectric(registry::parse(table)?))),
};

const SCHLICK: Entry<FresnelSpec> = Entry {
    kind: "schlick",
    summary: "Schlick's approximation from the reflectance f0 at the normal",
    examples: &["f0 = 0.04", "f0 = [1.0, 0.8, 0.3]"],
    read: |table| Ok(Box::new(FresnelSpec::Schlick(registry::parse(table)?))),
};

const NONE: Entry<FresnelSpec> = Entry {
    kind: "none",
    summary: "perfect mirrors, F = 1",
    examples: &[""],
    read: |table| {
        registry::parse::<NoKeys>(table)?;
        Ok(Box::new(FresnelSpec::None))
    },
};

/// Every Fresnel term a config can name.
pub fn all() -> Vec<Entry<FresnelSpec>> {
    vec![CONDUCTOR, DIELECTRIC, SCHLICK, NONE]
}

/// Reads a Fresnel term from its config table.
pub fn read(table: Table<'_>) -> Result<FresnelSpec, ReadError> {
    registry::read("fresnel term", &all(), table).map(|spec| *spec)
}

/// Takes the term of another table out of it; the usual one if it names none.
pub(crate) fn take(table: &mut Table<'_>) -> Result<FresnelSpec, ReadError> {
    Ok(registry::take(table, "fresnel", read)?.unwrap_or_default())
}

/// A Fresnel term, as a config writes it.
#[derive(Clone, Debug, PartialEq)]
pub enum FresnelSpec {
    /// Exact reflectance of a metal.
    Conductor(ConductorSpec),
    /// Exact reflectance of a transparent medium.
    Dielectric(DielectricSpec),
    /// Schlick's approximation.
    Schlick(SchlickSpec),
    /// F = 1.
    None,
}

keys! {
    /// Complex index of a metal, relative to air.
    #[derive(PartialEq)]
    pub struct ConductorSpec(channels: &Channels) {
        /// Real part.
        eta: Spectrum = Spectrum::Grey(0.2), in 1e-3..=1e3;
        /// Imaginary part (extinction).
        kappa: Spectrum = Spectrum::Grey(3.0), in 0.0..=1e3;
    }
}

keys! {
    /// Real index, relative to air.
    #[derive(PartialEq)]
    pub struct DielectricSpec(channels: &Channels) {
        /// Index of refraction.
        ior: Spectrum = Spectrum::Grey(1.5), in 1.0..=1e3;
    }
}

keys! {
    /// Schlick's parameter.
    #[derive(PartialEq)]
    pub struct SchlickSpec(channels: &Channels) {
        /// Reflectance at the normal.
        f0: Spectrum = Spectrum::Grey(0.04), in 0.0..=1.0;
    }
}

impl Default for FresnelSpec {
    fn default() -> Self {
        FresnelSpec::Conductor(ConductorSpec::default())
    }
}

impl FresnelSpec {
    /// The kind and every key with its value.
    pub fn resolved(&self) -> registry::Keys {
        match self {
            FresnelSpec::Conductor(spec) => registry::resolved(CONDUCTOR.kind, spec),
            FresnelSpec::Dielectric(spec) => registry::resolved(DIELECTRIC.kind, spec),
            FresnelSpec::Schlick(spec) => registry::resolved(SCHLICK.kind, spec),
            FresnelSpec::None => registry::resolved(NONE.kind, &NoKeys {}),
        }
    }

    /// A piece of a material's label, e.g. `dielectric-1.5`.
    pub(crate) fn label(&self) -> String {
        match self {
            FresnelSpec::Conductor(s) => format!("{}-{}-{}", CONDUCTOR.kind, s.eta, s.kappa),
            FresnelSpec::Dielectric(s) => format!("{}-{}", DIELECTRIC.kind, s.ior),
            FresnelSpec::Schlick(s) => format!("{}-{}", SCHLICK.kind, s.f0),
            FresnelSpec::None => NONE.kind.into(),
        }
    }

    /// How many different values there are to work out: 1 if grey, else one a colour or wavelength.
    pub(crate) fn distinct(&self, channels: &Channels) -> usize {
        match self {
            FresnelSpec::Conductor(s) => s.eta.distinct(channels).max(s.kappa.distinct(channels)),
            FresnelSpec::Dielectric(s) => s.ior.distinct(channels),
            FresnelSpec::Schlick(s) => s.f0.distinct(channels),
            FresnelSpec::None => 1,
        }
    }

    /// Checks every parameter.
    pub fn check(&self, channels: &Channels) -> Result<(), ParameterError> {
        let checked = match self {
            FresnelSpec::Conductor(s) => s.check_keys(channels),
            FresnelSpec::Dielectric(s) => s.check_keys(channels),
            FresnelSpec::Schlick(s) => s.check_keys(channels),
            FresnelSpec::None => Ok(()),
        };
        checked.map_err(|e| e.within("fresnel"))
    }
}

/// A Fresnel term ready to be evaluated in a scene's channels.
#[derive(Clone, Debug)]
pub struct Fresnel(Law);

/// One entry if it is grey, else one a colour or wavelength.
#[derive(Clone, Debug)]
enum Law {
    /// (η² − κ², 4η²κ²).
    Conductor(Vec<[f64; 2]>),
    /// ior² − 1.
    Dielectric(Vec<f64>),
    Schlick(Vec<f64>),
    One,
}

impl Fresnel {
    /// The term of a checked `spec`.
    pub(crate) fn new(spec: &FresnelSpec, channels: &Channels) -> Self {
        Self(match spec {
            FresnelSpec::Conductor(s) => {
                let squares = planes([&s.eta, &s.kappa], channels)
                    .map(|both| both.map(|index| index * index));
                Law::Conductor(squares.map(|[e2, k2]| [e2 - k2, 4.0 * e2 * k2]).collect())
            }
            FresnelSpec::Dielectric(s) => {
                let indices = planes([&s.ior], channels);
                Law::Dielectric(indices.map(|[ior]| excess(ior)).collect())
            }
            FresnelSpec::Schlick(s) => Law::Schlick(match s.f0 {
                Spectrum::Grey(_) => vec![s.f0.linear(channels)[0]],
                _ => s.f0.linear(channels),
            }),
            FresnelSpec::None => Law::One,
        })
    }

    /// Writes `factor · F(cos_d)` for each channel of each factor and cosine.
    #[inline(always)]
    pub(crate) fn scale(&self, cos_d: &[f64], factors: &[f64], out: &mut [f64]) {
        match &self.0 {
            Law::Conductor(indices) => each(indices, cos_d, factors, out, conductor),
            Law::Dielectric(excess) => each(excess, cos_d, factors, out, dielectric),
            Law::Schlick(f0) => each(f0, cos_d, factors, out, |f0, cos_d| {
                let w = 1.0 - cos_d;
                f0 + (1.0 - f0) * (w * w * w * w * w)
            }),
            Law::One => each(&[()], cos_d, factors, out, |(), _| 1.0),
        }
    }
}

/// Writes `factor · law(constants, cos_d)` for each channel of each factor and cosine.
#[inline(always)]
fn each<T: Copy>(
    constants: &[T],
    cos_d: &[f64],
    factors: &[f64],
    out: &mut [f64],
    law: impl Fn(T, f64) -> f64,
) {
    let channels = out.len() / factors.len();
    let arguments = cos_d.iter().zip(factors);
    if let (&[of], 1) = (constants, channels) {
        for ((c, factor), out) in arguments.zip(out) {
            *out = factor * law(of, *c);
        }
    } else {
        for ((c, factor), out) in arguments.zip(out.chunks_exact_mut(channels)) {
            spread(constants.len(), out, |i| factor * law(constants[i], *c));
        }
    }
}

/// ior² − 1, without the cancellation near 1: the parameter of [`dielectric`].
#[inline]
pub(crate) fn excess(ior: f64) -> f64 {
    (ior - 1.0) * (ior + 1.0)
}

/// F of a conductor, from (η² − κ², 4η²κ²).
///
/// With a² + b² = sqrt((η² − κ² − s²)² + 4η²κ²), s = sin θ_d: R_s = (t1 − t2)/(t1 + t2),
/// R_p = R_s (t3 − t4)/(t3 + t4), and their mean is R_s t3/(t3 + t4), one division.
#[inline(always)]
fn conductor([e2k2, e2k2_4]: [f64; 2], c: f64) -> f64 {
    let c2 = c * c;
    let s2 = (1.0 - c2).max(0.0);
    let t0 = e2k2 - s2;
    let a2b2 = (t0 * t0 + e2k2_4).sqrt();
    // a² = (a² + b² + t0)/2, which cancels where t0 < 0: there it is 2η²κ² over the sum with −t0.
    let sum = a2b2 + t0.abs();
    let a2 = if t0 < 0.0 { e2k2_4 / sum } else { sum };
    let a = (0.5 * a2).sqrt();
    let (t1, t2) = (a2b2 + c2, 2.0 * c * a);
    let (t3, t4) = (c2 * a2b2 + s2 * s2, t2 * s2);
    (t1 - t2).max(0.0) * t3 / ((t1 + t2) * (t3 + t4))
}

/// F of a dielectric, from ior² − 1: with g² = ior² − 1 + c²,
/// F = ½ ((g − c)/(g + c))² (1 + ((c(g + c) − 1)/(c(g − c) + 1))²), where g − c = (ior² − 1)/(g + c).
#[inline(always)]
pub(crate) fn dielectric(excess: f64, c: f64) -> f64 {
    // At c = 0 and ior = 1 both g and c vanish and no reflectance is defined: the floor makes it 0.
    let c = c.max(DENOMINATOR_FLOOR);
    let sum = (excess + c * c).sqrt() + c;
    let difference = excess / sum;
    let s = difference / sum;
    let p = (c * sum - 1.0) / (c * difference + 1.0);
    0.5 * s * s * (1.0 + p * p)
}
