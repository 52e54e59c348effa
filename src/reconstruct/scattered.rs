//! The base of every interpolation of scattered readings: readings and their mirror images as
//! points of an embedding, a k-d tree over them, and the search for neighbours of pairs.
//!
//! Coordinates are embedded so that nearness means nearness on the bench. With u = radial
//! coordinate over its range: 3-D (stretch · u1, u2 cos a, u2 sin a), 4-D (stretch · u1 cos a1,
//! stretch · u1 sin a1, u2 cos b, u2 sin b), where b is a2, or a1 + a2 if a2 turns with a1 (b is
//! what stays put when a1 runs round the pole u1 = 0). Coordinates that are no polar ones stand as
//! they are, each over its largest size, the first half of them times stretch. Every reading also stands at its mirror
//! images under the declared symmetries, and near the first pole at its place on the other side of
//! it, so that neighbours surround a point near a fold as they do inside. A reading *at* the first
//! pole is, in 3-D, the same at every azimuth and stands all around the circle.

use super::cloud::{Cloud, Reach, Search};
use super::interpolant::{Interpolant, Readings};
use super::transform::Transform;
use super::{ReconstructError, ReconstructionCoordinates, STRETCH, STRETCH_OF_SHEETS};
use crate::geometry::DirectionPair;
use crate::numeric::vectorised;
use crate::parametrization::{Coords, Layout, Parametrization};
use crate::schedule::{Pose, Schedule};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::f64::consts::{PI, TAU};
use std::num::NonZeroUsize;
use std::sync::Arc;

/// Share of the first radial axis within which readings also stand on the other side of its pole,
/// at least.
const POLE_REACH: f64 = 0.3;

/// [`POLE_REACH`] in spacings of readings, at least: a hundred neighbours in half a ball reach 3.6.
const POLE_SPACINGS: f64 = 4.0;

/// Share of the first radial axis that counts as its pole: an azimuth has no digits left there.
const ON_POLE: f64 = 1e-9;

/// Points of one reading that are closer than this are one: twice nearly the same point would make
/// local systems singular, and the value is the same.
const SAME: f64 = 1e-6;

/// Readings from which on they stand in memory as in space: a tree over them in any order waits for memory.
const MANY: usize = 1 << 19;

/// Numbers of the poses in an order that is not that of the rows of their file, which would choose among neighbours at equal distances:
/// by light, then by sensor; of [`MANY`] along a curve through the box of their coordinates (Morton 1966). A lattice has the order of
/// its nodes.
fn in_order(schedule: &Schedule) -> Vec<u32> {
    const BITS: u32 = 10;
    let is_long = schedule.poses.len() >= MANY;
    if schedule.lattice.is_some() && !is_long {
        return (0..schedule.poses.len() as u32).collect();
    }
    let axes = schedule.parametrization.axes();
    let along_curve = |coords: &Coords| {
        let mut numbers = [0; 4];
        for ((number, axis), c) in numbers.iter_mut().zip(axes).zip(coords) {
            *number = ((c - axis.range[0]) / axis.length() * f64::from(1 << BITS)) as u64;
        }
        let bits = |key, bit: u32| numbers.iter().fold(key, |key, n| 2 * key + (n >> bit & 1));
        (0..BITS).rev().fold(0_u64, bits)
    };
    let key = |pose: &Pose| {
        let place = if is_long {
            along_curve(&pose.coords)
        } else {
            0
        };
        (place, pose.pair.rank())
    };
    let poses = schedule.poses.par_iter().enumerate();
    let mut order: Vec<_> = poses.map(|(i, pose)| (key(pose), i as u32)).collect();
    order.par_sort_unstable();
    order.iter().map(|(_, i)| *i).collect()
}

/// Readings and their images as points of an embedding, with transformed values.
pub(super) struct Embedded<const K: usize> {
    pub cloud: Cloud<K>,
    embedding: Embedding,
}

/// Embedding of coordinates as points.
struct Embedding {
    parametrization: Arc<dyn Parametrization>,
    /// Polar: stretch / range of the first radial axis, 1 / range of the second; straight: of
    /// every axis.
    scale: [f64; 4],
    layout: Layout,
}

impl Embedding {
    fn new(parametrization: &Arc<dyn Parametrization>, stretch: f64) -> Self {
        let axes = parametrization.axes();
        let layout = parametrization.facts().layout;
        let mut scale = [0.0; 4];
        let first = axes.len() / 2;
        if layout == Layout::Straight {
            for (d, (scale, axis)) in scale.iter_mut().zip(axes).enumerate() {
                let weight = if d < first { stretch } else { 1.0 };
                *scale = weight / axis.range[0].abs().max(axis.range[1].abs());
            }
        } else {
            scale[0] = stretch / axes[0].range[1];
            scale[1] = 1.0 / axes[first].range[1];
        }
        Self {
            parametrization: Arc::clone(parametrization),
            scale,
            layout,
        }
    }

    #[inline]
    fn point<const K: usize>(&self, c: &Coords) -> [f64; K] {
        if self.layout == Layout::Straight {
            return std::array::from_fn(|d| self.scale[d] * c[d]);
        }
        let [s1, s2, ..] = self.scale;
        let mut x = [0.0; K];
        if K == 3 {
            let (sin, cos) = c[2].sin_cos();
            (x[0], x[1], x[2]) = (s1 * c[0], s2 * c[1] * cos, s2 * c[1] * sin);
        } else {
            let (sin, cos) = c[1].sin_cos();
            (x[0], x[1]) = (s1 * c[0] * cos, s1 * c[0] * sin);
            let (sin, cos) = (if self.layout == Layout::Nested {
                c[1] + c[3]
            } else {
                c[3]
            })
            .sin_cos();
            (x[2], x[3]) = (s2 * c[2] * cos, s2 * c[2] * sin);
        }
        x
    }
}

impl<const K: usize> Embedded<K> {
    /// The readings in the given coordinates.
    pub(crate) fn new(
        method: &'static str,
        readings: &Readings<'_>,
        coordinates: &ReconstructionCoordinates,
        transform: Transform,
    ) -> Result<Self, ReconstructError> {
        super::admit(method, readings.count(), usize::MAX)?;
        let parametrization = coordinates.resolve(&readings.schedule.parametrization)?;
        let of = |stretch| Self::stretched(readings, &parametrization, stretch, transform);
        if let Some(stretch) = coordinates.stretch {
            return Ok(of(stretch));
        }
        let embedded = of(STRETCH);
        if !embedded.is_in_sheets(readings) {
            return Ok(embedded);
        }
        // Of many readings two are too large.
        drop(embedded);
        let Self { cloud, embedding } = of(STRETCH_OF_SHEETS);
        Ok(Self {
            cloud: cloud.in_sheets(),
            embedding,
        })
    }

    /// The readings in an embedding.
    fn stretched(
        readings: &Readings<'_>,
        parametrization: &Arc<dyn Parametrization>,
        stretch: f64,
        transform: Transform,
    ) -> Self {
        let schedule = readings.schedule;
        let own = Arc::ptr_eq(parametrization, &schedule.parametrization);
        let count = readings.count();
        let embedding = Embedding::new(parametrization, stretch);
        let copies = parametrization.images(&[0.0; 4]).len();
        // In 3-D all points fill a cylinder of radius 1 and height `stretch`.
        let volume = PI * stretch / (count * copies) as f64;
        let spacing = volume.cbrt();
        let first_range = parametrization.axes()[0].range[1];
        // In 4-D the embedding closes the pole by itself, and a straight one has none.
        let has_pole = K == 3 && embedding.layout != Layout::Straight;
        let reach = first_range * (POLE_SPACINGS * spacing / stretch).max(POLE_REACH);
        let channels = readings.width;
        let mut points: Vec<[f64; K]> = Vec::with_capacity((copies + 1) * count);
        let mut values = Vec::with_capacity(points.capacity() * channels);
        let mut noise = Vec::new();
        let is_noisy = readings.noise.is_some();
        for i in in_order(schedule) {
            let i = i as usize;
            let pose = &schedule.poses[i];
            let Some(reading) = readings.value(i) else {
                continue;
            };
            let coords = if own {
                pose.coords
            } else {
                parametrization.forward(&pose.pair)
            };
            let own_noise = readings.relative_noise(i, transform.epsilon());
            let first = points.len();
            let mut stand = |c: &Coords| {
                let x = embedding.point(c);
                let near = |y: &[f64; K]| x.iter().zip(y).all(|(a, b)| (a - b).abs() < SAME);
                if !points[first..].iter().any(near) {
                    points.push(x);
                    values.extend(reading.iter().map(|&f| transform.forward(f)));
                    noise.extend(is_noisy.then_some(own_noise));
                }
            };
            for image in parametrization.images(&coords) {
                let [r1, r2, a, _] = image;
                if has_pole && r1 <= ON_POLE * first_range {
                    // Half a spacing apart, as a grid's rows are closer to each other than its
                    // mean spacing. Even, so that images at a + π fall on the same points.
                    let arc = PI * r2 * embedding.scale[1];
                    let around = 2.0 * (2.0 * arc / spacing).ceil().max(1.0);
                    for j in 0..around as usize {
                        stand(&[0.0, r2, TAU * j as f64 / around, 0.0]);
                    }
                    continue;
                }
                stand(&image);
                if has_pole && r1 < reach {
                    // (−r1, a) is (r1, a + π).
                    stand(&[-r1, r2, a + PI, 0.0]);
                }
            }
        }
        Self {
            cloud: Cloud::new(points, values, channels, noise),
            embedding,
        }
    }

    /// The point of a pair.
    pub(super) fn place(&self, pair: &DirectionPair) -> [f64; K] {
        self.embedding
            .point(&self.embedding.parametrization.forward(pair))
    }

    /// True if the readings lie in sheets, lines or clusters. The steps of a coarse grid differ from axis to axis,
    /// which makes no sheets of it in its own coordinates.
    pub(crate) fn is_in_sheets(&self, readings: &Readings<'_>) -> bool {
        let parametrization = &self.embedding.parametrization;
        let own = Arc::ptr_eq(parametrization, &readings.schedule.parametrization);
        !(own && readings.schedule.lattice.is_some()) && self.cloud.is_in_sheets()
    }

    /// The neighbours of a pair; true if they surround it.
    pub(crate) fn find(&self, pair: &DirectionPair, k: NonZeroUsize, search: &mut Search) -> bool {
        let x = self.place(pair);
        self.cloud.find(&x, k, search);
        let found = &search.found;
        found.reach != Reach::Flat && self.cloud.surrounds(&found.index, &x)
    }
}

/// An interpolation rule over neighbours.
pub(super) trait ScatteredRule<const K: usize>: Send + Sync {
    /// Buffers that one thread reuses from query to query.
    type Scratch: Default;

    /// Writes the transformed value of each channel at each of some points, point after point.
    fn interpolate(
        &self,
        cloud: &Cloud<K>,
        queries: &[[f64; K]],
        scratch: &mut Self::Scratch,
        out: &mut [f64],
    );
}

/// A rule over readings.
struct ScatteredInterpolant<R, const K: usize> {
    rule: R,
    readings: Embedded<K>,
    transform: Transform,
}

/// The interpolant of a rule on readings, in as many dimensions as their coordinates have.
pub(super) fn scattered<R>(
    method: &'static str,
    readings: &Readings<'_>,
    coordinates: &ReconstructionCoordinates,
    transform: Transform,
    rule: R,
) -> Result<Box<dyn Interpolant>, ReconstructError>
where
    R: ScatteredRule<3> + ScatteredRule<4> + 'static,
{
    fn on<R: ScatteredRule<K> + 'static, const K: usize>(
        readings: Result<Embedded<K>, ReconstructError>,
        transform: Transform,
        rule: R,
    ) -> Result<Box<dyn Interpolant>, ReconstructError> {
        Ok(Box::new(ScatteredInterpolant {
            rule,
            readings: readings?,
            transform,
        }))
    }
    let (r, of) = (readings, coordinates);
    match r.schedule.parametrization.axes().len() {
        3 => on::<R, 3>(Embedded::new(method, r, of, transform), transform, rule),
        _ => on::<R, 4>(Embedded::new(method, r, of, transform), transform, rule),
    }
}

/// Pairs per call of `forward_batch`.
const BATCH: usize = 128;

impl<R: ScatteredRule<K>, const K: usize> ScatteredInterpolant<R, K> {
    /// Values at pairs with these coordinates.
    fn values(
        &self,
        pairs: &[DirectionPair],
        coords: &[Coords],
        scratch: &mut R::Scratch,
        out: &mut [f64],
    ) {
        let width = self.width();
        let above = |i: &usize| pairs[*i].is_above_horizon();
        let above: SmallVec<[usize; BATCH]> = (0..pairs.len()).filter(above).collect();
        let queries = above
            .iter()
            .map(|&i| self.readings.embedding.point(&coords[i]));
        let queries: SmallVec<[[f64; K]; BATCH]> = queries.collect();
        let values = &mut out[..above.len() * width];
        self.rule
            .interpolate(&self.readings.cloud, &queries, scratch, values);
        vectorised!(self.transform.inverse_all(values));
        if above.len() < pairs.len() {
            // From the last on, so that none is written over before it is moved.
            let mut next = above.len();
            for i in (0..pairs.len()).rev() {
                if next > 0 && above[next - 1] == i {
                    next -= 1;
                    out.copy_within(next * width..(next + 1) * width, i * width);
                } else {
                    out[i * width..(i + 1) * width].fill(0.0);
                }
            }
        }
    }
}

impl<R: ScatteredRule<K>, const K: usize> Interpolant for ScatteredInterpolant<R, K> {
    fn width(&self) -> usize {
        self.readings.cloud.channels
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        let n = self.width();
        let mut scratch = R::Scratch::default();
        let mut coords = [[0.0; 4]; BATCH];
        for (pairs, out) in pairs.chunks(BATCH).zip(out.chunks_mut(BATCH * n)) {
            let coords = &mut coords[..pairs.len()];
            let parametrization = &self.readings.embedding.parametrization;
            parametrization.forward_batch(pairs, coords);
            self.values(pairs, coords, &mut scratch, out);
        }
    }
}
