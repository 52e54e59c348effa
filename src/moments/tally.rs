//! Weighted central co-moments of points in the plane, to order 4.
//!
//! Sums are of (x − mean)^n (y − mean)^m, never of x^n y^m: for a lobe of width σ at distance d
//! from the origin raw sums lose the square of d/σ in every variance, ten digits for a mirror-like
//! lobe. Parts are merged by moving both to the common mean (Chan, Golub, LeVeque 1979; Pébay
//! 2008 for higher orders), so that partial results can be made anywhere and put together in a
//! fixed order.

use super::component::{Component, Order};

#[inline]
const fn index_of(n: usize, m: usize) -> usize {
    Component { n, m }.index()
}

/// The steps of a move along an angle, 0 for θ: a sum and the next lower one along it. Each sum grows by the distance
/// times the lower one; all steps together make the powers of (x + d) (Shaw, Traub 1974).
const fn steps(axis: usize) -> [(usize, usize); 20] {
    let mut steps = [(0, 0); 20];
    let (mut round, mut next) = (1, 0);
    while round <= 4 {
        let mut degree = 4;
        while degree >= round {
            let mut other = 0;
            while other + degree <= 4 {
                steps[next] = if axis == 0 {
                    (index_of(degree, other), index_of(degree - 1, other))
                } else {
                    (index_of(other, degree), index_of(other, degree - 1))
                };
                other += 1;
                next += 1;
            }
            degree -= 1;
        }
        round += 1;
    }
    steps
}

const ALONG: [[(usize, usize); 20]; 2] = [steps(0), steps(1)];

/// Moments moved to another origin: `sums[(n, m)]` is Σ w x^n y^m, and the new origin is
/// at (−dx, −dy) of the old, Σ w (x + dx)^n (y + dy)^m.
pub(super) fn shifted(sums: &[f64; 15], order: Order, dx: f64, dy: f64) -> [f64; 15] {
    let mut sums = *sums;
    for (sum, lower) in ALONG[1] {
        sums[sum] += dy * sums[lower];
    }
    for (sum, lower) in ALONG[0] {
        sums[sum] += dx * sums[lower];
    }
    sums[order.count()..].fill(0.0);
    sums
}

/// 1, x, … x⁴.
#[inline]
pub(super) fn powers(x: f64) -> [f64; 5] {
    let x2 = x * x;
    [1.0, x, x2, x2 * x, x2 * x2]
}

/// Weight, mean and central co-moments of a set of weighted points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally {
    order: Order,
    /// Mean; meaningless if the weight is 0.
    pub(super) mean: [f64; 2],
    /// Σ w (x − x̄)^n (y − ȳ)^m at the index of (n, m); first orders are 0.
    sums: [f64; 15],
}

impl Tally {
    /// The tally of no points.
    pub fn new(order: Order) -> Self {
        Self {
            order,
            mean: [0.0; 2],
            sums: [0.0; 15],
        }
    }

    /// The tally of points with weights ≥ 0: two passes, so that every difference is one of
    /// neighbouring numbers.
    pub fn from_points(order: Order, points: &[[f64; 2]], weights: &[f64]) -> Self {
        let mut tally = Self::new(order);
        let weight: f64 = weights.iter().sum();
        tally.sums[0] = weight;
        if weight <= 0.0 || order.get() == 0 {
            return tally;
        }
        let mut mean = [0.0; 2];
        for (p, w) in points.iter().zip(weights) {
            mean[0] += w * p[0];
            mean[1] += w * p[1];
        }
        tally.mean = mean.map(|m| m / weight);
        let mut about = [0.0; 15];
        for (p, &w) in points.iter().zip(weights) {
            let (px, py) = (powers(p[0] - tally.mean[0]), powers(p[1] - tally.mean[1]));
            for (sum, c) in about.iter_mut().zip(Component::ALL) {
                *sum += w * px[c.n] * py[c.m];
            }
        }
        tally.recentred(&about)
    }

    /// The tally of sums Σ w x^n y^m about `centre`.
    pub(super) fn about(order: Order, centre: [f64; 2], sums: &[f64; 15]) -> Self {
        let tally = Self {
            order,
            mean: centre,
            sums: [0.0; 15],
        };
        tally.recentred(sums)
    }

    /// Moves sums about `self.mean` to the mean they imply.
    fn recentred(mut self, about: &[f64; 15]) -> Self {
        let weight = about[0];
        if weight <= 0.0 || self.order.get() == 0 {
            self.sums = [0.0; 15];
            self.sums[0] = weight;
            return self;
        }
        let d = [about[1] / weight, about[2] / weight];
        self.sums = shifted(about, self.order, -d[0], -d[1]);
        self.mean = [self.mean[0] + d[0], self.mean[1] + d[1]];
        (self.sums[1], self.sums[2]) = (0.0, 0.0);
        self
    }

    /// Adds the points of another tally of the same order.
    pub fn merge(&mut self, other: &Tally) {
        debug_assert_eq!(self.order, other.order);
        let (a, b) = (self.sums[0], other.sums[0]);
        if b == 0.0 {
            return;
        }
        if a == 0.0 {
            *self = *other;
            return;
        }
        let share = b / (a + b);
        let d = [0, 1].map(|i| other.mean[i] - self.mean[i]);
        let mine = shifted(&self.sums, self.order, -share * d[0], -share * d[1]);
        let rest = 1.0 - share;
        let theirs = shifted(&other.sums, self.order, rest * d[0], rest * d[1]);
        for i in 0..15 {
            self.sums[i] = mine[i] + theirs[i];
        }
        (self.sums[1], self.sums[2]) = (0.0, 0.0);
        for i in 0..2 {
            self.mean[i] += share * d[i];
        }
    }

    /// Total weight.
    pub(crate) fn weight(&self) -> f64 {
        self.sums[0]
    }

    /// Σ w (x − x̄)^n (y − ȳ)^m.
    pub(super) fn central(&self, c: Component) -> f64 {
        self.sums[c.index()]
    }

    /// Weight, mean, covariance, standardised co-skewness and excess co-kurtosis, component by
    /// component; `None` where undefined or not computed.
    pub fn values(&self) -> [Option<f64>; 15] {
        let mut out = [None; 15];
        let w = self.sums[0];
        out[0] = Some(w);
        if w <= 0.0 || self.order.get() == 0 {
            return out;
        }
        out[1] = Some(self.mean[0]);
        out[2] = Some(self.mean[1]);
        if self.order.get() == 1 {
            return out;
        }
        let covariance = [3, 4, 5].map(|i| self.sums[i] / w);
        out[3..6].copy_from_slice(&covariance.map(Some));
        if covariance[0] <= 0.0 || covariance[2] <= 0.0 {
            return out;
        }
        let (px, py) = (
            powers(covariance[0].sqrt().recip()),
            powers(covariance[2].sqrt().recip()),
        );
        let r = covariance[1] * px[1] * py[1];
        for c in self.order.components().skip(6) {
            let standardised = self.sums[c.index()] / w * px[c.n] * py[c.m];
            out[c.index()] = Some(standardised - gaussian(c, r));
        }
        out
    }
}

/// The standardised co-moment of order 3 or 4 of a bivariate normal distribution of correlation r.
#[inline]
pub(super) fn gaussian(c: Component, r: f64) -> f64 {
    match (c.n, c.m) {
        (4, 0) | (0, 4) => 3.0,
        (3, 1) | (1, 3) => 3.0 * r,
        (2, 2) => 1.0 + 2.0 * r * r,
        _ => 0.0,
    }
}
