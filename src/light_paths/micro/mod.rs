//! `micro-surface`: what the facets of a height field do to light.
//!
//! Of mirrors no path hits a pair of points, so f_r is an average over a small solid angle. Light of one facet:
//!
//! f₁ = F D G/(4 cos θ_i cos θ_o),
//!
//! D the density of normals in a cone of half the asked angle about the half vector, whose mirror directions lie in a cone of the
//! asked one, and G the share of their area from which both directions see the sky, estimated by rays. Light of more facets is
//! counted about the pair in a wider cone, since it varies more slowly.
//!
//! Other facets have values at a pair: paths from either side send light from each facet to the other direction.
//!
//! What looks the same mirrored is averaged over mirrors. What looks the same however it is turned is followed once, before the
//! first value: G, light of more mirrors and light of diffuse facets are known at nodes of (θ_i, θ_o, |Δφ|) and linear between
//! them, so that f_r is as smooth as the surface makes it. D is not taken at nodes, and so neither is the width of a lobe.

mod binned;
mod nodes;
mod noise;
mod spec;

pub use spec::{ENTRY, MicroSurfaceSpec};

use super::accumulate::{Bounces, apart, batch, followed, seen as in_scene};
use super::canonical::{canonical, stream};
use super::facets::{Facets, FacetsSpec};
use super::gathered::{Drawing, Gathered, MIRRORS, beyond};
use super::normals::{BLOCKS, Density, Normals, in_block};
use super::smith::{Paths, remark};
use super::surface::HeightField;
use super::transport::Transport;
use crate::brdf::{
    Brdf, BuildError, CLASSES, ChannelValues, Channels, LightPath, Part, Presence, Source, Split,
    SplitBrdf, SplitErrors,
};
use crate::geometry::{DirectionPair, Symmetry};
use crate::numeric::DENOMINATOR_FLOOR;
use crate::sampling::{Random, RandomStream};
use binned::Binned;
use glam::{DMat3, DVec3};
use nodes::{LAST, Nodes};
use rayon::prelude::*;
use smallvec::smallvec;
use spec::Keys;
use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

/// Most times that the asked paths are followed for a relative error.
const ROUNDS: usize = 64;

/// Draws for each path that is asked for, of facets that may lie outside the cone.
const DRAWS: usize = 16;

/// Least G that a relative error is of: light that is hardly seen counts for little.
const HIDDEN: f64 = 0.01;

/// Radians between nodes at the normal, and how they draw together towards the horizon, where shadows change.
const STEP: f64 = 3.0 * TAU / 360.0;
const POWER: f64 = 1.5;

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
    /// True if values are found at nodes.
    has_nodes: bool,
    known: OnceLock<Known>,
}

/// Normals of mirrors.
struct Mirrors {
    /// True if all have one of a few normals: light leaves in as many directions, and no pair has a value.
    are_few: bool,
    /// Of each surface.
    normals: Vec<Normals>,
    density: Density,
}

/// Light that was followed before the first value was asked for.
#[derive(Default)]
struct Known {
    at_nodes: Option<(Nodes, AtNodes)>,
    later: Option<Later>,
}

/// What is known at nodes.
enum AtNodes {
    /// G of mirrors, and its standard error.
    Seen(Vec<[f64; 2]>),
    /// Light of other facets.
    Lit(Vec<Split>),
}

/// Light of more than one mirror.
enum Later {
    Binned(Binned),
    Gathered(Gathered),
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
        let of_field = |field: &Arc<HeightField>| {
            Transport::with_facets(field.clone(), facets.clone(), followed.clone())
        };
        let surfaces: Vec<_> = fields.iter().map(of_field).collect();
        let facts = spec.surface.facts();
        let is_turned = facts.symmetry.isotropic;
        let random = Random::new(keys.seed);
        let mirrors = matches!(spec.facets, FacetsSpec::Mirror(_)).then(|| {
            let radius = spec.cone();
            let normals = fields.iter();
            let normals = normals.map(|field| Normals::new(field, keys.spot, radius, is_turned));
            let normals: Vec<_> = normals.collect();
            Mirrors {
                are_few: normals.iter().all(Normals::are_few),
                density: Density::new(&normals, radius, is_turned),
                normals,
            }
        });
        Ok(Self {
            channels,
            keys,
            symmetry: facts.symmetry,
            is_random: facts.is_random,
            surfaces,
            random,
            has_nodes: spec.has_nodes() && !mirrors.as_ref().is_some_and(|m| m.are_few),
            mirrors,
            known: OnceLock::new(),
        })
    }

    /// Light that has to be followed once; a run that asks for no value does not wait for it.
    fn known(&self) -> &Known {
        let follow = || match self.has_nodes || self.has_later() {
            true => apart(|| self.follow()),
            false => Known::default(),
        };
        self.known.get_or_init(follow)
    }

    /// True if light of more than one mirror is followed.
    fn has_later(&self) -> bool {
        self.keys.bounces != Part::First && self.mirrors.as_ref().is_some_and(|m| !m.are_few)
    }

    fn follow(&self) -> Known {
        let keys = &self.keys;
        let at_nodes = self.has_nodes.then(|| {
            let nodes = Nodes::new(STEP, POWER, LAST);
            let pairs = nodes.pairs();
            let pairs = pairs.par_iter().enumerate();
            let stream = |node: usize| self.random.stream(node as u64);
            let values = match &self.mirrors {
                Some(of) => {
                    let seen = pairs.map(|(node, pair)| self.seen(of, *pair, &mut stream(node)));
                    AtNodes::Seen(seen.collect())
                }
                None => {
                    let lit = pairs.map(|(node, pair)| self.lit(*pair, &mut stream(node)));
                    AtNodes::Lit(lit.collect())
                }
            };
            (nodes, values)
        });
        let later = self.has_later().then(|| {
            let drawing = Drawing {
                radius: keys.multiple_half_angle_deg.to_radians(),
                rays: keys.rays,
                spot: keys.spot,
                last: keys.bounces.last(),
                symmetry: self.symmetry,
            };
            let random = Random::new(!keys.seed);
            match self.symmetry.isotropic {
                true => Later::Binned(Binned::new(&self.surfaces, &random, drawing)),
                false => Later::Gathered(Gathered::new(&self.surfaces, &random, drawing)),
            }
        });
        Known { at_nodes, later }
    }

    /// Vectors that mean the same as these: turned or mirrored, as far as the surface may be, by a number of [0, 1).
    fn image<const N: usize>(&self, vectors: [DVec3; N], u: f64) -> [DVec3; N] {
        if self.symmetry.isotropic {
            let turn = DMat3::from_rotation_z(TAU * u);
            vectors.map(|v| turn * v)
        } else if self.symmetry.bilateral {
            let mirror = MIRRORS[(4.0 * u) as usize];
            vectors.map(|v| v * mirror)
        } else {
            vectors
        }
    }

    fn is_of_few_mirrors(&self) -> bool {
        self.mirrors.as_ref().is_some_and(|mirrors| mirrors.are_few)
    }

    /// G at a pair of mirrors, and its standard error. Where no facet is that steep, the steepest ones are taken.
    fn seen(&self, mirrors: &Mirrors, pair: [DVec3; 2], random: &mut RandomStream) -> [f64; 2] {
        let (mut seen, asked) = (Seen::default(), self.keys.paths);
        let half = mirrors.density.nearest(half_vector(pair));
        let most = self.keys.relative_error.map_or(1, |_| ROUNDS) * asked * DRAWS;
        for draw in 0..most {
            let [lap, place] = [draw / asked, draw % asked];
            if place == 0 && seen.draws >= asked {
                let relative = seen.error() / seen.share().max(HIDDEN);
                let asks_for_more = |error: f64| relative > error && seen.draws < ROUNDS * asked;
                if !self.keys.relative_error.is_some_and(asks_for_more) {
                    break;
                }
            }
            // Turn by turn, in whole laps: facets of one are near those of the last.
            let turn = (place as f64 + random.next()) / asked as f64;
            let [light, sensor, half] = self.image([pair[0], pair[1], half], turn);
            let surface = (draw + lap) % self.surfaces.len();
            let found = mirrors.normals[surface].draw(half, random.next());
            if let Some(found) = found.filter(|found| found.weight > 0.0) {
                let surface = &self.surfaces[surface];
                let within = [random.next(), random.next()];
                let point = surface.tracer.on_triangle(found.triangle, within);
                seen.add(found.weight, surface.is_seen(&point, [light, sensor]));
            }
        }
        [seen.share(), seen.error()]
    }

    /// Half vectors that mean the same, of densities that are not averaged over turns.
    fn images(&self, h: DVec3) -> Vec<DVec3> {
        match self.symmetry {
            Symmetry {
                isotropic: false,
                bilateral: true,
                ..
            } => MIRRORS.iter().map(|m| h * *m).collect(),
            _ => vec![h],
        }
    }

    /// Light of one mirror.
    fn first(&self, mirrors: &Mirrors, pair: [DVec3; 2], key: &[i64; 5]) -> Split {
        let cos_d = (0.5 * (pair[0] + pair[1]).length()).min(1.0);
        let images = self.images(half_vector(pair));
        let [density, spread] = mirrors.density.density_at(&mirrors.normals, &images);
        let [share, error] = match &self.known().at_nodes {
            Some((nodes, AtNodes::Seen(seen))) => {
                let (mut share, mut square) = (0.0, 0.0);
                for (node, of_node) in nodes.around(pair) {
                    share += of_node * seen[node][0];
                    square += (of_node * seen[node][1]).powi(2);
                }
                // Beyond the last nodes what is seen ends with the plane.
                let last = LAST.cos();
                let seen: f64 = pair.iter().map(|v| (v.z / last).min(1.0)).product();
                [share, square.sqrt()].map(|v| v * seen)
            }
            _ if density == 0.0 => [0.5; 2],
            _ => self.seen(mirrors, pair, &mut stream(&self.random, key)),
        };
        let transport = &self.surfaces[0];
        let mut value: ChannelValues = smallvec![0.0; transport.channels.count()];
        if let Facets::Mirror(fresnel) = &transport.facets {
            let cosines = (pair[0].z * pair[1].z).max(DENOMINATOR_FLOOR);
            fresnel.scale(&[cos_d], &[1.0 / (4.0 * cosines)], &mut value);
        }
        // Of D = 1, all of it seen.
        let luminance = transport.channels.luminance(&value);
        value.iter_mut().for_each(|v| *v *= density * share);
        let of_first = |e: f64| SplitErrors([e, 0.0, 0.0, e]);
        let mut split = Split::dark(self.channels.count());
        split.value[0] = in_scene(value, &transport.channels, &self.channels);
        split.transport = of_first(luminance * density * error);
        split.realisation = of_first(luminance * share * spread);
        split
    }

    /// Light of facets that are not mirrors.
    fn lit(&self, pair: [DVec3; 2], random: &mut RandomStream) -> Split {
        let channels = &self.surfaces[0].channels;
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
                let error = split.transport.error(self.keys.bounces);
                let is_enough = |asked: f64| error <= asked * value;
                if self.keys.relative_error.is_none_or(is_enough) {
                    break;
                }
            }
            // Every surface from one side and then from the other, and its blocks in turn.
            let of_surface = path / self.surfaces.len();
            let group = path % self.surfaces.len() * BLOCKS + of_surface / 2 % BLOCKS;
            let mut image = self.image(pair, random.next());
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
        let squares = split.transport.0.map(|e| e * e);
        split.realisation = SplitErrors(beyond(&sums, squares));
        split.only(self.keys.bounces)
    }
}

/// The half vector; of a pair that has none, along the surface.
fn half_vector([a, b]: [DVec3; 2]) -> DVec3 {
    (a + b).normalize_or(DVec3::X)
}

/// Light between nodes. Each has paths of its own, on the same surfaces.
fn between(nodes: &Nodes, splits: &[Split], pair: [DVec3; 2], channels: usize) -> Split {
    let mut all = Split::dark(channels);
    for (node, share) in nodes.around(pair) {
        let split = &splits[node];
        for (value, of_node) in all.value.iter_mut().zip(&split.value) {
            let add = |(v, n): (&mut f64, &f64)| *v += share * n;
            value.iter_mut().zip(of_node).for_each(add);
        }
        all.transport = all.transport.hypot(&split.transport.times(share));
        all.realisation = all.realisation.plus(&split.realisation.times(share));
    }
    all
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
        self.surfaces.iter().all(|s| s.facets.conserve_energy())
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
            false if self.has_nodes => vec![remark(self, paths, "node")],
            false => vec![remark(self, paths, "pair")],
        }
    }

    fn as_split(&self) -> Option<&dyn SplitBrdf> {
        Some(self)
    }
}

impl SplitBrdf for MicroSurface {
    fn split(&self, pair: &DirectionPair) -> Split {
        let followed = &self.surfaces[0].channels;
        let channels = self.channels.count();
        if !pair.is_above_horizon() || self.is_of_few_mirrors() {
            return Split::dark(channels);
        }
        let (pair, key) = canonical(pair, self.symmetry);
        let Known { at_nodes, later } = self.known();
        let Some(mirrors) = &self.mirrors else {
            return match at_nodes {
                Some((nodes, AtNodes::Lit(lit))) => between(nodes, lit, pair, channels),
                _ => self.lit(pair, &mut stream(&self.random, &key)),
            };
        };
        let later = match later {
            Some(Later::Binned(binned)) => binned.split(pair, followed, &self.channels),
            Some(Later::Gathered(gathered)) => gathered.split(pair, followed, &self.channels),
            None => Split::dark(channels),
        };
        let mut split = later.only(self.keys.bounces);
        if self.keys.bounces.holds(1) {
            let [value, ..] = &mut split.value;
            let first = self.first(mirrors, pair, &key);
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
        let channels = &surface.channels;
        for _ in 0..count {
            let mut weight: ChannelValues = smallvec![1.0; channels.count()];
            let last = self.keys.bounces.last();
            let start = |u: [f64; 2]| u.map(|s| s * self.keys.spot);
            let path = surface.draw(start, last, &mut weight, &mut random);
            if let Some(path) = path.filter(|path| self.keys.bounces.holds(path.order)) {
                each(path);
            }
        }
    }

    fn noise(&self, pair: &DirectionPair, each: &mut dyn FnMut(Source, f64)) {
        if pair.is_above_horizon() && !self.is_of_few_mirrors() {
            self.noise_above(pair, each);
        }
    }

    fn follows_pairs(&self) -> bool {
        !self.has_nodes && !self.is_of_few_mirrors()
    }

    fn surfaces(&self) -> usize {
        match self.is_random {
            true => self.surfaces.len(),
            false => 0,
        }
    }
}
