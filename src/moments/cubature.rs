//! Integrals of value × polynomial over one rectangle of the square (θ, φ), with an error estimate
//! for each angle.
//!
//! The rule is the product of the Gauss–Kronrod pair of 7 and 15 nodes with itself: exact for degrees
//! up to 22 in each angle.
//! Replacing the 15 nodes of one angle by the 7 of its Gauss rule, exact to degree 13, gives the
//! error estimate of that angle. It is the error of the 7: generous by orders of magnitude where
//! the slice is smooth, by a factor of a few where it has kinks, as tables have everywhere.

use super::component::{Component, Order};
use super::slice::{Batch, Kind, Slice};
use super::tally::powers;
use crate::geometry::Direction;
use crate::sampling::GAUSS_KRONROD;
use glam::DVec3;

/// Nodes along each angle.
pub(super) const NODES: usize = GAUSS_KRONROD.len();

/// Values of the BRDF that one rectangle costs.
pub(super) const EVALUATIONS: usize = NODES * NODES;

/// Weights times powers of the nodes, for the Kronrod and the Gauss rule.
pub(super) struct Rule {
    nodes: [f64; NODES],
    /// `[node][power]`: weight × node^power.
    kronrod: [[f64; 5]; NODES],
    gauss: [[f64; 5]; NODES],
}

impl Rule {
    pub(super) const fn new() -> Self {
        let mut rule = Self {
            nodes: [0.0; NODES],
            kronrod: [[0.0; 5]; NODES],
            gauss: [[0.0; 5]; NODES],
        };
        let mut i = 0;
        while i < NODES {
            let [x, kronrod, gauss] = GAUSS_KRONROD[i];
            rule.nodes[i] = x;
            let (mut power, mut p) = (1.0, 0);
            while p < 5 {
                rule.kronrod[i][p] = kronrod * power;
                rule.gauss[i][p] = gauss * power;
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

    fn centre(&self) -> [f64; 2] {
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

/// Integrals over a rectangle of value × (θ − θ_c)^n (φ − φ_c)^m about its centre (θ_c, φ_c).
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) rectangle: Rectangle,
    pub(super) centre: [f64; 2],
    /// Integrals, at the index of (n, m).
    pub(super) sums: [f64; 15],
    /// Estimated errors along θ and along φ.
    pub(super) differences: [[f64; 15]; 2],
    /// Area (rad²) without data, and area that was clamped.
    pub(super) missing: f64,
    pub(super) clamped: f64,
}

impl Cell {
    pub(super) fn new(
        slice: &Slice<'_>,
        order: Order,
        rectangle: Rectangle,
        batch: &mut Batch,
    ) -> Self {
        let centre = rectangle.centre();
        let half = [0, 1].map(|a| 0.5 * rectangle.width(a));
        let angles = |axis: usize| {
            RULE.nodes
                .map(|x| (centre[axis] + half[axis] * x).sin_cos())
        };
        let (thetas, phis) = (angles(0), angles(1));
        batch.clear();
        for (st, ct) in thetas {
            for (sp, cp) in phis {
                let m = DVec3::new(st * cp, sp, ct * cp);
                batch.push(slice, Direction::from_unit(m));
            }
        }
        slice.evaluate(batch);
        let mut cell = Self {
            rectangle,
            centre,
            sums: [0.0; 15],
            differences: [[0.0; 15]; 2],
            missing: 0.0,
            clamped: 0.0,
        };
        match order.get() {
            0 => cell.integrate::<0>(batch.values()),
            1 => cell.integrate::<1>(batch.values()),
            2 => cell.integrate::<2>(batch.values()),
            3 => cell.integrate::<3>(batch.values()),
            _ => cell.integrate::<4>(batch.values()),
        }
        let area = half[0] * half[1];
        if batch.kinds().iter().any(|k| *k != Kind::Value) {
            for (i, kind) in batch.kinds().iter().enumerate() {
                let weight = RULE.kronrod[i / NODES][0] * RULE.kronrod[i % NODES][0] * area;
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
        cell
    }

    /// Sums over the unit cell [−1, 1]².
    fn integrate<const ORDER: usize>(&mut self, values: &[f64]) {
        let (rows, _) = values.as_chunks::<NODES>();
        for (i, row) in rows.iter().enumerate() {
            // Integrals over φ at this θ, by both rules.
            let (mut kronrod, mut gauss) = ([0.0; 5], [0.0; 5]);
            for j in 0..NODES {
                for m in 0..=ORDER {
                    kronrod[m] += RULE.kronrod[j][m] * row[j];
                }
            }
            for j in (1..NODES).step_by(2) {
                for m in 0..=ORDER {
                    gauss[m] += RULE.gauss[j][m] * row[j];
                }
            }
            for (k, Component { n, m }) in Component::ALL.into_iter().enumerate() {
                if n + m > ORDER {
                    break;
                }
                let weight = RULE.kronrod[i][n];
                self.sums[k] += weight * kronrod[m];
                self.differences[0][k] += (weight - RULE.gauss[i][n]) * kronrod[m];
                self.differences[1][k] += weight * (kronrod[m] - gauss[m]);
            }
        }
    }
}
