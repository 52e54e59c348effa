//! Facets of height fields, found by their normals.
//!
//! The density of normals D(h) is the area of the facets whose normals are within an angle r of h, for each area of the plane
//! and each steradian of that cone. For a surface that looks the same however it is turned, D is the mean over its turns.

use super::surface::{HeightField, SIZE};
use glam::DVec3;
use smallvec::SmallVec;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

/// Blocks along an edge of the illuminated part of a period: as many surfaces of their own, for errors.
const EDGE: usize = 4;

/// Blocks of a period.
pub(super) const BLOCKS: usize = EDGE * EDGE;

/// Steps of elevation in the radius of a cone, and parts of a step that facets are counted in: the share of turns has steep ends,
/// and its sum over n parts of the radius is too large by 0.11 n^(-3/2) of itself.
const STEPS: f64 = 8.0;
const PARTS: usize = 32;

/// Squares in the radius of a cone, where all of its facets are looked at, and the largest number of squares along an axis. Where
/// only a few are drawn, squares are as large as the radius: rows are fewer, and more often in the cache.
const FINE: f64 = 4.0;
const MOST: f64 = 2048.0;

/// Bits of a triangle's number, of two for each cell; a block's are those above.
const TRIANGLE_BITS: u32 = 28;
const _: () = assert!(2 * SIZE[1] * SIZE[1] <= 1 << TRIANGLE_BITS);
const _: () = assert!(BLOCKS <= 1 << (u32::BITS - TRIANGLE_BITS));

/// Facets of one period, in squares of (m_x, m_y), the normals' components in the plane.
pub(super) struct Normals {
    /// Square of the chord of the cone's angle.
    chord2: f64,
    squares: Squares,
    /// Number of the first facet of each square, m_x fastest.
    first: Vec<u32>,
    facets: Vec<Facet>,
    /// Cells of each block.
    cells: [f64; BLOCKS],
}

/// A facet: its normal, and its block in the bits above those of its triangle.
#[derive(Clone, Copy, Default)]
pub(super) struct Facet {
    normal: [f32; 3],
    place: u32,
}

impl Facet {
    fn triangle(&self) -> usize {
        (self.place & ((1 << TRIANGLE_BITS) - 1)) as usize
    }

    fn block(&self) -> usize {
        (self.place >> TRIANGLE_BITS) as usize
    }

    fn normal(&self) -> DVec3 {
        let [x, y, z] = self.normal.map(f64::from);
        DVec3::new(x, y, z)
    }
}

/// A facet that was drawn.
pub(super) struct Candidate {
    /// Its triangle.
    pub triangle: usize,
    /// Its area over the probability that it was drawn with; 0 outside the cone.
    pub weight: f64,
}

/// The block of a cell, of cells that are illuminated.
fn block([x, y]: [usize; 2], lit: [usize; 2]) -> usize {
    let along = |place: usize, all: usize| place * EDGE / all;
    along(y, lit[1]) * EDGE + along(x, lit[0])
}

/// Cells along each axis of the illuminated part.
fn lit(field: &HeightField, spot: f64) -> [usize; 2] {
    field
        .size()
        .map(|n| ((spot * n as f64).round() as usize).clamp(1, n))
}

/// The block of a point, shares of the illuminated part.
pub(super) fn block_of(start: [f64; 2]) -> usize {
    let [x, y] = start.map(|s| ((s * EDGE as f64) as usize).min(EDGE - 1));
    y * EDGE + x
}

/// A point of a block from one of the unit square, shares of the illuminated part.
pub(super) fn in_block(block: usize, [u, v]: [f64; 2]) -> [f64; 2] {
    let [x, y] = [block % EDGE, block / EDGE].map(|i| i as f64);
    [(x + u) / EDGE as f64, (y + v) / EDGE as f64]
}

impl Normals {
    /// Facets of the part `spot` of the edges of `field`, for cones of an angle `radius`; `turned`: for a density that is averaged
    /// over all turns.
    pub(super) fn new(field: &HeightField, spot: f64, radius: f64, turned: bool) -> Self {
        let fine = if turned { 1.0 } else { FINE };
        let squares = Squares::new(radius / fine, MOST);
        let lit = lit(field, spot);
        let [nx, _] = field.size();
        let all = || {
            (0..lit[1]).flat_map(move |y| {
                (0..lit[0]).flat_map(move |x| {
                    let slopes = field.slopes([x, y]);
                    (0..2).map(move |side| {
                        let [sx, sy] = slopes[side];
                        let long = (1.0 + sx * sx + sy * sy).sqrt();
                        let triangle = (2 * (y * nx + x) + side) as u32;
                        Facet {
                            normal: [-sx / long, -sy / long, 1.0 / long].map(|m| m as f32),
                            place: (block([x, y], lit) as u32) << TRIANGLE_BITS | triangle,
                        }
                    })
                })
            })
        };
        let square = |facet: &Facet| {
            let [x, y, _] = facet.normal.map(f64::from);
            squares.index([y, x])
        };
        let first = firsts(squares.across.pow(2), all().map(|facet| square(&facet)));
        let mut next = first.clone();
        let mut facets = vec![Facet::default(); 2 * lit[0] * lit[1]];
        for facet in all() {
            let to = &mut next[square(&facet)];
            facets[*to as usize] = facet;
            *to += 1;
        }
        let mut cells = [0.0; BLOCKS];
        facets.iter().for_each(|facet| cells[facet.block()] += 0.5);
        Self {
            chord2: (2.0 * (0.5 * radius).sin()).powi(2),
            squares,
            first,
            facets,
            cells,
        }
    }

    /// True if all facets have one of 64 normals at most: then D is a sum of peaks.
    pub(super) fn are_few(&self) -> bool {
        let mut seen: Vec<[u32; 3]> = Vec::new();
        self.facets.iter().all(|facet| {
            let bits = facet.normal.map(f32::to_bits);
            if !seen.contains(&bits) {
                seen.push(bits);
            }
            seen.len() <= 64
        })
    }

    /// The facets of the squares that the cone about `h` may reach, a range for each row.
    fn about(&self, h: DVec3) -> SmallVec<[Range<u32>; 16]> {
        // Of the cone's rim, and of what rounding may add.
        let reach = self.chord2.sqrt() * (1.0 + 1e-9);
        let Squares { across, per_unit } = self.squares;
        let at = |m: f64| self.squares.part(m);
        let rows = at(h.y - reach)..=at(h.y + reach);
        let facets = rows.map(|row| {
            let [low, high] = [row, row + 1].map(|edge| edge as f64 / per_unit - 1.0);
            let off = (low - h.y).max(h.y - high).max(0.0);
            let half = (reach * reach - off * off).max(0.0).sqrt();
            let [low, high] = [h.x - half, h.x + half].map(|m| row * across + at(m));
            self.first[low]..self.first[high + 1]
        });
        facets.collect()
    }

    fn is_within(&self, facet: &Facet, h: DVec3) -> bool {
        (facet.normal() - h).length_squared() <= self.chord2
    }

    /// A facet about `h`, drawn by a number of [0, 1); `None` if there is none.
    pub(super) fn draw(&self, h: DVec3, u: f64) -> Option<Candidate> {
        let ranges = self.about(h);
        let count: usize = ranges.iter().map(|r| r.len()).sum();
        let mut left = ((u * count as f64) as usize).min(count.checked_sub(1)?);
        let mut ranges = ranges.into_iter();
        let facet = loop {
            let range = ranges.next()?;
            match left.checked_sub(range.len()) {
                None => break self.facets[range.start as usize + left],
                Some(rest) => left = rest,
            }
        };
        let weight = match self.is_within(&facet, h) {
            true => area(&facet) * count as f64,
            false => 0.0,
        };
        Some(Candidate {
            triangle: facet.triangle(),
            weight,
        })
    }

    fn add_cone(&self, h: DVec3, areas: &mut [f64; BLOCKS]) {
        for range in self.about(h) {
            for facet in &self.facets[range.start as usize..range.end as usize] {
                if self.is_within(facet, h) {
                    areas[facet.block()] += area(facet);
                }
            }
        }
    }
}

/// Area of a facet, cells.
fn area(facet: &Facet) -> f64 {
    0.5 / f64::from(facet.normal[2])
}

/// D of several periods of one kind of surface.
pub(super) struct Density {
    /// sr of the cone.
    solid_angle: f64,
    /// Cells of each block of each period.
    cells: Vec<f64>,
    kind: Kind,
}

enum Kind {
    /// Mean over all turns: values at equal steps of the elevation of h, blocks together; the largest elevation whose cone holds
    /// a cell of facets.
    Turned {
        step: f64,
        values: Vec<f64>,
        steepest: f64,
    },
    /// Of the facets themselves.
    Fixed,
}

impl Density {
    /// Of periods of one size, in cones of an angle `radius`; `turned`: averaged over all turns.
    pub(super) fn new(all: &[Normals], radius: f64, turned: bool) -> Self {
        let solid_angle = TAU * 2.0 * (0.5 * radius).sin().powi(2);
        let cells: Vec<f64> = all.iter().flat_map(|n| n.cells).collect();
        let kind = match turned {
            false => Kind::Fixed,
            true => {
                let nodes = (STEPS * FRAC_PI_2 / radius).ceil().max(1.0) as usize;
                let bins = nodes * PARTS;
                let [step, width] = [nodes, bins].map(|n| FRAC_PI_2 / n as f64);
                let blocks = cells.len();
                let reach = (radius / width).ceil() as usize + 1;
                let mut values = vec![0.0; (nodes + 1) * blocks];
                // One period at a time: parts are many.
                for (period, normals) in all.iter().enumerate() {
                    let mut areas = vec![[0.0; BLOCKS]; bins];
                    for facet in &normals.facets {
                        let m = facet.normal();
                        let bin = ((m.x.hypot(m.y).atan2(m.z) / width) as usize).min(bins - 1);
                        areas[bin][facet.block()] += area(facet);
                    }
                    for (node, values) in values.chunks_mut(blocks).enumerate() {
                        let values = &mut values[period * BLOCKS..][..BLOCKS];
                        let middle = node * PARTS;
                        for bin in middle.saturating_sub(reach)..(middle + reach).min(bins) {
                            let facet = (bin as f64 + 0.5) * width;
                            let share = turns(node as f64 * step, facet, radius);
                            let of_bin = values.iter_mut().zip(&areas[bin]);
                            of_bin.for_each(|(v, a)| *v += share * a);
                        }
                    }
                }
                let mut cones = values.chunks(blocks);
                let steepest = cones.rposition(|areas| areas.iter().sum::<f64>() >= 1.0);
                Kind::Turned {
                    step,
                    values,
                    steepest: steepest.map_or(0.0, |node| node as f64 * step),
                }
            }
        };
        Self {
            solid_angle,
            cells,
            kind,
        }
    }

    /// `h`, or, where hardly a facet is as steep, the unit vector above it of the steepest that are there in number; of densities
    /// that are averaged over turns.
    pub(super) fn nearest(&self, h: DVec3) -> DVec3 {
        let steepest = match self.kind {
            Kind::Turned { steepest, .. } => steepest,
            Kind::Fixed => return h,
        };
        let radius = h.x.hypot(h.y);
        match radius.atan2(h.z) > steepest {
            true => {
                let (sin, cos) = steepest.sin_cos();
                DVec3::new(h.x / radius * sin, h.y / radius * sin, cos)
            }
            false => h,
        }
    }

    /// D at each of `images` of a unit vector, which mean the same, and its standard error, of which more surface is the cure;
    /// sr⁻¹. Where there is no facet another surface may have one: the error is that of a cell.
    pub(super) fn density_at(&self, all: &[Normals], images: &[DVec3]) -> [f64; 2] {
        let mut square = 0.0;
        let mean = self.noise(all, images, |_, e| square += e * e);
        match mean > 0.0 {
            true => [mean, f64::sqrt(square)],
            false => [mean, 1.0 / self.measure()],
        }
    }

    /// D as [`density_at`](Self::density_at), and its standard error by blocks, of which its square is the sum of the squares: what a
    /// block has too much it has at all half vectors.
    pub(super) fn noise(
        &self,
        all: &[Normals],
        images: &[DVec3],
        mut each: impl FnMut(usize, f64),
    ) -> f64 {
        let areas = self.areas(all, images);
        let mean = areas.iter().sum::<f64>() / self.measure();
        // Blocks have the same number of cells, but for a row; those without any say nothing.
        let used = self.cells.iter().filter(|c| **c > 0.0).count() as f64;
        let scale = 1.0 / (used * (used - 1.0).max(1.0)).sqrt();
        let blocks = areas.iter().zip(&self.cells).enumerate();
        for (block, (area, cells)) in blocks.filter(|(_, (_, cells))| **cells > 0.0) {
            each(block, scale * (area / (cells * self.solid_angle) - mean));
        }
        mean
    }

    /// Cells of all periods, times the sr of the cone.
    fn measure(&self) -> f64 {
        self.cells.iter().sum::<f64>() * self.solid_angle
    }

    /// Areas of the facets about `images` in each block, cells.
    fn areas(&self, all: &[Normals], images: &[DVec3]) -> Vec<f64> {
        let blocks = self.cells.len();
        let mut areas = vec![0.0; blocks];
        match &self.kind {
            Kind::Turned { step, values, .. } => {
                let h = images[0];
                let place = h.x.hypot(h.y).atan2(h.z) / step;
                let last = values.len() / blocks - 2;
                let node = (place as usize).min(last);
                let share = (place - node as f64).clamp(0.0, 1.0);
                for (block, area) in areas.iter_mut().enumerate() {
                    let [a, b] = [node, node + 1].map(|n| values[n * blocks + block]);
                    *area = a + share * (b - a);
                }
            }
            Kind::Fixed => {
                let (periods, _) = areas.as_chunks_mut();
                for h in images {
                    for (normals, areas) in all.iter().zip(&mut *periods) {
                        normals.add_cone(*h, areas);
                    }
                }
                areas.iter_mut().for_each(|a| *a /= images.len() as f64);
            }
        }
        areas
    }
}

/// Share of the turns about the normal in which a facet at an elevation is within `radius` of a vector at another.
fn turns(vector: f64, facet: f64, radius: f64) -> f64 {
    let over = (0.5 * radius).sin().powi(2) - (0.5 * (vector - facet)).sin().powi(2);
    if over <= 0.0 {
        return 0.0;
    }
    let sines = vector.sin() * facet.sin();
    match over >= sines {
        true => 1.0,
        false => 2.0 * (over / sines).sqrt().asin() / PI,
    }
}

/// Equal parts of [−1, 1] along each axis.
#[derive(Clone, Copy)]
pub(super) struct Squares {
    /// Parts along an axis.
    pub across: usize,
    /// Parts for each unit.
    pub per_unit: f64,
}

impl Squares {
    /// Parts of a width, at most so many along an axis.
    pub(super) fn new(width: f64, most: f64) -> Self {
        let across = (2.0 / width).clamp(1.0, most) as usize;
        Self {
            across,
            per_unit: across as f64 / 2.0,
        }
    }

    /// The part of a component.
    pub(super) fn part(&self, x: f64) -> usize {
        (((x + 1.0) * self.per_unit) as usize).min(self.across - 1)
    }

    /// The number of the square of a place, the last axis fastest.
    pub(super) fn index<const N: usize>(&self, at: [f64; N]) -> usize {
        let parts = at.into_iter().map(|x| self.part(x));
        parts.fold(0, |index, part| index * self.across + part)
    }
}

/// The number of the first thing of each square, from the square of each, as they lie in the order of their squares; one more
/// at the end.
pub(super) fn firsts(squares: usize, of_each: impl Iterator<Item = usize>) -> Vec<u32> {
    let mut first = vec![0; squares + 1];
    of_each.for_each(|square| first[square + 1] += 1);
    for i in 1..first.len() {
        first[i] += first[i - 1];
    }
    first
}

#[cfg(test)]
mod tests {
    use super::super::surface;
    use super::*;
    use crate::registry;

    /// ∫ D dω is the area of the facets for each of the plane, as each of them is in all of its cone.
    #[test]
    fn densities_integrate_to_the_area_of_facets() {
        let gaussian = surface::all()
            .into_iter()
            .find(|entry| entry.kind == "gaussian")
            .unwrap();
        for (rms_slope, degrees) in [(0.1, 0.5f64), (0.3, 0.5), (0.3, 2.0), (0.8, 1.0)] {
            let text = format!("rms_slope = {rms_slope}\nsize = 256");
            let field = registry::read_text(&gaussian, &text)
                .unwrap()
                .build(0)
                .unwrap();
            let radius = degrees.to_radians();
            let normals = [Normals::new(&field, 1.0, radius, true)];
            let area = normals[0].facets.iter().map(area).sum::<f64>() / (256.0 * 256.0);
            let density = Density::new(&normals, radius, true);
            let n = 200_000;
            let step = FRAC_PI_2 / f64::from(n);
            let rings = (0..n).map(|i| {
                let theta = (f64::from(i) + 0.5) * step;
                let (sin, cos) = theta.sin_cos();
                TAU * sin * step * density.density_at(&normals, &[DVec3::new(sin, 0.0, cos)])[0]
            });
            let whole: f64 = rings.sum();
            let off = whole / area - 1.0;
            assert!(
                off.abs() < 2e-4,
                "{rms_slope} {degrees}: {whole} {area} {off:.1e}"
            );
        }
    }
}
