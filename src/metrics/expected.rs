//! Errors that a reconstruction expects of itself.

use super::{Judged, Level, Uncovered, quantity::quantities};
use crate::geometry::DirectionPair;
use crate::reconstruct::{EPSILON, LogNormal, Predictive};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Errors that are expected where ln(f + ε) is known as a normal variable; `None` where undefined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Expected {
    /// Of `nrmse`; `None` also where all is black.
    pub nrmse: Option<f64>,
    /// Of `log_relative`.
    pub log_relative: Option<f64>,
    /// The part of both that is of errors which all readings share; their squares add up.
    pub shared: [Option<f64>; 2],
}

/// What nine of ten normal numbers are below, in absolute value, over their root mean square and over their mean absolute value.
const SHARED_NINTH: [f64; 2] = [1.645, 2.06];

/// Variance of ln f from which on the tail of f does not count: its exponential would be all of the sum.
const TAIL: f64 = 2.0;

/// Ratios of true and expected errors that nine of ten tables are below, by the number of readings: of nrmse and of
/// log_relative. The larger of those at Sobol points and at adaptive poses, with a prior of other families and without
/// one, and at least 1; [`docs::planning`](crate::docs::planning) names the commands.
const NINTH: [(f64, [f64; 2]); 9] = [
    (4.0, [2.0, 1.6]),
    (8.0, [2.0, 1.6]),
    (16.0, [1.8, 1.5]),
    (32.0, [1.7, 1.3]),
    (64.0, [2.0, 1.2]),
    (128.0, [1.7, 1.2]),
    (250.0, [1.6, 1.0]),
    (500.0, [1.5, 1.0]),
    (1000.0, [1.4, 1.0]),
];

/// The ratios at a number of readings: between two of the list by the logarithm of the number.
fn factors(readings: f64) -> [f64; 2] {
    let after = NINTH.partition_point(|(n, _)| *n <= readings);
    let at = |i: usize| NINTH[i.min(NINTH.len() - 1)];
    let ((n, a), (m, b)) = (at(after.saturating_sub(1)), at(after));
    let t = match n < m {
        true => ((readings / n).ln() / (m / n).ln()).max(0.0),
        false => 0.0,
    };
    [0, 1].map(|k| a[k] + t * (b[k] - a[k]))
}

impl Expected {
    /// Both errors, in the order of columns.
    pub const QUANTITIES: [Judged<Expected>; 4] = quantities! {
        "expected_nrmse": nrmse,
            "nrmse that the reconstruction expects of itself, if `quantities` asks for it and it knows";
        "expected_log_relative": log_relative, "the same of log_relative";
        "expected_nrmse_shared": shared[0],
            "the part of expected_nrmse that is of errors which all readings share; squares add up";
        "expected_log_relative_shared": shared[1], "the same of log_relative";
    };

    /// What errors under the cosine measure of nine of ten materials are below, with so many readings.
    pub fn bound(&self, readings: usize) -> Self {
        let factors = factors(readings as f64);
        let both = [self.nrmse, self.log_relative];
        // What is not shared averages out over pairs; what is shared is one number.
        let bound = [0, 1].map(|k| {
            both[k].map(|all| {
                let shared = self.shared[k].unwrap_or(0.0).min(all);
                let own = (all * all - shared * shared).sqrt();
                (factors[k] * own).hypot(SHARED_NINTH[k] * shared)
            })
        });
        Self {
            nrmse: bound[0],
            log_relative: bound[1],
            shared: [0, 1].map(|k| self.shared[k].map(|e| SHARED_NINTH[k] * e)),
        }
    }

    /// The errors under each measure of a level of test pairs, by some of these.
    pub(crate) fn per_measure(level: &Level, predictive: &dyn Predictive) -> Vec<Self> {
        let counted: Vec<usize> = Uncovered::counted(level.pairs.len()).collect();
        let pairs: Vec<DirectionPair> = counted.iter().map(|&i| level.pairs[i]).collect();
        let known = predictive.predict(&pairs);
        let under = |weights: &Vec<f64>| {
            let all = counted.iter().zip(&pairs).zip(&known);
            Self::from_pairs(
                all.map(|((&i, pair), known)| (weights[i], pair.omega_i.cos_theta(), *known)),
            )
        };
        level.weights.iter().map(under).collect()
    }

    /// The errors under a measure: of each pair its weight, cos θ_i, and what is known there.
    ///
    /// The square of an error of f is taken for e^v − 1 of that of the median of f, v the variance of ln f: for small v
    /// it is that on average, and for large v between its mean as a share of the median's square and of the mean square.
    pub fn from_pairs(pairs: impl Iterator<Item = (f64, f64, LogNormal)>) -> Self {
        let errors = |weight: f64, cosine: f64, mean: f64, variance: f64| {
            let shifted = mean.exp();
            [
                weight,
                (shifted * cosine).powi(2) * variance.min(TAIL).exp_m1(),
                ((shifted - EPSILON).max(0.0) * cosine).powi(2),
                variance.sqrt(),
            ]
        };
        let all: Vec<_> = pairs.collect();
        let of = |variance: fn(&LogNormal) -> f64| {
            let each = all.iter();
            of_means(
                each.map(|(w, cosine, known)| errors(*w, *cosine, known.mean, variance(known))),
            )
        };
        let [nrmse, log_relative] = of(|known| known.variance);
        Self {
            nrmse,
            log_relative,
            shared: of(|known| known.shared),
        }
    }
}

/// `nrmse` and `log_relative` of errors that are known on average: of each pair its weight, the squares of the error and of f, both
/// times the cosine, and the standard deviation of the error of ln (f + ε). `None` where undefined.
pub(super) fn of_means(pairs: impl Iterator<Item = [f64; 4]>) -> [Option<f64>; 2] {
    let [mut all, mut square, mut energy, mut log] = [0.0; 4];
    for [weight, of_error, of_f, deviation] in pairs {
        all += weight;
        square += weight * of_error;
        energy += weight * of_f;
        // The mean of the absolute value of a normal number.
        log += weight * (2.0 / PI).sqrt() * deviation;
    }
    [(square / energy).sqrt(), log / all].map(|error: f64| error.is_finite().then_some(error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_lie_between_those_of_the_numbers_beside() {
        for pair in NINTH.windows(2) {
            let [(n, a), (m, b)] = [pair[0], pair[1]];
            assert_eq!((factors(n), factors(m)), (a, b));
            let middle = factors((n * m).sqrt());
            for k in 0..2 {
                assert!((middle[k] - 0.5 * (a[k] + b[k])).abs() < 1e-12);
            }
        }
        assert_eq!((factors(1.0), factors(1e5)), (NINTH[0].1, NINTH[8].1));
    }
}
