//! What moments err by since the values of a BRDF follow random paths, or are estimates from readings.
//!
//! A value that is off by δ shifts a moment by w δ g/α, w the weight of its node and g the influence of a point on that moment.
//! Of random paths, neighbours that come from the same ones are off together; noise that each pair has to itself is not counted here: the
//! estimators see that neighbours differ. Of readings, errors are what these leave open ([`EstimatedBrdf`]). The diffuse part that
//! was subtracted counts as known.

use super::component::{Component, Moments};
use super::mesh::nodes;
use super::slice::Slice;
use super::tally::{gaussian, powers};
use crate::brdf::SumErrors;
use crate::geometry::DirectionPair;
use std::f64::consts::FRAC_PI_4;

/// Relative uncertainty of the energy up to which what errors shift the other moments by is linear in them.
const LINEAR: f64 = 0.3;

/// Uncertainty of a mean that is no knowledge of it where no σ was asked for, rad.
const ANYWHERE: f64 = FRAC_PI_4;

/// Adds a standard error to each uncertainty. A moment of readings that is known to no better than the energy, σ, σ² or, of orders 3 and 4,
/// 1 is one that they do not determine, and is left out; so are all orders above an energy that is known to no better than [`LINEAR`], and
/// orders 3 and 4 where a covariance is left out.
pub(super) fn add(slice: &Slice<'_>, moments: &mut Moments) {
    let brdf = slice.brdf;
    let (split, estimated) = (brdf.as_split(), brdf.as_estimated());
    if split.is_none() && estimated.is_none() {
        return;
    }
    let Some(alpha) = moments.energy() else {
        return;
    };
    let Sums { pairs, weights } = Sums::new(slice, moments, alpha, &nodes(slice));
    let mut errors = vec![0.0; weights.len()];
    if let Some(split) = split {
        let mut sums = SumErrors::<15>::new();
        for (k, pair) in pairs.iter().enumerate() {
            sums.add(split, pair, std::array::from_fn(|i| weights[i][k]));
        }
        errors = sums.errors()[0].to_vec();
    }
    let of_readings = estimated.and_then(|of| of.uncertainties_of_sums(&pairs, &weights));
    let is_estimated = of_readings.is_some();
    let both = errors.iter_mut().zip(of_readings.into_iter().flatten());
    both.for_each(|(error, more)| *error += more);
    for (estimate, error) in moments.0.iter_mut().zip(errors) {
        if let Some(estimate) = estimate {
            estimate.uncertainty += error;
        }
    }
    if is_estimated && alpha > 0.0 {
        leave_out(moments, alpha);
    }
}

/// Pairs at nodes of a slice, and the weights of a sum Σ w f over them for each component: what moments shift by where errors of f are
/// small.
pub(super) struct Sums {
    pub pairs: Vec<DirectionPair>,
    pub weights: Vec<Vec<f64>>,
}

impl Sums {
    /// Of a slice with these moments, of energy `alpha`, by nodes with their areas; where the BRDF is mirrored those at φ ≥ 0.
    pub(super) fn new(
        slice: &Slice<'_>,
        moments: &Moments,
        alpha: f64,
        nodes: &[([f64; 2], f64)],
    ) -> Self {
        let (mut pairs, mut weights) = (Vec::new(), vec![Vec::new(); Component::ALL.len()]);
        for (point, area) in nodes {
            let pair = slice.pair(*point);
            let mut influence = influence(moments, *point);
            if slice.is_mirrored() {
                // The pair at −φ too: what is odd has no error.
                for c in Component::ALL {
                    influence[c.index()] *= if c.is_odd() { 0.0 } else { 2.0 };
                }
            }
            // A black slice has no other moments.
            influence[1..]
                .iter_mut()
                .for_each(|g| *g /= alpha.max(f64::MIN_POSITIVE));
            let weight = area * slice.of_luminance(&pair);
            let each = weights.iter_mut().zip(influence);
            each.for_each(|(of, g)| of.push(weight * g));
            pairs.push(pair);
        }
        Self { pairs, weights }
    }
}

/// Leaves out the moments that uncertainties do not determine.
fn leave_out(moments: &mut Moments, alpha: f64) {
    let whole = *moments;
    let is_open = |c: Component| {
        let unit = match c.order() {
            0 => alpha,
            1 => whole.unit(c).unwrap_or(ANYWHERE),
            2 => whole.unit(c).unwrap_or(0.0),
            _ => 1.0,
        };
        whole
            .get(c)
            .is_some_and(|estimate| estimate.uncertainty > unit)
    };
    let energy = whole.get(Component::ENERGY);
    let is_vague = energy.is_some_and(|energy| energy.uncertainty > LINEAR * alpha);
    let is_width_open = Component::ALL
        .into_iter()
        .any(|c| c.order() == 2 && is_open(c));
    for c in Component::ALL {
        let below = (is_vague && c.order() > 0) || (is_width_open && c.order() > 2);
        if below || is_open(c) {
            moments.0[c.index()] = None;
        }
    }
}

/// What a share ε more of all light would shift the moments by, if it were at a point: of energy, ε α; of the others, ε times
/// this.
fn influence(moments: &Moments, point: [f64; 2]) -> [f64; 15] {
    let mut of = [0.0; 15];
    of[0] = 1.0;
    let Some(mean) = moments.mean() else {
        return of;
    };
    let away = [0, 1].map(|i| point[i] - mean[i]);
    (of[1], of[2]) = (away[0], away[1]);
    let Some(covariance) = moments.covariance() else {
        return of;
    };
    of[3] = away[0] * away[0] - covariance[0];
    of[4] = away[0] * away[1] - covariance[1];
    of[5] = away[1] * away[1] - covariance[2];
    let Some(sigma) = moments.sigma() else {
        return of;
    };
    let z = [0, 1].map(|i| away[i] / sigma[i]);
    let r = covariance[1] / (sigma[0] * sigma[1]);
    let correlation = z[0] * z[1] - 0.5 * r * (z[0] * z[0] + z[1] * z[1]);
    let powers = z.map(powers);
    // Standardised moments, without the normal distribution's taken off.
    let raw = |n: usize, m: usize| match n + m {
        2 if n == m => r,
        2 => 1.0,
        3 | 4 => moments.value(n, m).unwrap_or(0.0) + gaussian(Component { n, m }, r),
        _ => 0.0,
    };
    for c in Component::ALL.into_iter().filter(|c| c.order() > 2) {
        let Component { n, m } = c;
        let [along, across] = [n as f64, m as f64];
        let own = raw(n, m);
        let mut shift = powers[0][n] * powers[1][m] - own;
        // Of the mean, and of both widths.
        if n > 0 {
            shift -= along * raw(n - 1, m) * z[0];
        }
        if m > 0 {
            shift -= across * raw(n, m - 1) * z[1];
        }
        shift -= 0.5 * own * (along * (z[0] * z[0] - 1.0) + across * (z[1] * z[1] - 1.0));
        // Of what the normal distribution has.
        shift -= correlation
            * match (n, m) {
                (3, 1) | (1, 3) => 3.0,
                (2, 2) => 4.0 * r,
                _ => 0.0,
            };
        of[c.index()] = shift;
    }
    of
}

#[cfg(test)]
mod tests {
    use super::super::component::Estimate;
    use super::super::{Order, Tally};
    use super::*;

    /// The influence of a point is what moments change by when it gets more light.
    #[test]
    fn influence_is_the_derivative_of_the_moments() {
        let points: Vec<[f64; 2]> = (0..200)
            .map(|i| {
                let [a, b] = [0.618, 0.414].map(|step| (step * f64::from(i)).fract());
                [a * a - 0.2 * b, 0.5 * b * b * a + 0.3 * a]
            })
            .collect();
        let weights: Vec<f64> = (0..200).map(|i| 1.0 + (0.7 * f64::from(i)).sin()).collect();
        let whole: f64 = weights.iter().sum();
        let of = |weights: &[f64]| Tally::from_points(Order::MAX, &points, weights).values();
        let estimate = |value: Option<f64>| {
            value.map(|value| Estimate {
                value,
                uncertainty: 0.0,
            })
        };
        let moments = Moments(of(&weights).map(estimate));
        for place in [0, 17, 150] {
            let step = 1e-4;
            let changed = [step, -step].map(|share| {
                let mut weights = weights.clone();
                weights[place] += share * whole;
                of(&weights)
            });
            let [more, less] = changed;
            let mut expected = influence(&moments, points[place]);
            expected[0] *= whole;
            for i in 0..15 {
                let slope = (more[i].unwrap() - less[i].unwrap()) / (2.0 * step);
                let off = (slope - expected[i]).abs();
                assert!(
                    off < 1e-5 * (1.0 + slope.abs()),
                    "{place} {i}: {slope} {}",
                    expected[i]
                );
            }
        }
    }
}
