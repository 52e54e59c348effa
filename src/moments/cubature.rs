//! Integrals of value × polynomial over one rectangle of the square (θ, φ), with an error estimate
//! for each angle.
//!
//! The rule is the product of the Gauss–Kronrod pair of 7 and 15 nodes with itself: exact for degrees
//! up to 22 in each angle.
//! Replacing the 15 nodes of one angle by the 7 of its Gauss rule, exact to degree 13, gives the
//! error estimate of that angle. It is the error of the 7: generous by orders of magnitude where
//! the slice is smooth, by a factor of a few where it has kinks, as tables have everywhere.
//!
//! Where a slice is the same at φ and −φ, rectangles lie at φ ≥ 0, and each stands for its mirror
//! image too.

use super::component::{Component, Order};
use super::slice::{Batch, Kind, Slice};
use super::tally::{powers, shifted};
use crate::geometry::Direction;
use crate::numeric::vectorised;
use crate::sampling::GAUSS_KRONROD;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Nodes along each angle.
pub(super) const NODES: usize = GAUSS_KRONROD.len();

/// Values of the BRDF that one rectangle costs.
pub(super) const EVALUATIONS: usize = NODES * NODES;

/// Weights times powers of the nodes, for the Kronrod and the Gauss rule.
pub(super) struct Rule {
    nodes: [f64; NODES],
    /// `[power][node]`: weight × node^power.
    kronrod: [[f64; NODES]; 5],
    gauss: [[f64; NODES]; 5],
}

impl Rule {
    pub(super) const fn new() -> Self {
        let mut rule = Self {
            nodes: [0.0; NODES],
            kronrod: [[0.0; NODES]; 5],
            gauss: [[0.0; NODES]; 5],
        };
        let mut i = 0;
        while i < NODES {
            let [x, kronrod, gauss] = GAUSS_KRONROD[i];
            rule.nodes[i] = x;
            let (mut power, mut p) = (1.0, 0);
            while p < 5 {
                rule.kronrod[p][i] = kronrod * power;
                rule.gauss[p][i] = gauss * power;
                power *= x;
                p += 1;
            }
            i += 1;
        }
        rule
    }
}

static RULE: Rule = Rule::new();

/// A rectangle of the square (θ, φ), rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    pub(super) lo: [f64; 2],
    pub(super) hi: [f64; 2],
}

impl Rectangle {
    pub(super) fn width(&self, axis: usize) -> f64 {
        self.hi[axis] - self.lo[axis]
    }

    pub(super) fn centre(&self) -> [f64; 2] {
        [0, 1].map(|a| 0.5 * (self.lo[a] + self.hi[a]))
    }

    /// The two parts on either side of `at`.
    pub(super) fn cut(&self, axis: usize, at: f64) -> [Self; 2] {
        let (mut below, mut above) = (*self, *self);
        below.hi[axis] = at;
        above.lo[axis] = at;
        [below, above]
    }
}

/// Sines and cosines at the nodes of an interval; rectangles beside each other share them.
type Nodes = [(f64, f64); NODES];

/// What the rectangles of a slice are evaluated in.
#[derive(Default)]
pub(super) struct Workspace {
    batch: Batch,
    /// By the ends of the interval.
    nodes: FxHashMap<[u64; 2], Nodes>,
}

/// Integrals over a rectangle of value × (θ − θ_c)^n (φ − φ_c)^m about (θ_c, φ_c): the centre, or
/// that of the rectangle and its mirror image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) rectangle: Rectangle,
    pub(super) centre: [f64; 2],
    /// Integrals, at the index of (n, m).
    pub(super) sums: [f64; 15],
    /// Estimated errors along θ and along φ.
    pub(super) differences: [[f64; 15]; 2],
    /// Area, that without data, and that which was clamped, rad².
    pub(super) area: f64,
    pub(super) missing: f64,
    pub(super) clamped: f64,
}

impl Cell {
    pub(super) fn new(
        slice: &Slice<'_>,
        order: Order,
        rectangle: Rectangle,
        Workspace { batch, nodes }: &mut Workspace,
    ) -> Self {
        let centre = rectangle.centre();
        let half = [0, 1].map(|a| 0.5 * rectangle.width(a));
        let [thetas, phis] = [0, 1].map(|axis| {
            let ends = [rectangle.lo[axis], rectangle.hi[axis]].map(f64::to_bits);
            let at = |x| f64::sin_cos(centre[axis] + half[axis] * x);
            *nodes.entry(ends).or_insert_with(|| RULE.nodes.map(at))
        });
        let mut lights = [[Direction::NORMAL; NODES]; NODES];
        for (row, (st, ct)) in lights.iter_mut().zip(thetas) {
            for (light, (sp, cp)) in row.iter_mut().zip(phis) {
                *light = Direction::from_unit(DVec3::new(st * cp, sp, ct * cp));
            }
        }
        batch.clear();
        batch.extend(slice, lights.as_flattened());
        slice.evaluate(batch);
        let area = half[0] * half[1];
        let mut cell = Self {
            rectangle,
            centre,
            sums: [0.0; 15],
            differences: [[0.0; 15]; 2],
            area: 4.0 * area,
            missing: 0.0,
            clamped: 0.0,
        };
        vectorised!(match order.get() {
            0 => cell.integrate::<0>(batch.values()),
            1 => cell.integrate::<1>(batch.values()),
            2 => cell.integrate::<2>(batch.values()),
            3 => cell.integrate::<3>(batch.values()),
            _ => cell.integrate::<4>(batch.values()),
        });
        if batch.kinds().iter().any(|k| *k != Kind::Value) {
            for (i, kind) in batch.kinds().iter().enumerate() {
                let weight = RULE.kronrod[0][i / NODES] * RULE.kronrod[0][i % NODES] * area;
                match kind {
                    Kind::Missing => cell.missing += weight,
                    Kind::Clamped => cell.clamped += weight,
                    Kind::Value => {}
                }
            }
        }
        let (px, py) = (powers(half[0]), powers(half[1]));
        for c in order.components() {
            let unit = area * px[c.n] * py[c.m];
            let i = c.index();
            cell.sums[i] *= unit;
            cell.differences[0][i] *= unit;
            cell.differences[1][i] *= unit;
        }
        if slice.is_mirrored() {
            cell.mirror(order);
        }
        cell
    }

    /// Adds the mirror image at −φ: what is odd in φ vanishes.
    fn mirror(&mut self, order: Order) {
        let phi = std::mem::replace(&mut self.centre[1], 0.0);
        let [along_theta, along_phi] = &mut self.differences;
        for sums in [&mut self.sums, along_theta, along_phi] {
            *sums = shifted(sums, order, 0.0, phi);
            for c in order.components() {
                sums[c.index()] *= if c.m % 2 == 0 { 2.0 } else { 0.0 };
            }
        }
        for area in [&mut self.area, &mut self.missing, &mut self.clamped] {
            *area *= 2.0;
        }
    }

    /// Sums over the unit cell [−1, 1]².
    #[inline(always)]
    fn integrate<const ORDER: usize>(&mut self, values: &[f64]) {
        // Integrals over θ at each φ, by both rules.
        let (mut kronrod, mut gauss) = ([[0.0; NODES]; 5], [[0.0; NODES]; 5]);
        let (rows, _) = values.as_chunks::<NODES>();
        for (i, row) in rows.iter().enumerate() {
            for n in 0..=ORDER {
                let weight = RULE.kronrod[n][i];
                for j in 0..NODES {
                    kronrod[n][j] += weight * row[j];
                }
            }
            // Every other node is one of Gauss's.
            if i % 2 == 1 {
                for n in 0..=ORDER {
                    let weight = RULE.gauss[n][i];
                    for j in 0..NODES {
                        gauss[n][j] += weight * row[j];
                    }
                }
            }
        }
        for (k, Component { n, m }) in Component::ALL.into_iter().enumerate() {
            if n + m > ORDER {
                break;
            }
            let (mut sum, mut along_theta, mut along_phi) = (0.0, 0.0, 0.0);
            for j in 0..NODES {
                let weight = RULE.kronrod[m][j];
                sum += weight * kronrod[n][j];
                along_theta += weight * (kronrod[n][j] - gauss[n][j]);
                along_phi += (weight - RULE.gauss[m][j]) * kronrod[n][j];
            }
            self.sums[k] = sum;
            (self.differences[0][k], self.differences[1][k]) = (along_theta, along_phi);
        }
    }
}
