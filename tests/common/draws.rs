//! Pearson's chi-squared test of a sampler against its density.
//!
//! Bins over (cos θ_i, φ_i), equal-area on the hemisphere, adapt to the lobe: a first set of draws splits the
//! rectangle at medians, alternating between the axes, until each bin holds about the same number. A second,
//! independent set is counted in them, and the expected counts are integrals of the density
//! over each bin. Draws below the horizon are one bin more, whose expectation is what the
//! density leaves of 1: a density with the wrong total fails too.

use glam::DVec3;
use gonio::brdf::SampleBrdf;
use gonio::geometry::{Direction, DirectionPair};
use gonio::sampling::{Random, gauss_legendre};
use std::f64::consts::PI;

/// Result of [`chi_squared`], to be compared with the chi-squared distribution of its degrees of freedom.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquared {
    /// Σ (observed − expected)²/expected over the bins.
    pub statistic: f64,
    /// Bins less one.
    pub degrees_of_freedom: usize,
    /// Integral of the density over the hemisphere, 1 minus the share of draws below the horizon.
    pub pdf_integral: f64,
    /// Share of draws that fell below the horizon.
    pub rejected: f64,
}

/// Smallest expected count of a bin, the usual rule for Pearson's statistic.
const MIN_EXPECTED: f64 = 5.0;
/// Halvings of the hemisphere: 2⁷ bins.
const BIN_LEVELS: usize = 7;
/// Further halvings of a bin for the integral of the density, so that its cells follow the lobe.
const CELL_LEVELS: usize = 4;

/// Draws `count` directions for the view `omega_o` and compares their histogram with the density.
pub fn chi_squared(
    brdf: &dyn SampleBrdf,
    omega_o: Direction,
    count: usize,
    seed: u64,
) -> ChiSquared {
    let draws = |seed: u64| {
        let random = Random::new(seed);
        (0..count as u64).map(move |i| brdf.sample(omega_o, random.point(i)))
    };
    let mut pilot: Vec<_> = draws(seed).flatten().map(to_chart).collect();
    let mut bins = Vec::new();
    Rectangle::HEMISPHERE.split(&mut pilot, BIN_LEVELS, &mut |bounds, points| {
        let mut cells = Vec::with_capacity(1 << CELL_LEVELS);
        bounds.split(points, CELL_LEVELS, &mut |cell, points| {
            cell.grade(points, &mut cells);
        });
        bins.push((bounds, cells));
    });

    let density = |[z, phi]: [f64; 2]| {
        let sin = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let omega_i = Direction::from_unit(DVec3::new(sin * phi.cos(), sin * phi.sin(), z));
        brdf.pdf(&DirectionPair::new(omega_i, omega_o))
    };
    let rule = gauss_legendre(6);
    let mut expected: Vec<f64> = bins
        .iter()
        .map(|(_, cells)| {
            let integrals = cells.iter().map(|cell| cell.integral(&rule, &density));
            integrals.sum::<f64>() * count as f64
        })
        .collect();
    let mut observed = vec![0.0; bins.len()];
    let mut rejected = 0.0;
    for draw in draws(seed.wrapping_add(1)) {
        match draw.map(to_chart) {
            Some(point) => {
                for ((bin, _), observed) in bins.iter().zip(&mut observed) {
                    if bin.contains(point) {
                        *observed += 1.0;
                    }
                }
            }
            None => rejected += 1.0,
        }
    }
    let total: f64 = expected.iter().sum();
    expected.push((count as f64 - total).max(0.0));
    observed.push(rejected);

    let (statistic, used) = statistic(&expected, &observed);
    ChiSquared {
        statistic,
        degrees_of_freedom: used.saturating_sub(1),
        pdf_integral: total / count as f64,
        rejected: rejected / count as f64,
    }
}

/// Pearson's statistic and the number of bins it was taken over; bins too small to stand alone
/// are pooled, and the pool joins the smallest other bin if it is still too small.
pub fn statistic(expected: &[f64], observed: &[f64]) -> (f64, usize) {
    let mut bins = Vec::with_capacity(expected.len());
    let mut pool = (0.0, 0.0);
    for (&e, &o) in expected.iter().zip(observed) {
        if e >= MIN_EXPECTED {
            bins.push((e, o));
        } else {
            pool = (pool.0 + e, pool.1 + o);
        }
    }
    if pool.0 >= MIN_EXPECTED {
        bins.push(pool);
    } else if let Some(smallest) = bins.iter_mut().min_by(|a, b| a.0.total_cmp(&b.0)) {
        *smallest = (smallest.0 + pool.0, smallest.1 + pool.1);
    }
    let terms = bins.iter().map(|(e, o)| (o - e) * (o - e) / e);
    (terms.sum(), bins.len())
}

fn to_chart(omega: Direction) -> [f64; 2] {
    [omega.cos_theta(), omega.phi()]
}

/// A bin `[lo, hi)` in (cos θ, φ).
#[derive(Clone, Copy, Debug)]
struct Rectangle {
    lo: [f64; 2],
    hi: [f64; 2],
}

impl Rectangle {
    const HEMISPHERE: Self = Self {
        lo: [0.0, -PI],
        hi: [1.0, PI],
    };

    /// The outer edges are closed: the normal has z = 1 and the −t axis may have φ = π.
    fn contains(&self, p: [f64; 2]) -> bool {
        [0, 1].iter().all(|&d| {
            let last = self.hi[d] == Self::HEMISPHERE.hi[d];
            p[d] >= self.lo[d] && (p[d] < self.hi[d] || last)
        })
    }

    /// Cut at `at` along axis `d`.
    fn cut(self, d: usize, at: f64) -> [Self; 2] {
        let (mut low, mut high) = (self, self);
        low.hi[d] = at;
        high.lo[d] = at;
        [low, high]
    }

    /// Cuts the rectangle around the points it holds, then at distances that double away from
    /// them: in a bin at the rim of a narrow lobe nearly all the density stands along one edge, and a
    /// rule spread over the whole bin would miss it.
    fn grade(self, points: &[[f64; 2]], parts: &mut Vec<Self>) {
        let [zs, phis] = [0, 1].map(|d| self.graded_edges(d, points));
        for z in zs.windows(2) {
            for phi in phis.windows(2) {
                parts.push(Self {
                    lo: [z[0], phi[0]],
                    hi: [z[1], phi[1]],
                });
            }
        }
    }

    fn graded_edges(self, d: usize, points: &[[f64; 2]]) -> Vec<f64> {
        let (lo, hi) = (self.lo[d], self.hi[d]);
        let coordinates = || points.iter().map(|p| p[d]);
        let (first, last) = (
            coordinates().fold(hi, f64::min),
            coordinates().fold(lo, f64::max),
        );
        // No point: nothing to follow. One point, or all on a line: ten doublings reach the edge.
        if first > last {
            return vec![lo, hi];
        }
        let width = (last - first).max(1e-3 * (hi - lo));
        let mut edges = vec![lo];
        let doublings = |room: f64| {
            let steps = (0..).map(move |k| width * (f64::from(1 << k) - 1.0));
            // The last piece takes what is left, up to half a step more.
            steps.take_while(move |step| step + 0.5 * width < room)
        };
        let below: Vec<_> = doublings(first - lo).collect();
        edges.extend(below.iter().rev().map(|step| first - step));
        edges.extend(doublings(hi - last).map(|step| last + step));
        edges.push(hi);
        edges.retain({
            let mut previous = f64::NEG_INFINITY;
            move |&x| std::mem::replace(&mut previous, x) < x
        });
        edges
    }

    fn quarters(self) -> [Self; 4] {
        let [a, b] = self.cut(0, 0.5 * (self.lo[0] + self.hi[0]));
        let at = 0.5 * (self.lo[1] + self.hi[1]);
        let ([p, q], [r, s]) = (a.cut(1, at), b.cut(1, at));
        [p, q, r, s]
    }

    fn integral(self, rule: &[(f64, f64)], f: &dyn Fn([f64; 2]) -> f64) -> f64 {
        self.refine(self.product_rule(rule, f), rule, f, 12)
    }

    /// Splits until four quarters agree with the whole.
    fn refine(
        self,
        whole: f64,
        rule: &[(f64, f64)],
        f: &dyn Fn([f64; 2]) -> f64,
        depth: usize,
    ) -> f64 {
        let quarters = self.quarters().map(|q| (q, q.product_rule(rule, f)));
        let sum: f64 = quarters.iter().map(|(_, integral)| integral).sum();
        // 1e-8 of all draws: no bin of a million draws can tell.
        if depth == 0 || (sum - whole).abs() < 1e-8 {
            return sum;
        }
        let parts = quarters.map(|(q, integral)| q.refine(integral, rule, f, depth - 1));
        parts.iter().sum()
    }

    fn product_rule(self, rule: &[(f64, f64)], f: &dyn Fn([f64; 2]) -> f64) -> f64 {
        let half = [0, 1].map(|d| 0.5 * (self.hi[d] - self.lo[d]));
        let mid = [0, 1].map(|d| 0.5 * (self.hi[d] + self.lo[d]));
        let mut sum = 0.0;
        for &(x, wx) in rule {
            for &(y, wy) in rule {
                sum += wx * wy * f([mid[0] + half[0] * x, mid[1] + half[1] * y]);
            }
        }
        sum * half[0] * half[1]
    }

    /// Halves the rectangle at the median of the points it holds, `levels` times, and hands over
    /// each part with its points.
    fn split(
        self,
        points: &mut [[f64; 2]],
        levels: usize,
        emit: &mut dyn FnMut(Self, &mut [[f64; 2]]),
    ) {
        let d = levels % 2;
        if levels == 0 || points.len() < 2 {
            return emit(self, points);
        }
        let middle = points.len() / 2;
        let (_, median, _) = points.select_nth_unstable_by(middle, |a, b| a[d].total_cmp(&b[d]));
        let at = median[d];
        // Points on a line cannot be told apart along this axis.
        if !(at > self.lo[d] && at < self.hi[d]) {
            return emit(self, points);
        }
        let [low, high] = self.cut(d, at);
        let (before, after) = points.split_at_mut(middle);
        low.split(before, levels - 1, emit);
        high.split(after, levels - 1, emit);
    }
}
