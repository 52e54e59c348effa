//! Slices whose moments are known: Lambert, and mirrors.

use super::common::{model, near};
use super::{assert_within, estimate, resolving};
use gonio::brdf::{Channels, Lambert, Spectrum};
use gonio::moments::Component;
use std::f64::consts::PI;

/// Of the uniform density on the square: variance π²/12, excess kurtosis −6/5 on the axes.
fn uniform(energy: f64) -> [f64; 15] {
    Component::ALL.map(|c| match (c.n, c.m) {
        (0, 0) => energy,
        (2, 0) | (0, 2) => PI * PI / 12.0,
        (4, 0) | (0, 4) => -1.2,
        _ => 0.0,
    })
}

#[test]
fn lambert_is_the_uniform_density() {
    for albedo in [1e-3, 0.5, 1.0] {
        let lambert = Lambert::new(Spectrum::Grey(albedo), Channels::Luminance);
        let want = uniform(albedo * PI);
        for theta_deg in [
            0.0,
            1e-7,
            1.0,
            30.0,
            45.0,
            60.0,
            80.0,
            89.0,
            89.999,
            89.999_999_f64,
        ] {
            let got = estimate(&lambert, f64::to_radians(theta_deg), &resolving(1e-5), 1);
            for c in Component::ALL {
                let value = got.moments.get(c).unwrap().value;
                let error = (value - want[c.index()]).abs();
                // Rounding of a sum of some 10⁴ terms of order 1.
                near(error, 0.0, 1e-12, (albedo, theta_deg, c));
            }
            assert_within(&format!("at {theta_deg}°"), &got, &want, 0.0);
            assert_eq!(got.unresolved, None);
            assert_eq!((got.missing_share, got.clamped_share), (0.0, 0.0));
        }
    }
}

/// µ_θ + θ_o: how far the mean is from the mirror direction.
fn offset(kind: &str, alpha: f64, theta_o: f64) -> f64 {
    let brdf = model(kind, &format!("alpha = {alpha}"));
    let got = estimate(&*brdf, theta_o, &resolving(1e-8), 1);
    assert_eq!(got.unresolved, None, "{kind} {alpha} at {theta_o}");
    got.moments.mean().unwrap()[0] + theta_o
}

#[test]
fn the_mean_of_a_mirror_is_the_mirror_direction() {
    // Beckmann's tails fall faster than any power: what moves the mean is the next term of every
    // expansion about the peak, α² times a function of the view.
    for theta_o in [0.3, 0.8, 1.3] {
        let over = |alpha: f64| offset("beckmann", alpha, theta_o) / (alpha * alpha);
        let (coarse, fine) = (over(1e-2), over(1e-3));
        // The term after it is α⁴: 1e-4 relative to the first at 1e-2, times a number of order 10
        // to 100 near grazing.
        near(coarse / fine, 1.0, 0.02, (theta_o, coarse, fine));
        assert!(over(1e-2).abs() > 0.01, "{theta_o}");
    }
    // GGX has tails α²/θ_h⁴ at every α, and divides by cos θ_i = cos θ cos φ down to cosines of α:
    // in the corners of the square both angles make a logarithm, so that the offset over α² is a
    // polynomial of degree 2 in ln α. Over equal ratios of α its second differences are equal.
    for theta_o in [0.3, 0.8, 1.3] {
        let over = |alpha: f64| offset("ggx", alpha, theta_o) / (alpha * alpha);
        let [a, b, c, d] = [1e-3, 2.5e-4, 6.25e-5, 1.5625e-5].map(over);
        let (first, second) = (a - 2.0 * b + c, b - 2.0 * c + d);
        // What the next terms, of order α / cos θ_o, leave at 1e-3 and 1.3 rad is 2.5 %.
        near(first / second, 1.0, 0.05, (theta_o, first, second));
        assert!(second.abs() > 0.1, "{theta_o}: {second}");
        let slope = offset("ggx", 1e-5, theta_o) / theta_o;
        assert!(slope.abs() < 1e-7, "{theta_o}: {slope}");
    }
}
