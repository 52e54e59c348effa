//! What a truth that is followed along paths may be off by, in the terms of the errors.

use super::expected::of_means;
use super::{Judged, Level, Uncovered, Values, quantity::quantities};
use crate::brdf::{Part, SplitBrdf};
use crate::reconstruct::EPSILON;
use rayon::prelude::*;

/// Errors that the paths of a truth make, which more of them make smaller; `None` where undefined.
///
/// A reconstruction cannot reproduce the errors t that pairs have of their own, and its error e is found too large: √(e² + t²).
/// Where values are linear between nodes, readings as dense as these reproduce them, and t is the most that they may do.
/// What other surfaces of a kind would change is not in it: that is no noise, but another truth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TruthErrors {
    /// RMS of u cos over RMS of f cos, u the standard error of f.
    pub nrmse: Option<f64>,
    /// Mean of √(2/π) u/(f + ε).
    pub log_relative: Option<f64>,
}

impl TruthErrors {
    /// Both errors, in the order of columns; the name of each begins with `truth_`.
    pub(crate) const QUANTITIES: [Judged<TruthErrors>; 2] = quantities! {
        "truth_nrmse": nrmse,
            "nrmse that the standard error of a truth from random paths makes (at 2000 pairs), at most; empty where none is known";
        "truth_log_relative": log_relative, "the same of log_relative";
    };

    /// The errors under each measure of a level of test pairs, by some of these, where the truth has these `values`.
    pub(crate) fn per_measure(level: &Level, truth: &dyn SplitBrdf, values: &Values) -> Vec<Self> {
        let counted = Uncovered::counted(level.pairs.len());
        let present: Vec<_> = counted.filter_map(|i| Some((i, values.get(i)?))).collect();
        let error =
            |&(i, _): &(usize, f64)| truth.split(&level.pairs[i]).transport.error(Part::All);
        let errors: Vec<f64> = present.par_iter().map(error).collect();
        let under = |weights: &Vec<f64>| {
            let all = present.iter().zip(&errors);
            let cosine = |i: usize| level.pairs[i].omega_i.cos_theta();
            Self::from_pairs(all.map(|(&(i, f), u)| (weights[i], cosine(i), f, *u)))
        };
        level.weights.iter().map(under).collect()
    }

    /// The errors under a measure: of each pair its weight, cos θ_i, f and u.
    fn from_pairs(pairs: impl Iterator<Item = (f64, f64, f64, f64)>) -> Self {
        let [nrmse, log_relative] = of_means(pairs.map(|(weight, cosine, f, u)| {
            let [of_error, of_f] = [u, f].map(|x| (x * cosine).powi(2));
            [weight, of_error, of_f, u / (f + EPSILON)]
        }));
        Self {
            nrmse,
            log_relative,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;
    use rand_distr::{Distribution, StandardNormal};

    /// A reconstruction without errors of its own, compared with truths that have such errors.
    #[test]
    fn errors_are_those_of_what_is_right_against_truths_with_noise() {
        let pairs = |i: u32| {
            let i = f64::from(i);
            let (f, weight) = (1.0 + 0.9 * (0.7 * i).sin(), 1.0 + (0.3 * i).cos());
            (weight, 0.2 + 0.7 * (0.5 * i).cos().abs(), f, 0.02 * f)
        };
        let told = TruthErrors::from_pairs((0..4000).map(pairs));
        let mut random = Random::new(3).stream(0);
        let [mut all, mut log, mut square, mut energy] = [0.0; 4];
        for (weight, cosine, f, u) in (0..4000).map(pairs) {
            let normal: f64 = StandardNormal.sample(&mut random);
            let truth = f + u * normal;
            all += weight;
            log += weight * ((f + EPSILON) / (truth + EPSILON)).ln().abs();
            square += weight * ((f - truth) * cosine).powi(2);
            energy += weight * (truth * cosine).powi(2);
        }
        let found = [(square / energy).sqrt(), log / all];
        for ((_, of), found) in TruthErrors::QUANTITIES.iter().zip(found) {
            let told = of(&told).unwrap();
            assert!((told / found - 1.0).abs() < 0.05, "{told} {found}");
        }
        assert_eq!(
            TruthErrors::from_pairs(std::iter::empty()),
            TruthErrors::default()
        );
    }
}
