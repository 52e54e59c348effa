//! Paths of several mirrors, counted about a pair.
//!
//! A path that met mirrors has left in one direction: it says nothing of any pair but its own. So N paths that began as the cosine
//! of the hemisphere are kept, and f_r of a pair is the light of those within an angle r of its light and of its sensor:
//!
//! f_r = Σ w π/(N ∫ cos θ_i dω_i ∫ cos θ_o dω_o),   integrals over the cones about the pair's light and sensor.
//!
//! A path backwards is a path, so pairs are exchanged; and mirrored, where the surface looks the same, and values are means over all
//! of these. (Of a surface that looks the same however it is turned, light is counted at nodes, as it leaves.)

use super::accumulate::seen;
use super::normals::{BLOCKS, Squares, block_of, firsts};
use super::transport::Transport;
use crate::brdf::{CLASSES, ChannelValues, Channels, LightPath, Part, Split, SplitErrors};
use crate::geometry::Symmetry;
use crate::sampling::{Random, gauss_legendre};
use glam::DVec3;
use rayon::prelude::*;
use smallvec::smallvec;
use std::f64::consts::{FRAC_PI_2, PI};

/// Paths of a block at most, which has numbers of its own.
const BLOCK: usize = 1 << 14;

/// The largest number of squares along an axis: memory of four axes.
const MOST: f64 = 48.0;

/// A path: its place among the squares of (ω_i, ω_o), who made it, and what it met.
#[derive(Clone, Copy, Default)]
pub(super) struct Event {
    /// x and y of ω_i and of ω_o.
    at: [f32; 4],
    group: u16,
    class: u8,
}

/// Paths that met two facets or more.
pub(super) struct Gathered {
    drawing: Drawing,
    channels: usize,
    /// Blocks of all surfaces: their scatter is the error that more surface removes.
    groups: usize,
    squares: Squares,
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
    pub rays: usize,
    /// Illuminated part of the edges of a period.
    pub spot: f64,
    /// Facets after which a path is not followed.
    pub last: usize,
    pub symmetry: Symmetry,
}

impl Gathered {
    /// Paths through several surfaces of a kind.
    pub(super) fn new(surfaces: &[Transport], random: &Random, drawing: Drawing) -> Self {
        let rays = drawing.rays;
        let channels = surfaces[0].channels.count();
        // Each surface has some, of few paths too.
        let block = BLOCK.min(rays.div_ceil(surfaces.len()));
        let parts: Vec<(Vec<Event>, Vec<f32>)> = (0..rays.div_ceil(block))
            .into_par_iter()
            .map(|place| {
                let mut stream = random.stream(place as u64);
                let surface = place % surfaces.len();
                let (mut events, mut light) = (Vec::new(), Vec::new());
                for _ in 0..block.min(rays - place * block) {
                    let mut weight: ChannelValues = smallvec![1.0; channels];
                    let mut group = surface * BLOCKS;
                    let start = |u: [f64; 2]| {
                        group += block_of(u);
                        u.map(|s| s * drawing.spot)
                    };
                    let drawn =
                        surfaces[surface].draw(start, drawing.last, &mut weight, &mut stream);
                    if let Some(drawn) = drawn.filter(|drawn| drawn.order > 1) {
                        events.push(event(&drawn, group));
                        light.extend(weight.iter().map(|w| *w as f32));
                    }
                }
                (events, light)
            })
            .collect();
        let squares = Squares::new(drawing.radius, MOST);
        let square = |event: &Event| squares.index(event.at.map(f64::from));
        let count = parts.iter().map(|(events, _)| events.len()).sum();
        let all = parts.iter().flat_map(|(events, _)| events);
        let first = firsts(squares.across.pow(4), all.map(square));
        let mut next = first.clone();
        let mut events = vec![Event::default(); count];
        let mut light = vec![0.0; count * channels];
        // Each part is let go once it is in its place.
        for (of_part, values) in parts {
            for (event, values) in of_part.iter().zip(values.chunks(channels)) {
                let to = &mut next[square(event)];
                let place = *to as usize;
                events[place] = *event;
                light[place * channels..][..channels].copy_from_slice(values);
                *to += 1;
            }
        }
        Self {
            drawing,
            channels,
            groups: surfaces.len() * BLOCKS,
            squares,
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
        let images = images(pair, self.drawing.symmetry);
        // What a path brings; elevations, and so the cones, are those of the pair in every image.
        let [light, sensor] = pair.map(|v| cone(v.x.hypot(v.y).atan2(v.z), self.drawing.radius));
        let measure = self.drawing.rays as f64 * light * sensor * images.len() as f64 / PI;
        let one = if measure > 0.0 { 1.0 / measure } else { 0.0 };
        let mut found: Vec<u32> = Vec::new();
        images
            .iter()
            .for_each(|image| self.about(*image, |event| found.push(event)));
        // A path that is near in several ways is one path.
        found.sort_unstable();
        let mut value = [(); CLASSES].map(|()| ChannelValues::from_elem(0.0, self.channels));
        let mut squares = [0.0; CLASSES + 1];
        let mut sums = vec![[0.0; CLASSES + 1]; self.groups];
        for same in found.chunk_by(|a, b| a == b) {
            let place = same[0] as usize;
            let scale = one * same.len() as f64;
            let event = &self.events[place];
            let light = &self.light[place * self.channels..][..self.channels];
            let light: ChannelValues = light.iter().map(|w| scale * f64::from(*w)).collect();
            let luminance = followed.luminance(&light);
            let class = usize::from(event.class);
            let of_class = value[class].iter_mut().zip(&light);
            of_class.for_each(|(v, l)| *v += l);
            for i in [class, CLASSES] {
                squares[i] += luminance * luminance;
                sums[usize::from(event.group)][i] += luminance;
            }
        }
        let realisation = beyond(&sums, squares);
        with_unseen(&mut squares[1..], one * one);
        Split {
            value: value.map(|v| seen(v, followed, channels)),
            transport: SplitErrors(squares.map(f64::sqrt)),
            realisation: SplitErrors(realisation),
        }
    }

    /// A number that pairs near each other have in common: much of their light is that of the same paths.
    pub(super) fn place(&self, pair: [DVec3; 2]) -> u64 {
        let steps =
            pair.map(|v| [v.x, v.y].map(|x| ((x + 1.0) / (2.0 * self.drawing.radius)) as u64));
        let steps = steps.as_flattened().iter();
        steps.fold(0, |all, s| all << 15 | s.min(&0x7fff))
    }

    fn about(&self, [light, sensor]: [DVec3; 2], mut each: impl FnMut(u32)) {
        let chord2 = (2.0 * (0.5 * self.drawing.radius).sin()).powi(2);
        let across = self.squares.across;
        let near = |x: f64| {
            let part = self.squares.part(x);
            part.saturating_sub(1)..(part + 2).min(across)
        };
        for i in near(light.x) {
            for j in near(light.y) {
                for k in near(sensor.x) {
                    let row = ((i * across + j) * across + k) * across;
                    let last = near(sensor.y);
                    let [low, high] = [last.start, last.end].map(|l| self.first[row + l]);
                    for index in low..high {
                        let [x, y, u, v] = self.events[index as usize].at.map(f64::from);
                        if is_within([x, y], light, chord2) && is_within([u, v], sensor, chord2) {
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
    std::array::from_fn(|i| {
        let (sum, square) = sums.iter().fold((0.0, 0.0), |(sum, square), s| {
            (sum + s[i], square + s[i] * s[i])
        });
        more_surface(sums.len(), sum, square, squares[i])
    })
}

/// Gives classes without paths the squared error `one` of a single path, and adds that to their sum, the last one.
pub(super) fn with_unseen(squares: &mut [f64], one: f64) {
    if let [classes @ .., sum] = squares {
        for square in classes.iter_mut().filter(|s| **s == 0.0) {
            *square = one;
            *sum += one;
        }
    }
}

/// Standard error that only more surface reduces, of `groups` groups: from their sum, the sum of their squares, and the part
/// `of_paths` of that sum which is the variance of the paths.
pub(super) fn more_surface(groups: usize, sum: f64, square: f64, of_paths: f64) -> f64 {
    let n = groups as f64;
    let spread = (square - sum * sum / n).max(0.0);
    (spread * n / (n - 1.0).max(1.0) - of_paths).max(0.0).sqrt()
}

/// Pairs that mean the same as `pair`, by exchange and mirrors.
fn images([a, b]: [DVec3; 2], symmetry: Symmetry) -> Vec<[DVec3; 2]> {
    let mirrors = if symmetry.bilateral { 4 } else { 1 };
    let ways = [[a, b], [b, a]].into_iter();
    ways.flat_map(|way| MIRRORS[..mirrors].iter().map(move |m| way.map(|v| v * *m)))
        .collect()
}

/// Factors of x, y and z: none, across y, across x, across both.
pub(super) const MIRRORS: [DVec3; 4] = [
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, 1.0),
    DVec3::new(-1.0, -1.0, 1.0),
];

fn event(drawn: &LightPath, group: usize) -> Event {
    let [light, sensor] = drawn.pair.vectors();
    Event {
        at: [light.x, light.y, sensor.x, sensor.y].map(|x| x as f32),
        group: group as u16,
        class: Part::from_order(drawn.order).classes().start as u8,
    }
}

/// True if the unit vector of these x and y is within a chord of another one.
#[inline]
fn is_within([x, y]: [f64; 2], other: DVec3, chord2: f64) -> bool {
    // In the plane they are nearer to each other.
    (x - other.x).powi(2) + (y - other.y).powi(2) < chord2
        && (lifted(x, y) - other).length_squared() < chord2
}

fn lifted(x: f64, y: f64) -> DVec3 {
    DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
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
