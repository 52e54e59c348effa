//! Local splines: the rule of [`super::ThinPlate`], about each query a spline through its neighbours.
//!
//! The k nearest points x_j of the embedding (see [`super::scattered`]) and, where these are flat, some
//! farther ones (see [`super::cloud`]) are interpolated by Σ c_j φ(|x − x_j|) plus a linear
//! polynomial, φ(r) = r² ln r (Duchon 1977), under the usual side conditions. r² ln r is conditionally
//! positive definite of order 2 in every dimension, so with d + 1 of the points taken as Lagrange
//! points ξ_i of the polynomial part p_i, the *reduced* kernel
//!
//! κ(x, y) = φ(x − y) − Σ p_i(x) φ(ξ_i − y) − Σ p_j(y) φ(x − ξ_j) + ΣΣ p_i(x) p_j(y) φ(ξ_i − ξ_j)
//!
//! is positive definite on the others (Wendland, *Scattered Data Approximation*, §8.5) and one
//! Cholesky factorisation of size k − d − 1 gives the weights of the k readings: half the work of
//! the indefinite system, and no pivoting.
//!
//! Neighbours that lie near a plane, a line or a point say nothing of the slope across it. The
//! polynomial then is linear along the directions they determine and constant across, and φ(r) = −r,
//! for which a constant is enough (conditionally positive definite of order 1).
//!
//! Readings that are uncertain are missed by some of it: their variance (of the logarithm, or as a share of f)
//! stands on the diagonal. That is the mean of a Gaussian process whose values vary by about 1, a factor of e,
//! over a neighbourhood (Wahba, *Spline Models for Observational Data*, 1990, §1.4).
//!
//! The weights of a value far from what surrounds it grow without bound. If the sum of their sizes
//! exceeds [`LARGEST_WEIGHTS`], points that almost coincide are let miss their values a little
//! ([`NUGGETS`]); if that is not the cause the query is moved towards its nearest neighbour until the
//! sum is small enough. And no value leaves the range of its neighbours by more than [`OVERSHOOT`] of
//! it; where the readings fill space it rises above by [`RISE`] times what the largest stands above the
//! median at most, and beside gaps that they do not surround not at all. Of f itself no more than the factors [`LARGEST_FACTOR`] and [`LARGEST_FACTOR_IN_SPACE`]
//! if it is logarithms that are interpolated.

use super::cloud::{Cloud, Found, Reach, Search, covariance};
use super::neighbours::Shepard;
use super::scattered::ScatteredRule;
use super::spline_block::{Block, LANES, MOST, SMALLEST_PIVOT, biharmonic, weighted};
use super::transform::Values;
use crate::numeric::vectorised;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::num::NonZeroUsize;

/// Share of the largest variance above which neighbours that are flat determine a direction.
const DETERMINED: f64 = 0.02;

/// Largest sum of the sizes of the weights; of a value that is surrounded it is 1 to 3. For neighbours
/// that are the nearest points and fill space, that are from thinner copies too, and that are flat.
const LARGEST_WEIGHTS: [f64; 3] = [6.0, 2.5, 1.5];

/// Largest sum of the sizes of the weights where most of the readings fill space, and all of them agree on the slope.
const LARGEST_OF_SPACE: f64 = 20.0;

/// Distance to the nearest neighbour that is rounding, as a share of that to the farthest.
const AT_READING: f64 = 1e-10;

/// Variances of the readings that are tried in turn, in units of the kernel at distance 1 of a
/// neighbourhood of size 1.
const NUGGETS: [f64; 3] = [0.0, 1e-6, 1e-3];

/// Largest distance of a value from the range of its neighbours, as a share of that range; 0 where
/// these are flat, and none above it where the readings fill space.
const OVERSHOOT: f64 = 0.5;

/// Largest distance of a value above its neighbours, as a share of that of the largest from their median:
/// a peak rises over its flanks, and one small value among equal ones lifts nothing.
const RISE: f64 = 3.0;

/// Largest factor by which a value exceeds its neighbours, f + epsilon.
const LARGEST_FACTOR: f64 = 4.0;

/// Largest factor where the readings fill space: of narrow lobes they seldom sample the peak.
const LARGEST_FACTOR_IN_SPACE: f64 = 30.0;

/// Steps of the search along the way to the nearest neighbour: the place to 1 in 64.
const STEPS: u32 = 6;

/// Local splines as a rule over neighbours.
pub(super) struct Local {
    neighbours: NonZeroUsize,
    /// Largest distance above the range of the neighbours, in the transformed value: ln of a factor.
    pub above: f64,
    /// Largest distance above that range where the readings fill space.
    above_in_space: f64,
}

/// φ(r) = −r, from r².
#[inline]
fn linear(r2: f64) -> f64 {
    -r2.sqrt()
}

#[inline]
fn distance2<const K: usize>(a: &[f64; K], b: &[f64; K]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += (a - b) * (a - b);
    }
    sum
}

/// Buffers of one thread.
#[derive(Default)]
pub(super) struct Scratch<const K: usize> {
    search: Search,
    found: Found,
    /// The neighbours relative to the query, in units of the farthest.
    points: Vec<[f64; K]>,
    /// Largest sum of the sizes of the weights that is taken.
    largest: f64,
    /// Values of the polynomials at each neighbour; Lagrange ones after elimination.
    basis: Vec<[f64; MOST]>,
    /// Lagrange polynomials in terms of 1 and the components of a point: a row per component.
    polynomials: [[f64; MOST]; MOST],
    /// φ to the Lagrange points minus half their own correction, per neighbour.
    to_lagrange: Vec<[f64; MOST]>,
    /// φ between the Lagrange points.
    own: [[f64; MOST]; MOST],
    /// Neighbours that are Lagrange points, each with its column of `basis`.
    lagrange: Vec<(usize, usize)>,
    /// The other neighbours.
    free: Vec<usize>,
    /// Storage of the reduced system.
    matrix: Vec<f64>,
    /// Right-hand side, then weights of the free neighbours.
    of_free: Vec<f64>,
    /// A weight per neighbour.
    weights: Vec<f64>,
    /// Smallest and largest value of the neighbours, per channel.
    ranges: [Vec<f64>; 2],
    /// The values of one channel.
    values: Vec<f64>,
    /// Variance of each neighbour.
    noise: Vec<f64>,
    /// Queries that wait for others to be solved with.
    block: Option<Box<Block<K>>>,
}

impl<const K: usize> ScatteredRule<K> for Local {
    type Scratch = Box<Scratch<K>>;

    fn interpolate(
        &self,
        cloud: &Cloud<K>,
        queries: &[[f64; K]],
        scratch: &mut Self::Scratch,
        out: &mut [f64],
    ) {
        let s = &mut **scratch;
        let mut block = s.block.take().unwrap_or_default();
        s.search.restart();
        let width = cloud.channels;
        for (slot, x) in queries.iter().enumerate() {
            cloud.find(x, self.neighbours, &mut s.search);
            let found = &mut s.search.found;
            let nearest = found.index[0];
            let at_reading = found.distance2[0].sqrt() <= AT_READING * found.size();
            let out_of = slot * width..(slot + 1) * width;
            if at_reading && cloud.noise(nearest) == 0.0 {
                out[out_of].copy_from_slice(cloud.value(nearest));
                continue;
            }
            if found.reach != Reach::Nearest || !block.suits(found.index.len()) {
                std::mem::swap(&mut s.found, found);
                s.alone(self, cloud, x, &mut out[out_of]);
                continue;
            }
            block.take(slot, cloud, x, found);
            if block.taken == LANES {
                self.solve(cloud, queries, &mut block, s, out);
            }
        }
        self.solve(cloud, queries, &mut block, s, out);
        s.block = Some(block);
    }
}

impl Local {
    pub(crate) fn new(neighbours: NonZeroUsize, values: Values) -> Self {
        Self {
            neighbours,
            above: values.rise(LARGEST_FACTOR),
            above_in_space: values.rise(LARGEST_FACTOR_IN_SPACE),
        }
    }

    /// Interpolates at the queries of a block, and empties it.
    fn solve<const K: usize>(
        &self,
        cloud: &Cloud<K>,
        x: &[[f64; K]],
        block: &mut Block<K>,
        s: &mut Scratch<K>,
        out: &mut [f64],
    ) {
        if block.taken == 0 {
            return;
        }
        let sizes = vectorised!(block.solve());
        let largest = largest_weights(cloud, Reach::Nearest);
        for lane in 0..std::mem::take(&mut block.taken) {
            let slot = block.slots[lane];
            let out = &mut out[slot * cloud.channels..(slot + 1) * cloud.channels];
            std::mem::swap(&mut s.found, &mut block.found[lane]);
            if sizes[lane] <= largest {
                block.weights(lane, &mut s.weights);
                s.combine(self, cloud, &x[slot], out);
            } else {
                s.alone(self, cloud, &x[slot], out);
            }
        }
    }
}

/// Largest sum of the sizes of the weights that is taken of neighbours that were found so far away.
fn largest_weights<const K: usize>(cloud: &Cloud<K>, reach: Reach) -> f64 {
    match reach {
        Reach::Nearest if !cloud.is_in_sheets() => LARGEST_OF_SPACE,
        reach => LARGEST_WEIGHTS[reach as usize],
    }
}

impl<const K: usize> Scratch<K> {
    /// Interpolates by the neighbours that were found.
    fn alone(&mut self, rule: &Local, cloud: &Cloud<K>, x: &[f64; K], out: &mut [f64]) {
        if self.weigh(cloud, x) {
            self.combine(rule, cloud, x, out);
        } else {
            Shepard::mean(2.0, cloud, &self.found, out);
        }
    }

    /// Σ weight · value, kept near the range of the values.
    fn combine(&mut self, rule: &Local, cloud: &Cloud<K>, x: &[f64; K], out: &mut [f64]) {
        let index = &self.found.index;
        vectorised!(weighted(cloud, index, &self.weights, &mut self.ranges, out));
        let in_space = self.found.reach == Reach::Nearest && !cloud.is_in_sheets();
        let mut is_inside = None;
        let [lows, highs] = &self.ranges;
        let ranges = lows.iter().zip(highs);
        for (channel, (out, (&low, &high))) in out.iter_mut().zip(ranges).enumerate() {
            let reach = match self.found.reach {
                Reach::Flat => 0.0,
                Reach::Nearest | Reach::Far => OVERSHOOT * (high - low),
            };
            *out = out.max(low - reach);
            if *out > high {
                let rise = if in_space {
                    self.values.clear();
                    let values = self.found.index.iter().map(|&i| cloud.value(i)[channel]);
                    self.values.extend(values);
                    let middle = (self.values.len() - 1) / 2;
                    let (_, &mut median, _) =
                        self.values.select_nth_unstable_by(middle, f64::total_cmp);
                    rule.above_in_space.min(RISE * (high - median))
                } else {
                    let index = &self.found.index;
                    let inside = self.found.reach == Reach::Nearest;
                    match *is_inside.get_or_insert_with(|| inside || cloud.surrounds(index, x)) {
                        true => rule.above.min(reach),
                        false => 0.0,
                    }
                };
                *out = out.min(high + rise);
            }
        }
    }

    /// Finds the weights of the neighbours; false if there are none.
    fn weigh(&mut self, cloud: &Cloud<K>, x: &[f64; K]) -> bool {
        let query = self.localise(cloud, x);
        self.eliminate();
        self.largest = largest_weights(cloud, self.found.reach);
        let found = if self.lagrange.len() == K + 1 {
            self.solve(biharmonic, &query)
        } else {
            self.solve(linear, &query)
        };
        found && self.weights.iter().all(|w| w.is_finite())
    }

    /// Solves for the weights with the first nugget that keeps them small; false if none can.
    fn solve(&mut self, phi: impl Fn(f64) -> f64 + Copy, query: &[f64; K]) -> bool {
        let mut found = false;
        for (i, &nugget) in NUGGETS.iter().enumerate() {
            let Some(factor) = self.factor(phi, nugget) else {
                continue;
            };
            found = true;
            let is_small = self.weights_at(phi, query, &factor) <= self.largest;
            if !is_small && i + 1 == NUGGETS.len() {
                self.approach(phi, query, &factor);
            }
            self.matrix = factor.unpack_dirty().data.into();
            if is_small {
                break;
            }
        }
        found
    }

    /// Moves the query towards its nearest neighbour until its weights are small enough.
    fn approach(
        &mut self,
        phi: impl Fn(f64) -> f64 + Copy,
        query: &[f64; K],
        factor: &Cholesky<f64, Dyn>,
    ) {
        let nearest = self.points[0];
        let between = |t: f64| -> [f64; K] {
            std::array::from_fn(|d| query[d] + t * (nearest[d] - query[d]))
        };
        let [mut outside, mut inside] = [0.0, 1.0];
        for _ in 0..STEPS {
            let t = 0.5 * (outside + inside);
            if self.weights_at(phi, &between(t), factor) <= self.largest {
                inside = t;
            } else {
                outside = t;
            }
        }
        self.weights_at(phi, &between(inside), factor);
    }

    /// Moves the query to 0 and the farthest neighbour to distance 1; where the query is then: elsewhere only of neighbours
    /// that are flat, in their plane.
    fn localise(&mut self, cloud: &Cloud<K>, x: &[f64; K]) -> [f64; K] {
        let size = self.found.size();
        self.points.clear();
        self.basis.clear();
        self.noise.clear();
        let noise = self.found.index.iter().map(|&i| cloud.noise(i).powi(2));
        self.noise.extend(noise);
        for &i in &self.found.index {
            let p = &cloud.points[i];
            let local: [f64; K] = std::array::from_fn(|d| (p[d] - x[d]) / size);
            let mut row = [0.0; MOST];
            row[0] = 1.0;
            row[1..=K].copy_from_slice(&local);
            self.points.push(local);
            self.basis.push(row);
        }
        self.polynomials = [[0.0; MOST]; MOST];
        for (i, row) in self.polynomials.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        match self.found.reach {
            Reach::Flat => self.determine(),
            Reach::Nearest | Reach::Far => [0.0; K],
        }
    }

    /// Polynomials along the directions that the neighbours determine, 0 for the others. Where the query is: from the mean
    /// of the neighbours towards 0, along the directions that are kept.
    fn determine(&mut self) -> [f64; K] {
        let all: Vec<usize> = (0..self.points.len()).collect();
        let c = covariance(&self.points, &all);
        let eigen = DMatrix::from_fn(K, K, |a, b| c[a][b]).symmetric_eigen();
        let least = DETERMINED * eigen.eigenvalues.max();
        for d in 0..K {
            let is_kept = eigen.eigenvalues[d] > least;
            for a in 0..K {
                self.polynomials[a + 1][d + 1] = if is_kept {
                    eigen.eigenvectors[(a, d)]
                } else {
                    0.0
                };
            }
        }
        let n = self.points.len() as f64;
        let mean: [f64; K] =
            std::array::from_fn(|d| self.points.iter().map(|p| p[d]).sum::<f64>() / n);
        let mut query = mean;
        for d in 0..K {
            let along: f64 = (0..K)
                .map(|a| -mean[a] * self.polynomials[a + 1][d + 1])
                .sum();
            for a in 0..K {
                query[a] += along * self.polynomials[a + 1][d + 1];
            }
        }
        for (row, p) in self.basis.iter_mut().zip(&self.points) {
            for d in 0..K {
                row[d + 1] = (0..K).map(|a| p[a] * self.polynomials[a + 1][d + 1]).sum();
            }
        }
        query
    }

    /// Column elimination with full pivoting: picks the Lagrange points and turns the rows of
    /// `basis` into values of their cardinal polynomials.
    fn eliminate(&mut self) {
        self.lagrange.clear();
        for _ in 0..=K {
            let mut best = (0.0, 0, 0);
            for (a, row) in self.basis.iter().enumerate() {
                if self.lagrange.iter().any(|l| l.0 == a) {
                    continue;
                }
                for (c, value) in row[..=K].iter().enumerate() {
                    if value.abs() > best.0 && self.lagrange.iter().all(|l| l.1 != c) {
                        best = (value.abs(), a, c);
                    }
                }
            }
            let (size, a, c) = best;
            if size < SMALLEST_PIVOT {
                break;
            }
            let pivot_row = self.basis[a];
            let inverse = 1.0 / pivot_row[c];
            for row in self.basis.iter_mut().chain(&mut self.polynomials) {
                let scaled = row[c] * inverse;
                for (d, value) in row[..=K].iter_mut().enumerate() {
                    if d != c {
                        *value -= scaled * pivot_row[d];
                    }
                }
                row[c] = scaled;
            }
            self.lagrange.push((a, c));
        }
        let lagrange = &self.lagrange;
        let is_free = |a: &usize| lagrange.iter().all(|l| l.0 != *a);
        self.free.clear();
        self.free.extend((0..self.points.len()).filter(is_free));
    }

    /// κ of two places from φ between them, their polynomials and their `to_lagrange`.
    #[inline]
    fn reduced(phi: f64, [pa, ta]: [&[f64; MOST]; 2], [pb, tb]: [&[f64; MOST]; 2]) -> f64 {
        let mut sum = phi;
        for i in 0..=K {
            sum -= pa[i] * tb[i] + pb[i] * ta[i];
        }
        sum
    }

    /// φ from a place to the Lagrange points minus half their own correction.
    #[inline]
    fn towards_lagrange(
        &self,
        phi: impl Fn(f64) -> f64,
        place: &[f64; K],
        row: &[f64; MOST],
        at: impl Fn(usize) -> f64,
    ) -> [f64; MOST] {
        let mut t = [0.0; MOST];
        for &(b, i) in &self.lagrange {
            let correction: f64 = self
                .lagrange
                .iter()
                .map(|&(_, j)| row[j] * self.own[i][j])
                .sum();
            t[i] = phi(distance2(place, &self.points[b])) + at(b) - 0.5 * correction;
        }
        t
    }

    /// The factored reduced system; `None` if it is not positive definite.
    fn factor(
        &mut self,
        phi: impl Fn(f64) -> f64 + Copy,
        nugget: f64,
    ) -> Option<Cholesky<f64, Dyn>> {
        let noise = &self.noise;
        let at = |a: usize, b: usize| {
            if a == b { nugget + noise[a] } else { 0.0 }
        };
        self.own = [[0.0; MOST]; MOST];
        for &(a, i) in &self.lagrange {
            for &(b, j) in &self.lagrange {
                self.own[i][j] = phi(distance2(&self.points[a], &self.points[b])) + at(a, b);
            }
        }
        let mut to_lagrange = std::mem::take(&mut self.to_lagrange);
        to_lagrange.clear();
        for (a, (row, point)) in self.basis.iter().zip(&self.points).enumerate() {
            to_lagrange.push(self.towards_lagrange(phi, point, row, |b| at(a, b)));
        }
        self.to_lagrange = to_lagrange;
        let n = self.free.len();
        let mut matrix = std::mem::take(&mut self.matrix);
        matrix.clear();
        matrix.resize(n * n, 0.0);
        let of = |a: usize| [&self.basis[a], &self.to_lagrange[a]];
        for (column, &a) in self.free.iter().enumerate() {
            let pa = &self.points[a];
            // Cholesky reads the lower triangle; storage is column-major.
            for (row, &b) in self.free.iter().enumerate().skip(column) {
                let direct = phi(distance2(pa, &self.points[b])) + at(a, b);
                matrix[column * n + row] = Self::reduced(direct, of(a), of(b));
            }
        }
        Cholesky::new(DMatrix::from_vec(n, n, matrix))
    }

    /// Sets the weights of the neighbours at a place; the sum of their sizes, NaN if they overflow.
    fn weights_at(
        &mut self,
        phi: impl Fn(f64) -> f64 + Copy,
        q: &[f64; K],
        factor: &Cholesky<f64, Dyn>,
    ) -> f64 {
        let mut p = self.polynomials[0];
        for (q, row) in q.iter().zip(&self.polynomials[1..]) {
            for (p, row) in p.iter_mut().zip(row) {
                *p += q * row;
            }
        }
        let t = self.towards_lagrange(phi, q, &p, |_| 0.0);
        let mut rhs = std::mem::take(&mut self.of_free);
        rhs.clear();
        for &a in &self.free {
            let direct = phi(distance2(q, &self.points[a]));
            let of = [&self.basis[a], &self.to_lagrange[a]];
            rhs.push(Self::reduced(direct, of, [&p, &t]));
        }
        let mut rhs = DVector::from_vec(rhs);
        factor.solve_mut(&mut rhs);
        self.weights.clear();
        self.weights.resize(self.points.len(), 0.0);
        for (&a, &w) in self.free.iter().zip(&rhs) {
            self.weights[a] = w;
            for &(_, i) in &self.lagrange {
                p[i] -= w * self.basis[a][i];
            }
        }
        for &(a, i) in &self.lagrange {
            self.weights[a] = p[i];
        }
        self.of_free = rhs.data.into();
        self.weights.iter().map(|w| w.abs()).sum()
    }
}
