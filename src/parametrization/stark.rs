//! Stark's (sigma, alpha) (Stark, Arvo, Smits 2005, eqs. 35-36): squares of the hybrid lengths.
//!
//! sigma = |h_bar|², phi_h, alpha = |k|², phi_k; isotropic: sigma, alpha, delta = phi_k − phi_h.
//! J = 1/(1 − alpha − sigma sin² delta). Squaring costs nothing in digits: both lengths come back
//! with half the relative error of their squares.

use super::hybrid::{Hybrid, inverse_height};
use super::{Chart, Unit};
use crate::geometry::DirectionPair;

/// Stark's chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stark;

impl Chart for Stark {
    const NAME: &'static str = "stark";
    const RADIAL: [(&'static str, Unit, f64); 2] =
        [("sigma", Unit::One, 1.0), ("alpha", Unit::One, 1.0)];
    const AZIMUTH: [&'static str; 2] = ["phi_h", "phi_k"];
    const RELATIVE: &'static str = "delta";
    const EXCHANGE: bool = false;
    const NESTED: bool = false;
    const PEAK_AT_START: bool = true;

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
