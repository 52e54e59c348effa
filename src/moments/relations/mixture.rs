//! Slices of neighbouring views as a sum of a few Gaussians.
//!
//! Near a view of elevation θ_v, with τ the elevation of a view less θ_v, a slice is
//!
//! Σ_k α_k(τ) N(θ; µ_k(τ), σ_θ,k) N(φ; 0, σ_φ,k), ln α_k(τ) = ln α_k + a_k τ + q_k τ²/2, µ_k(τ) = µ_k + µ'_k τ,
//!
//! N(x; µ, σ) the normal density over all angles, not cut at the horizon. All numbers are fitted together to the slices of views
//! within [`REACH`] widths v of a window exp(−τ²/(2v²)), by Poisson's deviance with weight cos θ cos² φ: relative
//! errors count by the energy about them, those of a peak and of wide tails alike. Views beyond the normal are those mirrored there.

use super::super::slice::{Batch, Kind, Slice};
use crate::error::ParameterError;
use crate::parametrization::view_centered;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, LN_2, PI, TAU};
use std::sync::{Arc, Mutex, PoisonError};

/// Components of a slice, at most.
pub const MOST_COMPONENTS: usize = 4;

/// Numbers of a component.
const NUMBERS: usize = 7;

/// Views of a fit lie within so many widths of the window.
const REACH: f64 = 3.0;

/// Views of a fit.
const VIEWS: usize = 9;

/// Directions of a slice along θ, and along one side of φ.
const THETAS: usize = 41;
const PHIS: usize = 15;

/// Curvature q of ln α, at most, times v²: the product with the window still falls on both sides.
pub(super) const MOST_CURVED: f64 = 0.6;

/// Least and greatest σ, rad.
const SIGMA: [f64; 2] = [1e-5, 3.0];

/// Steps of a fit, at most, those by which a start is judged, those of a fit without a view, and the relative decrease of the deviance at which a fit ends.
const STEPS: usize = 200;
const TRIED: usize = 6;
const WITHOUT: usize = 3;
const SMALL: f64 = 1e-4;

/// Least value of a model, sr⁻¹: no quotient overflows.
const LEAST: f64 = 1e-100;

/// Step of a number, at most.
const LONGEST: f64 = 1.5;

/// A component more is taken if it lowers the deviance of views that were left out to this share.
const WORTH: f64 = 0.95;

/// A Gaussian of the slices of views near one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gaussian {
    /// ln α (α in rad² sr⁻¹) at the view, and its first and second derivative by the view's elevation.
    pub log_energy: [f64; 3],
    /// Centre µ in θ at the view, rad, and its derivative by the view's elevation.
    pub centre: [f64; 2],
    /// σ_θ and σ_φ, rad.
    pub sigma: [f64; 2],
}

/// The components of the slices of views near one, and how well they are those.
#[derive(Clone, Debug)]
pub(super) struct Mixture {
    /// None where the slices are black.
    pub components: Vec<Gaussian>,
    /// Half the deviance over the energy of the slices, each slice when it was left out: of Gaussian residuals of relative size ε
    /// it is ε²/2.
    pub misfit: f64,
}

impl Mixture {
    /// The same slices about a view whose elevation is greater by `by` (rad).
    pub(super) fn moved(&self, by: f64) -> Self {
        let moved = |g: &Gaussian| {
            let [log, a, q] = g.log_energy;
            Gaussian {
                log_energy: [log + by * (a + 0.5 * q * by), a + q * by, q],
                centre: [g.centre[0] + g.centre[1] * by, g.centre[1]],
                ..*g
            }
        };
        Self {
            components: self.components.iter().map(moved).collect(),
            misfit: self.misfit,
        }
    }
}

/// The mixtures of a material's slices that were asked for.
#[derive(Debug, Default)]
pub(super) struct Mixtures(Mutex<HashMap<[u64; 3], Arc<Mixture>>>);

impl Mixtures {
    /// The mixture of at most `most` components of slices near an elevation in [0, π/2), for a window of width v.
    ///
    /// # Errors
    /// As [`Slice::new`].
    pub(super) fn near(
        &self,
        slice: &Slice<'_>,
        theta_o: f64,
        width: f64,
        most: usize,
    ) -> Result<Arc<Mixture>, ParameterError> {
        let key = [theta_o.to_bits(), width.to_bits(), most as u64];
        let held = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = held().get(&key) {
            return Ok(Arc::clone(found));
        }
        // Two threads may fit the same at once: the same comes out.
        let made = Arc::new(fitted(slice, theta_o, width, most)?);
        held().insert(key, Arc::clone(&made));
        Ok(made)
    }
}

/// A value of a slice.
#[derive(Clone, Copy)]
struct Sample {
    /// Number of its view.
    view: usize,
    /// Elevation of the view less that of the middle.
    tau: f64,
    theta: f64,
    phi: f64,
    /// f, sr⁻¹.
    value: f64,
    /// Weight cos θ cos² φ dθ dφ times that of the view.
    weight: f64,
}

/// The numbers of a component in the order of the fit: ln α, a, q, µ, µ', ln σ_θ, ln σ_φ.
type Numbers = [f64; NUMBERS];

/// Offsets from 0 to `reach`, closer about 0, and the width that each stands for: those of a hyperbolic sine.
fn offsets(scale: f64, reach: f64, count: usize) -> Vec<[f64; 2]> {
    let last = (reach / scale).asinh();
    let at = |i: usize| {
        let u = (i as f64 + 0.5) / count as f64 * last;
        [scale * u.sinh(), scale * u.cosh() * last / count as f64]
    };
    (0..count).map(at).collect()
}

/// Distance along θ from the mirror direction at which a slice has fallen to half, rad, in [1e-4, 0.3].
fn half_width(slice: &Slice<'_>) -> f64 {
    let theta_o = slice.theta_o;
    let steps: Vec<f64> = (0..=40)
        .map(|i| 1e-4 * 3000_f64.powf(f64::from(i) / 40.0))
        .collect();
    let mut batch = Batch::default();
    batch.push(slice, view_centered(-theta_o, 0.0));
    for &x in &steps {
        batch.push(slice, view_centered((x - theta_o).min(FRAC_PI_2), 0.0));
    }
    slice.evaluate(&mut batch);
    let (first, rest) = batch.values().split_at(1);
    let found = rest.iter().position(|f| *f <= 0.5 * first[0]);
    found.map_or(0.3, |i| steps[i])
}

/// Samples of the slices of views about an elevation.
fn samples(
    slice: &Slice<'_>,
    theta_o: f64,
    width: f64,
) -> Result<(Vec<Sample>, f64), ParameterError> {
    let at = |v: f64| Ok(Slice::new(slice.brdf, slice.channel, v)?.without(slice.diffuse));
    let scale = half_width(&at(theta_o)?);
    let sides = offsets(0.3 * scale, PI, THETAS / 2 + 1);
    let thetas = sides.iter().flat_map(|&[x, w]| [[x, w], [-x, w]]);
    let thetas: Vec<[f64; 2]> = thetas.collect();
    let phis = offsets(0.3 * scale, FRAC_PI_2, PHIS);
    let mut all = Vec::new();
    for view in 0..VIEWS {
        let tau = REACH * width * (2.0 * view as f64 / (VIEWS - 1) as f64 - 1.0);
        let signed = theta_o + tau;
        if signed.abs() >= super::LAST_VIEW {
            continue;
        }
        let slice = at(signed.abs())?;
        let side = signed.signum();
        let of_view = (-0.5 * (tau / width).powi(2)).exp();
        let mut batch = Batch::default();
        let mut new = Vec::new();
        for &[x, along] in &thetas {
            let theta = x - signed;
            if theta.abs() >= FRAC_PI_2 {
                continue;
            }
            for &[phi, across] in &phis {
                batch.push(&slice, view_centered(side * theta, phi));
                let weight = theta.cos() * phi.cos().powi(2) * along * across * of_view;
                new.push(Sample {
                    view,
                    tau,
                    theta,
                    phi,
                    value: 0.0,
                    weight,
                });
            }
        }
        slice.evaluate(&mut batch);
        let found = batch.values().iter().zip(batch.kinds());
        let there = new
            .into_iter()
            .zip(found)
            .filter(|(_, (_, kind))| **kind != Kind::Missing);
        all.extend(there.map(|(sample, (value, _))| Sample {
            value: *value,
            ..sample
        }));
    }
    Ok((all, scale))
}

/// The mixture whose number of components predicts left-out views best.
fn fitted(
    slice: &Slice<'_>,
    theta_o: f64,
    width: f64,
    most: usize,
) -> Result<Mixture, ParameterError> {
    let (samples, scale) = samples(slice, theta_o, width)?;
    let energy: f64 = samples.iter().map(|s| s.weight * s.value).sum();
    if !(energy > 0.0) {
        return Ok(Mixture {
            components: Vec::new(),
            misfit: 0.0,
        });
    }
    let mut numbers = fit(&samples, start(&samples, theta_o, scale), width, STEPS).1;
    let mut best = (left_out(&samples, &numbers, width), numbers.clone());
    for _ in 1..most {
        let tried = splits(&numbers)
            .into_iter()
            .map(|n| fit(&samples, n, width, TRIED));
        let least = tried.min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, first)) = least else { break };
        numbers = fit(&samples, first, width, STEPS).1;
        let deviance = left_out(&samples, &numbers, width);
        if deviance < WORTH * best.0 {
            best = (deviance, numbers.clone());
        }
    }
    let (deviance, numbers) = best;
    let gaussian = |&[log, a, q, mu, slope, theta, phi]: &Numbers| Gaussian {
        log_energy: [log, a, q],
        centre: [mu, slope],
        sigma: [theta.exp(), phi.exp()],
    };
    Ok(Mixture {
        components: numbers.iter().map(gaussian).collect(),
        misfit: deviance / energy,
    })
}

/// Where the fit of one component begins: centred on the mirror direction.
fn start(samples: &[Sample], theta_o: f64, scale: f64) -> Vec<Numbers> {
    let sums = samples.iter().fold([0.0; 2], |[seen, own], s| {
        let model = (-0.5 * ((s.theta + theta_o + s.tau) / scale).powi(2)).exp();
        let model = model * (-0.5 * (s.phi / scale).powi(2)).exp() / (TAU * scale * scale);
        [seen + s.weight * s.value, own + s.weight * model]
    });
    let log = (sums[0] / sums[1].max(LEAST)).ln();
    vec![[log, 0.0, 0.0, -theta_o, -1.0, scale.ln(), scale.ln()]]
}

/// Each component in two of half its energy, along θ or a narrow and a wide one.
fn splits(numbers: &[Numbers]) -> Vec<Vec<Numbers>> {
    let split = |k: usize, is_along: bool| {
        let mut new = numbers.to_vec();
        let [mut a, mut b] = [new[k]; 2];
        a[0] -= LN_2;
        b[0] -= LN_2;
        if is_along {
            let way = 0.7 * a[5].exp();
            (a[3], b[3]) = (a[3] - way, b[3] + way);
            (a[5], b[5]) = (a[5] - 0.35, b[5] - 0.35);
        } else {
            a[5..].iter_mut().for_each(|s| *s -= 0.5);
            b[5..].iter_mut().for_each(|s| *s += 0.4);
        }
        new[k] = a;
        new.push(b);
        new
    };
    let all = (0..numbers.len()).flat_map(|k| [(k, true), (k, false)]);
    all.map(|(k, is_along)| split(k, is_along)).collect()
}

/// A component with what is computed once for all samples.
struct Ready {
    /// ln of its value at its centre, and the derivatives a and q.
    log: [f64; 3],
    centre: [f64; 2],
    /// 1/σ_θ and 1/σ_φ.
    per_sigma: [f64; 2],
}

impl Ready {
    fn of(numbers: &[Numbers]) -> Vec<Self> {
        let of = |&[log, a, q, mu, rate, theta, phi]: &Numbers| Self {
            log: [log - theta - phi - TAU.ln(), a, q],
            centre: [mu, rate],
            per_sigma: [(-theta).exp(), (-phi).exp()],
        };
        numbers.iter().map(of).collect()
    }

    /// How far a sample is from the centre, in σ.
    #[inline]
    fn off(&self, s: &Sample) -> [f64; 2] {
        let [mu, rate] = self.centre;
        let [theta, phi] = self.per_sigma;
        [(s.theta - mu - rate * s.tau) * theta, s.phi * phi]
    }
}

/// The value of a model at the place of a sample, and that of each component.
#[inline]
fn model(components: &[Ready], s: &Sample, parts: &mut [f64]) -> f64 {
    let mut sum = LEAST;
    for (part, ready) in parts.iter_mut().zip(components) {
        let ([log, a, q], [z, y]) = (ready.log, ready.off(s));
        *part = (log + s.tau * (a + 0.5 * q * s.tau) - 0.5 * (z * z + y * y)).exp();
        sum += *part;
    }
    sum
}

/// Half the deviance of a sample.
#[inline]
fn deviance(s: &Sample, model: f64) -> f64 {
    let own = if s.value > 0.0 {
        s.value * (s.value / model).ln()
    } else {
        0.0
    };
    s.weight * (model - s.value + own)
}

/// Half the deviance of samples.
fn deviances(samples: &[Sample], numbers: &[Numbers]) -> f64 {
    let mut parts = vec![0.0; numbers.len()];
    let components = Ready::of(numbers);
    let of = |s: &Sample| deviance(s, model(&components, s, &mut parts));
    samples.iter().map(of).sum()
}

/// Information (Fisher's) and slope of half the deviance.
struct Normal {
    information: DMatrix<f64>,
    slope: DVector<f64>,
}

impl Normal {
    fn new(samples: &[Sample], numbers: &[Numbers]) -> Self {
        let n = NUMBERS * numbers.len();
        let mut slope = DVector::zeros(n);
        let mut parts = vec![0.0; numbers.len()];
        // Derivatives of the model at each sample, a column each, times the square root of its weight.
        let mut slopes = DMatrix::zeros(n, samples.len());
        let columns = slopes.as_mut_slice().chunks_exact_mut(n);
        let components = Ready::of(numbers);
        for (s, by) in samples.iter().zip(columns) {
            let model = model(&components, s, &mut parts);
            let root = (s.weight / model).sqrt();
            let of = components
                .iter()
                .zip(&parts)
                .zip(by.chunks_exact_mut(NUMBERS));
            for ((ready, part), by) in of {
                let (part, [z, y]) = (root * part, ready.off(s));
                by[0] = part;
                by[1] = part * s.tau;
                by[2] = 0.5 * by[1] * s.tau;
                by[3] = part * z * ready.per_sigma[0];
                by[4] = by[3] * s.tau;
                by[5] = part * (z * z - 1.0);
                by[6] = part * (y * y - 1.0);
            }
            let pull = root * (model - s.value);
            slope
                .iter_mut()
                .zip(&*by)
                .for_each(|(sum, by)| *sum += pull * by);
        }
        let information = &slopes * slopes.transpose();
        Self { information, slope }
    }

    /// The step to the least of the deviance, each number's information larger by a share.
    fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let mut damped = self.information.clone();
        let least = 1e-12 * damped.trace();
        for i in 0..damped.nrows() {
            damped[(i, i)] += damping * (damped[(i, i)] + least);
        }
        let factor: Cholesky<f64, Dyn> = damped.cholesky()?;
        Some(
            factor
                .solve(&-&self.slope)
                .map(|x| x.clamp(-LONGEST, LONGEST)),
        )
    }
}

/// Numbers after a step, each in its range.
fn stepped(numbers: &[Numbers], step: &DVector<f64>, width: f64) -> Vec<Numbers> {
    let of = |(old, step): (&Numbers, &[f64])| {
        let mut new: Numbers = std::array::from_fn(|i| old[i] + step[i]);
        new[2] = new[2].min(MOST_CURVED / (width * width));
        new[3] = new[3].clamp(-FRAC_PI_2, FRAC_PI_2);
        let [least, most] = SIGMA.map(f64::ln);
        new[5..].iter_mut().for_each(|s| *s = s.clamp(least, most));
        new
    };
    let steps = step.as_slice().chunks_exact(NUMBERS);
    numbers.iter().zip(steps).map(of).collect()
}

/// The numbers of least deviance and half of it, by Fisher's scoring with Levenberg's damping.
fn fit(samples: &[Sample], start: Vec<Numbers>, width: f64, steps: usize) -> (f64, Vec<Numbers>) {
    let still = DVector::zeros(NUMBERS * start.len());
    let mut numbers = stepped(&start, &still, width);
    let mut damping = 1e-2;
    let mut least = deviances(samples, &numbers);
    for _ in 0..steps {
        let normal = Normal::new(samples, &numbers);
        let better = (0..12).find_map(|_| {
            let new = normal
                .step(damping)
                .map(|step| stepped(&numbers, &step, width));
            let new = new.map(|new| (deviances(samples, &new), new));
            let found = new.filter(|(deviance, _)| *deviance < least);
            damping = if found.is_some() {
                (0.2 * damping).max(1e-9)
            } else {
                4.0 * damping
            };
            found
        });
        let Some((deviance, new)) = better else { break };
        let gain = (least - deviance) / least;
        (least, numbers) = (deviance, new);
        if gain < SMALL {
            break;
        }
    }
    (least, numbers)
}

/// Half the deviance of each view under the numbers that the others lead to, in a few steps from those of all.
fn left_out(samples: &[Sample], numbers: &[Numbers], width: f64) -> f64 {
    let views: Vec<&[Sample]> = samples.chunk_by(|a, b| a.view == b.view).collect();
    let of = |view: &&[Sample]| {
        let others = samples.iter().filter(|s| s.view != view[0].view);
        let others: Vec<Sample> = others.copied().collect();
        let (_, without) = fit(&others, numbers.to_vec(), width, WITHOUT);
        deviances(view, &without)
    };
    let each: Vec<f64> = views.par_iter().map(of).collect();
    each.iter().sum()
}
