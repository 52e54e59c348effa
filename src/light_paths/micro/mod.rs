//! `micro-surface`: what the facets of a height field do to light.
//!
//! Of mirrors no path hits a pair of points, so f_r is an average over a small solid angle. Light of one facet:
//!
//! f₁ = F D G/(4 cos θ_i cos θ_o),
//!
//! D the density of normals in a cone of half the asked angle about the half vector, whose mirror directions lie in a cone of the
//! asked one, and G the share of their area from which both directions see the sky, which rays tell. Light of more facets is
//! counted about the pair in a wider cone, since it varies more slowly.
//!
//! Other facets have values at a pair: paths from either side send light from each facet to the other direction.
//!
//! What looks the same however it is turned, or mirrored, is averaged over turns or mirrors.

mod spec;

pub use spec::{ENTRY, MicroSurfaceSpec};

use super::accumulate::{Bounces, batch, seen};
use super::canonical::{canonical, stream};
use super::facets::{Facets, FacetsSpec};
use super::gathered::{Drawing, Gathered, MIRRORS, beyond, errors};
use super::normals::{BLOCKS, Density, Normals, in_block};
use super::smith::{Paths, remark};
use super::transport::Transport;
use crate::brdf::{
    Brdf, BuildError, CLASSES, ChannelValues, Channels, LightPath, Part, Presence, Split,
    SplitBrdf, SplitErrors,
};
use crate::geometry::{DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use crate::sampling::{Random, RandomStream};
use glam::{DMat3, DVec3};
use smallvec::smallvec;
use spec::Keys;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Most times that the asked paths are followed for a relative error.
const ROUNDS: usize = 64;

/// Draws for each path that is asked for, of facets that may lie outside the cone.
const DRAWS: usize = 16;

/// Facets of a height field.
pub struct MicroSurface {
    channels: Channels,
    keys: Keys,
    symmetry: Symmetry,
    /// True if there are other surfaces of the kind.
    is_random: bool,
    surfaces: Vec<Transport>,
    random: Random,
    mirrors: Option<Mirrors>,
}

/// What is known of mirrors.
struct Mirrors {
    /// True if all have one of a few normals: light leaves in as many directions, and no pair has a value.
    are_few: bool,
    /// Of each surface.
    normals: Vec<Normals>,
    density: Density,
    /// Light of more facets, if it is asked for.
    gathered: Option<Gathered>,
}

impl MicroSurface {
    fn new(spec: &MicroSurfaceSpec, channels: Channels) -> Result<Self, BuildError> {
        let keys = spec.keys.clone();
        let fields = (0..keys.surfaces as u64).map(|draw| spec.surface.build(draw).map(Arc::new));
        let fields: Vec<_> = fields
            .collect::<Result<_, _>>()
            .map_err(MicroSurfaceSpec::in_surface)?;
        let surfaces = fields
            .iter()
            .map(|field| Transport::new(field.clone(), &spec.facets, &channels))
            .collect::<Result<Vec<_>, _>>()?;
        let symmetry = spec.surface.symmetry();
        let random = Random::new(keys.seed);
        let mut mirrors = None;
        if let FacetsSpec::Mirror(_) = &spec.facets {
            let radius = spec.cone();
            let normals: Vec<_> = fields
                .iter()
                .map(|field| Normals::new(field, keys.spot, radius))
                .collect();
            let density = Density::new(&normals, &fields[0], keys.spot, radius, symmetry.isotropic);
            let drawing = Drawing {
                radius: keys.multiple_half_angle_deg.to_radians(),
                rays: keys.rays,
                spot: keys.spot,
                last: keys.bounces.last(),
                symmetry,
            };
            let are_few = normals.iter().all(Normals::are_few);
            let gathered = (keys.bounces != Part::First && !are_few)
                .then(|| Gathered::new(&surfaces, &Random::new(!keys.seed), drawing));
            mirrors = Some(Mirrors {
                are_few,
                normals,
                density,
                gathered,
            });
        }
        Ok(Self {
            channels,
            keys,
            symmetry,
            is_random: spec.surface.is_random(),
            surfaces,
            random,
            mirrors,
        })
    }

    /// A pair that means the same as `pair`: turned or mirrored at random, as far as the surface may be.
    fn image(&self, pair: [DVec3; 2], random: &mut RandomStream) -> [DVec3; 2] {
        if self.symmetry.isotropic {
            let turn = DMat3::from_rotation_z(TAU * random.next());
            pair.map(|v| turn * v)
        } else if self.symmetry.bilateral {
            let mirror = MIRRORS[(4.0 * random.next()) as usize];
            pair.map(|v| v * mirror)
        } else {
            pair
        }
    }

    fn is_of_few_mirrors(&self) -> bool {
        self.mirrors.as_ref().is_some_and(|mirrors| mirrors.are_few)
    }

    /// Light of one mirror.
    fn first(&self, mirrors: &Mirrors, pair: [DVec3; 2], random: &mut RandomStream) -> Split {
        let half = pair[0] + pair[1];
        let cos_d = (0.5 * half.length()).min(1.0);
        let h = half.normalize_or(DVec3::X);
        let images: Vec<_> = match self.symmetry {
            Symmetry {
                isotropic: false,
                bilateral: true,
                ..
            } => MIRRORS.iter().map(|m| h * *m).collect(),
            _ => vec![h],
        };
        let [density, spread] = mirrors.density.at(&mirrors.normals, &images);
        // Weights of the draws that were seen, and that were not; the same of their squares.
        let (mut sums, mut squares, mut within) = ([0.0; 2], [0.0; 2], 0);
        let asked = self.keys.paths;
        let most = self.keys.relative_error.map_or(1, |_| ROUNDS) * asked * DRAWS;
        let share = |sums: [f64; 2]| {
            if sums[0] > 0.0 {
                sums[0] / (sums[0] + sums[1])
            } else {
                0.0
            }
        };
        let error = |sums: [f64; 2], squares: [f64; 2], within: usize| {
            let seen = share(sums);
            match seen > 0.0 && seen < 1.0 {
                true => {
                    (squares[0] * (1.0 - seen).powi(2) + squares[1] * seen * seen).sqrt()
                        / (sums[0] + sums[1])
                }
                // Of n draws that agree one more may not.
                false => 1.0 / (within + 2) as f64,
            }
        };
        if density > 0.0 {
            for draw in 0..most {
                if within >= asked && within.is_multiple_of(asked) {
                    let rel = error(sums, squares, within) / share(sums).max(DENOMINATOR_FLOOR);
                    if self.keys.relative_error.is_none_or(|asked| rel <= asked) {
                        break;
                    }
                }
                let image = self.image(pair, random);
                let surface = draw % self.surfaces.len();
                let half = (image[0] + image[1]).normalize_or(h);
                let Some(found) = mirrors.normals[surface].draw(half, random.next()) else {
                    continue;
                };
                if found.weight == 0.0 {
                    continue;
                }
                within += 1;
                let surface = &self.surfaces[surface];
                let point = surface
                    .tracer()
                    .on_triangle(found.triangle, [random.next(), random.next()]);
                let place = usize::from(!surface.is_seen(&point, image));
                sums[place] += found.weight;
                squares[place] += found.weight * found.weight;
            }
        }
        let cosines = (pair[0].z * pair[1].z).max(DENOMINATOR_FLOOR);
        let scale = density / (4.0 * cosines);
        let transport = &self.surfaces[0];
        let mut value: ChannelValues = smallvec![0.0; transport.channels().count()];
        if let Facets::Mirror(fresnel) = transport.facets() {
            fresnel.scale(&[cos_d], &[scale], &mut value);
        }
        let luminance = transport.channels().luminance(&value);
        let seen_share = share(sums);
        value.iter_mut().for_each(|v| *v *= seen_share);
        let off = match within {
            0 => 0.5,
            n => error(sums, squares, n),
        };
        let relative = if density > 0.0 { spread / density } else { 0.0 };
        let split_errors = |e: f64| errors([e, 0.0, 0.0, e]);
        let none = || ChannelValues::from_elem(0.0, self.channels.count());
        Split {
            value: [
                seen(value, transport.channels(), &self.channels),
                none(),
                none(),
            ],
            transport: split_errors(luminance * off),
            realisation: split_errors(luminance * seen_share * relative),
        }
    }

    /// Light of facets that are not mirrors.
    fn lit(&self, pair: [DVec3; 2], random: &mut RandomStream) -> Split {
        let channels = self.surfaces[0].channels();
        let groups = self.surfaces.len() * BLOCKS;
        let mut bounces = Bounces::new(channels.count());
        let mut sums = vec![[0.0; CLASSES + 1]; groups];
        let mut counts = vec![0.0; groups];
        let asked = self.keys.paths;
        let most = self.keys.relative_error.map_or(1, |_| ROUNDS) * asked;
        for path in 0..most {
            if path >= asked && path.is_multiple_of(asked) {
                let split = bounces.split(channels, &self.channels);
                let value = self.channels.luminance(&split.part(self.keys.bounces));
                let error = split.transport.of(self.keys.bounces);
                if self
                    .keys
                    .relative_error
                    .is_none_or(|asked| error <= asked * value)
                {
                    break;
                }
            }
            // Every surface from one side and then from the other, and its blocks in turn.
            let of_surface = path / self.surfaces.len();
            let group = path % self.surfaces.len() * BLOCKS + of_surface / 2 % BLOCKS;
            let mut image = self.image(pair, random);
            if of_surface % 2 == 1 {
                image.swap(0, 1);
            }
            let start = in_block(group % BLOCKS, [random.next(), random.next()]);
            let start = start.map(|s| s * self.keys.spot);
            let surface = &self.surfaces[group / BLOCKS];
            surface.light(image, start, self.keys.bounces.last(), random, &mut bounces);
            let light = bounces.end(|values| channels.luminance(values));
            sums[group].iter_mut().zip(light).for_each(|(s, l)| *s += l);
            counts[group] += 1.0;
        }
        let mut split = bounces.split(channels, &self.channels);
        // Each block's share of the mean, from the paths that it had.
        let used = counts.iter().filter(|n| **n > 0.0).count() as f64;
        for (sums, n) in sums.iter_mut().zip(&counts) {
            sums.iter_mut().for_each(|s| *s /= f64::max(*n, 1.0) * used);
        }
        let mut counted = counts.iter();
        sums.retain(|_| counted.next().is_some_and(|n| *n > 0.0));
        let [a, b, c] = split.transport.classes;
        let squares = [a, b, c, split.transport.sum].map(|e| e * e);
        split.realisation = errors(beyond(&sums, squares));
        split.only(self.keys.bounces)
    }
}

/// Both together, of errors that have nothing to do with each other.
fn with(first: SplitErrors, more: SplitErrors) -> SplitErrors {
    SplitErrors {
        classes: std::array::from_fn(|i| first.classes[i].hypot(more.classes[i])),
        sum: first.sum.hypot(more.sum),
    }
}

impl Brdf for MicroSurface {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// The paths do if the facets do; what is averaged over few of them may stray by its error.
    fn conserves_energy(&self) -> bool {
        self.surfaces.iter().all(|s| s.facets().conserve_energy())
    }

    fn is_mirrored(&self) -> bool {
        self.symmetry.bilateral
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        if self.is_of_few_mirrors() {
            out.fill(0.0);
            return Presence::Missing;
        }
        out.copy_from_slice(&self.split(pair).part(self.keys.bounces));
        Presence::Present
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        batch(self, pairs, out, presence);
    }

    fn remarks(&self) -> Vec<String> {
        let paths = Paths {
            bounces: self.keys.bounces,
            paths: self.keys.paths,
            seed: self.keys.seed,
        };
        match self.is_of_few_mirrors() {
            true => Vec::new(),
            false => vec![remark(self, paths)],
        }
    }

    fn as_split(&self) -> Option<&dyn SplitBrdf> {
        Some(self)
    }
}

impl SplitBrdf for MicroSurface {
    fn split(&self, pair: &DirectionPair) -> Split {
        let followed = self.surfaces[0].channels();
        if !pair.is_above_horizon() {
            return Bounces::new(followed.count()).split(followed, &self.channels);
        }
        let (pair, key) = canonical(pair, self.symmetry);
        let mut random = stream(&self.random, &key);
        let Some(mirrors) = &self.mirrors else {
            return self.lit(pair, &mut random);
        };
        let bounces = self.keys.bounces.classes();
        let first = bounces
            .contains(&0)
            .then(|| self.first(mirrors, pair, &mut random));
        let more = mirrors.gathered.as_ref();
        let more = more.map(|gathered| {
            let split = gathered.split(pair, followed, &self.channels);
            split.only(self.keys.bounces)
        });
        match (first, more) {
            (Some(first), Some(mut more)) => {
                more.value[0] = first.value.into_iter().next().unwrap_or_default();
                more.transport = with(first.transport, more.transport);
                more.realisation = with(first.realisation, more.realisation);
                more
            }
            (Some(split), None) | (None, Some(split)) => split,
            (None, None) => Bounces::new(followed.count()).split(followed, &self.channels),
        }
    }

    fn paths(&self, block: u64, count: usize, each: &mut dyn FnMut(LightPath)) {
        // Far from the numbers of pairs, which are hashes, and of the paths that are kept.
        let mut random = Random::new(self.keys.seed ^ (1 << 63)).stream(block);
        let surface = &self.surfaces[block as usize % self.surfaces.len()];
        let channels = surface.channels();
        for _ in 0..count {
            let mut weight: ChannelValues = smallvec![1.0; channels.count()];
            let last = self.keys.bounces.last();
            let drawn = surface.draw(self.keys.spot, last, &mut weight, &mut random);
            if let Some(drawn) = drawn.filter(|drawn| self.keys.bounces.holds(drawn.met)) {
                each(LightPath {
                    pair: drawn.pair,
                    met: drawn.met,
                    light: channels.luminance(&weight),
                });
            }
        }
    }

    fn surfaces(&self) -> usize {
        if self.is_random {
            self.surfaces.len()
        } else {
            0
        }
    }
}
