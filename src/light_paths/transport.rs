//! Light that goes through a surface, counted by the number of facets it met.

use super::facets::{Facets, survives};
use super::surface::HeightField;
use super::trace::{Exit, Ray, Tracer};
use super::{FacetsSpec, accumulate};
use crate::brdf::{CLASSES, ChannelValues, Channels};
use crate::geometry::Direction;
use crate::sampling::Random;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use smallvec::smallvec;

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
    /// Facets after which a ray is not followed; what has more is left out.
    pub last: usize,
}

/// Shares of the light of one direction: luminance. Standard errors are of the rays, not of the surface, and at most as large as
/// told: as if rays had begun anywhere, though they are spread evenly.
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
    /// Rays that neither left nor were absorbed: lost along a groove, or trapped.
    pub lost: u64,
    /// Ways from facet to facet, to the first and from the last one included.
    pub segments: u64,
}

/// A surface and what its facets do.
pub struct Transport<'a> {
    tracer: Tracer<'a>,
    facets: Facets,
    channels: Channels,
}

/// Sums of a block.
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

impl<'a> Transport<'a> {
    /// Light through `field`.
    pub fn new(field: &'a HeightField, facets: &FacetsSpec, channels: &Channels) -> Self {
        let channels = accumulate::followed(channels, facets.distinct(channels));
        Self {
            tracer: Tracer::new(field),
            facets: Facets::new(facets, &channels),
            channels,
        }
    }

    /// Where the light of a direction goes.
    pub fn energies(&self, omega_i: Direction, spec: &TransportSpec) -> Energies {
        let random = Random::new(spec.seed);
        let blocks = spec.rays.div_ceil(BLOCK);
        let sums: Vec<Sums> = (0..blocks)
            .into_par_iter()
            .map(|block| {
                let mut stream = random.stream(block);
                let mut sums = Sums::default();
                let first = block * BLOCK;
                let rays = BLOCK.min(spec.rays - first);
                for ray in 0..rays {
                    // A block takes a strip of the period, from left to right: rays meet what the last ones met.
                    let x = (ray as f64 + stream.next()) / rays as f64;
                    let y = (first as f64 + rays as f64 * stream.next()) / spec.rays as f64;
                    let ray = self.tracer.from_sky([x, y], -omega_i.vector());
                    let path = self.path(ray, spec.last, &mut stream, &mut sums);
                    sums.rays += 1.0;
                    if let Some((_, met, energy)) = path {
                        for class in [met.min(CLASSES) - 1, CLASSES] {
                            sums.value[class] += energy;
                            sums.square[class] += energy * energy;
                        }
                    }
                }
                sums
            })
            .collect();
        let total = sums.into_iter().fold(Sums::default(), Sums::plus);
        let n = total.rays.max(1.0);
        let mean = total.value.map(|v| v / n);
        let error = |i: usize| ((total.square[i] / n - mean[i] * mean[i]).max(0.0) / n).sqrt();
        Energies {
            bounces: std::array::from_fn(|i| mean[i]),
            errors: std::array::from_fn(error),
            error_of_sum: error(CLASSES),
            absorbed: total.absorbed / n,
            masked: total.masked as f64 / n,
            lost: total.lost,
            segments: total.segments,
        }
    }

    /// A path of a ray from the sky: where it leaves, the facets it met, and its luminance; `None` if it does not leave.
    fn path(
        &self,
        mut ray: Ray,
        last: usize,
        random: &mut crate::sampling::RandomStream,
        sums: &mut Sums,
    ) -> Option<(DVec3, usize, f64)> {
        let mut weight: ChannelValues = smallvec![1.0; self.channels.count()];
        let mut light = 1.0;
        for met in 0..TRAPPED {
            sums.segments += 1;
            let hit = match self.tracer.follow(ray) {
                Exit::Hit(hit) => hit,
                Exit::Sky if met == 0 => break,
                Exit::Sky => return Some((ray.direction(), met, light)),
                Exit::Lost => break,
            };
            if met == 1 {
                sums.masked += 1;
            }
            if met == last {
                return None;
            }
            let back = -hit.direction();
            let before = light;
            let next = self.facets.scatter(back, hit.normal, &mut weight, random);
            light = self.channels.luminance(&weight);
            sums.absorbed += before - light;
            if met + 1 >= CERTAIN {
                if !survives(&mut weight, random) {
                    // What chance takes here it gives to those that go on.
                    sums.absorbed += light;
                    return None;
                }
                let kept = self.channels.luminance(&weight);
                sums.absorbed += light - kept;
                light = kept;
            }
            ray = hit.turned(next);
        }
        sums.lost += 1;
        None
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
