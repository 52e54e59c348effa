//! Moments of slices against closed forms and against quadratures that share nothing with the
//! estimators: neither nodes nor, where the slice has a lobe, variables.
#![cfg(feature = "experiments")]

#[path = "../common/mod.rs"]
mod common;

mod azimuths;
mod exact;
mod extremes;
mod gaussians;
mod peak;
mod sampled;
mod symmetric;

use common::{made, peak_resolving as resolving, product};
use gonio::brdf::Brdf;
use gonio::geometry::Symmetry;
use gonio::moments::{
    Channel, Component, Estimator, Moments, MonteCarlo, Order, PeakResolving, ScrambledSobol,
    Slice, SliceMoments,
};
use gonio::parametrization::view_centered_angles;

/// A function of the slice's angles as a BRDF: every view sees the same slice. `None`: no data.
fn planar(f: impl Fn([f64; 2]) -> Option<f64> + Send + Sync) -> impl Brdf {
    made(Symmetry::NONE, move |pair| {
        Some([f(view_centered_angles(pair.omega_i))?])
    })
}

fn slice(brdf: &dyn Brdf, theta_o: f64) -> Slice<'_> {
    Slice::new(brdf, Channel::Luminance, theta_o).unwrap()
}

/// Every order, by one estimator.
fn estimate(brdf: &dyn Brdf, theta_o: f64, by: &dyn Estimator, seed: u64) -> SliceMoments {
    by.estimate(&slice(brdf, theta_o), Order::MAX, seed)
}

/// One of each kind, with its default parameters.
fn estimators() -> [Box<dyn Estimator>; 3] {
    [
        Box::new(MonteCarlo::default()),
        Box::new(ScrambledSobol::default()),
        Box::new(PeakResolving::default()),
    ]
}

fn is_random(by: &dyn Estimator) -> bool {
    !by.label().starts_with("peak")
}

/// What the tolerance of a component is relative to: α, σ, σ², and for standardised ones a bound
/// of max(1, E|x^n y^m|), which Hölder's inequality takes from the fourth moments.
fn scale(moments: &Moments, c: Component) -> f64 {
    let [s, t] = moments.sigma().unwrap();
    let fourth = [(4, 0), (0, 4)].map(|(n, m)| moments.value(n, m).unwrap() + 3.0);
    match c.order() {
        0 => moments.energy().unwrap(),
        1 | 2 => s.powi(c.n as i32) * t.powi(c.m as i32),
        _ => fourth[0].max(fourth[1]).max(1.0),
    }
}

/// The fifteen moments from raw ones, E[x^n y^m] × weight, about the origin of x and y, which is
/// at `origin`.
fn from_raw(raw: impl Fn(usize, usize) -> f64, origin: [f64; 2]) -> [f64; 15] {
    let binomial = |n: usize, k: usize| [1.0, n as f64, (n * n.saturating_sub(1)) as f64 / 2.0][k];
    let choose = |n: usize, k: usize| binomial(n, k.min(n - k));
    let weight = raw(0, 0);
    let mean = [raw(1, 0) / weight, raw(0, 1) / weight];
    let central = |n: usize, m: usize| {
        let mut sum = 0.0;
        for (i, j) in product(0..=n, 0..=m) {
            let shift = (-mean[0]).powi((n - i) as i32) * (-mean[1]).powi((m - j) as i32);
            sum += choose(n, i) * choose(m, j) * shift * raw(i, j) / weight;
        }
        sum
    };
    let (s, t) = (central(2, 0).sqrt(), central(0, 2).sqrt());
    let r = central(1, 1) / (s * t);
    Component::ALL.map(|c| {
        let Component { n, m } = c;
        let standardised = || central(n, m) / (s.powi(n as i32) * t.powi(m as i32));
        match (n, m) {
            (0, 0) => weight,
            (1, 0) => origin[0] + mean[0],
            (0, 1) => origin[1] + mean[1],
            _ if n + m == 2 => central(n, m),
            (4, 0) | (0, 4) => standardised() - 3.0,
            (3, 1) | (1, 3) => standardised() - 3.0 * r,
            (2, 2) => standardised() - 1.0 - 2.0 * r * r,
            _ => standardised(),
        }
    })
}

/// Asserts that every component is within its uncertainty of what it should be, which itself is
/// good to `known` times the component's scale.
fn assert_within(what: &str, got: &SliceMoments, want: &[f64; 15], known: f64) {
    for c in Component::ALL {
        let e = got.moments.get(c);
        let e = e.unwrap_or_else(|| panic!("{what}: no {c}"));
        let error = (e.value - want[c.index()]).abs();
        let allowed = e.uncertainty + known * scale(&got.moments, c);
        let want = want[c.index()];
        assert!(
            error <= allowed,
            "{what}: {c} is {e:?}, should be {want}: off by {error:e}"
        );
    }
}

/// Asserts that no uncertainty is above the tolerance if the result says it is resolved.
fn assert_tolerance(what: &str, got: &SliceMoments, tolerance: f64) {
    if got.unresolved.is_some() {
        return;
    }
    for c in Component::ALL {
        let e = got.moments.get(c).unwrap();
        let relative = e.uncertainty / scale(&got.moments, c);
        let is_resolved = relative <= tolerance * (1.0 + 1e-12);
        assert!(
            is_resolved,
            "{what}: {c} is resolved to {relative:e}, not to {tolerance:e}"
        );
    }
}
