//! Slices of views at any azimuth, of anisotropic materials.

use super::*;
use common::{model, near};
use std::f64::consts::{FRAC_PI_2, PI};

/// Moments of the slice of a view.
fn at(brdf: &dyn Brdf, theta_o: f64, azimuth: f64) -> Moments {
    let slice = slice(brdf, theta_o).at_azimuth(azimuth);
    resolving(1e-5).estimate(&slice, Order::MAX, 1).moments
}

fn lobe(kind: &str, [x, y]: [f64; 2]) -> Box<dyn Brdf> {
    let specular = if kind == "ward" { "rho_d = 0\n" } else { "" };
    model(kind, &format!("{specular}alpha = [{x}, {y}]"))
}

/// A lobe of two roughnesses is the same after a half turn; mirrored in the plane of incidence, what is odd in φ changes sign, so that it
/// vanishes where the view is along an axis of the surface, and nowhere else.
#[test]
fn odd_moments_change_sign_with_the_side_of_the_view() {
    for kind in ["ward", "ggx"] {
        let brdf = lobe(kind, [0.1, 0.25]);
        let of = |azimuth: f64| at(&*brdf, 0.7, azimuth);
        let [one, turned, mirrored] = [0.6, 0.6 + PI, -0.6].map(of);
        for c in Component::ALL {
            let unit = match c.order() {
                0 => one.energy().unwrap(),
                1 | 2 => {
                    let [s, t] = one.sigma().unwrap();
                    s.powi(c.n as i32) * t.powi(c.m as i32)
                }
                _ => 1.0,
            };
            let sign = if c.is_odd() { -1.0 } else { 1.0 };
            let value = |m: &Moments| m.value(c.n, c.m).unwrap() / unit;
            near(value(&turned), value(&one), 1e-4, (kind, c));
            near(value(&mirrored), sign * value(&one), 1e-4, (kind, c));
            if c.is_odd() {
                assert!(value(&one).abs() > 1e-3, "{kind} {c}: {}", value(&one));
                for axis in [0.0, FRAC_PI_2] {
                    near(value(&of(axis)), 0.0, 1e-4, (kind, c));
                }
            }
        }
    }
}

/// A narrow lobe moves by twice the slope along the plane of incidence, and by 2 cos θ_o times that across: its ellipse is that of
/// the slopes, (α_x²/2, α_y²/2) along the axes of the surface, turned by the azimuth of the view and stretched so. Its skewness
/// is as small as the lobe is narrow.
#[test]
fn ellipses_of_narrow_lobes_turn_with_the_surface() {
    let alpha = [0.004, 0.01];
    for kind in ["ward", "beckmann"] {
        let brdf = lobe(kind, alpha);
        for (theta_o, azimuth) in [(0.0, 0.5), (0.6, 0.0), (0.6, 0.4), (1.0, 2.0)] {
            let [tt, tp, pp] = at(&*brdf, theta_o, azimuth).covariance().unwrap();
            let [x, y] = alpha.map(|a| 0.5 * a * a);
            let (s, c) = f64::sin_cos(azimuth);
            let across = 2.0 * theta_o.cos();
            let expected = [
                4.0 * (x * c * c + y * s * s),
                2.0 * across * (y - x) * s * c,
                across * across * (x * s * s + y * c * c),
            ];
            let unit = [expected[0], (expected[0] * expected[2]).sqrt(), expected[2]];
            for ((found, expected), unit) in [tt, tp, pp].into_iter().zip(expected).zip(unit) {
                near(
                    found / unit,
                    expected / unit,
                    2e-3,
                    (kind, theta_o, azimuth),
                );
            }
        }
    }
    // GGX has no such limit: the variance of its slopes grows without end, and what the horizon leaves of it is no ellipse.
    let skewness = |share: f64| {
        let brdf = lobe("ward", [0.02 * share, 0.05 * share]);
        at(&*brdf, 0.7, 0.6).value(2, 1).unwrap()
    };
    let ratio = skewness(1.0) / skewness(0.5);
    assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
}
