//! Stark's (sigma, alpha) (Stark, Arvo, Smits 2005, eqs. 35-36): squares of the hybrid lengths.
//!
//! sigma = |h_bar|², phi_h, alpha = |k|², phi_k; isotropic: sigma, alpha, delta = phi_k − phi_h.
//! J = 1/(1 − alpha − sigma sin² delta). Squaring costs nothing in digits: both lengths come back
//! with half the relative error of their squares.

use super::hybrid::{Hybrid, inverse_height};
use super::{Azimuth, Chart, Form, ParametrizationSpec, Quantity, Radial, entry};
use crate::registry::Entry;
use glam::DVec3;

/// Stark's chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stark;

/// The registry entry.
pub(super) const ENTRY: Entry<ParametrizationSpec> = entry::<Form<Stark>>(
    "squares of the hybrid lengths, sigma and alpha (Stark et al.)",
    &[
        "",
        "warp = { sigma = { kind = \"power\", exponent = 0.25 } }",
    ],
);

impl Chart for Stark {
    const NAME: &'static str = "stark";
    const RADIAL: [Radial; 2] = [
        Radial::length("sigma", "σ = |h\u{304}|²", Quantity::Other),
        Radial::length("alpha", "α = |k|²", Quantity::Other),
    ];
    const AZIMUTH: [Azimuth; 2] = Hybrid::AZIMUTH;
    const RELATIVE: Azimuth = Hybrid::RELATIVE;
    const EXCHANGE: bool = false;
    const NESTED: bool = false;
    const PEAK_AT_START: bool = true;
    const SQUARED: bool = true;

    #[inline(always)]
    fn absolute(directions: [DVec3; 2]) -> [f64; 4] {
        let [h_bar, phi_h, k, phi_k] = Hybrid::absolute(directions);
        [h_bar * h_bar, phi_h, k * k, phi_k]
    }

    #[inline(always)]
    fn relative(directions: [DVec3; 2]) -> [f64; 3] {
        let [h_bar, k, delta] = Hybrid::relative(directions);
        [h_bar * h_bar, k * k, delta]
    }

    #[inline(always)]
    fn inverse([sigma, phi_h, alpha, phi_k]: [f64; 4]) -> ([DVec3; 2], bool) {
        Hybrid::inverse([sigma.sqrt(), phi_h, alpha.sqrt(), phi_k])
    }

    #[inline]
    fn jacobian([sigma, phi_h, alpha, phi_k]: [f64; 4]) -> f64 {
        inverse_height(sigma.sqrt(), alpha.sqrt(), phi_k - phi_h)
    }
}
