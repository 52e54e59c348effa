//! Integrals of value × polynomial over one rectangle of the square (θ, φ), with an error estimate
//! for each angle.
//!
//! The rule is the product of the Gauss–Kronrod pair of 7 and 15 nodes (Kronrod 1965; digits of
//! QUADPACK, Piessens et al. 1983) with itself: exact for degrees up to 22 in each angle.
//! Replacing the 15 nodes of one angle by the 7 of its Gauss rule, exact to degree 13, gives the
//! error estimate of that angle. It is the error of the 7: generous by orders of magnitude where
//! the slice is smooth, by a factor of a few where it has kinks, as tables have everywhere.

use super::component::{Component, Order};
use super::slice::{Batch, Kind, Slice};
use super::tally::powers;
use crate::geometry::Direction;
use glam::DVec3;

/// Nodes along each angle.
pub(super) const NODES: usize = 15;

/// Values of the BRDF that one rectangle costs.
pub(super) const EVALUATIONS: usize = NODES * NODES;

/// Nodes in [0, 1) of the Kronrod rule, from the outermost; every other one is a Gauss node.
const KRONROD: [(f64, f64); 8] = [
    (0.991_455_371_120_812_6, 0.022_935_322_010_529_224),
    (0.949_107_912_342_758_5, 0.063_092_092_629_978_56),
    (0.864_864_423_359_769_1, 0.104_790_010_322_250_19),
    (0.741_531_185_599_394_4, 0.140_653_259_715_525_92),
    (0.586_087_235_467_691_1, 0.169_004_726_639_267_9),
    (0.405_845_151_377_397_2, 0.190_350_578_064_785_4),
    (0.207_784_955_007_898_47, 0.204_432_940_075_298_9),
    (0.0, 0.209_482_141_084_727_82),
];
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// Node × weight × power, for the Kronrod and the Gauss rule.
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
            let k = if i < 8 { i } else { 14 - i };
            let x = if i < 8 { -KRONROD[k].0 } else { KRONROD[k].0 };
            let gauss = if k % 2 == 1 { GAUSS[k / 2] } else { 0.0 };
            rule.nodes[i] = x;
            let (mut power, mut p) = (1.0, 0);
            while p < 5 {
                rule.kronrod[i][p] = KRONROD[k].1 * power;
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
    /// At the index of (n, m).
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pair_has_its_degrees() {
        let exact = |degree: i32| match degree % 2 {
            0 => 2.0 / f64::from(degree + 1),
            _ => 0.0,
        };
        let sum = |weights: &[[f64; 5]; NODES], degree: i32| -> f64 {
            let terms = RULE.nodes.iter().zip(weights);
            terms.map(|(x, w)| w[0] * x.powi(degree)).sum()
        };
        for degree in 0..=22 {
            assert!((sum(&RULE.kronrod, degree) - exact(degree)).abs() < 1e-15);
            let off = (sum(&RULE.gauss, degree) - exact(degree)).abs();
            assert_eq!(off < 1e-15, degree <= 13 || degree % 2 == 1, "{degree}");
        }
        assert!((sum(&RULE.kronrod, 24) - exact(24)).abs() > 1e-12);
    }
}
