//! Rules for the two caps of directions, and their products.

use super::Estimate;
use super::batch::{Sums, Workspace, add, zeros};
use crate::brdf::{Brdf, ChannelValues};
use crate::geometry::Direction;
use crate::sampling::gauss_legendre;
use glam::DVec3;
use std::f64::consts::PI;

/// Nodes along each of the two dimensions of a disk. The first is of a higher degree than the sparse
/// rule: a difference of two rules of one degree says nothing about either.
pub(super) const PRODUCTS: [usize; 4] = [4, 6, 9, 13];

/// A cap of directions of equal weight around a centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disk {
    centre: DVec3,
    /// Towards the horizon, level: with the centre a right-handed frame.
    down: DVec3,
    level: DVec3,
    half_angle: f64,
}

impl Disk {
    pub(super) fn new(centre: Direction, half_angle: f64) -> Self {
        let (v, sin) = (centre.vector(), centre.sin_theta());
        // At the normal every azimuth is as good as any other.
        let level = match sin > 0.0 {
            true => DVec3::new(-v.y / sin, v.x / sin, 0.0),
            false => DVec3::Y,
        };
        Self {
            centre: v,
            down: level.cross(v),
            level,
            half_angle,
        }
    }

    /// The direction at a place of the unit disk: Lambert's equal-area map, so that equal areas are
    /// equal solid angles.
    #[inline]
    fn direction(&self, [x, y]: [f64; 2]) -> DVec3 {
        let radius = 2.0 * (0.5 * self.half_angle).sin();
        let (x, y) = (radius * x, radius * y);
        let rr = x * x + y * y;
        let side = (1.0 - 0.25 * rr).sqrt();
        self.centre * (1.0 - 0.5 * rr) + (self.down * x + self.level * y) * side
    }

    /// Nodes and weights of a rule of degree 2n − 1 over the part above the horizon.
    fn nodes(&self, n: usize, legendre: &[(f64, f64)], wide: &[(f64, f64)]) -> Vec<(DVec3, f64)> {
        if self.half_angle == 0.0 {
            return vec![(self.centre, 1.0)];
        }
        if self.centre.z >= self.half_angle.sin() {
            let mut nodes = Vec::with_capacity(n * n);
            for k in 1..=n {
                // Chebyshev's rule of the second kind: the weight √(1 − x²) is the chord.
                let (s, c) = (PI * k as f64 / (n + 1) as f64).sin_cos();
                let w = s * s / (n + 1) as f64;
                let node = |(y, wy): &(f64, f64)| (self.direction([c, s * y]), w * wy);
                nodes.extend(legendre.iter().map(node));
            }
            return nodes;
        }
        // In the gnomonic map the horizon is a straight line across the disk, and what is above
        // it a segment: x = R cos φ from where the line cuts, y along the chord.
        let radius = self.half_angle.tan();
        let sin = self.down.z.abs();
        let from = (self.centre.z / (sin * radius)).clamp(-1.0, 1.0).acos();
        let half = 0.5 * (PI - from);
        let mut nodes = Vec::with_capacity(n * (n + 2));
        for (phi, w_phi) in wide {
            let (s, c) = (from + half * (1.0 + phi)).sin_cos();
            let (x, chord) = (radius * c, radius * s);
            for (y, wy) in legendre {
                let v = self.centre + self.down * x + self.level * (chord * y);
                let length = v.length();
                // dω = dx dy / |v|³.
                let w = w_phi * half * chord * chord * wy / (length * length * length);
                nodes.push((v / length, w));
            }
        }
        nodes
    }
}

/// One-dimensional nodes and weights on [−1, 1] for products.
#[derive(Clone, Debug)]
pub(super) struct Rules {
    /// Per order: n nodes, and n + 2 for the angle of a segment.
    legendre: Vec<[Vec<(f64, f64)>; 2]>,
    hexagon: [[f64; 2]; 6],
}

/// A square of degree 3: four points at R/√2, weight 1/4.
const SQUARE: [[f64; 2]; 4] = [
    [std::f64::consts::FRAC_1_SQRT_2, 0.0],
    [0.0, std::f64::consts::FRAC_1_SQRT_2],
    [-std::f64::consts::FRAC_1_SQRT_2, 0.0],
    [0.0, -std::f64::consts::FRAC_1_SQRT_2],
];

impl Rules {
    pub(super) fn new() -> Self {
        let corner = |k: usize| {
            let (s, c) = (PI * k as f64 / 3.0 + 0.5).sin_cos();
            let r = (2.0_f64 / 3.0).sqrt();
            [r * c, r * s]
        };
        Self {
            legendre: PRODUCTS.map(|n| [n, n + 2].map(gauss_legendre)).to_vec(),
            hexagon: [0, 1, 2, 3, 4, 5].map(corner),
        }
    }

    /// The product of the rules of one order.
    pub(super) fn product(
        &self,
        brdf: &dyn Brdf,
        disks: &[Disk; 2],
        order: usize,
        work: &mut Workspace,
    ) -> Sums {
        let [legendre, wide] = &self.legendre[order];
        let [light, sensor] = disks.map(|d| d.nodes(PRODUCTS[order], legendre, wide));
        for (i, wi) in &light {
            for (o, wo) in &sensor {
                work.push(*i, *o, wi * wo, 0);
            }
        }
        work.evaluate(brdf, 1)[0].into()
    }

    /// The share of a disk above the horizon, and the mean of max(cos θ, 0) over the whole disk.
    pub(super) fn means(&self, disk: &Disk) -> [f64; 2] {
        let (z, a) = (disk.centre.z, disk.half_angle);
        if z >= a.sin() {
            // ⟨cos θ⟩ over a cap: the projection of its area on the plane.
            return [1.0, z * (0.5 * (1.0 + a.cos()))];
        }
        if a == 0.0 {
            return [0.0; 2];
        }
        let [legendre, wide] = &self.legendre[PRODUCTS.len() - 1];
        let cap = 4.0 * PI * (0.5 * a).sin().powi(2);
        let mut sums = [0.0; 2];
        for (v, w) in disk.nodes(PRODUCTS[PRODUCTS.len() - 1], legendre, wide) {
            sums[0] += w / cap;
            sums[1] += w * v.z / cap;
        }
        sums
    }

    /// Radon's rule of degree 5 (the centre with weight 1/4, a hexagon at R √(2/3)) on either disk
    /// with the other at its centre, and the square on both:
    /// 5⊗1 + 1⊗5 − 1⊗1 + (3 − 1)⊗(3 − 1), exact to degree 5. The rules of degree 3 in it give the
    /// error; the first of the pair is one of them. For disks above the horizon.
    pub(super) fn sparse(
        &self,
        brdf: &dyn Brdf,
        [light, sensor]: &[Disk; 2],
        work: &mut Workspace,
    ) -> (Estimate, Estimate) {
        let disks = [light, sensor];
        let centres = disks.map(|d| d.centre);
        let wide = disks.map(|d| d.half_angle > 0.0);
        work.push(centres[0], centres[1], 1.0, 0);
        for (points, weight, group) in [(&self.hexagon[..], 0.125, 1), (&SQUARE[..], 0.25, 3)] {
            for side in (0..2).filter(|side| wide[*side]) {
                for point in points {
                    let mut pair = centres;
                    pair[side] = disks[side].direction(*point);
                    work.push(pair[0], pair[1], weight, group + side);
                }
            }
        }
        if wide[0] && wide[1] {
            let [on_light, on_sensor] = disks.map(|disk| SQUARE.map(|p| disk.direction(p)));
            for i in on_light {
                for o in on_sensor {
                    work.push(i, o, 0.0625, 5);
                }
            }
        }
        let channels = brdf.channels().count();
        let groups = work.evaluate(brdf, 6);
        let sum = |factors: [f64; 6]| {
            let mut sums = zeros(channels);
            for (factor, group) in factors.into_iter().zip(&groups) {
                add(&mut sums, factor, group);
            }
            sums
        };
        let centre = sum([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let on_light = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
        let on_sensor = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let [third, also_third, fifth] = match wide {
            [true, true] => [
                [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
                [-1.0, 0.0, 0.0, 1.0, 1.0, 0.0],
                [0.5, 1.0, 1.0, -1.0, -1.0, 1.0],
            ],
            [true, false] => [on_light, on_light, [0.25, 1.0, 0.0, 0.0, 0.0, 0.0]],
            [false, _] => [on_sensor, on_sensor, [0.25, 0.0, 1.0, 0.0, 0.0, 0.0]],
        }
        .map(sum);
        let exact = |sums| Estimate {
            sums,
            error: ChannelValues::from_elem(0.0, channels),
        };
        let mut steps = [exact(centre), exact(also_third)];
        let other = Estimate::after(fifth.clone(), &steps, 0.02);
        steps[1] = exact(third);
        let mut estimate = Estimate::after(fifth, &steps, 0.02);
        for (error, other) in estimate.error.iter_mut().zip(&other.error) {
            *error = error.max(*other);
        }
        let [_, third] = steps;
        (third, estimate)
    }
}
