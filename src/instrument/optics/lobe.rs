//! Adaptive quadrature in the half vector.
//!
//! A half turn about h takes ω_i to the ω_o whose half vector is h, and the sensor's centre c_o to a
//! direction g. In place of ω_o it is g that is integrated over:
//!
//! dω_i dω_o = (h·ω_i)/(h·c_o) dω_i dω_g.
//!
//! For a given g, and so a given h, ω_i is where the light's cap and the cap around g overlap, a lens
//! whose shape depends on the distance of g from c_i alone. Over the lens the narrow factor of a
//! reflection lobe does not change: few nodes do. Over g the cells shrink towards the peak, where h
//! is the normal. For a retro peak the light's cap is turned by half about its own centre first:
//! then h = c_i is where both directions agree.

use super::batch::{Sums, Workspace, add, ratio, ratios, weight, zeros};
use super::lens::{FINEST, Overlap};
use super::{Estimate, Optics};
use crate::brdf::{Brdf, ChannelValues};
use crate::geometry::{DirectionPair, angle_between};
use crate::sampling::{cut, halve_worst, mirrored};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Kind of a peak, by its direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PeakKind {
    /// The half vector is the normal.
    Mirror,
    /// Light and sensor directions agree.
    Retro,
}

/// A peak that the apertures see.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    kind: PeakKind,
    /// Half width (rad of g).
    pub(super) width: f64,
}

/// `v` after half a turn about the unit vector `axis`.
#[inline]
fn half_turn(v: DVec3, axis: DVec3) -> DVec3 {
    2.0 * v.dot(axis) * axis - v
}

impl PeakKind {
    /// The half vector of the peak.
    fn axis(self, pair: &DirectionPair) -> DVec3 {
        match self {
            PeakKind::Mirror => DVec3::Z,
            PeakKind::Retro => pair.omega_i.vector(),
        }
    }

    /// The light direction for a direction of its (turned) cap.
    #[inline]
    fn light(self, v: DVec3, pair: &DirectionPair) -> DVec3 {
        match self {
            PeakKind::Mirror => v,
            PeakKind::Retro => half_turn(v, pair.omega_i.vector()),
        }
    }
}

impl Peak {
    /// Number of scales that are tried, down to a 10⁷th of the apertures.
    const SCALES: i32 = 24;

    /// The peak, if the apertures hold it and the material falls to half within them.
    pub(super) fn find(
        optics: &Optics,
        brdf: &dyn Brdf,
        pair: &DirectionPair,
        kind: PeakKind,
        work: &mut Workspace,
    ) -> Option<Peak> {
        let reach = optics.source + optics.detector;
        let polar = Polar::new(pair, kind);
        if polar.peak[0] > reach {
            return None;
        }
        let share = optics.source / reach;
        let mut look = |g: DVec3, group: usize| {
            if let Some(h) = (g + pair.omega_o.vector()).try_normalize() {
                // Between c_i and g in the ratio of the apertures: inside both caps.
                let v = (polar.centre * (1.0 - share) + g * share).normalize();
                work.push(kind.light(v, pair), half_turn(v, h), 1.0, group);
            }
        };
        let top = half_turn(pair.omega_o.vector(), kind.axis(pair));
        look(top, 0);
        let sides = [polar.x, polar.y].map(|e| (e - top * e.dot(top)).normalize_or_zero());
        for k in 0..Self::SCALES {
            let r = reach * f64::powi(2.0, -k);
            for (axis, side) in sides.into_iter().enumerate() {
                look(top * r.cos() + side * r.sin(), 1 + 2 * k as usize + axis);
            }
        }
        let values = work.evaluate(brdf, 1 + 2 * Self::SCALES as usize);
        let peak = ratios(values[0]);
        let largest = (0..peak.len()).max_by(|a, b| peak[*a].total_cmp(&peak[*b]))?;
        let width = |axis: usize| {
            let falls = |k: &i32| {
                let sums = values[1 + 2 * *k as usize + axis];
                weight(sums) > 0.0 && ratio(sums, largest) < 0.5 * peak[largest]
            };
            let last = (0..Self::SCALES).rfind(falls);
            last.map_or(f64::INFINITY, |k| reach * f64::powi(2.0, -k))
        };
        let widths = [width(0), width(1)];
        let falls = widths.iter().any(|w| w.is_finite());
        let [x, y] = widths.map(|w| w.min(reach));
        falls.then_some(Peak {
            kind,
            width: (x * y).sqrt(),
        })
    }

    /// A stand-in where no peak was seen: cells need not shrink before they are evaluated.
    pub(super) fn unseen(optics: &Optics, pair: &DirectionPair) -> Peak {
        let reach = optics.source + optics.detector;
        let distance = |kind| Polar::new(pair, kind).peak[0];
        let kind = match distance(PeakKind::Retro) < distance(PeakKind::Mirror) {
            true => PeakKind::Retro,
            false => PeakKind::Mirror,
        };
        Peak { kind, width: reach }
    }
}

/// Polar coordinates of g about the light's centre.
struct Polar {
    centre: DVec3,
    x: DVec3,
    y: DVec3,
    /// Distance and azimuth of the peak.
    peak: [f64; 2],
}

impl Polar {
    fn new(pair: &DirectionPair, kind: PeakKind) -> Self {
        let (centre, sensor) = (pair.omega_i.vector(), pair.omega_o.vector());
        // In the plane of light and sensor: a lobe is longest along it or across.
        let plane = sensor - centre * sensor.dot(centre);
        let x = if plane.length_squared() > 1e-20 {
            plane.normalize()
        } else {
            centre.any_orthonormal_vector()
        };
        let y = centre.cross(x);
        let top = half_turn(sensor, kind.axis(pair));
        Self {
            centre,
            x,
            y,
            peak: [angle_between(top, centre), top.dot(y).atan2(top.dot(x))],
        }
    }
}

/// Radial pieces, each smooth inside: where one cap holds the other, and where they cross. There
/// the overlap goes as the power 3/2 of the distance from either end, which ρ = m − l cos t mends.
#[derive(Clone, Copy, Debug)]
enum Radial {
    Inside,
    Crossing { middle: f64, half: f64 },
}

impl Radial {
    /// ρ and dρ/dt.
    fn rho_and_slope(self, t: f64) -> [f64; 2] {
        match self {
            Radial::Inside => [t, 1.0],
            Radial::Crossing { middle, half } => {
                let (s, c) = t.sin_cos();
                [middle - half * c, half * s]
            }
        }
    }

    fn inverse(self, rho: f64) -> f64 {
        match self {
            Radial::Inside => rho,
            Radial::Crossing { middle, half } => ((middle - rho) / half).clamp(-1.0, 1.0).acos(),
        }
    }
}

/// The Gauss–Kronrod pair of 5 and 11 nodes on [−1, 1]: node (ascending), weight of the 11, weight of the 5 (0 where it has no
/// node).
const PAIR: [[f64; 3]; NODES] = mirrored(&[
    [0.984_085_360_094_842_5, 0.042_582_036_751_081_83, 0.0],
    [
        0.906_179_845_938_664,
        0.115_233_316_622_473_4,
        0.236_926_885_056_189_1,
    ],
    [0.754_166_726_570_849_2, 0.186_800_796_556_492_65, 0.0],
    [
        0.538_469_310_105_683_1,
        0.241_040_339_228_647_6,
        0.478_628_670_499_366_5,
    ],
    [0.279_630_413_161_783_2, 0.272_849_801_912_558_9, 0.0],
    [0.0, 0.282_987_417_857_491_2, 0.568_888_888_888_888_9],
]);

const NODES: usize = 11;

/// A part of the polar plane.
#[derive(Clone, Debug)]
struct Cell {
    radial: Radial,
    /// Ranges of t and of the azimuth.
    range: [[f64; 2]; 2],
    sums: Sums,
    /// Difference of the two rules along either.
    differences: [Sums; 2],
}

impl Cell {
    fn new(radial: Radial, range: [[f64; 2]; 2], channels: usize) -> Self {
        Self {
            radial,
            range,
            sums: zeros(channels),
            differences: [zeros(channels), zeros(channels)],
        }
    }

    fn halves(&self, axis: usize) -> [Cell; 2] {
        let [lo, hi] = self.range[axis];
        let channels = self.sums.len() - 1;
        let parts = cut(self.range, axis, 0.5 * (lo + hi));
        parts.map(|range| Cell::new(self.radial, range, channels))
    }
}

/// The integral that cells are parts of.
struct Integral<'a> {
    optics: &'a Optics,
    brdf: &'a dyn Brdf,
    pair: &'a DirectionPair,
    kind: PeakKind,
    polar: Polar,
    overlap: Overlap,
}

impl Integral<'_> {
    fn evaluate(&mut self, cell: &mut Cell, level: usize, work: &mut Workspace) {
        let [[t0, t1], [p0, p1]] = cell.range;
        let (ht, hp) = (0.5 * (t1 - t0), 0.5 * (p1 - p0));
        let (kind, pair, polar) = (self.kind, self.pair, &self.polar);
        let sensor = pair.omega_o.vector();
        for (i, node) in PAIR.iter().enumerate() {
            let [rho, slope] = cell.radial.rho_and_slope(t0 + ht * (1.0 + node[0]));
            let (sr, cr) = rho.sin_cos();
            let radial_weight = ht * slope * sr;
            let (a, b) = (self.optics.source, self.optics.detector);
            self.optics
                .lens
                .overlap(a, b, rho, level, &mut self.overlap);
            for (j, node) in PAIR.iter().enumerate() {
                let (s, c) = (p0 + hp * (1.0 + node[0])).sin_cos();
                let along = polar.x * c + polar.y * s;
                let g = polar.centre * cr + along * sr;
                let Some(h) = (g + sensor).try_normalize() else {
                    continue;
                };
                let weight = radial_weight * hp / h.dot(sensor);
                let frame = [polar.centre, along, polar.centre.cross(along)];
                let group = i * NODES + j;
                self.optics
                    .lens
                    .for_each(&self.overlap, &frame, level, |v, w| {
                        let w = w * weight * v.dot(h);
                        work.push(kind.light(v, pair), half_turn(v, h), w, group);
                    });
            }
        }
        let groups = work.evaluate(self.brdf, NODES * NODES);
        cell.sums.fill(0.0);
        cell.differences.iter_mut().for_each(|d| d.fill(0.0));
        for (ij, sums) in groups.into_iter().enumerate() {
            let [[_, ki, gi], [_, kj, gj]] = [PAIR[ij / NODES], PAIR[ij % NODES]];
            add(&mut cell.sums, ki * kj, sums);
            add(&mut cell.differences[0], (ki - gi) * kj, sums);
            add(&mut cell.differences[1], ki * (kj - gj), sums);
        }
    }

    /// The first cells: none is wide against both the peak's width and its distance from it.
    fn mesh(&self, width: f64) -> Vec<Cell> {
        let (a, b) = (self.optics.source, self.optics.detector);
        let (inner, outer) = ((a - b).abs(), a + b);
        let [at, azimuth] = self.polar.peak;
        // A peak at the pole has no azimuth; cells then follow the plane of light and sensor.
        let is_at_pole = at < 0.5 * width;
        let [at, azimuth] = if is_at_pole { [0.0; 2] } else { [at, azimuth] };
        let mut pieces = Vec::new();
        let crossing = Radial::Crossing {
            middle: 0.5 * (inner + outer),
            half: 0.5 * (outer - inner),
        };
        for (radial, lo, hi) in [(Radial::Inside, 0.0, inner), (crossing, inner, outer)] {
            match lo < at && at < hi {
                true => pieces.extend([(radial, [lo, at]), (radial, [at, hi])]),
                false => pieces.push((radial, [lo, hi])),
            }
        }
        let mut stack = Vec::new();
        for (radial, ends) in pieces.into_iter().filter(|(_, [lo, hi])| lo < hi) {
            for quarter in 0..4 {
                let from = azimuth + FRAC_PI_2 * f64::from(quarter);
                stack.push((radial, ends, [from, from + FRAC_PI_2]));
            }
        }
        let channels = self.brdf.channels().count();
        let mut cells = Vec::new();
        while let Some((radial, [r0, r1], [p0, p1])) = stack.pop() {
            let aside = match p0 - azimuth {
                after if after < PI => after,
                _ => azimuth + TAU - p1,
            };
            let nearest = at.clamp(r0, r1);
            let distance = (nearest - at).hypot(nearest.min(at) * aside.min(FRAC_PI_2));
            let size = width.max(distance);
            if r1 - r0 > 2.0 * size {
                // Away from the peak by as much as it is wide, or as near as makes sense.
                let middle = if at <= r0 {
                    r0 + (0.25 * (r1 - r0)).max(size)
                } else if at >= r1 {
                    r1 - (0.25 * (r1 - r0)).max(size)
                } else {
                    0.5 * (r0 + r1)
                };
                stack.push((radial, [middle, r1], [p0, p1]));
                stack.push((radial, [r0, middle], [p0, p1]));
            } else if at > 0.0 && 0.5 * (r0 + r1) * (p1 - p0) > 4.0 * size {
                let middle = 0.5 * (p0 + p1);
                stack.push((radial, [r0, r1], [middle, p1]));
                stack.push((radial, [r0, r1], [p0, middle]));
            } else {
                let t = [radial.inverse(r0), radial.inverse(r1)];
                cells.push(Cell::new(radial, [t, [p0, p1]], channels));
            }
        }
        cells
    }
}

/// The average, with cells as small as the tolerance asks for and the budget allows.
pub(super) fn integrate(
    optics: &Optics,
    brdf: &dyn Brdf,
    pair: &DirectionPair,
    peak: &Peak,
    budget: usize,
    work: &mut Workspace,
) -> Estimate {
    let mut integral = Integral {
        optics,
        brdf,
        pair,
        kind: peak.kind,
        polar: Polar::new(pair, peak.kind),
        overlap: Overlap::default(),
    };
    let channels = brdf.channels().count();
    let start = work.evaluations;
    let mut cells = integral.mesh(peak.width);
    for cell in &mut cells {
        integral.evaluate(cell, 0, work);
    }
    // Half of the tolerance for the cells, half for the lenses.
    let tolerance = &optics.tolerance;
    let coarse = loop {
        let (estimate, errors) = outer(&cells, channels);
        // The cells are evaluated once more with finer lenses, at three times the cost.
        let spent = 4 * (work.evaluations - start);
        if estimate.excess(tolerance) <= 0.5 || spent > budget {
            break estimate;
        }
        let halved = halve_worst(&mut cells, &errors, |cell, axis| {
            cell.halves(axis).map(|mut half| {
                integral.evaluate(&mut half, 0, work);
                half
            })
        });
        // No cell is to blame where errors are infinite, or no channel is above 0.
        if halved == 0 {
            break estimate;
        }
    };
    let mut last = coarse;
    for level in 1..=FINEST {
        let before = work.evaluations;
        for cell in &mut cells {
            integral.evaluate(cell, level, work);
        }
        let cost = work.evaluations - before;
        let (mut estimate, _) = outer(&cells, channels);
        for (c, error) in estimate.error.iter_mut().enumerate() {
            *error += (ratio(&estimate.sums, c) - ratio(&last.sums, c)).abs();
        }
        let spent = work.evaluations - start;
        last = estimate;
        if last.good(tolerance) || spent + 2 * cost > budget {
            break;
        }
    }
    last
}

/// The average over all cells with the error of the cells, and the error of each along either axis.
fn outer(cells: &[Cell], channels: usize) -> (Estimate, Vec<[f64; 2]>) {
    let mut sums = zeros(channels);
    for cell in cells {
        add(&mut sums, 1.0, &cell.sums);
    }
    let value = ratios(&sums);
    let weight = weight(&sums).max(f64::MIN_POSITIVE);
    let mut error = ChannelValues::from_elem(0.0, channels);
    let errors = cells
        .iter()
        .map(|cell| {
            cell.differences.each_ref().map(|difference| {
                let mut largest = 0.0_f64;
                for (c, (error, value)) in error.iter_mut().zip(&value).enumerate() {
                    // How much an error of both sums changes the average.
                    let of_weight = value * difference[channels];
                    let effect = ((difference[c] - of_weight) / weight).abs();
                    *error += effect;
                    if *value > 0.0 {
                        largest = largest.max(effect / value);
                    }
                }
                largest
            })
        })
        .collect();
    (Estimate { sums, error }, errors)
}
