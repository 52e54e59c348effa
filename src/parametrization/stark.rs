//! Stark's (sigma, alpha) (Stark, Arvo, Smits 2005, eqs. 35-36): squares of the hybrid lengths.
//!
//! sigma = |h_bar|², phi_h, alpha = |k|², phi_k; isotropic: sigma, alpha, delta = phi_k − phi_h.
//! J = 1/(1 − alpha − sigma sin² delta). Squaring costs nothing in digits: both lengths come back
//! with half the relative error of their squares.

use super::hybrid::{Hybrid, inverse_height};
use super::{Azimuth, Chart, Form, ParametrizationSpec, Quantity, Radial, Unit, entry};
use crate::geometry::DirectionPair;
use crate::registry::Entry;

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
        Radial {
            symbol: "sigma",
            label: "σ = |h\u{304}|²",
            unit: Unit::One,
            max: 1.0,
            quantity: Quantity::Other,
        },
        Radial {
            symbol: "alpha",
            label: "α = |k|²",
            unit: Unit::One,
            max: 1.0,
            quantity: Quantity::Other,
        },
    ];
    const AZIMUTH: [Azimuth; 2] = Hybrid::AZIMUTH;
    const RELATIVE: Azimuth = Hybrid::RELATIVE;
    const EXCHANGE: bool = false;
    const NESTED: bool = false;
    const PEAK_AT_START: bool = true;
    const SQUARED: bool = true;

    #[inline]
    fn absolute(&self, pair: &DirectionPair) -> [f64; 4] {
        let [h_bar, phi_h, k, phi_k] = Hybrid.absolute(pair);
        [h_bar * h_bar, phi_h, k * k, phi_k]
    }

    #[inline]
    fn relative(&self, pair: &DirectionPair) -> [f64; 3] {
        let [h_bar, k, delta] = Hybrid.relative(pair);
        [h_bar * h_bar, k * k, delta]
    }

    #[inline]
    fn inverse(&self, [sigma, phi_h, alpha, phi_k]: [f64; 4]) -> Option<DirectionPair> {
        Hybrid.inverse([sigma.sqrt(), phi_h, alpha.sqrt(), phi_k])
    }

    #[inline]
    fn jacobian(&self, [sigma, phi_h, alpha, phi_k]: [f64; 4]) -> f64 {
        inverse_height(sigma.sqrt(), alpha.sqrt(), phi_k - phi_h)
    }
}
