//! Paths of several mirrors, counted about a pair.
//!
//! A path that met mirrors has left in one direction: it says nothing of any pair but its own. So N paths that began as the cosine
//! of the hemisphere are kept, and f_r of a pair is the light of those within an angle r of its light and of its sensor:
//!
//! f_r = Σ w / (N p ∫ cos θ_o dω_o),   p the share of light that comes from about ω_i, the integral over the cone about ω_o.
//!
//! Where the surface looks the same however it is turned, p is of a ring of elevations, and paths are turned to the light of the pair.
//! A path backwards is a path, so all of them count twice.

use super::accumulate::seen;
use super::normals::{BLOCKS, block_of};
use super::transport::{Drawn, Transport};
use crate::brdf::{CLASSES, ChannelValues, Channels, Part, Split, SplitErrors};
use crate::geometry::Symmetry;
use crate::sampling::{Random, gauss_legendre};
use glam::DVec3;
use rayon::prelude::*;
use smallvec::smallvec;
use std::f64::consts::{FRAC_PI_2, PI};

/// Paths of a block, which has numbers of its own.
const BLOCK: u64 = 1 << 14;

/// The largest number of squares along an axis: memory of four axes.
const MOST: f64 = 48.0;

/// A path: its place among the squares of (ω_i, ω_o), who made it, and what it met.
#[derive(Clone, Copy, Default)]
pub(super) struct Event {
    /// x and y of ω_i and of ω_o; turned so that ω_i has no y if the surface may be turned.
    at: [f32; 4],
    group: u16,
    class: u8,
}

/// Paths that met two facets or more.
pub(super) struct Gathered {
    radius: f64,
    symmetry: Symmetry,
    channels: usize,
    /// Paths that were begun.
    begun: f64,
    /// Blocks of all surfaces: what they differ by tells what a surface more would change.
    groups: usize,
    per_unit: f64,
    across: [usize; 4],
    first: Vec<u32>,
    events: Vec<Event>,
    /// Of each event, channels together.
    light: Vec<f32>,
}

/// How paths are drawn.
#[derive(Clone, Copy)]
pub(super) struct Drawing {
    /// Angle about light and sensor.
    pub radius: f64,
    /// Paths in all.
    pub rays: u64,
    /// Illuminated part of the edges of a period.
    pub spot: f64,
    /// Facets after which a path is not followed.
    pub last: usize,
    pub symmetry: Symmetry,
}

impl Gathered {
    /// Paths through several surfaces of a kind.
    pub(super) fn new(surfaces: &[Transport], random: &Random, drawing: Drawing) -> Self {
        let Drawing {
            radius,
            rays,
            spot,
            last,
            symmetry,
        } = drawing;
        let channels = surfaces[0].channels().count();
        let blocks = rays.div_ceil(BLOCK);
        let parts: Vec<(Vec<Event>, Vec<f32>)> = (0..blocks)
            .into_par_iter()
            .map(|block| {
                let mut stream = random.stream(block);
                let surface = block as usize % surfaces.len();
                let (mut events, mut light) = (Vec::new(), Vec::new());
                for _ in 0..BLOCK.min(rays - block * BLOCK) {
                    let mut weight: ChannelValues = smallvec![1.0; channels];
                    let drawn = surfaces[surface].draw(spot, last, &mut weight, &mut stream);
                    if let Some(drawn) = drawn.filter(|drawn| drawn.met > 1) {
                        let group = surface * BLOCKS + block_of(drawn.start.map(|s| s / spot));
                        events.push(event(&drawn, symmetry, group));
                        light.extend(weight.iter().map(|w| *w as f32));
                    }
                }
                (events, light)
            })
            .collect();
        let across = (2.0 / radius).clamp(1.0, MOST) as usize;
        let per_unit = across as f64 / 2.0;
        let across = [
            across,
            if symmetry.isotropic { 1 } else { across },
            across,
            across,
        ];
        let square = |event: &Event| index(event.at.map(f64::from), per_unit, across);
        let count = parts.iter().map(|(events, _)| events.len()).sum();
        let mut first = vec![0u32; across.iter().product::<usize>() + 1];
        let all = || parts.iter().flat_map(|(events, _)| events);
        all().for_each(|event| first[square(event) + 1] += 1);
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let mut next = first.clone();
        let mut events = vec![Event::default(); count];
        let mut light = vec![0.0; count * channels];
        let lights = parts.iter().flat_map(|(_, light)| light.chunks(channels));
        for (event, values) in all().zip(lights) {
            let to = &mut next[square(event)];
            let place = *to as usize;
            events[place] = *event;
            light[place * channels..][..channels].copy_from_slice(values);
            *to += 1;
        }
        Self {
            radius,
            symmetry,
            channels,
            begun: rays as f64,
            groups: surfaces.len() * BLOCKS,
            per_unit,
            across,
            first,
            events,
            light,
        }
    }

    /// Light of two facets and more at a pair: in the channels that it was `followed` in, for a scene in `channels`.
    pub(super) fn split(
        &self,
        pair: [DVec3; 2],
        followed: &Channels,
        channels: &Channels,
    ) -> Split {
        let mut found: Vec<(u32, f64)> = Vec::new();
        let images = images(pair, self.symmetry);
        for image in &images {
            let [light, sensor] = image.map(|v| v.x.hypot(v.y).atan2(v.z));
            let share = match self.symmetry.isotropic {
                true => ring(light, self.radius),
                false => cone(light, self.radius) / PI,
            };
            let scale = self.begun * share * cone(sensor, self.radius) * images.len() as f64;
            if scale > 0.0 {
                self.about(*image, |event| found.push((event, 1.0 / scale)));
            }
        }
        // A path that is near in several ways is one path.
        found.sort_unstable_by_key(|(event, _)| *event);
        let mut value = [(); CLASSES].map(|()| ChannelValues::from_elem(0.0, self.channels));
        let mut squares = [0.0; CLASSES + 1];
        let mut sums = vec![[0.0; CLASSES + 1]; self.groups];
        for same in found.chunk_by(|a, b| a.0 == b.0) {
            let place = same[0].0 as usize;
            let scale = same.iter().map(|(_, scale)| scale).sum::<f64>();
            let event = &self.events[place];
            let light = &self.light[place * self.channels..][..self.channels];
            let light: ChannelValues = light.iter().map(|w| scale * f64::from(*w)).collect();
            let luminance = followed.luminance(&light);
            let class = usize::from(event.class);
            value[class]
                .iter_mut()
                .zip(&light)
                .for_each(|(v, l)| *v += l);
            for i in [class, CLASSES] {
                squares[i] += luminance * luminance;
                sums[usize::from(event.group)][i] += luminance;
            }
        }
        let realisation = beyond(&sums, squares);
        Split {
            value: value.map(|v| seen(v, followed, channels)),
            transport: errors(squares.map(f64::sqrt)),
            realisation: errors(realisation),
        }
    }

    /// Events near a pair.
    fn about(&self, [light, sensor]: [DVec3; 2], mut each: impl FnMut(u32)) {
        let isotropic = self.symmetry.isotropic;
        let at = placed([light, sensor], isotropic);
        let chord2 = (2.0 * (0.5 * self.radius).sin()).powi(2);
        let light = lifted(at[0], at[1]);
        let sensor = lifted(at[2], at[3]);
        // Sines of a ring of elevations.
        let elevation = at[0].atan2(light.z);
        let ring = (elevation - self.radius).sin()..(elevation + self.radius).min(FRAC_PI_2).sin();
        let places: [i64; 4] =
            std::array::from_fn(|i| place(at[i], self.per_unit, self.across[i]) as i64);
        let near = |i: usize| {
            let last = self.across[i] as i64 - 1;
            (places[i] - 1).max(0)..=(places[i] + 1).min(last)
        };
        for i in near(0) {
            for j in near(1) {
                for k in near(2) {
                    let [_, b, c, d] = self.across.map(|n| n as i64);
                    let row = ((i * b + j) * c + k) * d;
                    let last = near(3);
                    let range = [row + last.start(), row + last.end() + 1];
                    let [low, high] = range.map(|place| self.first[place as usize]);
                    for index in low..high {
                        let [x, y, u, v] = self.events[index as usize].at.map(f64::from);
                        let near = match isotropic {
                            true => ring.contains(&x),
                            false => is_within([x, y], light, chord2),
                        };
                        if near && is_within([u, v], sensor, chord2) {
                            each(index);
                        }
                    }
                }
            }
        }
    }
}

/// What groups differ by more than `squares`, the squared errors of the paths, explain: the standard errors of the sums over all
/// groups that more surface removes.
pub(super) fn beyond(
    sums: &[[f64; CLASSES + 1]],
    squares: [f64; CLASSES + 1],
) -> [f64; CLASSES + 1] {
    let n = sums.len() as f64;
    std::array::from_fn(|i| {
        let mean = sums.iter().map(|s| s[i]).sum::<f64>() / n;
        let spread = sums.iter().map(|s| (s[i] - mean).powi(2)).sum::<f64>();
        let whole = spread * n / (n - 1.0).max(1.0);
        (whole - squares[i]).max(0.0).sqrt()
    })
}

/// Of each class, and of their sum.
pub(super) fn errors([a, b, c, sum]: [f64; CLASSES + 1]) -> SplitErrors {
    SplitErrors {
        classes: [a, b, c],
        sum,
    }
}

/// Pairs that mean the same as `pair` by exchange and by mirrors; turns about the normal are left out.
fn images([a, b]: [DVec3; 2], symmetry: Symmetry) -> Vec<[DVec3; 2]> {
    let mirrors: &[DVec3] = match symmetry {
        // Of a pair that is turned to its light the mirror is in y.
        Symmetry {
            isotropic: true,
            bilateral: true,
            ..
        } => &MIRRORS[..2],
        Symmetry {
            bilateral: true, ..
        } => &MIRRORS,
        _ => &MIRRORS[..1],
    };
    let ways = [[a, b], [b, a]].into_iter();
    ways.flat_map(|way| mirrors.iter().map(move |m| way.map(|v| v * *m)))
        .collect()
}

/// Factors of x, y and z: none, across y, across x, across both.
pub(super) const MIRRORS: [DVec3; 4] = [
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, 1.0),
    DVec3::new(-1.0, -1.0, 1.0),
];

/// x and y of both directions, turned to the light if the surface may be turned.
fn placed([light, sensor]: [DVec3; 2], isotropic: bool) -> [f64; 4] {
    let radius = light.x.hypot(light.y);
    if !isotropic {
        return [light.x, light.y, sensor.x, sensor.y];
    }
    let [cos, sin] = match radius > 0.0 {
        true => [light.x / radius, light.y / radius],
        false => [1.0, 0.0],
    };
    [
        radius,
        0.0,
        cos * sensor.x + sin * sensor.y,
        cos * sensor.y - sin * sensor.x,
    ]
}

fn event(drawn: &Drawn, symmetry: Symmetry, group: usize) -> Event {
    let at = placed(drawn.pair.vectors(), symmetry.isotropic);
    Event {
        at: at.map(|x| x as f32),
        group: group as u16,
        class: Part::of(drawn.met).classes().start as u8,
    }
}

/// True if the unit vector of these x and y is within a chord of another one.
#[inline]
fn is_within([x, y]: [f64; 2], other: DVec3, chord2: f64) -> bool {
    // In the plane they are nearer to each other.
    (x - other.x).powi(2) + (y - other.y).powi(2) < chord2
        && (lifted(x, y) - other).length_squared() < chord2
}

/// The unit vector above the horizon of these x and y.
fn lifted(x: f64, y: f64) -> DVec3 {
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

fn place(x: f64, per_unit: f64, across: usize) -> usize {
    (((x + 1.0) * per_unit) as usize).min(across - 1)
}

fn index(at: [f64; 4], per_unit: f64, across: [usize; 4]) -> usize {
    (0..4).fold(0, |sum, i| {
        sum * across[i] + place(at[i], per_unit, across[i])
    })
}

/// Share of cosine-distributed directions within `radius` of an elevation.
fn ring(elevation: f64, radius: f64) -> f64 {
    let [low, high] = [elevation - radius, elevation + radius];
    high.min(FRAC_PI_2).sin().powi(2) - low.max(0.0).sin().powi(2)
}

/// ∫ cos θ dω over the part above the horizon of a cone of an angle `radius` about an elevation.
fn cone(elevation: f64, radius: f64) -> f64 {
    if elevation + radius <= FRAC_PI_2 {
        return PI * radius.sin().powi(2) * elevation.cos();
    }
    // Rings of the cone of angle t, cut by the horizon: an azimuth of theirs is above it where
    // cos t cos θ + sin t sin θ cos φ > 0.
    let (sin, cos) = elevation.sin_cos();
    let ring = |t: f64| {
        let (a, b) = (t.cos() * cos, t.sin() * sin);
        let up = match a < b {
            true => (-a / b).acos(),
            false => PI,
        };
        2.0 * t.sin() * (a * up + b * up.sin())
    };
    // The cut begins at a kink.
    let kink = (FRAC_PI_2 - elevation).clamp(0.0, radius);
    let part = |low: f64, high: f64| {
        let nodes = gauss_legendre(16);
        let sum: f64 = nodes
            .iter()
            .map(|(x, w)| w * ring(0.5 * ((high - low) * x + high + low)))
            .sum();
        0.5 * (high - low) * sum
    };
    part(0.0, kink) + part(kink, radius)
}
