//! Pixels of pictures, made few readings.
//!
//! Of each stop the rectangle of half/difference coordinates that its pixels fill, √θ_h and the others as shares of their ranges, is
//! halved across its longest side, and again and again the part of the longest side, until there are so many parts as nodes
//! are asked for, or each is one pixel. The reading of a part is the mean over a patch, at its mean coordinates: the pixel nearest to
//! the mean of the part and those of the part within θ_h/16 of it, and within 2° times the lesser cosine, by
//! √(Δθ_h² + Δθ_d² + sin²θ_h Δφ²). Type A is the larger of the
//! standard error of the mean and of the root mean square of what the pixels state, part of which they share; type B is the mean. Pixels
//! between patches, and those with a direction beyond 85°, are left out.

use super::merge::Pool;
use super::{Measurement, Outcome};
use crate::error::count;
use crate::geometry::DirectionPair;
use crate::parametrization::{Coords, Form, HalfDifference, Parametrization};
use crate::schedule::{Pose, Schedule};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::f64::consts::PI;
use std::sync::Arc;

/// Radius of a patch as a share of θ_h, at most: the mean over it of a lobe that falls as θ_h⁻⁴ is .8 % above its middle.
const CLEAR: f64 = 1.0 / 16.0;

/// Radius of a patch over the lesser cosine, at most, rad.
const WIDEST: f64 = 2.0 * PI / 180.0;

/// Largest angle of a direction from the normal, rad.
const WITHIN: f64 = 85.0 * PI / 180.0;

/// What became of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Thinned {
    pub pixels: usize,
    pub stops: usize,
    pub nodes: usize,
    /// Pixels that a reading is a mean of.
    pub used: usize,
    /// Pixels beyond the largest angle.
    pub grazing: usize,
}

impl Thinned {
    /// What was done, for the user.
    pub(super) fn note(&self) -> String {
        let pixels = count(self.pixels, "pixel");
        let [stops, nodes] =
            [(self.stops, "stop"), (self.nodes, "reading")].map(|(n, of)| count(n, of));
        let (used, grazing) = (self.used, self.grazing);
        let between = self.pixels - used - grazing;
        format!(
            "{pixels} of {stops}: {nodes}, means over patches of {used} of them; {between} between patches and {grazing} beyond 85° are left out"
        )
    }
}

/// A part of a stop.
#[derive(Default)]
struct Part {
    pixels: Vec<usize>,
    axis: usize,
    /// Its longest side, as a share of the range.
    side: f64,
    middle: f64,
}

/// Half/difference coordinates of poses, rad, and as shares of their ranges, √θ_h first.
struct Places<'a> {
    poses: &'a [Pose],
    form: Form<HalfDifference>,
    angles: Vec<Coords>,
    shares: Vec<Coords>,
    /// True of the axes that are azimuths.
    is_azimuth: [bool; 4],
}

impl<'a> Places<'a> {
    fn new(schedule: &'a Schedule) -> Self {
        let form = Form::<HalfDifference>::new(schedule.parametrization.symmetry());
        let (mut lengths, mut is_azimuth) = ([1.0; 4], [false; 4]);
        for (d, axis) in form.axes().iter().enumerate() {
            lengths[d] = axis.length();
            is_azimuth[d] = axis.symbol.starts_with("phi");
        }
        let poses = schedule.poses.iter();
        let angles: Vec<Coords> = poses.map(|pose| form.forward(&pose.pair)).collect();
        let share = |at: &Coords| {
            let mut share: Coords = std::array::from_fn(|d| at[d] / lengths[d]);
            share[0] = share[0].sqrt();
            share
        };
        Self {
            shares: angles.iter().map(share).collect(),
            poses: &schedule.poses,
            form,
            angles,
            is_azimuth,
        }
    }

    /// The pair at the mean coordinates of some poses, or the first of them.
    fn mean(&self, of: &[usize]) -> DirectionPair {
        let sum = |d: usize| of.iter().map(|&i| self.angles[i][d]).sum::<f64>();
        let mean = std::array::from_fn(|d| sum(d) / of.len() as f64);
        self.form.inverse(&mean).unwrap_or(self.poses[of[0]].pair)
    }

    /// How far two poses are apart, rad.
    fn distance(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (&self.angles[a], &self.angles[b]);
        let sine = a[0].sin();
        let square = |d: usize| {
            let scale = if self.is_azimuth[d] { sine } else { 1.0 };
            (scale * (a[d] - b[d])).powi(2)
        };
        (0..4).map(square).sum::<f64>().sqrt()
    }
}

impl Part {
    fn new(pixels: Vec<usize>, at: &Places<'_>) -> Self {
        let side = |axis: usize| {
            let all = pixels.iter().map(|&i| at.shares[i][axis]);
            let (low, high) = all.fold((f64::MAX, f64::MIN), |(low, high), x| {
                (low.min(x), high.max(x))
            });
            (axis, high - low, 0.5 * (low + high))
        };
        let longest = (0..4).map(side).max_by(|a, b| a.1.total_cmp(&b.1));
        let (axis, side, middle) = longest.unwrap_or_default();
        Self {
            pixels,
            axis,
            side,
            middle,
        }
    }

    fn halves(self, at: &Places<'_>) -> [Self; 2] {
        let below = |i: &usize| at.shares[*i][self.axis] <= self.middle;
        let (low, high) = self.pixels.into_iter().partition(below);
        [low, high].map(|pixels| Self::new(pixels, at))
    }

    /// The pixels that its reading is the mean of, the middle one first.
    fn patch(self, at: &Places<'_>) -> Vec<usize> {
        let n = self.pixels.len() as f64;
        let mean: Coords = std::array::from_fn(|axis| {
            self.pixels.iter().map(|&i| at.shares[i][axis]).sum::<f64>() / n
        });
        let off = |i: usize| -> f64 {
            let all = at.shares[i].iter().zip(mean);
            all.map(|(x, mean)| (x - mean).powi(2)).sum()
        };
        let all = self.pixels.iter().copied();
        let nearest = all.min_by(|&a, &b| off(a).total_cmp(&off(b)));
        let node = nearest.unwrap_or_default();
        let widest = WIDEST * at.poses[node].pair.least_cosine();
        let radius = widest.min(CLEAR * at.angles[node][0]);
        let near = |i: &usize| *i != node && at.distance(node, *i) <= radius;
        let others = self.pixels.into_iter().filter(near);
        std::iter::once(node).chain(others).collect()
    }
}

/// Parts of a stop, at most so many.
fn parts(pixels: Vec<usize>, at: &Places<'_>, most: usize) -> Vec<Part> {
    let mut parts = vec![Part::new(pixels, at)];
    // Sides are not negative, so that their bits are in their order.
    let mut longest = BinaryHeap::from([(parts[0].side.to_bits(), Reverse(0))]);
    while parts.len() < most {
        let Some((1.., Reverse(k))) = longest.pop() else {
            break;
        };
        let [low, high] = std::mem::take(&mut parts[k]).halves(at);
        for (number, part) in [(k, low), (parts.len(), high)] {
            longest.push((part.side.to_bits(), Reverse(number)));
            match parts.get_mut(number) {
                Some(place) => *place = part,
                None => parts.push(part),
            }
        }
    }
    parts
}

impl Measurement {
    /// The measurement with at most `nodes` readings of each stop; `stops` has the stop of each pose.
    pub(super) fn thinned(self, stops: &[f64], nodes: usize) -> (Self, Thinned) {
        let (poses, at) = (&self.schedule.poses, Places::new(&self.schedule));
        let is_read = |i: &usize| self.outcomes[*i] == Outcome::Reading;
        let mut pixels: Vec<usize> = (0..poses.len()).filter(is_read).collect();
        let mut thinned = Thinned {
            pixels: pixels.len(),
            ..Thinned::default()
        };
        pixels.retain(|&i| poses[i].pair.least_cosine() >= WITHIN.cos());
        thinned.grazing = thinned.pixels - pixels.len();
        // Whatever the order of the file.
        pixels.sort_by(|&a, &b| {
            let by_place = || at.shares[a].partial_cmp(&at.shares[b]);
            let by_stop = stops[a].total_cmp(&stops[b]);
            by_stop.then_with(|| by_place().unwrap_or(Ordering::Equal))
        });
        let mut patches = Vec::new();
        for stop in pixels.chunk_by(|&a, &b| stops[a] == stops[b]) {
            thinned.stops += 1;
            let parts = parts(stop.to_vec(), &at, nodes).into_iter();
            patches.extend(parts.map(|part| part.patch(&at)));
        }
        thinned.nodes = patches.len();
        thinned.used = patches.iter().map(Vec::len).sum();
        let n = self.channels.count();
        let mut pool = Pool::new(patches.len(), n);
        for (reading, patch) in patches.iter().enumerate() {
            for &i in patch {
                pool.take(reading, &self, i);
            }
        }
        let form = &self.schedule.parametrization;
        let pose = |patch: &Vec<usize>| {
            let pair = at.mean(patch);
            let coords = form.forward(&pair);
            Pose { coords, pair }
        };
        let schedule = Arc::new(Schedule {
            poses: patches.iter().map(pose).collect(),
            lattice: None,
            ..Schedule::clone(&self.schedule)
        });
        let mut made = pool.measurement(schedule, self.channels.clone(), self.details.is_some());
        // Part of what pixels of one picture err by is that of the picture: means do not lower it.
        if let (Some(all), Some(made)) = (&self.details, &mut made.details) {
            for (reading, patch) in patches.iter().enumerate() {
                for c in 0..n {
                    let squares = patch.iter().map(|&i| all.type_a[i * n + c].powi(2));
                    let claimed = (squares.sum::<f64>() / patch.len() as f64).sqrt();
                    let type_a = &mut made.type_a[reading * n + c];
                    *type_a = type_a.max(claimed);
                }
            }
        }
        if !self.places.is_empty() {
            made.places = patches.iter().map(|patch| self.places[patch[0]]).collect();
        }
        made.half_angles_deg = self.half_angles_deg;
        (made, thinned)
    }
}
