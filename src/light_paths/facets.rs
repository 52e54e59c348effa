//! What a single facet does to light.

use crate::brdf::microfacet::fresnel::{self, Fresnel, FresnelSpec};
use crate::brdf::{
    self, Brdf, BrdfSpec, BuildError, ChannelValues, Channels, Favours, Part, Spectrum, Tables,
    laws,
};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair};
use crate::registry::{self, Entry, ReadError, Table, keys, only};
use crate::sampling::{RandomStream, cosine_hemisphere, cosine_hemisphere_pdf};
use glam::{DMat3, DVec3};
use smallvec::smallvec;
use std::f64::consts::FRAC_1_PI;
use std::sync::Arc;

const MIRROR: Entry<FacetsSpec> = Entry {
    kind: "mirror",
    summary: "mirrors; fresnel, the table of a Fresnel term, says how much they reflect",
    examples: &["", "fresnel = { kind = \"none\" }"],
    read: |mut table| {
        let term = fresnel::take(&mut table)?;
        only!(table, "fresnel")?;
        Ok(Box::new(FacetsSpec::Mirror(term)))
    },
};

const DIFFUSE: Entry<FacetsSpec> = Entry {
    kind: "diffuse",
    summary: "Lambertian facets of some albedo",
    examples: &["albedo = 0.8"],
    read: |table| Ok(Box::new(FacetsSpec::Diffuse(registry::parse(table)?))),
};

const MATERIAL: Entry<FacetsSpec> = Entry {
    kind: "material",
    summary: "facets of the material that its table brdf names, in the frame of each facet; an isotropic one",
    examples: &["brdf = { kind = \"ggx\", alpha = 0.2 }"],
    read: |mut table| {
        let span = table.span();
        let spec = registry::take_table(&mut table, "brdf")?;
        only!(table, "brdf")?;
        let Some(spec) = spec else {
            let message =
                "brdf is missing from the facets; allowed: a table with a kind of material";
            return Err(ReadError::new(span, message));
        };
        Ok(Box::new(FacetsSpec::Material(brdf::read(spec)?.into())))
    },
};

/// Every kind of facet that a config can name.
pub fn all() -> Vec<Entry<FacetsSpec>> {
    vec![MIRROR, DIFFUSE, MATERIAL]
}

/// Reads facets from their config table.
pub fn read(table: Table<'_>) -> Result<FacetsSpec, ReadError> {
    registry::read("facet", &all(), table).map(|spec| *spec)
}

/// Takes the facets of a table of another kind out of it; the usual ones by default.
pub(super) fn take(table: &mut Table<'_>) -> Result<FacetsSpec, ReadError> {
    Ok(registry::take(table, "facets", read)?.unwrap_or_default())
}

/// Facets, as a config writes them.
#[derive(Clone, Debug)]
pub enum FacetsSpec {
    /// Mirrors.
    Mirror(FresnelSpec),
    /// Lambertian ones.
    Diffuse(DiffuseSpec),
    /// Those of a material, isotropic.
    Material(Arc<dyn BrdfSpec>),
}

/// By what a config would write.
impl PartialEq for FacetsSpec {
    fn eq(&self, other: &Self) -> bool {
        self.resolved() == other.resolved()
    }
}

keys! {
    /// Lambertian facets.
    #[derive(PartialEq)]
    pub struct DiffuseSpec(channels: &Channels) {
        /// Their albedo.
        albedo: Spectrum = Spectrum::Grey(0.5), in 0.0..=1.0;
    }
}

impl Default for FacetsSpec {
    fn default() -> Self {
        FacetsSpec::Mirror(FresnelSpec::default())
    }
}

impl FacetsSpec {
    /// The kind and every key with its value.
    pub fn resolved(&self) -> registry::Keys {
        match self {
            FacetsSpec::Mirror(fresnel) => {
                registry::nested(MIRROR.kind, "fresnel", fresnel.resolved())
            }
            FacetsSpec::Diffuse(spec) => registry::resolved(DIFFUSE.kind, spec),
            FacetsSpec::Material(spec) => registry::nested(MATERIAL.kind, "brdf", spec.resolved()),
        }
    }

    /// A piece of a material's label, e.g. `diffuse-0.8`; the usual conductor goes without saying.
    pub(crate) fn label(&self) -> Option<String> {
        match self {
            FacetsSpec::Mirror(fresnel) if *fresnel == FresnelSpec::default() => None,
            FacetsSpec::Mirror(fresnel) => Some(fresnel.label()),
            FacetsSpec::Diffuse(spec) => Some(format!("{}-{}", DIFFUSE.kind, spec.albedo)),
            FacetsSpec::Material(spec) => Some(spec.label()),
        }
    }

    /// A material's label with those of its facets and of the light that is asked for.
    pub(super) fn labelled(&self, mut label: String, bounces: Part) -> String {
        if let Some(facets) = self.label() {
            label += &format!("-{facets}");
        }
        if bounces != Part::All {
            label += &format!("-{bounces}");
        }
        label
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter outside its range, or a file that cannot be used.
    pub fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        match self {
            FacetsSpec::Mirror(fresnel) => fresnel.check(channels).map_err(BuildError::from),
            FacetsSpec::Diffuse(spec) => spec.check_keys(channels).map_err(BuildError::from),
            FacetsSpec::Material(spec) => {
                let within = |e: BuildError| e.within("brdf");
                spec.check(channels).map_err(within)?;
                let error =
                    || ParameterError::new("brdf", spec.label(), "an isotropic material").into();
                let symmetry = spec.symmetry(channels).map_err(within)?;
                symmetry.isotropic.then_some(()).ok_or_else(error)
            }
        }
        .map_err(|e| e.within("facets"))
    }

    /// The files they read and the tables they hold.
    pub(super) fn tables(&self) -> Tables {
        match self {
            FacetsSpec::Material(spec) => spec.tables(),
            _ => Tables::NONE,
        }
    }

    /// Coordinates that light of facets favours: that of one mirror goes with the density of half vectors.
    pub(super) fn favours(&self, bounces: Part) -> Favours {
        match (self, bounces) {
            (FacetsSpec::Mirror(_), Part::All | Part::First) => Favours::HalfAngle,
            _ => Favours::Neither,
        }
    }

    /// Number of values that differ in a scene of `channels`.
    pub(super) fn distinct(&self, channels: &Channels) -> usize {
        match self {
            FacetsSpec::Mirror(fresnel) => fresnel.distinct(channels),
            FacetsSpec::Diffuse(spec) => spec.albedo.distinct(channels),
            // Of a table it is not known before it is read.
            FacetsSpec::Material(_) => 3,
        }
    }
}

/// Largest albedo of a material of facets: tables stray by a few percent; of more, each further facet would add light.
const MOST: f64 = 1.05;

/// Facets ready for a scene's channels.
#[derive(Clone)]
pub(super) enum Facets {
    Mirror(Fresnel),
    /// Albedo of each channel.
    Diffuse(ChannelValues),
    Material(Arc<dyn Brdf>),
}

impl Facets {
    /// Those of a `spec`.
    pub(super) fn new(spec: &FacetsSpec, channels: &Channels) -> Result<Self, BuildError> {
        Ok(match spec {
            FacetsSpec::Mirror(fresnel) => Facets::Mirror(Fresnel::new(fresnel, channels)),
            FacetsSpec::Diffuse(spec) => Facets::Diffuse(spec.albedo.linear(channels).into()),
            FacetsSpec::Material(spec) => {
                let brdf = spec.build(channels.clone())?;
                if !brdf.conserves_energy() {
                    // Near the horizon tables say little.
                    let mut views = laws::standard_views(true);
                    views.retain(|view| view.cos_theta() > 0.4);
                    let most = laws::max_albedo(&*brdf, &views);
                    let albedo = most.map_or(0.0, |most| most.albedo.max());
                    if albedo > MOST {
                        let allowed = format!(
                            "a material with an albedo of {MOST} at most up to 65°; this one has {albedo:.3}"
                        );
                        let error = ParameterError::new("facets.brdf", spec.label(), allowed);
                        return Err(error.into());
                    }
                }
                Facets::Material(brdf.into())
            }
        })
    }

    /// True if no facet sends more light than it receives, by construction.
    pub(super) fn conserve_energy(&self) -> bool {
        match self {
            Facets::Mirror(_) | Facets::Diffuse(_) => true,
            Facets::Material(brdf) => brdf.conserves_energy(),
        }
    }

    /// f_r of a facet of that normal, sr⁻¹; 0 of mirrors, where data is missing, and below the facet.
    #[inline]
    pub(super) fn value(&self, from: DVec3, to: DVec3, normal: DVec3, out: &mut [f64]) {
        out.fill(0.0);
        match self {
            Facets::Mirror(_) => {}
            Facets::Diffuse(albedo) => {
                out.iter_mut()
                    .zip(albedo)
                    .for_each(|(o, a)| *o = a * FRAC_1_PI);
            }
            Facets::Material(brdf) => {
                let frame = frame(normal);
                if let [Some(from), Some(to)] = [from, to].map(|v| seen_in(&frame, v)) {
                    _ = brdf.eval(&DirectionPair::new(from, to), out);
                }
            }
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
                frame(normal) * local
            }
            Facets::Material(brdf) => {
                let frame = frame(normal);
                let u = [random.next(), random.next()];
                let mut share: ChannelValues = smallvec![0.0; weight.len()];
                let mut next = normal;
                if let Some(back) = seen_in(&frame, back) {
                    // Drawn as the light of a sensor there, and weighted as what it is.
                    let drawn = match brdf.as_sample() {
                        Some(sampler) => sampler
                            .sample(back, u)
                            .map(|drawn| (drawn, sampler.pdf(&DirectionPair::new(drawn, back)))),
                        None => Some(cosine_hemisphere(u)).map(|d| (d, cosine_hemisphere_pdf(d))),
                    };
                    if let Some((drawn, density)) = drawn {
                        _ = brdf.eval(&DirectionPair::new(back, drawn), &mut share);
                        let scale = match density > 0.0 {
                            true => drawn.cos_theta() / density,
                            false => 0.0,
                        };
                        share.iter_mut().for_each(|s| *s *= scale);
                        next = frame * drawn.vector();
                    }
                }
                weight.iter_mut().zip(&share).for_each(|(w, s)| *w *= s);
                next
            }
        };
        next.normalize()
    }
}

/// Axes of a facet: any tangents, and its normal.
#[inline]
fn frame(normal: DVec3) -> DMat3 {
    let (t, b) = normal.any_orthonormal_pair();
    DMat3::from_cols(t, b, normal)
}

/// A unit vector as a facet of that frame sees it.
#[inline]
fn seen_in(frame: &DMat3, v: DVec3) -> Option<Direction> {
    Direction::try_new(frame.transpose() * v)
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
