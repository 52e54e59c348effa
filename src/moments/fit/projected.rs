//! Variable projection: the knots of energy ramps by Levenberg-Marquardt, everything that is
//! linear (base, height, slope of every profile) by linear least squares at given knots.

use super::ramp::{basis, basis_by_knots};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DVector, Dyn, Matrix2, OMatrix, Owned, SVD, U2, U3, Vector2, Vector3};

/// Columns of the linear problem: base, height, slope.
type Columns = OMatrix<f64, Dyn, U3>;

/// Singular values below this share of the largest count as 0: the part of the ramp they belong
/// to is seen by no view.
const RANK: f64 = 1e-10;
/// Positions of each knot in the lattice of starts.
const LATTICE: usize = 12;
/// Starts of the lattice that are refined.
const REFINED: usize = 4;
/// Sums of squares that differ by a smaller share are equally good: below what the optimiser
/// still gains on its way to the end of the range.
const SAME: f64 = 1e-9;

/// Profiles with the same view elevations.
#[derive(Default)]
pub(super) struct Block {
    /// View elevations, rad.
    pub views: Vec<f64>,
    /// The values of each profile.
    pub profiles: Vec<DVector<f64>>,
    /// The number of each profile among those of all blocks.
    pub members: Vec<usize>,
}

/// The linear fit at given knots, with residuals and derivatives.
pub(super) struct Solved {
    /// Base, height and slope of each profile, block by block.
    pub linear: Vec<[f64; 3]>,
    /// Values less fit, profile by profile.
    pub residuals: DVector<f64>,
    /// Derivatives of the residuals with respect to θ_0 and θ_1, per rad.
    pub jacobian: OMatrix<f64, Dyn, U2>,
}

impl Solved {
    /// Sum of the squared residuals.
    pub(crate) fn cost(&self) -> f64 {
        self.residuals.norm_squared()
    }
}

/// Solves the linear part at given knots. The derivative of the residual r = (I − ΦΦ⁺)y is that of
/// Golub and Pereyra (1973), both terms: −P DΦ c − (Φ⁺)ᵀ DΦᵀ r with P = I − ΦΦ⁺ and c = Φ⁺y. It is
/// exact wherever the rank of Φ does not change.
pub(super) fn solve(blocks: &[Block], knots: [f64; 2]) -> Solved {
    let rows = blocks.iter().map(|b| b.views.len() * b.profiles.len());
    let rows = rows.sum();
    let mut solved = Solved {
        linear: Vec::new(),
        residuals: DVector::zeros(rows),
        jacobian: OMatrix::<f64, Dyn, U2>::zeros(rows),
    };
    let mut row = 0;
    for block in blocks {
        let n = block.views.len();
        let mut phi = Columns::from_element(n, 1.0);
        let mut by_knot = [Columns::zeros(n), Columns::zeros(n)];
        for (i, &theta) in block.views.iter().enumerate() {
            let weights = basis(knots, theta);
            let derivatives = basis_by_knots(knots, theta);
            for part in 0..2 {
                phi[(i, part + 1)] = weights[part];
                for knot in 0..2 {
                    by_knot[knot][(i, part + 1)] = derivatives[knot][part];
                }
            }
        }
        let svd = SVD::new(phi.clone(), true, true);
        let (Some(mut u), Some(v_t)) = (svd.u, svd.v_t) else {
            unreachable!("both factors were asked for");
        };
        let largest = svd.singular_values.max();
        let inverse = svd.singular_values.map(|s| match s > RANK * largest {
            true => 1.0 / s,
            false => 0.0,
        });
        for column in 0..3 {
            if inverse[column] == 0.0 {
                u.column_mut(column).fill(0.0);
            }
        }
        for y in &block.profiles {
            let c: Vector3<f64> = v_t.tr_mul(&u.tr_mul(y).component_mul(&inverse));
            let residual = y - &phi * c;
            for knot in 0..2 {
                let moved = &by_knot[knot] * c;
                let turned = &v_t * by_knot[knot].tr_mul(&residual);
                let derivative =
                    -&moved + &u * u.tr_mul(&moved) - &u * turned.component_mul(&inverse);
                solved
                    .jacobian
                    .view_mut((row, knot), (n, 1))
                    .copy_from(&derivative);
            }
            solved.residuals.rows_mut(row, n).copy_from(&residual);
            solved.linear.push(c.into());
            row += n;
        }
    }
    solved
}

/// The knots as functions of two unbounded numbers u: with the logistic function s,
/// θ_1 = lo + (hi − lo) s(u_1) and θ_0 = lo + (θ_1 − lo) s(u_0), so that lo < θ_0 < θ_1 < hi without a
/// clamp that would hide the slope from the optimiser.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform {
    /// Ends of the range, rad; the first is smaller.
    pub ends: [f64; 2],
    /// True if θ_1 = hi whatever u_1 is.
    pub at_end: bool,
}

/// 1/(1 + e^(−x)).
fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

impl Transform {
    fn knots(self, u: Vector2<f64>) -> [f64; 2] {
        let [lo, hi] = self.ends;
        let upper = match self.at_end {
            true => hi,
            false => lo + (hi - lo) * logistic(u[1]),
        };
        [lo + (upper - lo) * logistic(u[0]), upper]
    }

    /// Inverse of [`knots`](Self::knots).
    fn unbounded(self, [lower, upper]: [f64; 2]) -> Vector2<f64> {
        let [lo, hi] = self.ends;
        let log_odds = |below: f64, above: f64| (below / above).ln();
        let second = match self.at_end {
            true => 0.0,
            false => log_odds(upper - lo, hi - upper),
        };
        Vector2::new(log_odds(lower - lo, upper - lower), second)
    }

    /// Derivative of knot (row) with respect to u (column).
    fn derivative(self, u: Vector2<f64>) -> Matrix2<f64> {
        let [lo, hi] = self.ends;
        let share = logistic(u[0]);
        let upper = match self.at_end {
            true => 0.0,
            false => (hi - lo) * logistic(u[1]) * logistic(-u[1]),
        };
        let lower = (self.knots(u)[1] - lo) * share * logistic(-u[0]);
        Matrix2::new(lower, share * upper, 0.0, upper)
    }
}

/// The problem for the optimiser; keeps the best knots so far.
struct Problem<'a> {
    blocks: &'a [Block],
    transform: Transform,
    u: Vector2<f64>,
    solved: Solved,
    best: (f64, [f64; 2]),
}

impl<'a> Problem<'a> {
    fn new(blocks: &'a [Block], transform: Transform, start: [f64; 2]) -> Self {
        let solved = solve(blocks, start);
        Self {
            blocks,
            transform,
            u: transform.unbounded(start),
            best: (solved.cost(), start),
            solved,
        }
    }
}

impl LeastSquaresProblem<f64, Dyn, U2> for Problem<'_> {
    type ParameterStorage = Owned<f64, U2>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U2>;

    fn set_params(&mut self, u: &Vector2<f64>) {
        self.u = *u;
        let knots = self.transform.knots(*u);
        self.solved = solve(self.blocks, knots);
        let cost = self.solved.cost();
        if cost < self.best.0 {
            self.best = (cost, knots);
        }
    }

    fn params(&self) -> Vector2<f64> {
        self.u
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.solved.residuals.clone())
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, U2>> {
        Some(&self.solved.jacobian * self.transform.derivative(self.u))
    }
}

/// The knots with the smallest sum of squares that is found from `first` (if it is inside the
/// range) and from the best 4 pairs of a lattice of 12 positions over the range, and whether θ_1 is
/// the end of the range. Deterministic.
///
/// Where the energy is convex up to the last view, one cubic covers all views beyond θ_0 and the
/// best θ_1 is the end, which the transform only approaches, slowly because the fit does not
/// change there to first order. So θ_1 = hi is tried as well, and taken unless another is better.
pub(super) fn best_knots(blocks: &[Block], ends: [f64; 2], first: [f64; 2]) -> ([f64; 2], bool) {
    let [lo, hi] = ends;
    let at = |i: usize| lo + (hi - lo) * (i as f64 + 0.5) / LATTICE as f64;
    let pairs = (1..LATTICE).flat_map(|j| (0..j).map(move |i| [at(i), at(j)]));
    let mut starts: Vec<(f64, [f64; 2])> = pairs.map(|k| (solve(blocks, k).cost(), k)).collect();
    // Stable: of equal starts the first of the lattice.
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut starts: Vec<[f64; 2]> = starts.into_iter().take(REFINED).map(|s| s.1).collect();
    if lo < first[0] && first[1] < hi {
        starts.insert(0, first);
    }
    // Steps of the unbounded numbers beyond a few units reach the ends of the range.
    let optimiser = LevenbergMarquardt::new()
        .with_ftol(f64::EPSILON)
        .with_xtol(f64::EPSILON)
        .with_stepbound(1.0);
    let best = |at_end: bool| {
        let mut best = (f64::INFINITY, first);
        for &[lower, upper] in &starts {
            let start = [lower, if at_end { hi } else { upper }];
            let problem = Problem::new(blocks, Transform { ends, at_end }, start);
            let (problem, _) = optimiser.minimize(problem);
            if problem.best.0 < best.0 {
                best = problem.best;
            }
        }
        best
    };
    let [inside, at_end] = [best(false), best(true)];
    if at_end.0 <= inside.0 * (1.0 + SAME) {
        (at_end.1, true)
    } else {
        (inside.1, false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two profiles over one set of views and one over another, not of the ramp's form.
    fn blocks() -> Vec<Block> {
        let views = |n: usize| (0..n).map(|i| 1.4 * i as f64 / n as f64).collect();
        let values = |views: &[f64], f: &dyn Fn(f64) -> f64| {
            DVector::from_iterator(views.len(), views.iter().map(|&t| f(t)))
        };
        let (a, b): (Vec<f64>, Vec<f64>) = (views(41), views(23));
        let of_a: [&dyn Fn(f64) -> f64; 2] = [&|t| 1.0 + t.powi(4), &|t| (3.0 * t).cos()];
        let of_a = of_a.map(|f| values(&a, f)).to_vec();
        let of_b = vec![values(&b, &|t| (2.0 * t).exp() + 0.1 * (40.0 * t).sin())];
        let block = |views, profiles| Block {
            views,
            profiles,
            ..Block::default()
        };
        vec![block(a, of_a), block(b, of_b)]
    }

    #[test]
    fn the_transform_is_inverted_and_stays_inside() {
        let ends = [0.1, 1.4];
        let at_end = false;
        let transform = Transform { ends, at_end };
        for knots in [[0.2, 1.3], [0.7, 0.71], [0.1001, 1.3999]] {
            let back = transform.knots(transform.unbounded(knots));
            assert!((0..2).all(|i| (back[i] - knots[i]).abs() < 1e-14));
        }
        for u in [[-20.0, 3.0], [20.0, 20.0], [0.0, -20.0], [-15.0, -10.0]] {
            let [lower, upper] = transform.knots(u.into());
            assert!(0.1 < lower && lower < upper && upper < 1.4);
        }
        let at_end = true;
        let transform = Transform { ends, at_end };
        let back = transform.knots(transform.unbounded([0.3, 1.4]));
        assert!((back[0] - 0.3).abs() < 1e-15 && back[1] == 1.4);
    }

    #[test]
    fn the_jacobian_agrees_with_differences_of_the_residuals() {
        let blocks = blocks();
        let ends = [0.0, 1.4];
        let starts = [
            ([0.78, 1.31], false),
            ([0.2, 0.9], false),
            ([1.0, 1.11], false),
        ];
        for (start, at_end) in starts.into_iter().chain([([0.5, 1.4], true)]) {
            let transform = Transform { ends, at_end };
            let mut problem = Problem::new(&blocks, transform, start);
            let u = problem.params();
            let exact = problem.jacobian().unwrap();
            let scale = exact.amax();
            for column in 0..2 {
                let mut at = |step: f64| {
                    let mut moved = u;
                    moved[column] += step;
                    problem.set_params(&moved);
                    problem.residuals().unwrap()
                };
                // Fourth order: a cubic is continued by a line, so steps may not be long.
                let h = 1e-5;
                let difference =
                    ((at(h) - at(-h)) * 8.0 - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                let error = (difference - exact.column(column)).amax() / scale;
                assert!(error < 1e-8, "start {start:?} column {column}: {error}");
            }
        }
    }

    #[test]
    fn a_part_that_no_view_sees_is_left_out() {
        // Both knots beyond the last view: only the base is seen.
        let solved = solve(&blocks(), [1.38, 1.39]);
        assert!(solved.linear.iter().all(|c| c[1] == 0.0 && c[2] == 0.0));
        assert!(solved.jacobian.iter().all(|&j| j == 0.0));
        // Equal knots: a step, without a division by zero.
        let solved = solve(&blocks(), [0.7, 0.7]);
        assert!(solved.cost().is_finite() && solved.jacobian.iter().all(|j| j.is_finite()));
    }
}
