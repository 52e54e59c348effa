//! Truncated Gaussians: products against closed forms, correlated ones against a closed form in
//! one angle and a quadrature in the other.

use super::common::{near, product};
use super::{assert_tolerance, assert_within, estimate, from_raw, planar, resolving};
use gonio::sampling::gauss_legendre;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

/// exp(−x²/2).
fn bell(x: f64) -> f64 {
    (-0.5 * x * x).exp()
}

/// ∫ x^k exp(−x²/2) over [a, b], k = 0 to 4.
pub fn truncated(a: f64, b: f64) -> [f64; 5] {
    // The tail that both ends share must not be subtracted from 1.
    let root = (PI / 2.0).sqrt();
    let zero = if a > 0.0 {
        libm::erfc(a * FRAC_1_SQRT_2) - libm::erfc(b * FRAC_1_SQRT_2)
    } else if b < 0.0 {
        libm::erfc(-b * FRAC_1_SQRT_2) - libm::erfc(-a * FRAC_1_SQRT_2)
    } else {
        libm::erf(b * FRAC_1_SQRT_2) - libm::erf(a * FRAC_1_SQRT_2)
    };
    let mut m = [root * zero, bell(a) - bell(b), 0.0, 0.0, 0.0];
    for k in 2..5 {
        // By parts.
        let power = k as i32 - 1;
        let ends = a.powi(power) * bell(a) - b.powi(power) * bell(b);
        m[k] = (k as f64 - 1.0) * m[k - 2] + ends;
    }
    m
}

/// The ends of the square in units of the width from the centre.
pub fn ends(centre: f64, width: f64) -> [f64; 2] {
    [(-FRAC_PI_2 - centre) / width, (FRAC_PI_2 - centre) / width]
}

/// Asserts a Gaussian of the given centre, widths and correlation; `want` in units of the widths
/// about the centre.
fn check(centre: [f64; 2], width: [f64; 2], r: f64, raw: &[[f64; 5]; 5]) {
    let f = move |angles: [f64; 2]| {
        let [x, y] = [0, 1].map(|i| (angles[i] - centre[i]) / width[i]);
        Some((-0.5 * (x * x - 2.0 * r * x * y + y * y) / ((1.0 - r) * (1.0 + r))).exp())
    };
    let brdf = planar(f);
    let powers = |w: f64, n: usize| w.powi(n as i32 + 1);
    let unit = |n: usize, m: usize| raw[n][m] * powers(width[0], n) * powers(width[1], m);
    let want = from_raw(unit, centre);
    for tolerance in [1e-3, 1e-6, 1e-9] {
        // The view whose mirror direction, or the view itself, is at the centre.
        let got = estimate(&brdf, centre[0].abs(), &resolving(tolerance), 1);
        let what = format!("centre {centre:?} width {width:?} r {r} tolerance {tolerance:e}");
        // Closed forms lose a digit or two to cancellation where the widths exceed the square.
        assert_within(&what, &got, &want, 1e-12);
        assert_tolerance(&what, &got, tolerance);
        assert_eq!(got.unresolved, None, "{what}");
    }
}

#[test]
fn products_of_gaussians_have_their_closed_forms() {
    let widths = [1e-4_f64, 1e-2, 0.3, 2.0];
    let centres = product([-FRAC_PI_2 + 1e-4, -1.2, 0.0, 0.7], [0.0, 0.6, 1.5]);
    for ((theta, phi), (w, v)) in product(centres, product(widths, widths)) {
        // Away from the plane of incidence no rule has nodes near a lobe: the gaps between the
        // first nodes are 1.6° wide.
        if phi > 0.0 && w.min(v) < 0.05 {
            continue;
        }
        let ([a, b], [c, d]) = (ends(theta, w), ends(phi, v));
        let (x, y) = (truncated(a, b), truncated(c, d));
        check([theta, phi], [w, v], 0.0, &x.map(|x| y.map(|y| x * y)));
    }
}

/// ∬ x^n y^m exp(−(x² − 2 r x y + y²)/(2(1 − r²))): closed in y, where it is a Gaussian about r x
/// of width √(1 − r²), by panels of 20 nodes in x.
fn correlated([a, b]: [f64; 2], [c, d]: [f64; 2], r: f64) -> [[f64; 5]; 5] {
    let narrow = ((1.0 - r) * (1.0 + r)).sqrt();
    // Beyond 12 the Gaussian is below 1e-31.
    let (lo, hi) = (a.max(-12.0), b.min(12.0));
    let panels = ((hi - lo) / 0.25).ceil();
    let half = 0.5 * (hi - lo) / panels;
    let rule = gauss_legendre(20);
    let mut raw = [[0.0; 5]; 5];
    for (panel, &(t, w)) in product(0..panels as usize, &rule) {
        let x = lo + half * (2.0 * panel as f64 + 1.0 + t);
        let z = truncated((c - r * x) / narrow, (d - r * x) / narrow);
        let z: [f64; 5] = std::array::from_fn(|k| z[k] * narrow.powi(k as i32 + 1));
        // y = r x + z.
        let s = r * x;
        let y = [
            z[0],
            z[1] + s * z[0],
            z[2] + 2.0 * s * z[1] + s * s * z[0],
            z[3] + 3.0 * s * z[2] + 3.0 * s * s * z[1] + s.powi(3) * z[0],
            z[4] + 4.0 * s * z[3] + 6.0 * s * s * z[2] + 4.0 * s.powi(3) * z[1] + s.powi(4) * z[0],
        ];
        for (n, m) in product(0..5, 0..5) {
            raw[n][m] += half * w * bell(x) * x.powi(n as i32) * y[m];
        }
    }
    raw
}

#[test]
fn correlated_gaussians_agree_with_a_quadrature() {
    for (centre, width) in [
        ([-0.9, 0.0], [1e-4, 1e-4]),
        ([-0.9, 0.0], [1e-3, 1e-2]),
        ([-0.4, 0.0], [0.1, 0.1]),
        ([-1.5, 0.0], [0.1, 0.3]),
        ([0.5, -1.2], [0.4, 0.2]),
        ([-1.4, 1.4], [1.0, 2.0]),
    ] {
        for r in [-0.9, 0.5, 0.99] {
            let [x, y] = [0, 1].map(|i| ends(centre[i], width[i]));
            check(centre, width, r, &correlated(x, y, r));
        }
    }
    // Untruncated, every standardised moment is that of a normal distribution: all excess is 0,
    // which holds for (3, 1), (1, 3) and (2, 2) only if 3r and 1 + 2r² are subtracted.
    let raw = correlated([-50.0, 50.0], [-50.0, 50.0], 0.8);
    let moments = from_raw(|n, m| raw[n][m], [0.0; 2]);
    assert!(moments[6..].iter().all(|m| m.abs() < 1e-12), "{moments:?}");
    near(moments[4], 0.8, 1e-13, "correlation");
}
