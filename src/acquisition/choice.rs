//! Greedy choices of poses by the information of their readings.

use crate::numeric::vectorised;
use crate::reconstruct::{Estimates, Places, Posterior};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// How many poses are to be chosen.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub n: usize,
    /// Asked before each: false ends the choice.
    pub go_on: &'a dyn Fn() -> bool,
    /// The stop of each candidate: those of a stop are chosen together, by the sum of their scores. Empty: each by itself.
    pub stops: &'a [u32],
}

impl Wanted<'_> {
    /// Numbers after those that are there, one by one by what was chosen before, until there are enough or there is none.
    pub(crate) fn after(
        self,
        mut chosen: Vec<usize>,
        mut next: impl FnMut(&[usize]) -> Option<usize>,
    ) -> Vec<usize> {
        while chosen.len() < self.n && (self.go_on)() {
            match next(&chosen) {
                Some(best) => chosen.push(best),
                None => break,
            }
        }
        chosen
    }
}

/// How errors at a place are weighed.
pub(super) struct Weights {
    /// Density of the error of ln f.
    pub of_log: Vec<f64>,
    /// Density of the error of f cos, squared: times (f cos)².
    pub of_square: Vec<f64>,
    /// The share λ of the second, in [0, 1].
    pub share: f64,
    /// Variance of ln f from which on a place is worth what it is there.
    pub cap: f64,
}

impl Weights {
    /// What a little variance less is worth at each place: the derivative of 2(1 − λ) ln Σ ω √v + λ ln Σ ω F v, with the
    /// variance at most the cap.
    fn worth(&self, variances: &[f64], out: &mut [f64]) {
        let capped = |v: f64| v.clamp(1e-12, self.cap);
        let [mut log, mut square] = [0.0; 2];
        for (i, &v) in variances.iter().enumerate() {
            let v = capped(v);
            log += self.of_log[i] * v.sqrt();
            square += self.of_square[i] * v;
        }
        // Where all is dark or known to the last digit, nothing is worth anything.
        let (log, square) = (log.max(1e-300), square.max(1e-300));
        let (log, square) = ((1.0 - self.share) / log, self.share / square);
        for (i, &v) in variances.iter().enumerate() {
            out[i] = log * self.of_log[i] / capped(v).sqrt() + square * self.of_square[i];
        }
    }
}

/// Sum of the products of three lists, in eight interleaved parts.
#[inline(always)]
fn weighted(weights: &[f64], x: &[f64], y: &[f64]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let ([w, x, y], [a, b, c]): ([&[[f64; LANES]]; 3], [&[f64]; 3]) = {
        let [w, x, y] = [weights, x, y].map(|list| list.as_chunks());
        ([w.0, x.0, y.0], [w.1, x.1, y.1])
    };
    let rest = a.iter().zip(b).zip(c);
    let rest: f64 = rest.map(|((w, x), y)| w * x * y).sum();
    for ((w, x), y) in w.iter().zip(x).zip(y) {
        for i in 0..LANES {
            sums[i] += w[i] * x[i] * y[i];
        }
    }
    rest + ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]))
}

/// Numbers of `n` candidates, each the one whose reading lowers the weighted variances at all places most
/// (A-optimal; Krause et al. 2008).
pub(super) fn a_optimal(
    process: &Posterior,
    [places, candidates]: [&Places; 2],
    weights: &Weights,
    wanted: Wanted<'_>,
) -> Vec<usize> {
    let targets = Targets {
        covariances: process.covariances(places, candidates),
        variances: process.variances(places),
    };
    let worth = |variances: &[f64], out: &mut [f64]| weights.worth(variances, out);
    most_informative(process, candidates, targets, worth, wanted)
}

/// What is to be known: numbers of which readings lower the variances.
pub(super) struct Targets {
    /// Covariances with ln f at the candidates, a column for each.
    pub covariances: DMatrix<f64>,
    /// Their variances.
    pub variances: Vec<f64>,
}

/// Numbers of `n` candidates, each the one whose reading lowers the variances of targets most, times what a little less of each is
/// worth: `worth` writes it for given variances.
pub(super) fn most_informative(
    process: &Posterior,
    candidates: &Places,
    targets: Targets,
    worth: impl Fn(&[f64], &mut [f64]),
    wanted: Wanted<'_>,
) -> Vec<usize> {
    let Targets {
        mut covariances,
        mut variances,
    } = targets;
    let from = (process, candidates);
    let mut left = Left::new(&from, wanted.stops, wanted.n);
    let (mut worths, mut scaled) = (vec![0.0; variances.len()], vec![0.0; variances.len()]);
    let mut with = DVector::zeros(covariances.ncols());
    let mut gains = vec![0.0; covariances.ncols()];
    wanted.after(Vec::new(), |_| {
        worth(&variances, &mut worths);
        let columns = covariances
            .as_mut_slice()
            .par_chunks_mut(scaled.len().max(1) * SWEPT);
        let tasks = columns
            .zip(gains.par_chunks_mut(SWEPT))
            .zip(with.as_slice().par_chunks(SWEPT));
        tasks.for_each(|((covariances, gains), with)| {
            vectorised!(sweep(covariances, (&scaled, with), &worths, gains));
        });
        let scores = gains.iter().enumerate();
        let scores = scores.map(|(c, gain)| gain / left.of_reading(c));
        let best = left.best(scores)?;
        let spread = left.of_reading(best).sqrt();
        for ((scaled, c), v) in scaled
            .iter_mut()
            .zip(&covariances.column(best))
            .zip(&mut variances)
        {
            *scaled = c / spread;
            *v = (*v - *scaled * *scaled).max(0.0);
        }
        with = left.choose(best);
        Some(best)
    })
}

/// Candidates that one task sweeps over.
const SWEPT: usize = 64;

/// Subtracts the update of a reading from the covariances of candidates with all places, a column of places for each, and writes the
/// sums of worth times squared covariance that are left. `scaled` and `with` are covariances with the reading over the root of its
/// variance: of all places, and of these candidates.
#[inline(always)]
fn sweep(
    covariances: &mut [f64],
    (scaled, with): (&[f64], &[f64]),
    worth: &[f64],
    gains: &mut [f64],
) {
    let columns = covariances.chunks_exact_mut(scaled.len().max(1));
    for ((column, with), gain) in columns.zip(with).zip(gains) {
        for (c, scaled) in column.iter_mut().zip(scaled) {
            *c -= scaled * with;
        }
        *gain = weighted(worth, column, column);
    }
}

/// Numbers of `n` candidates, each where ln f is least certain, times a weight.
pub(super) fn least_certain(
    candidates: &dyn Estimates,
    weights: &[f64],
    wanted: Wanted<'_>,
) -> Vec<usize> {
    let mut left = Left::new(candidates, wanted.stops, wanted.n);
    wanted.after(Vec::new(), |_| {
        let scores = left.variances.iter().zip(weights).map(|(v, w)| v * w);
        let best = left.best(scores)?;
        left.choose(best);
        Some(best)
    })
}

/// Numbers of `n` candidates, each the one whose reading leaves known materials the smallest weighted squares of errors
/// at all places. `residuals` are those of places and of candidates, a column for each with a row per material: ln f
/// less its mean. The last `given` candidates were read before.
pub(super) fn least_error(
    process: &Posterior,
    [places, candidates]: [&Places; 2],
    [of_places, mut of_candidates]: [DMatrix<f64>; 2],
    weights: &[f64],
    given: usize,
    wanted: Wanted<'_>,
) -> Vec<usize> {
    let mut covariances = process.covariances(places, candidates);
    // Σ_m r_m(place) r_m(candidate), which is all that errors depend on.
    let mut products = of_places.tr_mul(&of_candidates);
    let count = of_candidates.ncols();
    let from = (process, candidates);
    let mut left = Left::new(&from, wanted.stops, given + wanted.n);
    left.is_left[count - given..].fill(false);
    let mut chosen = Vec::new();
    for step in 0..given + wanted.n {
        let best = if step < given {
            count - given + step
        } else {
            // What Σ_e w_e Σ_m (r_m(e) − g r_m(c))², g = C_ec / (v_c + s²), is less than without c.
            let less = (0..count).map(|c| {
                let (v, own) = (left.of_reading(c), of_candidates.column(c).norm_squared());
                let [with, cross] = [&covariances, &products].map(|m| m.column(c));
                let (with, cross) = (with.as_slice(), cross.as_slice());
                (2.0 * weighted(weights, with, cross) - weighted(weights, with, with) * own / v) / v
            });
            match left.best(less).filter(|_| (wanted.go_on)()) {
                Some(best) => best,
                None => break,
            }
        };
        let spread = left.of_reading(best).sqrt();
        let scaled = covariances.column(best) / spread;
        let with = left.choose(best);
        covariances.ger(-1.0, &scaled, &with, 1.0);
        let own = of_candidates.column(best).into_owned();
        let cross = products.column(best).into_owned();
        let shift = &with * (own.norm_squared() / spread) - of_candidates.tr_mul(&own);
        products.ger(1.0 / spread, &scaled, &shift, 1.0);
        products.ger(-1.0 / spread, &cross, &with, 1.0);
        of_candidates.ger(-1.0 / spread, &own, &with, 1.0);
        if step >= given {
            chosen.push(best);
        }
    }
    chosen
}

/// Candidates that are left, and what those that were chosen leave uncertain of them.
struct Left<'a> {
    candidates: &'a dyn Estimates,
    /// Variances of readings about the process.
    noise: Vec<f64>,
    variances: Vec<f64>,
    /// How likely there is a reading to be had.
    readable: Vec<f64>,
    is_left: Vec<bool>,
    /// As those of [`Wanted`].
    stops: &'a [u32],
    /// The stop of the last choice.
    stop: Option<u32>,
    /// A column per choice: covariances with it, given all before, over the root of its variance.
    scaled: DMatrix<f64>,
    choices: usize,
}

impl<'a> Left<'a> {
    /// For `n` choices.
    fn new(candidates: &'a dyn Estimates, stops: &'a [u32], n: usize) -> Self {
        let variances = candidates.variances();
        Self {
            candidates,
            noise: candidates.noise(),
            readable: candidates.readable(),
            is_left: vec![true; variances.len()],
            stops,
            stop: None,
            scaled: DMatrix::zeros(variances.len(), n),
            variances,
            choices: 0,
        }
    }

    /// The variance of a reading at a candidate.
    fn of_reading(&self, c: usize) -> f64 {
        self.variances[c] + self.noise[c]
    }

    /// The candidate of the highest score, times how likely it is to be had; of equal ones the first. Of stops the next candidate
    /// of the one that was begun, or the first of the one whose scores have the highest sum.
    fn best(&self, scores: impl Iterator<Item = f64>) -> Option<usize> {
        let of_stop = |stop: u32| {
            let mut all = self.stops.iter().zip(&self.is_left);
            all.position(|(of, is_left)| *of == stop && *is_left)
        };
        if let Some(next) = self.stop.and_then(of_stop) {
            return Some(next);
        }
        let likely = scores
            .zip(&self.readable)
            .map(|(score, likely)| score * likely);
        let left = likely.enumerate().filter(|(c, _)| self.is_left[*c]);
        let better = |a: (usize, f64), b: (usize, f64)| if b.1 > a.1 { b } else { a };
        if self.stops.is_empty() {
            return left.reduce(better).map(|(c, _)| c);
        }
        let mut sums: Vec<(usize, f64)> = Vec::new();
        for (c, score) in left {
            match sums.last_mut() {
                Some((first, sum)) if self.stops[*first] == self.stops[c] => *sum += score,
                _ => sums.push((c, score)),
            }
        }
        sums.into_iter().reduce(better).map(|(c, _)| c)
    }

    /// Takes a candidate, and returns its covariances with all, over the root of its variance.
    fn choose(&mut self, best: usize) -> DVector<f64> {
        let spread = self.of_reading(best).sqrt();
        let mut with = self.candidates.covariances_with(best);
        if self.choices > 0 {
            let row = self.scaled.row(best).transpose();
            let known = self.scaled.columns(0, self.choices);
            with.gemv(-1.0, &known, &row.rows(0, self.choices), 1.0);
        }
        // Covariances that are approximated may be larger than those of two numbers of such variances.
        let own = self.variances[best];
        for (with, v) in with.iter_mut().zip(&self.variances) {
            let most = (v * own).sqrt() * (1.0 + 1e-9);
            *with = with.clamp(-most, most);
        }
        with /= spread;
        for (v, t) in self.variances.iter_mut().zip(with.iter()) {
            *v = (*v - t * t).max(0.0);
        }
        self.scaled.set_column(self.choices, &with);
        self.choices += 1;
        self.is_left[best] = false;
        self.stop = self.stops.get(best).copied();
        with
    }
}

#[cfg(test)]
mod tests {
    use super::super::rows::tests::assert_each_is_best;
    use super::*;
    use crate::geometry::{DirectionPair, Symmetry};
    use crate::sampling::{Random, cosine_hemisphere};

    fn pairs(first: u64, n: u64) -> Vec<DirectionPair> {
        let random = Random::new(3);
        let pair = |i| {
            let u: [f64; 4] = random.point(i);
            DirectionPair::new(
                cosine_hemisphere([u[0], u[1]]),
                cosine_hemisphere([u[2], u[3]]),
            )
        };
        (first..first + n).map(pair).collect()
    }

    fn wanted(n: usize) -> Wanted<'static> {
        Wanted {
            n,
            go_on: &|| true,
            stops: &[],
        }
    }

    #[test]
    fn each_pose_is_the_one_that_lowers_the_variances_most() {
        let process = Posterior::before(Symmetry::FULL, None);
        let (at, from) = (pairs(0, 90), pairs(500, 60));
        let [places, candidates] = [&at, &from].map(|list| process.places(list));
        let weights = Weights {
            of_log: (0..90).map(|i| 1.0 + f64::from(i % 5)).collect(),
            of_square: (0..90).map(|i| 1.0 + f64::from(i % 7)).collect(),
            share: 0.3,
            cap: 1e9,
        };
        let chosen = a_optimal(&process, [&places, &candidates], &weights, wanted(6));
        assert_eq!(chosen.len(), 6);
        assert_each_is_best(&chosen, from.len(), 1e-6, |numbers, c| {
            let left = |numbers: &[usize]| {
                let read: Vec<DirectionPair> = numbers.iter().map(|&c| from[c]).collect();
                let variances = process.variances_with(&places, &process.places(&read));
                variances.unwrap()
            };
            let before = match numbers {
                [] => process.variances(&places),
                _ => left(numbers),
            };
            let mut worth = vec![0.0; before.len()];
            weights.worth(&before, &mut worth);
            let after = left(&[numbers, &[c]].concat());
            let drops = before.iter().zip(after).map(|(b, a)| b - a);
            drops.zip(&worth).map(|(drop, w)| drop * w).sum()
        });
    }

    #[test]
    fn each_pose_leaves_known_materials_the_least_error() {
        let process = Posterior::before(Symmetry::FULL, None);
        let (at, from) = (pairs(0, 50), pairs(500, 40));
        let [places, candidates] = [&at, &from].map(|list| process.places(list));
        let wave = |from: usize| {
            move |m: usize, i: usize| ((m + 2) as f64 * 0.7 * (i + from) as f64).sin()
        };
        let residuals = [
            DMatrix::from_fn(5, 50, wave(0)),
            DMatrix::from_fn(5, 40, wave(50)),
        ];
        let weights: Vec<f64> = (0..50).map(|i| 1.0 + f64::from(i % 5)).collect();
        let given = [38, 39];
        let both = [&places, &candidates];
        let chosen = least_error(&process, both, residuals.clone(), &weights, 2, wanted(6));
        // By the equations of all readings at once.
        let error = |read: &[usize]| {
            let some: Vec<DirectionPair> = read.iter().map(|&c| from[c]).collect();
            let some = process.places(&some);
            let mut own = process.covariances(&some, &some);
            let noise = process.noise(&some);
            (0..read.len()).for_each(|i| own[(i, i)] += noise[i]);
            let solved = own
                .cholesky()
                .unwrap()
                .solve(&residuals[1].select_columns(read).transpose());
            let left = residuals[0].transpose() - process.covariances(&places, &some) * solved;
            let squares = left.row_iter().zip(&weights);
            squares.map(|(row, w)| w * row.norm_squared()).sum::<f64>()
        };
        assert_eq!(chosen.len(), 6);
        assert_each_is_best(&chosen, 38, 1e-6, |before, c| {
            -error(&[&given[..], before, &[c]].concat())
        });
    }

    #[test]
    fn worth_is_the_derivative_of_what_is_made_small() {
        let weights = Weights {
            of_log: vec![1.0, 2.0, 0.5],
            of_square: vec![0.1, 3.0, 1.0],
            share: 0.4,
            cap: 10.0,
        };
        let v = [0.2, 1.5, 4.0];
        let objective = |v: &[f64]| {
            let log: f64 = v
                .iter()
                .zip(&weights.of_log)
                .map(|(v, w)| w * v.sqrt())
                .sum();
            let square: f64 = v.iter().zip(&weights.of_square).map(|(v, w)| w * v).sum();
            // Twice the share of a mean of roots changes by as much as the share of a mean of squares.
            2.0 * 0.6 * log.ln() + 0.4 * square.ln()
        };
        let mut worth = [0.0; 3];
        weights.worth(&v, &mut worth);
        for i in 0..3 {
            let at = |step: f64| {
                let mut v = v;
                v[i] += step;
                objective(&v)
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!((worth[i] / slope - 1.0).abs() < 1e-6, "{i}");
        }
    }

    #[test]
    fn the_least_certain_poses_are_apart() {
        let process = Posterior::before(Symmetry::FULL, None);
        let from = pairs(0, 400);
        let candidates = process.places(&from);
        let chosen = least_certain(&(&process, &candidates), &[1.0; 400], wanted(30));
        // Each was the least certain one given those before.
        for k in 1..30 {
            let read: Vec<DirectionPair> = chosen[..k].iter().map(|&c| from[c]).collect();
            let left = process.variances_with(&candidates, &process.places(&read));
            let left = left.unwrap();
            let most = left.iter().fold(0.0, |a: f64, b| a.max(*b));
            assert!(left[chosen[k]] >= most * (1.0 - 1e-4), "{k}");
        }
    }
}
