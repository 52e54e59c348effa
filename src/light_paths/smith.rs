//! `smith-multiple`: a rough surface whose facets send light to each other.

use super::accumulate::{Bounces, batch, followed, left_by};
use super::canonical::{canonical, number, stream};
use super::facets::{self, Facets, FacetsSpec};
use super::walk::Walk;
use crate::brdf::laws;
use crate::brdf::microfacet::{Beckmann, Distribution, Ggx};
use crate::brdf::{
    Brdf, BrdfSpec, BuildError, ChannelValues, Channels, Favours, LightPath, Part, Presence,
    Roughness, Source, Split, SplitBrdf, Tables,
};
use crate::error::{count, in_whole};
use crate::geometry::{DirectionPair, Symmetry};
use crate::registry::{self, Entry, ReadError, Table, keys, named};
use crate::sampling::{Random, cosine_hemisphere};
use serde::{Deserialize, Serialize};
use smallvec::smallvec;

const KIND: &str = "smith-multiple";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "ggx or Beckmann facets that light meets one after the other (Heitz et al. 2016): mirrors or diffuse ones; bounces: \
              all, first, second, later or multiple; a random walk, of so many paths a pair",
    examples: &[
        "alpha = 0.5\npaths = 64",
        "normals = \"beckmann\"\nalpha = [0.2, 0.6]\nbounces = \"second\"\npaths = 64",
        "alpha = 0.5\nfacets = { kind = \"diffuse\", albedo = 0.8 }\npaths = 64",
    ],
    read,
};

named! {
    /// Distributions of normals that a config can name.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    enum Normals {
        /// Those of `ggx`.
        #[default]
        Ggx = "ggx",
        /// Those of `beckmann`.
        Beckmann = "beckmann",
    }
}

keys! {
    /// A surface of facets that light meets one after the other, as a config writes it; `facets`, a table with a kind of its own, is
    /// taken out before.
    struct SmithMultipleSpec {
        normals: Normals = Normals::default();
        alpha: Roughness = Roughness::Isotropic(0.3);
        bounces: Part = Part::All;
        paths: usize = 256;
        seed: u64 = 1;
        #[serde(skip_serializing, deserialize_with = "registry::taken")]
        facets: FacetsSpec = FacetsSpec::default();
    }
}

/// Paths a pair: two at least, since one has no error estimate.
pub(super) const PATHS: [usize; 2] = [2, 1 << 24];

fn read(mut table: Table<'_>) -> Result<Box<dyn BrdfSpec>, ReadError> {
    Ok(Box::new(SmithMultipleSpec {
        facets: facets::take(&mut table)?,
        ..registry::parse(table)?
    }))
}

impl BrdfSpec for SmithMultipleSpec {
    fn resolved(&self) -> registry::Keys {
        let own = registry::resolved(KIND, self);
        registry::with(own, "facets", self.facets.resolved())
    }

    fn label(&self) -> String {
        let label = format!("smith-{}-{}", self.normals.name(), self.alpha);
        self.facets.labelled(label, self.bounces)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.alpha.within("alpha", Roughness::RANGE, channels)?;
        in_whole("paths", self.paths, PATHS)?;
        self.facets.check(channels)
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        Ok(self.alpha.symmetry())
    }

    fn favours(&self) -> Favours {
        self.facets.favours(self.bounces)
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        match self.normals {
            Normals::Ggx => self.of::<Ggx>(channels),
            Normals::Beckmann => self.of::<Beckmann>(channels),
        }
    }

    fn tables(&self) -> Tables {
        self.facets.tables()
    }
}

impl SmithMultipleSpec {
    fn of<D: Distribution>(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        let paths = Paths {
            bounces: self.bounces,
            paths: self.paths,
            seed: self.seed,
        };
        let built = SmithMultiple::<D>::new(self.alpha, &self.facets, paths, channels)?;
        Ok(Box::new(built))
    }
}

/// Light that is followed, and how much of it.
#[derive(Clone, Copy, Debug)]
pub struct Paths {
    /// What is asked for; what comes after it is not followed.
    pub bounces: Part,
    /// Paths a pair, half of them from either side.
    pub paths: usize,
    /// Another one gives other errors.
    pub seed: u64,
}

/// A surface of facets that light meets one after the other.
#[derive(Clone)]
pub struct SmithMultiple<D> {
    channels: Channels,
    followed: Channels,
    symmetry: Symmetry,
    paths: Paths,
    random: Random,
    walk: Walk<D>,
}

impl<D: Distribution> SmithMultiple<D> {
    /// Facets of roughness `alpha`.
    pub fn new(
        alpha: Roughness,
        facets: &FacetsSpec,
        paths: Paths,
        channels: Channels,
    ) -> Result<Self, BuildError> {
        let followed = followed(&channels, facets.distinct(&channels));
        Ok(Self {
            symmetry: alpha.symmetry(),
            walk: Walk {
                normals: D::new(alpha),
                facets: Facets::new(facets, &followed)?,
                last: paths.bounces.last(),
            },
            channels,
            followed,
            random: Random::new(paths.seed),
            paths,
        })
    }
}

impl<D: Distribution> Brdf for SmithMultiple<D> {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// The paths do if the facets do; what is averaged over few of them may stray by its error.
    fn conserves_energy(&self) -> bool {
        self.walk.facets.conserve_energy()
    }

    fn is_mirrored(&self) -> bool {
        true
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.copy_from_slice(&self.split(pair).part(self.paths.bounces));
        Presence::Present
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        batch(self, pairs, out, presence);
    }

    fn remarks(&self) -> Vec<String> {
        match self.walk.is_exact() {
            true => Vec::new(),
            false => vec![remark(self, self.paths, "pair")],
        }
    }

    fn as_split(&self) -> Option<&dyn SplitBrdf> {
        Some(self)
    }
}

impl<D: Distribution> SplitBrdf for SmithMultiple<D> {
    fn split(&self, pair: &DirectionPair) -> Split {
        let channels = self.followed.count();
        let mut bounces = Bounces::new(channels);
        if pair.is_above_horizon() {
            let (pair, key) = canonical(pair, self.symmetry);
            let mut random = stream(&self.random, &key);
            let ways = [pair, [pair[1], pair[0]]];
            let paths = match self.walk.is_exact() {
                true => ways.len(),
                false => self.paths.paths,
            };
            for way in ways.into_iter().cycle().take(paths) {
                self.walk.follow(way, &mut random, &mut bounces, channels);
                bounces.end(|values| self.followed.luminance(values));
            }
        }
        let split = bounces.split(&self.followed, &self.channels);
        split.only(self.paths.bounces)
    }

    fn follows_pairs(&self) -> bool {
        !self.walk.is_exact()
    }

    fn noise(&self, pair: &DirectionPair, each: &mut dyn FnMut(Source, f64)) {
        if !self.walk.is_exact() {
            let (_, key) = canonical(pair, self.symmetry);
            let error = self.split(pair).error(self.paths.bounces);
            each(Source::Pair(number(&key)), error);
        }
    }

    fn paths(&self, block: u64, count: usize, each: &mut dyn FnMut(LightPath)) {
        // Far from the numbers of pairs, which are hashes.
        let mut random = Random::new(!self.paths.seed).stream(block);
        for _ in 0..count {
            let omega_i = cosine_hemisphere([random.next(), random.next()]);
            let mut weight: ChannelValues = smallvec![1.0; self.followed.count()];
            let left = self.walk.path(omega_i.vector(), &mut random, &mut weight);
            let path = left_by(omega_i, left, || self.followed.luminance(&weight));
            if let Some(path) = path.filter(|path| self.paths.bounces.holds(path.order)) {
                each(path);
            }
        }
    }
}

/// What values may be off by, of a material in random paths.
pub(super) fn remark(brdf: &dyn SplitBrdf, paths: Paths, each: &str) -> String {
    let pairs = laws::pairs(64, paths.seed);
    let [mut value, mut error] = [0.0; 2];
    for pair in &pairs {
        let split = brdf.split(pair);
        let luminance = brdf.channels().luminance(&split.part(paths.bounces));
        value += luminance.powi(2);
        error += split.error(paths.bounces).powi(2);
    }
    let share = match value > 0.0 {
        true => 100.0 * (error / value).sqrt(),
        false => 0.0,
    };
    format!(
        "{} a {each}: values have a standard error of {share:.2} % of their root mean square ({} of all elevations and lobes)",
        count(paths.paths, "path"),
        count(pairs.len(), "pair"),
    )
}
