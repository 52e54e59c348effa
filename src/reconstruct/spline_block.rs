//! Local splines in vector instructions: the weights of several at once, one in each lane, and their values. The rule of
//! [`super::ThinPlate`] where neighbours are the nearest points and fill space, which nearly all are.
//!
//! A lane whose system is not positive definite, or whose weights are too large, says so; that query is solved
//! alone.

use super::cloud::{Cloud, Found};
use crate::numeric::powers::ln;

/// Polynomials of the 4-D embedding, the most there are.
pub(super) const MOST: usize = 5;

/// A pivot below this share of the neighbourhood's size determines no slope: rounding of the embedded
/// coordinates is 1e-16 of 1 (1e-9 near poles of other coordinates than the schedule's).
pub(super) const SMALLEST_PIVOT: f64 = 1e-6;

/// φ(r) = r² ln r, from r²: ½ r² ln r²; 0 at 0.
#[inline(always)]
pub(super) fn biharmonic(r2: f64) -> f64 {
    let log = ln(r2);
    if r2 > 0.0 { 0.5 * r2 * log } else { 0.0 }
}

/// Queries that are solved at once.
pub(super) const LANES: usize = 8;

/// A number of each query.
type Lane = [f64; LANES];

const ZERO: Lane = [0.0; LANES];

/// Queries with as many neighbours each.
#[derive(Default)]
pub(super) struct Block<const K: usize> {
    /// Queries that are taken up.
    pub taken: usize,
    /// Where in a list of queries each is, and what was found about it.
    pub slots: [usize; LANES],
    pub found: [Found; LANES],
    /// Number of each neighbour in `found`: the Lagrange points become the first.
    order: Vec<[usize; LANES]>,
    /// The neighbours relative to the query, in units of the farthest.
    points: Vec<[Lane; K]>,
    /// Variance of each neighbour.
    noise: Vec<Lane>,
    /// Values of the Lagrange polynomials at the neighbours, then at the query.
    basis: Vec<[Lane; MOST]>,
    /// φ to the Lagrange points minus half their own correction, of the free neighbours.
    to_lagrange: Vec<[Lane; MOST]>,
    /// The lower triangle of the reduced system, row after row; then its Cholesky factor, with the inverses of the
    /// diagonal.
    factor: Vec<Lane>,
    weights: Vec<Lane>,
}

impl<const K: usize> Block<K> {
    /// True if a query with so many neighbours fits beside those that are taken up.
    pub fn suits(&self, neighbours: usize) -> bool {
        neighbours > K && (self.taken == 0 || self.order.len() == neighbours)
    }

    /// Takes up query `x`, with what was found about it.
    pub(crate) fn take(&mut self, slot: usize, cloud: &Cloud<K>, x: &[f64; K], found: &mut Found) {
        let lane = self.taken;
        let n = found.index.len();
        self.order.resize(n, [0; LANES]);
        self.points.resize(n, [ZERO; K]);
        self.noise.resize(n, ZERO);
        let size = found.size();
        for (at, &i) in found.index.iter().enumerate() {
            self.order[at][lane] = at;
            self.noise[at][lane] = cloud.noise(i).powi(2);
            for d in 0..K {
                self.points[at][d][lane] = (cloud.points[i][d] - x[d]) / size;
            }
        }
        std::mem::swap(&mut self.found[lane], found);
        self.slots[lane] = slot;
        self.taken += 1;
    }

    /// The weights of one query, by number in what was found.
    pub(crate) fn weights(&self, lane: usize, out: &mut Vec<f64>) {
        out.clear();
        out.resize(self.order.len(), 0.0);
        for (to, weight) in self.order.iter().zip(&self.weights) {
            out[to[lane]] = weight[lane];
        }
    }
}

/// Numbers as rows of one.
fn as_rows<T>(all: &mut [T]) -> &mut [[T; 1]] {
    all.as_chunks_mut().0
}

/// |a − b|².
#[inline(always)]
fn distance2<const K: usize>(a: &[Lane; K], b: &[Lane; K]) -> Lane {
    let mut sum = ZERO;
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            sum[l] += (a[l] - b[l]) * (a[l] - b[l]);
        }
    }
    sum
}

#[inline(always)]
fn kernel(mut r2: Lane) -> Lane {
    // No `map`: it is a call that vector instructions end at.
    for r2 in &mut r2 {
        *r2 = biharmonic(*r2);
    }
    r2
}

/// Σ a_i b_i, taken from a sum.
#[inline(always)]
fn subtract(from: &mut Lane, a: &[Lane], b: &[Lane]) {
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            from[l] -= a[l] * b[l];
        }
    }
}

/// First number of a row of a lower triangle.
#[inline(always)]
fn row(i: usize) -> usize {
    i * (i + 1) / 2
}

impl<const K: usize> Block<K> {
    /// Solves for the weights; the sum of their sizes in each lane, NaN of a system that is not positive definite.
    #[inline(always)]
    pub(super) fn solve(&mut self) -> Lane {
        let least = self.eliminate();
        let own = self.own();
        self.reduce(&own);
        self.factorise();
        let mut sizes = self.weigh(&own);
        for l in 0..LANES {
            sizes[l] = if least[l] < SMALLEST_PIVOT {
                f64::NAN
            } else {
                sizes[l]
            };
        }
        sizes
    }

    /// Column elimination with the largest of each column as its pivot: moves the Lagrange points to the front, and
    /// turns 1 and the components of a point into their cardinal polynomials. The smallest pivot of each lane.
    #[inline(always)]
    fn eliminate(&mut self) -> Lane {
        let n = self.points.len();
        self.basis.clear();
        for point in &self.points {
            let mut row = [ZERO; MOST];
            row[0] = [1.0; LANES];
            row[1..=K].copy_from_slice(point);
            self.basis.push(row);
        }
        let mut at_query = [ZERO; MOST];
        at_query[0] = [1.0; LANES];
        self.basis.push(at_query);
        let mut least = [f64::INFINITY; LANES];
        for step in 0..=K {
            let (mut best, mut at) = (ZERO, [0; LANES]);
            for a in step..n {
                let column = &self.basis[a][step];
                for l in 0..LANES {
                    let size = column[l].abs();
                    let is_larger = size > best[l];
                    at[l] = if is_larger { a as u64 } else { at[l] };
                    best[l] = if is_larger { size } else { best[l] };
                }
            }
            for l in 0..LANES {
                least[l] = if best[l] < least[l] {
                    best[l]
                } else {
                    least[l]
                };
                self.swap(step, (at[l] as usize).max(step), l);
            }
            let pivot = self.basis[step];
            let mut inverse = ZERO;
            for l in 0..LANES {
                inverse[l] = 1.0 / pivot[step][l];
            }
            for row in &mut self.basis {
                let mut scaled = ZERO;
                for l in 0..LANES {
                    scaled[l] = row[step][l] * inverse[l];
                }
                for d in 0..=K {
                    for l in 0..LANES {
                        row[d][l] -= scaled[l] * pivot[d][l];
                    }
                }
                row[step] = scaled;
            }
        }
        least
    }

    /// Exchanges two neighbours of a lane.
    #[inline(always)]
    fn swap(&mut self, a: usize, b: usize, lane: usize) {
        fn swap<const N: usize, T: Copy>(
            all: &mut [[[T; LANES]; N]],
            [a, b]: [usize; 2],
            lane: usize,
        ) {
            for d in 0..N {
                let kept = all[a][d][lane];
                all[a][d][lane] = all[b][d][lane];
                all[b][d][lane] = kept;
            }
        }
        if a != b {
            swap(&mut self.points, [a, b], lane);
            swap(&mut self.basis, [a, b], lane);
            swap(as_rows(&mut self.noise), [a, b], lane);
            swap(as_rows(&mut self.order), [a, b], lane);
        }
    }

    /// φ between the Lagrange points.
    #[inline(always)]
    fn own(&self) -> [[Lane; MOST]; MOST] {
        let mut own = [[ZERO; MOST]; MOST];
        for i in 0..=K {
            own[i][i] = self.noise[i];
            for j in 0..i {
                own[i][j] = kernel(distance2(&self.points[i], &self.points[j]));
                own[j][i] = own[i][j];
            }
        }
        own
    }

    /// φ from a place, whose distances to the Lagrange points are given, minus half their own correction.
    #[inline(always)]
    fn towards_lagrange(
        own: &[[Lane; MOST]; MOST],
        basis: &[Lane; MOST],
        distance2: impl Fn(usize) -> Lane,
    ) -> [Lane; MOST] {
        let mut t = [ZERO; MOST];
        for i in 0..=K {
            let phi = kernel(distance2(i));
            let mut correction = ZERO;
            for j in 0..=K {
                for l in 0..LANES {
                    correction[l] += basis[j][l] * own[i][j][l];
                }
            }
            for l in 0..LANES {
                t[i][l] = phi[l] - 0.5 * correction[l];
            }
        }
        t
    }

    /// The reduced system of the free neighbours.
    #[inline(always)]
    fn reduce(&mut self, own: &[[Lane; MOST]; MOST]) {
        let free = K + 1..self.points.len();
        self.to_lagrange.clear();
        for a in free.clone() {
            let point = &self.points[a];
            let to = |i: usize| distance2(point, &self.points[i]);
            let t = Self::towards_lagrange(own, &self.basis[a], to);
            self.to_lagrange.push(t);
        }
        self.factor.clear();
        for a in free.clone() {
            for b in K + 1..=a {
                let mut sum = match a == b {
                    true => self.noise[a],
                    false => kernel(distance2(&self.points[a], &self.points[b])),
                };
                let [ta, tb] = [a, b].map(|i| &self.to_lagrange[i - K - 1][..=K]);
                subtract(&mut sum, &self.basis[a][..=K], tb);
                subtract(&mut sum, &self.basis[b][..=K], ta);
                self.factor.push(sum);
            }
        }
    }

    #[inline(always)]
    fn factorise(&mut self) {
        let n = self.to_lagrange.len();
        for a in 0..n {
            let (before, here) = self.factor.split_at_mut(row(a));
            let here = &mut here[..=a];
            for b in 0..a {
                let there = &before[row(b)..];
                let (done, rest) = here.split_at_mut(b);
                subtract(&mut rest[0], done, &there[..b]);
                for l in 0..LANES {
                    rest[0][l] *= there[b][l];
                }
            }
            let (done, last) = here.split_at_mut(a);
            for done in done.iter() {
                for l in 0..LANES {
                    last[0][l] -= done[l] * done[l];
                }
            }
            for l in 0..LANES {
                // NaN of what is not positive, so that nothing comes of it.
                let pivot = if last[0][l] > 0.0 {
                    last[0][l]
                } else {
                    f64::NAN
                };
                last[0][l] = 1.0 / pivot.sqrt();
            }
        }
    }

    /// The weights at the query, which is at 0.
    #[inline(always)]
    fn weigh(&mut self, own: &[[Lane; MOST]; MOST]) -> Lane {
        let n = self.to_lagrange.len();
        let origin = [ZERO; K];
        let to = |i: usize| distance2(&self.points[i], &origin);
        let at_query = self.basis[self.points.len()];
        let t = Self::towards_lagrange(own, &at_query, to);
        self.weights.clear();
        self.weights.resize(K + 1, ZERO);
        for a in 0..n {
            let mut sum = kernel(to(K + 1 + a));
            subtract(&mut sum, &self.basis[K + 1 + a][..=K], &t[..=K]);
            subtract(&mut sum, &at_query[..=K], &self.to_lagrange[a][..=K]);
            let row = &self.factor[row(a)..];
            subtract(&mut sum, &row[..a], &self.weights[K + 1..]);
            for l in 0..LANES {
                sum[l] *= row[a][l];
            }
            self.weights.push(sum);
        }
        let mut lagrange = at_query;
        for a in (0..n).rev() {
            let (before, last) = self.weights.split_at_mut(K + 1 + a);
            let row = &self.factor[row(a)..];
            for l in 0..LANES {
                last[0][l] *= row[a][l];
            }
            for (before, factor) in before[K + 1..].iter_mut().zip(row) {
                for l in 0..LANES {
                    before[l] -= factor[l] * last[0][l];
                }
            }
            for (to, basis) in lagrange.iter_mut().zip(&self.basis[K + 1 + a]).take(K + 1) {
                for l in 0..LANES {
                    to[l] -= last[0][l] * basis[l];
                }
            }
        }
        self.weights[..=K].copy_from_slice(&lagrange[..=K]);
        let mut sizes = ZERO;
        for weight in &self.weights {
            for l in 0..LANES {
                sizes[l] += weight[l].abs();
            }
        }
        sizes
    }
}

/// Σ weight · value of some points, and the ranges of their values: smallest, largest, per channel.
#[inline(always)]
pub(super) fn weighted<const K: usize>(
    cloud: &Cloud<K>,
    index: &[usize],
    weights: &[f64],
    [lows, highs]: &mut [Vec<f64>; 2],
    out: &mut [f64],
) {
    out.fill(0.0);
    for (range, start) in [
        (&mut *lows, f64::INFINITY),
        (&mut *highs, f64::NEG_INFINITY),
    ] {
        range.clear();
        range.resize(out.len(), start);
    }
    for (&i, &w) in index.iter().zip(weights) {
        let values = cloud.value(i);
        let all = out.iter_mut().zip(lows.iter_mut()).zip(highs.iter_mut());
        for (((out, low), high), &y) in all.zip(values) {
            *out += w * y;
            *low = if y < *low { y } else { *low };
            *high = if y > *high { y } else { *high };
        }
    }
}
