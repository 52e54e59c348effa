//! Microfacet reflection: many small mirrors with a distribution of normals.
//!
//! f_r = F(θ_d) D(h) G₂(ω_i, ω_o) / (4 cos θ_i cos θ_o)   (Cook and Torrance 1981, Walter et al. 2007),
//!
//! D (sr⁻¹) with ∫ D cos θ_h dω_h = 1, G₂ the height-correlated Smith term 1/(1 + Λ_i + Λ_o) (Heitz 2014),
//! F the Fresnel reflectance of one facet. Roughness 1e-6 to 10, along t and b.
//!
//! Written with m(ω) = cos θ (1 + 2Λ(ω)) = ∫ |ω·m| D(m) dω_m, the area the facets project along ω, seen
//! from both sides,
//!
//! G₂/(4 cos θ_i cos θ_o) = 1/(2 (cos θ_o m(ω_i) + cos θ_i m(ω_o))),
//!
//! which is finite when one direction is on the horizon. When both are, f_r itself diverges and a
//! floor on the denominator keeps it finite. Nothing needs an angle.
//!
//! Energy: G₂ ≤ G₁(ω_o) and ∫ G₁ D ⟨ω_o·m⟩/cos θ_o dω_m = 1 (the weak white furnace), so the albedo is at
//! most 1 for any F ≤ 1; what multiple scattering would return is lost.

mod beckmann;
pub mod fresnel;
mod ggx;

pub use beckmann::{Beckmann, ENTRY as BECKMANN};
pub use fresnel::{Fresnel, FresnelSpec};
pub use ggx::{ENTRY as GGX, Ggx};

use super::half_vector::{half_above, reflect};
use super::{Brdf, BrdfSpec, BuildError, Channels, Favours, Presence, Roughness, SampleBrdf};
use crate::geometry::{BLOCK, Direction, DirectionPair, FEW, PairBlock, Symmetry, half_and_back};
use crate::numeric::angles::scale;
use crate::numeric::{DENOMINATOR_FLOOR, vectorised};
use crate::registry::{self, ReadError, Table, keys};
use crate::sampling::RandomStream;
use glam::DVec3;
use std::marker::PhantomData;

/// A distribution of facet normals, with its projected area and sampling.
pub trait Distribution: Clone + std::fmt::Debug + Send + Sync + 'static {
    /// The `kind` of the model built on it.
    const KIND: &'static str;

    /// Normals of the given roughness.
    fn new(alpha: Roughness) -> Self;

    /// D(h) in sr⁻¹, for a normal of any length whose square is a number, with h_z ≥ 0.
    fn density(&self, h: DVec3) -> f64;

    /// m(ω) = cos θ (1 + 2Λ(ω)), for a unit vector with z ≥ 0.
    fn projected_area(&self, omega: DVec3) -> f64;

    /// σ(ω) = ∫ max(0, ω·m) D(m) dω_m, the area of the facets that are seen from ω, for any unit vector: (m(ω) + z)/2 above
    /// the horizon, and below it what rays that go up meet.
    fn seen_area(&self, omega: DVec3) -> f64;

    /// A normal of the facets that are seen from ω, with density max(0, ω·m) D(m)/σ(ω), for any unit vector with σ(ω) > 0.
    fn visible_normal(&self, omega: DVec3, random: &mut RandomStream) -> DVec3;

    /// A facet normal for the view `omega_o`.
    fn sample_normal(&self, omega_o: DVec3, u: [f64; 2]) -> DVec3;

    /// Density of the direction reflected at [`sample_normal`](Self::sample_normal), per
    /// steradian of omega_i; `cos_d` = ω_o·h.
    fn reflected_pdf(&self, h: DVec3, cos_d: f64, omega_o: DVec3) -> f64;
}

keys! {
    /// The keys of a microfacet model; `fresnel`, a table with a kind of its own, is taken out before.
    struct Keys(channels: &Channels) {
        alpha: Roughness = Roughness::Isotropic(0.3), in Roughness::RANGE;
        #[serde(skip_serializing, deserialize_with = "registry::taken")]
        fresnel: FresnelSpec = FresnelSpec::default();
    }
}

/// A microfacet model, as a config writes it.
#[derive(Clone, Debug)]
pub struct MicrofacetSpec<D>(Keys, PhantomData<fn() -> D>);

impl<D: Distribution> MicrofacetSpec<D> {
    /// Facets of roughness `alpha` and reflectance `fresnel`.
    pub fn new(alpha: Roughness, fresnel: FresnelSpec) -> Self {
        Self(Keys { alpha, fresnel }, PhantomData)
    }

    fn read(mut table: Table<'_>) -> Result<Box<dyn BrdfSpec>, ReadError> {
        let fresnel = fresnel::take(&mut table)?;
        let Keys { alpha, .. } = registry::parse(table)?;
        Ok(Box::new(Self::new(alpha, fresnel)))
    }
}

impl<D: Distribution> BrdfSpec for MicrofacetSpec<D> {
    fn resolved(&self) -> registry::Keys {
        let own = registry::resolved(D::KIND, &self.0);
        registry::with(own, "fresnel", self.0.fresnel.resolved())
    }

    fn label(&self) -> String {
        let Keys { alpha, fresnel } = &self.0;
        let label = format!("{}-{alpha}", D::KIND);
        // The usual conductor goes without saying.
        match *fresnel == FresnelSpec::default() {
            true => label,
            false => format!("{label}-{}", fresnel.label()),
        }
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.0.check_keys(channels)?;
        Ok(self.0.fresnel.check(channels)?)
    }

    fn favours(&self) -> Favours {
        Favours::HalfAngle
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        let Keys { alpha, fresnel } = &self.0;
        Ok(Box::new(Microfacet::<D>::new(*alpha, fresnel, channels)))
    }
}

/// A microfacet BRDF over one distribution of normals.
#[derive(Clone, Debug)]
pub struct Microfacet<D> {
    channels: Channels,
    symmetry: Symmetry,
    distribution: D,
    fresnel: Fresnel,
}

impl<D: Distribution> Microfacet<D> {
    /// Facets of roughness `alpha` and reflectance `fresnel`.
    pub fn new(alpha: Roughness, fresnel: &FresnelSpec, channels: Channels) -> Self {
        Self {
            symmetry: alpha.symmetry(),
            distribution: D::new(alpha),
            fresnel: Fresnel::new(fresnel, &channels),
            channels,
        }
    }

    /// D G₂/(4 cos θ_i cos θ_o), 0 below the horizon, and cos θ_d.
    #[inline(always)]
    fn facets(&self, [i, o]: [DVec3; 2]) -> [f64; 2] {
        let (h, _) = half_and_back([i, o]);
        let [up, down] = scale(h.abs().max_element());
        let h = h * up;
        // Opposed grazing: the normal is as right as any other.
        let opposed = h.x == 0.0 && h.y == 0.0 && h.z == 0.0;
        let down = if opposed { 0.0 } else { down };
        let h = if opposed { DVec3::Z } else { h };
        let m = &self.distribution;
        let shadowing = 2.0 * (o.z * m.projected_area(i) + i.z * m.projected_area(o));
        let facets = m.density(h) / shadowing.max(DENOMINATOR_FLOOR);
        let above = (i.z > 0.0) & (o.z > 0.0);
        [
            if above { facets } else { 0.0 },
            (h.length() * down).min(1.0),
        ]
    }

    /// Values at many pairs.
    #[inline(always)]
    fn values_of(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        let mut block = PairBlock::new();
        let [mut facets, mut cos_d] = [[0.0; BLOCK]; 2];
        let channels = self.channels.count();
        let out = out.chunks_mut(BLOCK * channels);
        for (pairs, out) in pairs.chunks(BLOCK).zip(out) {
            let n = pairs.len();
            if n < FEW {
                for (j, pair) in pairs.iter().enumerate() {
                    [facets[j], cos_d[j]] = self.facets(pair.vectors());
                }
            } else {
                block.load(pairs);
                for j in 0..BLOCK {
                    [facets[j], cos_d[j]] = self.facets(block.vectors(j));
                }
            }
            self.fresnel.scale(&cos_d[..n], &facets[..n], out);
        }
    }
}

impl<D: Distribution> Brdf for Microfacet<D> {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn conserves_energy(&self) -> bool {
        true
    }

    fn is_mirrored(&self) -> bool {
        true
    }

    #[inline]
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let [facets, cos_d] = self.facets(pair.vectors());
        self.fresnel.scale(&[cos_d], &[facets], out);
        Presence::Present
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        presence.fill(Presence::Present);
        vectorised!(self.values_of(pairs, out));
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        Some(self)
    }
}

impl<D: Distribution> SampleBrdf for Microfacet<D> {
    fn sample(&self, omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        if omega_o.cos_theta() <= 0.0 {
            return None;
        }
        let h = self.distribution.sample_normal(omega_o.vector(), u);
        reflect(omega_o, h)
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        let Some((h, cos_d)) = half_above(pair) else {
            return 0.0;
        };
        self.distribution
            .reflected_pdf(h, cos_d, pair.omega_o.vector())
    }
}
