//! Choices among vectors, one per candidate, that are the functions of a prior there: rows of a matrix in the papers,
//! columns of a matrix here. The last ones are those of poses that were read before.

use super::choice::Wanted;
use crate::reconstruct::RIDGE;
use crate::sampling::Random;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Vectors of candidates, and of poses that were read.
pub(super) struct Rows {
    vectors: DMatrix<f64>,
    candidates: usize,
}

/// The square of what is left of a vector, as a share of the largest, below which it is rounding.
const ROUNDING: f64 = 1e-20;

/// Conditions that are compared at once for one pose.
const AT_ONCE: usize = 16;

/// Conditions that are compared in all: at most, at least, and times the cube of the size of the matrices.
const COMPARED: (f64, f64, f64) = (40_000.0, 1000.0, 2.5e9);

impl Rows {
    /// The first `candidates` of them can be chosen.
    pub(crate) fn new(vectors: DMatrix<f64>, candidates: usize) -> Self {
        Self {
            vectors,
            candidates,
        }
    }

    fn given(&self) -> Range<usize> {
        self.candidates..self.vectors.ncols()
    }

    /// Some candidates and others up to `n` that make det(ridge + Σ q qᵀ) largest, one by one (D-optimal design): each the one of
    /// the largest qᵀ (ridge + Σ q qᵀ)⁻¹ q, by one more than that the determinant grows.
    pub(crate) fn d_optimal(
        &self,
        chosen: Vec<usize>,
        ridge: f64,
        wanted: Wanted<'_>,
    ) -> Vec<usize> {
        let all = &self.vectors;
        let mut inverse = DMatrix::identity(all.nrows(), all.nrows()) / ridge;
        let mut gains: Vec<f64> = all
            .column_iter()
            .map(|q| q.norm_squared() / ridge)
            .collect();
        let mut take = |c: usize, gains: &mut [f64]| {
            let scaled = &inverse * all.column(c);
            let with = all.tr_mul(&scaled);
            let grown = 1.0 + with[c];
            inverse.ger(-1.0 / grown, &scaled, &scaled, 1.0);
            let with = gains.iter_mut().zip(with.iter());
            with.for_each(|(gain, w)| *gain -= w * w / grown);
        };
        for c in self.given().chain(chosen.iter().copied()) {
            take(c, &mut gains);
        }
        wanted.after(chosen, |chosen| {
            let best = self.largest(&gains, chosen)?;
            take(best, &mut gains);
            Some(best)
        })
    }

    /// The candidate of the highest score of those that were not chosen; of equal ones the first.
    fn largest(&self, scores: &[f64], chosen: &[usize]) -> Option<usize> {
        let left = (0..self.candidates).filter(|c| !chosen.contains(c));
        left.reduce(|a, b| if scores[b] > scores[a] { b } else { a })
    }

    /// Candidates by a score of what the span of those before leaves of all vectors, up to `n` or the rank; after that
    /// as [`d_optimal`](Self::d_optimal) does with the usual ridge.
    fn spanning(
        &self,
        vectors: &DMatrix<f64>,
        wanted: Wanted<'_>,
        scores: impl Fn(&DMatrix<f64>) -> Vec<f64>,
    ) -> Vec<usize> {
        let mut rest = vectors.clone();
        let square = |rest: &DMatrix<f64>, c: usize| rest.column(c).norm_squared();
        let largest = (0..self.candidates)
            .map(|c| square(&rest, c))
            .fold(0.0, f64::max);
        let is_new = |rest: &DMatrix<f64>, c: usize| square(rest, c) > ROUNDING * largest;
        for c in self.given() {
            if is_new(&rest, c) {
                project(&mut rest, c);
            }
        }
        let chosen = wanted.after(Vec::new(), |chosen| {
            let best = self.largest(&scores(&rest), chosen);
            let best = best.filter(|&c| is_new(&rest, c))?;
            project(&mut rest, best);
            Some(best)
        });
        self.d_optimal(chosen, RIDGE, wanted)
    }

    /// `n` candidates by QR with column pivoting of as many functions as there are poses, the first ones, each normalised
    /// over the candidates: each is the one of which the span of those before leaves most (Businger & Golub 1965; Manohar
    /// et al. 2018).
    pub(crate) fn pivots(&self, wanted: Wanted<'_>) -> Vec<usize> {
        let modes = self.vectors.nrows().min(wanted.n + self.given().len());
        let mut modes = self.vectors.rows(0, modes).into_owned();
        for mut mode in modes.row_iter_mut() {
            let norm = mode.columns(0, self.candidates).norm();
            mode /= norm.max(f64::MIN_POSITIVE);
        }
        let squares = |rest: &DMatrix<f64>| rest.column_iter().map(|r| r.norm_squared()).collect();
        self.spanning(&modes, wanted, squares)
    }

    /// `n` candidates by simultaneous orthogonal matching pursuit (Tropp et al. 2006; Miandji et al. 2024): each the one
    /// whose values over some materials, of these coefficients, have the largest sum of squared correlations with what
    /// those before leave of the values at all candidates.
    pub(crate) fn pursuit(&self, materials: &DMatrix<f64>, wanted: Wanted<'_>) -> Vec<usize> {
        // Products of values over materials are those of q with a root of the sum of their squares.
        let eigen = (materials * materials.transpose()).symmetric_eigen();
        let roots = eigen.eigenvalues.map(|l| l.max(0.0).sqrt());
        let atoms = DMatrix::from_diagonal(&roots) * eigen.eigenvectors.tr_mul(&self.vectors);
        let scores = |rest: &DMatrix<f64>| -> Vec<f64> {
            let rest = rest.columns(0, self.candidates);
            let squares = rest * rest.transpose();
            let correlated = &squares * &atoms;
            let with = atoms.column_iter().zip(correlated.column_iter());
            let score = |(atom, r): (_, nalgebra::DVectorView<'_, f64>)| {
                let atom: nalgebra::DVectorView<'_, f64> = atom;
                r.dot(&atom) / atom.norm_squared().max(f64::MIN_POSITIVE)
            };
            with.map(score).collect()
        };
        self.spanning(&atoms, wanted, scores)
    }

    /// `n` candidates that make the condition number of the matrix of all small (Nielsen et al. 2015): from the pivots,
    /// and from a random start, poses in random order are each exchanged for the best of 16 random candidates if that is
    /// better, a stated number of times ([`COMPARED`]). The better end of the two.
    pub(crate) fn conditioned(&self, seed: u64, wanted: Wanted<'_>) -> Vec<usize> {
        let given = self.independent();
        let mut random = Random::new(seed).stream(0);
        let mut left: Vec<usize> = (0..self.candidates).collect();
        let by_chance = |_| left.swap_remove((random.next() * left.len() as f64) as usize);
        let by_chance: Vec<usize> = (0..wanted.n.min(self.candidates)).map(by_chance).collect();
        let starts = [self.pivots(wanted), by_chance];
        let ends = (0..).zip(starts).map(|(stream, start)| {
            let mut random = Random::new(seed).stream(1 + stream);
            let below = &mut |count| (random.next() * count as f64) as usize;
            self.exchanged(start, &given, below, wanted.go_on)
        });
        let better = |a: (f64, Vec<usize>), b: (f64, Vec<usize>)| if b.0 < a.0 { b } else { a };
        ends.reduce(better).map(|end| end.1).unwrap_or_default()
    }

    /// The condition number that exchanges lead to, and the candidates then. `below` draws a number below another.
    fn exchanged(
        &self,
        mut chosen: Vec<usize>,
        given: &[usize],
        below: &mut dyn FnMut(usize) -> usize,
        go_on: &dyn Fn() -> bool,
    ) -> (f64, Vec<usize>) {
        let mut left: Vec<usize> = (0..self.candidates)
            .filter(|c| !chosen.contains(c))
            .collect();
        let mut now = condition(&self.vectors, &chosen, given);
        let (most, least, work) = COMPARED;
        let size = self.vectors.nrows().min(chosen.len() + given.len()).max(1) as f64;
        let visits = (work / size.powi(3)).clamp(least, most) as usize / AT_ONCE;
        for _ in 0..visits {
            if left.is_empty() || chosen.is_empty() || !go_on() {
                break;
            }
            let row = below(chosen.len());
            let tried: Vec<usize> = (0..AT_ONCE).map(|_| below(left.len())).collect();
            let conditions = tried.par_iter().map(|&at| {
                let mut other = chosen.clone();
                other[row] = left[at];
                (condition(&self.vectors, &other, given), at)
            });
            let conditions: Vec<(f64, usize)> = conditions.collect();
            let best = conditions
                .into_iter()
                .reduce(|a, b| if b.0 < a.0 { b } else { a });
            if let Some((condition, at)) = best.filter(|b| b.0 < now) {
                std::mem::swap(&mut chosen[row], &mut left[at]);
                now = condition;
            }
        }
        (now, chosen)
    }

    /// The poses that were read whose vectors are not in the span of those before.
    fn independent(&self) -> Vec<usize> {
        let mut rest = self.vectors.clone();
        let mut kept = Vec::new();
        for c in self.given() {
            if rest.column(c).norm_squared() > ROUNDING * self.vectors.column(c).norm_squared() {
                project(&mut rest, c);
                kept.push(c);
            }
        }
        kept
    }
}

/// The condition number of the vectors of some candidates and of some poses that were read.
fn condition(vectors: &DMatrix<f64>, chosen: &[usize], given: &[usize]) -> f64 {
    let all: Vec<usize> = chosen.iter().chain(given).copied().collect();
    if all.is_empty() {
        return f64::INFINITY;
    }
    let q = vectors.select_columns(&all);
    let square = match q.nrows() < q.ncols() {
        true => &q * q.transpose(),
        false => q.tr_mul(&q),
    };
    let values: DVector<f64> = square.symmetric_eigenvalues();
    // Below rounding nothing is singular, and some are no better than others.
    (values.max() / values.min().max(f64::EPSILON * values.max())).sqrt()
}

/// Takes from all vectors their parts along one.
fn project(rest: &mut DMatrix<f64>, c: usize) {
    let along = rest.column(c).normalize();
    let parts = rest.tr_mul(&along);
    rest.ger(-1.0, &along, &parts, 1.0);
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Asserts that each choice has the highest score of all candidates that were left, given those before it.
    pub fn assert_each_is_best(
        chosen: &[usize],
        candidates: usize,
        allowed: f64,
        score: impl Fn(&[usize], usize) -> f64,
    ) {
        for (k, c) in chosen.iter().enumerate() {
            let before = &chosen[..k];
            let others = (0..candidates).filter(|c| !before.contains(c));
            let best = others
                .map(|c| score(before, c))
                .fold(f64::NEG_INFINITY, f64::max);
            assert!(score(before, *c) >= best - allowed * best.abs(), "pose {k}");
        }
    }

    /// Vectors of 6 functions at 40 candidates and 2 poses that were read.
    fn vectors() -> DMatrix<f64> {
        let random = Random::new(7);
        DMatrix::from_fn(6, 42, |i, j| {
            let [u]: [f64; 1] = random.point((i * 42 + j) as u64);
            (2.0 * u - 1.0) / (1.0 + i as f64)
        })
    }

    fn wanted(n: usize) -> Wanted<'static> {
        Wanted {
            n,
            go_on: &|| true,
            stops: &[],
        }
    }

    fn rows() -> Rows {
        Rows::new(vectors(), 40)
    }

    /// The projections of all on what some leave, by a pseudo-inverse.
    fn left(all: &DMatrix<f64>, some: &[usize]) -> DMatrix<f64> {
        if some.is_empty() {
            return all.clone();
        }
        let basis = all.select_columns(some);
        let inverse = basis.clone().pseudo_inverse(1e-12).unwrap();
        all - basis * (inverse * all)
    }

    #[test]
    fn each_pose_makes_the_determinant_largest() {
        let (rows, q) = (rows(), vectors());
        let chosen = rows.d_optimal(Vec::new(), 0.2, wanted(9));
        let determinant = |some: &[usize]| {
            let s = q.select_columns(some);
            (&s * s.transpose() + DMatrix::identity(6, 6) * 0.2).determinant()
        };
        assert_eq!(chosen.len(), 9);
        assert_each_is_best(&chosen, 40, 1e-9, |before, c| {
            determinant(&[&[40, 41], before, &[c]].concat())
        });
    }

    #[test]
    fn pivots_are_those_of_a_qr_decomposition() {
        let q = vectors();
        let chosen = Rows::new(q.columns(0, 40).into_owned(), 40).pivots(wanted(8));
        // Of functions that are normalised over the candidates.
        let norms = q
            .columns(0, 40)
            .row_iter()
            .map(|row| row.norm())
            .collect::<Vec<_>>();
        let q = DMatrix::from_fn(6, 42, |i, j| q[(i, j)] / norms[i]);
        // The diagonal of R falls, and no column that was left has more beyond the span of those before.
        let r = q.select_columns(&chosen[..6]).qr().r();
        for k in 0..6 {
            let rest = left(&q, &chosen[..k]);
            let most = (0..40).map(|c| rest.column(c).norm()).fold(0.0, f64::max);
            assert!((r[(k, k)].abs() / most - 1.0).abs() < 1e-9, "pose {k}");
        }
        // Beyond the rank there are others.
        assert_eq!(chosen.len(), 8);
        assert!(!chosen[..7].contains(&chosen[7]) && !chosen[..6].contains(&chosen[6]));
    }

    #[test]
    fn pursuit_takes_what_explains_most_of_what_is_left() {
        let (rows, q) = (rows(), vectors());
        let materials = DMatrix::from_fn(6, 11, |i, j| (0.9 * ((i + 1) * (j + 2)) as f64).sin());
        let chosen = rows.pursuit(&materials, wanted(6));
        let values = materials.tr_mul(&q);
        let rest = |before: &[usize]| {
            let taken = [&[40, 41], before].concat();
            left(&values, &taken).columns(0, 40).into_owned()
        };
        // With the two that are given the rank is reached at the fourth.
        assert_each_is_best(&chosen[..4], 40, 1e-9, |before, c| {
            let atom = values.column(c).normalize();
            rest(before).tr_mul(&atom).norm_squared()
        });
        assert!((1..4).all(|k| rest(&chosen[..k]).norm() < rest(&chosen[..k - 1]).norm()));
        assert_eq!(chosen.len(), 6);
    }

    #[test]
    fn what_was_read_twice_counts_once() {
        let mut q = vectors();
        let twice = q.column(40).into_owned();
        q.set_column(41, &twice);
        let rows = Rows::new(q, 40);
        assert_eq!(rows.independent(), [40]);
        let chosen = rows.conditioned(5, wanted(3));
        assert!(condition(&rows.vectors, &chosen, &rows.independent()) < 1e3);
    }

    #[test]
    fn exchanges_lower_the_condition_number() {
        let (rows, q) = (rows(), vectors());
        for n in [3, 4, 12] {
            let chosen = rows.conditioned(5, wanted(n));
            let start = rows.pivots(wanted(n));
            let by_values = |some: &[usize]| {
                let all = [some, &[40, 41]].concat();
                let values = q.select_columns(&all).singular_values();
                values.max() / values.min()
            };
            let [now, before] = [&chosen, &start].map(|some| by_values(some));
            assert!(now <= before, "{n}: {now} {before}");
            assert!((condition(&rows.vectors, &chosen, &[40, 41]) / now - 1.0).abs() < 1e-6);
            // No exchange of one is better by more than chance has left.
            let others = (0..40).filter(|c| !chosen.contains(c));
            let single = others
                .flat_map(|c| (0..n).map(move |row| (row, c)))
                .map(|(row, c)| {
                    let mut other = chosen.clone();
                    other[row] = c;
                    by_values(&other)
                });
            assert!(
                single.fold(f64::INFINITY, f64::min) >= now * (1.0 - 1e-9),
                "{n}"
            );
        }
    }
}
