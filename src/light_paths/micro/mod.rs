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

use super::accumulate::{Bounces, batch, followed, seen as in_scene};
use super::canonical::{canonical, stream};
use super::facets::{Facets, FacetsSpec};
use super::gathered::{Drawing, Gathered, MIRRORS, beyond};
use super::normals::{BLOCKS, Density, Normals, in_block};
use super::smith::{Paths, remark};
use super::surface::Facts;
use super::transport::Transport;
use crate::brdf::{
    Brdf, BuildError, CLASSES, ChannelValues, Channels, LightPath, Part, Presence, Split, SplitBrdf,
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
            .map_err(|e| e.within("surface"))?;
        let followed = followed(&channels, spec.facets.distinct(&channels));
        let facets = Facets::new(&spec.facets, &followed)?;
        let surfaces = fields
            .iter()
            .map(|field| Transport::of(field.clone(), facets.clone(), followed.clone()));
        let surfaces: Vec<_> = surfaces.collect();
        let Facts {
            symmetry,
            is_random,
            ..
        } = spec.surface.facts();
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
            is_random,
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
        let (mut seen, asked) = (Seen::default(), self.keys.paths);
        let most = self.keys.relative_error.map_or(1, |_| ROUNDS) * asked * DRAWS;
        for draw in 0..if density > 0.0 { most } else { 0 } {
            if seen.draws >= asked && seen.draws.is_multiple_of(asked) {
                let relative = seen.error() / seen.share().max(DENOMINATOR_FLOOR);
                if self
                    .keys
                    .relative_error
                    .is_none_or(|asked| relative <= asked)
                {
                    break;
                }
            }
            let image = self.image(pair, random);
            let surface = draw % self.surfaces.len();
            let half = (image[0] + image[1]).normalize_or(h);
            let found = mirrors.normals[surface].draw(half, random.next());
            if let Some(found) = found.filter(|found| found.weight > 0.0) {
                let surface = &self.surfaces[surface];
                let within = [random.next(), random.next()];
                let point = surface.tracer().on_triangle(found.triangle, within);
                seen.add(found.weight, surface.is_seen(&point, image));
            }
        }
        let transport = &self.surfaces[0];
        let mut value: ChannelValues = smallvec![0.0; transport.channels().count()];
        if let Facets::Mirror(fresnel) = transport.facets() {
            let cosines = (pair[0].z * pair[1].z).max(DENOMINATOR_FLOOR);
            fresnel.scale(&[cos_d], &[1.0 / (4.0 * cosines)], &mut value);
        }
        // Of D = 1, all of it seen.
        let luminance = transport.channels().luminance(&value);
        value.iter_mut().for_each(|v| *v *= density * seen.share());
        let of_first = |e: f64| [e, 0.0, 0.0, e].into();
        let mut split = Split::dark(self.channels.count());
        split.value[0] = in_scene(value, transport.channels(), &self.channels);
        split.transport = of_first(luminance * density * seen.error());
        split.realisation = of_first(luminance * seen.share() * spread);
        split
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
        split.realisation = beyond(&sums, squares).into();
        split.only(self.keys.bounces)
    }
}

/// Facets that were drawn, by their weights.
#[derive(Default)]
struct Seen {
    draws: usize,
    /// Weights of those that were seen and of those that were not, and of their squares.
    sums: [f64; 2],
    squares: [f64; 2],
}

impl Seen {
    fn add(&mut self, weight: f64, is_seen: bool) {
        let place = usize::from(!is_seen);
        self.draws += 1;
        self.sums[place] += weight;
        self.squares[place] += weight * weight;
    }

    /// Share that was seen; a half, more or less, of nothing that was drawn.
    fn share(&self) -> f64 {
        let [seen, hidden] = self.sums;
        match self.draws {
            0 => 0.5,
            _ => seen / (seen + hidden),
        }
    }

    /// Its standard error.
    fn error(&self) -> f64 {
        let share = self.share();
        match self.sums.iter().all(|sum| *sum > 0.0) {
            true => {
                let [seen, hidden] = self.squares;
                let square = seen * (1.0 - share).powi(2) + hidden * share * share;
                square.sqrt() / self.sums.iter().sum::<f64>()
            }
            // Of n draws that agree one more may not.
            false => 1.0 / (self.draws + 2) as f64,
        }
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
            return Split::dark(self.channels.count());
        }
        let (pair, key) = canonical(pair, self.symmetry);
        let mut random = stream(&self.random, &key);
        let Some(mirrors) = &self.mirrors else {
            return self.lit(pair, &mut random);
        };
        let mut split = match &mirrors.gathered {
            Some(gathered) => gathered
                .split(pair, followed, &self.channels)
                .only(self.keys.bounces),
            None => Split::dark(self.channels.count()),
        };
        if self.keys.bounces.holds(1) {
            let [value, ..] = &mut split.value;
            let first = self.first(mirrors, pair, &mut random);
            value.clone_from(&first.value[0]);
            split.transport = first.transport.hypot(&split.transport);
            split.realisation = first.realisation.hypot(&split.realisation);
        }
        split
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
