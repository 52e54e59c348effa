//! What symmetry says of moments, and what they do not depend on.

use super::common::model;
use super::{estimate, estimators, is_random, slice};
use gonio::brdf::Brdf;
use gonio::moments::{Component, Moments, Order};

fn materials() -> Vec<Box<dyn Brdf>> {
    [
        ("ggx", "alpha = 0.4"),
        ("beckmann", "alpha = 0.2"),
        ("phong", "rho_d = 0.3\nrho_s = 0.5\nexponent = 20.0"),
        ("oren-nayar", "sigma_deg = 30.0"),
    ]
    .map(|(kind, text)| model(kind, text))
    .into()
}

/// Asserts that two components agree, or that one is 0, to six uncertainties of a random estimator
/// and to one of the deterministic one.
fn agree(what: &str, moments: &Moments, a: Component, b: Option<Component>, sigmas: f64) {
    let x = moments.get(a).unwrap();
    let y = b.map(|b| moments.get(b).unwrap());
    let (want, more) = y.map_or((0.0, 0.0), |y| (y.value, y.uncertainty));
    let error = (x.value - want).abs();
    let allowed = sigmas * (x.uncertainty + more);
    assert!(
        error <= allowed,
        "{what}: {a} − {b:?}: {error:e} ± {allowed:e}"
    );
}

#[test]
fn what_is_odd_in_phi_vanishes_and_at_the_normal_both_angles_are_alike() {
    let materials = materials();
    let all = materials
        .iter()
        .flat_map(|b| estimators().map(|by| (b, by)));
    for (brdf, by) in all {
        assert!(brdf.symmetry().bilateral);
        let sigmas = if is_random(&*by) { 6.0 } else { 1.0 };
        for theta_deg in [0.0, 1e-3, 20.0, 50.0, 80.0, 89.9] {
            let got = estimate(&**brdf, f64::to_radians(theta_deg), &*by, 6).moments;
            for c in Component::ALL {
                // m(θ, φ)·n = cos θ cos φ: what depends on it alone does not change when the angles change
                // places or signs.
                let at_normal = theta_deg == 0.0;
                if at_normal {
                    let swapped = Component { n: c.m, m: c.n };
                    agree(&by.label(), &got, c, Some(swapped), sigmas);
                }
                if c.is_odd() || at_normal && c.n % 2 == 1 {
                    agree(&by.label(), &got, c, None, sigmas);
                }
            }
            // Not by making everything 0.
            assert!(theta_deg == 0.0 || got.value(1, 0).unwrap().abs() > 1e-6);
        }
    }
}

#[test]
fn only_what_was_asked_for_is_there_and_it_is_the_same() {
    let ggx = model("ggx", "alpha = 0.2");
    for by in estimators() {
        let full = by.estimate(&slice(&*ggx, 0.8), Order::MAX, 8);
        let want = Component::ALL.map(|c| full.moments.get(c).unwrap());
        for order in 0..=4 {
            let order = Order::new(order).unwrap();
            let got = by.estimate(&slice(&*ggx, 0.8), order, 8);
            for c in Component::ALL {
                let e = got.moments.get(c);
                assert_eq!(e.is_some(), c.order() <= order.get(), "{} {c}", by.label());
                let Some(e) = e else { continue };
                let want = want[c.index()];
                // Random points are the same at every order; rectangles are refined for the
                // highest order and differ.
                let allowed = match is_random(&*by) {
                    true => 1e-13,
                    false => e.uncertainty + want.uncertainty,
                };
                let error = (e.value - want.value).abs();
                assert!(error <= allowed, "{} {c}: {error:e}", by.label());
            }
        }
    }
}

#[test]
fn seeds_change_what_is_random_and_nothing_else() {
    let ggx = model("ggx", "alpha = 0.2");
    for by in estimators() {
        let [a, b] = [1, 2].map(|seed| estimate(&*ggx, 0.8, &*by, seed));
        assert_eq!(a != b, is_random(&*by), "{}", by.label());
    }
}
