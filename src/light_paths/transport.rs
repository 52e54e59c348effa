//! Light that goes through a surface, by scattering order.

use super::accumulate::{Bounces, left_by};
use super::facets::{Facets, survives};
use super::surface::HeightField;
use super::trace::{Exit, Hit, Ray, Tracer};
use super::{FacetsSpec, accumulate};
use crate::brdf::{BuildError, CLASSES, ChannelValues, Channels, LightPath};
use crate::geometry::Direction;
use crate::numeric::DENOMINATOR_FLOOR;
use crate::sampling::{Random, RandomStream, cosine_hemisphere};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use smallvec::smallvec;
use std::sync::Arc;

/// Rays of a block, which has numbers and sums of its own: results do not depend on the number of threads.
const BLOCK: u64 = 4096;

/// Facets that light meets before chance may end it.
const CERTAIN: usize = 5;

/// Facets after which a ray counts as trapped.
const TRAPPED: usize = 10_000;

/// Rays, and what they meet.
#[derive(Clone, Copy, Debug)]
pub struct TransportSpec {
    /// Rays.
    pub rays: u64,
    /// Another one gives other rays.
    pub seed: u64,
}

/// Shares of the light of one direction: luminance. Standard errors are of the rays, not of the surface, and upper
/// bounds: as if rays had begun anywhere, though they are spread evenly.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Energies {
    /// Light that left after one facet, two, three and more.
    pub bounces: [f64; CLASSES],
    /// Standard errors of those.
    pub errors: [f64; CLASSES],
    /// Standard error of their sum.
    pub error_of_sum: f64,
    /// Light that facets absorbed.
    pub absorbed: f64,
    /// Share of the rays whose first mirror direction, or draw, met another facet: masked.
    pub masked: f64,
    /// Share of the area of the facets turned to the light, as the light would see it, that lies behind others. Exact: the rest of
    /// it is all that the light sees, the plane.
    pub shadowed: f64,
    /// Rays that neither left nor were absorbed: lost along a groove, or trapped.
    pub lost: u64,
    /// Ways from facet to facet, to the first and from the last one included.
    pub segments: u64,
}

/// A surface and what its facets do.
pub struct Transport {
    /// Rays through the surface.
    pub(super) tracer: Tracer,
    /// What the facets do.
    pub(super) facets: Facets,
    /// The channels in which light is followed.
    pub(super) channels: Channels,
}

#[derive(Clone, Copy, Default)]
struct Sums {
    rays: f64,
    value: [f64; CLASSES + 1],
    square: [f64; CLASSES + 1],
    absorbed: f64,
    masked: u64,
    lost: u64,
    segments: u64,
}

impl Transport {
    /// Light through `field`.
    pub fn new(
        field: Arc<HeightField>,
        facets: &FacetsSpec,
        channels: &Channels,
    ) -> Result<Self, BuildError> {
        let channels = accumulate::followed(channels, facets.distinct(channels));
        let facets = Facets::new(facets, &channels)?;
        Ok(Self::with_facets(field, facets, channels))
    }

    /// Light through `field`, followed in `channels`.
    pub(super) fn with_facets(field: Arc<HeightField>, facets: Facets, channels: Channels) -> Self {
        Self {
            tracer: Tracer::new(field),
            facets,
            channels,
        }
    }

    /// Where the light of a direction goes.
    pub fn energies(&self, omega_i: Direction, spec: &TransportSpec) -> Energies {
        let random = Random::new(spec.seed);
        let blocks = spec.rays.div_ceil(BLOCK);
        let of_block = |block: u64| {
            let mut stream = random.stream(block);
            let mut sums = Sums::default();
            let first = block * BLOCK;
            let rays = BLOCK.min(spec.rays - first);
            for ray in 0..rays {
                // A block takes a strip of the period, from left to right: rays meet what the last ones met.
                let x = (ray as f64 + stream.next()) / rays as f64;
                let y = (first as f64 + rays as f64 * stream.next()) / spec.rays as f64;
                let ray = self.tracer.from_sky([x, y], -omega_i.vector());
                let mut weight = smallvec![1.0; self.channels.count()];
                let path = self.path(ray, usize::MAX, &mut weight, &mut stream, &mut sums);
                sums.rays += 1.0;
                if let Some((_, order)) = path {
                    let energy = self.channels.luminance(&weight);
                    for class in [order.min(CLASSES) - 1, CLASSES] {
                        sums.value[class] += energy;
                        sums.square[class] += energy * energy;
                    }
                }
            }
            sums
        };
        let sums: Vec<Sums> = (0..blocks).into_par_iter().map(of_block).collect();
        let total = sums.into_iter().fold(Sums::default(), Sums::plus);
        let n = total.rays.max(1.0);
        let mean = total.value.map(|v| v / n);
        // Of one ray it is not known.
        let left = total.rays - 1.0;
        let error = |i: usize| match left > 0.0 {
            true => ((total.square[i] / n - mean[i] * mean[i]).max(0.0) / left).sqrt(),
            false => f64::INFINITY,
        };
        Energies {
            bounces: std::array::from_fn(|i| mean[i]),
            errors: std::array::from_fn(error),
            error_of_sum: error(CLASSES),
            absorbed: total.absorbed / n,
            masked: total.masked as f64 / n,
            shadowed: self.shadowed(omega_i),
            lost: total.lost,
            segments: total.segments,
        }
    }

    /// See [`Energies::shadowed`].
    fn shadowed(&self, omega_i: Direction) -> f64 {
        let light = omega_i.vector();
        // The area of a facet towards the light, for each of the plane below it.
        let towards = |[x, y]: [f64; 2]| (light.z - x * light.x - y * light.y).max(0.0);
        let [nx, ny] = self.tracer.field.size();
        let turned: f64 = self.tracer.field.all_slopes().map(towards).sum();
        let turned = turned / (2 * nx * ny) as f64;
        // Rounding may leave a plane a little less than itself.
        match turned > light.z {
            true => 1.0 - light.z / turned,
            false => 0.0,
        }
    }

    /// A path of a ray from the sky: where it leaves and its scattering order; `None` if it does not leave. `weight`, one number a
    /// channel, is what is left of it.
    fn path(
        &self,
        mut ray: Ray,
        last: usize,
        weight: &mut ChannelValues,
        random: &mut RandomStream,
        sums: &mut Sums,
    ) -> Option<(DVec3, usize)> {
        let mut light = self.channels.luminance(weight);
        for order in 0..TRAPPED {
            sums.segments += 1;
            let hit = match self.tracer.follow(ray) {
                Exit::Hit(hit) => hit,
                Exit::Sky if order == 0 => break,
                Exit::Sky => return Some((ray.direction, order)),
                Exit::Lost => break,
            };
            if order == 1 {
                sums.masked += 1;
            }
            if order == last {
                return None;
            }
            let back = -hit.ray.direction;
            let next = self.facets.scatter(back, hit.normal, weight, random);
            let before = std::mem::replace(&mut light, self.channels.luminance(weight));
            sums.absorbed += before - light;
            if order + 1 >= CERTAIN {
                if !survives(weight, random) {
                    // What chance takes here it gives to those that go on.
                    sums.absorbed += light;
                    return None;
                }
                let kept = self.channels.luminance(weight);
                sums.absorbed += light - kept;
                light = kept;
            }
            ray = hit.turned(next);
        }
        sums.lost += 1;
        None
    }

    /// A path of light from the hemisphere to wherever it leaves, begun where `start` puts numbers of [0, 1)²: shares of the period.
    pub(super) fn draw(
        &self,
        start: impl FnOnce([f64; 2]) -> [f64; 2],
        last: usize,
        weight: &mut ChannelValues,
        random: &mut RandomStream,
    ) -> Option<LightPath> {
        let omega_i = cosine_hemisphere([random.next(), random.next()]);
        let start = start([random.next(), random.next()]);
        let ray = self.tracer.from_sky(start, -omega_i.vector());
        let left = self.path(ray, last, weight, random, &mut Sums::default());
        left_by(omega_i, left, || self.channels.luminance(weight))
    }

    /// Follows light from `from`, begun at `start` (shares of the period), and adds what each facet sends to `to`, both above the
    /// horizon: f_r in sr⁻¹ of each scattering order, one sample of it. Facets are not mirrors.
    pub(super) fn light(
        &self,
        [from, to]: [DVec3; 2],
        start: [f64; 2],
        last: usize,
        random: &mut RandomStream,
        bounces: &mut Bounces,
    ) {
        let mut ray = self.tracer.from_sky(start, -from);
        let mut weight: ChannelValues = smallvec![1.0; self.channels.count()];
        let mut lit = weight.clone();
        let cos_to = to.z.max(DENOMINATOR_FLOOR);
        for order in 1..=last.min(TRAPPED) {
            let Exit::Hit(hit) = self.tracer.follow(ray) else {
                return;
            };
            let back = -hit.ray.direction;
            let cosine = hit.normal.dot(to);
            if cosine > 0.0 && matches!(self.tracer.follow(hit.turned(to)), Exit::Sky) {
                let scale = cosine / cos_to;
                self.facets.value(back, to, hit.normal, &mut lit);
                bounces.add(order, weight.iter().zip(&lit).map(|(w, f)| w * f * scale));
            }
            if order == last {
                return;
            }
            let next = self.facets.scatter(back, hit.normal, &mut weight, random);
            if order >= CERTAIN && !survives(&mut weight, random) {
                return;
            }
            ray = hit.turned(next);
        }
    }

    /// True if a point sees the sky in both directions, unit vectors.
    pub(super) fn is_seen(&self, point: &Hit, directions: [DVec3; 2]) -> bool {
        directions.into_iter().all(|d| {
            point.normal.dot(d) > 0.0 && matches!(self.tracer.follow(point.turned(d)), Exit::Sky)
        })
    }
}

impl Sums {
    fn plus(self, other: Self) -> Self {
        let add =
            |a: [f64; CLASSES + 1], b: [f64; CLASSES + 1]| std::array::from_fn(|i| a[i] + b[i]);
        Self {
            rays: self.rays + other.rays,
            value: add(self.value, other.value),
            square: add(self.square, other.square),
            absorbed: self.absorbed + other.absorbed,
            masked: self.masked + other.masked,
            lost: self.lost + other.lost,
            segments: self.segments + other.segments,
        }
    }
}
