//! What a single facet does to light.

use crate::brdf::microfacet::fresnel::{self, Fresnel, FresnelSpec};
use crate::brdf::{ChannelValues, Channels, Spectrum};
use crate::error::ParameterError;
use crate::registry::{self, Entry, ReadError, Table};
use crate::sampling::{RandomStream, cosine_hemisphere};
use glam::DVec3;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use smallvec::smallvec;

const MIRROR: Entry<FacetsSpec> = Entry {
    kind: "mirror",
    summary: "mirrors; fresnel, the table of a Fresnel term, says how much they reflect",
    examples: &["", "fresnel = { kind = \"none\" }"],
    read: read_mirror,
};

const DIFFUSE: Entry<FacetsSpec> = Entry {
    kind: "diffuse",
    summary: "Lambertian facets of some albedo",
    examples: &["albedo = 0.8"],
    read: |table| Ok(Box::new(FacetsSpec::Diffuse(registry::parse(table)?))),
};

/// Every kind of facet that a config can name.
pub fn all() -> Vec<Entry<FacetsSpec>> {
    vec![MIRROR, DIFFUSE]
}

/// Reads facets from their config table.
pub fn read(table: Table<'_>) -> Result<FacetsSpec, ReadError> {
    registry::read("facet", &all(), table).map(|spec| *spec)
}

/// Facets, as a config writes them.
#[derive(Clone, Debug, PartialEq)]
pub enum FacetsSpec {
    /// Mirrors.
    Mirror(FresnelSpec),
    /// Lambertian ones.
    Diffuse(DiffuseSpec),
}

/// Lambertian facets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DiffuseSpec {
    /// Their albedo in [0, 1].
    pub albedo: Spectrum,
}

impl Default for DiffuseSpec {
    fn default() -> Self {
        Self {
            albedo: Spectrum::Grey(0.5),
        }
    }
}

impl Default for FacetsSpec {
    fn default() -> Self {
        FacetsSpec::Mirror(FresnelSpec::default())
    }
}

/// The only key, taken out before; listed for the message about an unknown one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MirrorKeys {
    #[serde(rename = "fresnel")]
    _fresnel: Option<IgnoredAny>,
}

fn read_mirror(mut table: Table<'_>) -> Result<Box<FacetsSpec>, ReadError> {
    let term = match registry::take_table(&mut table, "fresnel")? {
        Some(table) => fresnel::read(table)?,
        None => FresnelSpec::default(),
    };
    let MirrorKeys { .. } = registry::parse(table)?;
    Ok(Box::new(FacetsSpec::Mirror(term)))
}

impl FacetsSpec {
    /// The kind and every key with its value.
    pub fn resolved(&self) -> registry::Keys {
        match self {
            FacetsSpec::Mirror(fresnel) => {
                let mut keys = registry::Keys::new();
                keys.insert("kind".into(), MIRROR.kind.into());
                keys.insert("fresnel".into(), fresnel.resolved().into());
                keys
            }
            FacetsSpec::Diffuse(spec) => registry::resolved(DIFFUSE.kind, spec),
        }
    }

    /// A piece of a material's label, e.g. `diffuse-0.8`; the usual conductor goes without saying.
    pub fn label(&self) -> Option<String> {
        match self {
            FacetsSpec::Mirror(fresnel) if *fresnel == FresnelSpec::default() => None,
            FacetsSpec::Mirror(fresnel) => Some(fresnel.label()),
            FacetsSpec::Diffuse(spec) => Some(format!("{}-{}", DIFFUSE.kind, spec.albedo)),
        }
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter outside its range.
    pub fn check(&self, channels: &Channels) -> Result<(), ParameterError> {
        match self {
            FacetsSpec::Mirror(fresnel) => fresnel.check(channels),
            FacetsSpec::Diffuse(spec) => spec.albedo.check("albedo", 0.0, 1.0, channels),
        }
        .map_err(|mut e| {
            e.key = format!("facets.{}", e.key);
            e
        })
    }

    /// True if they have a colour that a scene in `channels` can see.
    pub(super) fn distinct(&self, channels: &Channels) -> usize {
        match self {
            FacetsSpec::Mirror(fresnel) => fresnel.distinct(channels),
            FacetsSpec::Diffuse(spec) => spec.albedo.distinct(channels),
        }
    }
}

/// Facets ready for a scene's channels.
#[derive(Clone, Debug)]
pub(super) enum Facets {
    Mirror(Fresnel),
    /// Albedo of each channel.
    Diffuse(ChannelValues),
}

impl Facets {
    /// Those of a checked `spec`.
    pub(super) fn new(spec: &FacetsSpec, channels: &Channels) -> Self {
        match spec {
            FacetsSpec::Mirror(fresnel) => Facets::Mirror(Fresnel::new(fresnel, channels)),
            FacetsSpec::Diffuse(spec) => Facets::Diffuse(spec.albedo.linear(channels).into()),
        }
    }

    /// Where light goes that comes from `back`, drawn at a facet of that normal, and what the facet leaves of `weight`.
    #[inline]
    pub(super) fn scatter(
        &self,
        back: DVec3,
        normal: DVec3,
        weight: &mut ChannelValues,
        random: &mut RandomStream,
    ) -> DVec3 {
        let next = match self {
            Facets::Mirror(fresnel) => {
                let cos_d = back.dot(normal).clamp(0.0, 1.0);
                let mut share: ChannelValues = smallvec![0.0; weight.len()];
                fresnel.scale(&[cos_d], &[1.0], &mut share);
                weight.iter_mut().zip(&share).for_each(|(w, s)| *w *= s);
                2.0 * cos_d * normal - back
            }
            Facets::Diffuse(albedo) => {
                weight.iter_mut().zip(albedo).for_each(|(w, a)| *w *= a);
                let local = cosine_hemisphere([random.next(), random.next()]).vector();
                let (t, b) = normal.any_orthonormal_pair();
                t * local.x + b * local.y + normal * local.z
            }
        };
        next.normalize()
    }
}

/// Russian roulette: false if chance ends the path; else its `weight` makes up for those that it ended.
#[inline]
pub(super) fn survives(weight: &mut ChannelValues, random: &mut RandomStream) -> bool {
    let most = weight.iter().copied().fold(0.0, f64::max).min(1.0);
    if random.next() >= most {
        return false;
    }
    weight.iter_mut().for_each(|w| *w /= most);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_example_reads_and_resolves_to_itself() {
        for entry in all() {
            for example in entry.examples {
                let spec = registry::read_text(&entry, example).unwrap();
                spec.check(&Channels::Luminance).unwrap();
                let again = registry::read_keys("facet", &all(), spec.resolved()).unwrap();
                assert_eq!(again, spec, "{}", entry.kind);
            }
        }
    }
}
