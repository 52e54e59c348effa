//! Lambert's ideal diffuse reflector.
//!
//! f_r = rho/π for every pair above the horizon, `rho` the albedo in [0, 1].

use super::formula::formula;
use super::shape::{BLACK, Shape, Shaped};
use super::{Channels, Spectrum};
use crate::geometry::DirectionPair;
use std::f64::consts::{FRAC_1_PI, PI};

formula! {
    "lambert": "ideal diffuse reflector, albedo/π", ["albedo = 0.5", "albedo = [1.0, 0.9, 0.2]"]
    /// Lambert's reflector, as a config writes it.
    pub struct LambertSpec {
        /// Albedo.
        albedo: Spectrum = Spectrum::Grey(0.5), in 0.0..=1.0;
    }
    label: [],
    favours: Neither,
    build: |spec, channels| Lambert::new(spec.albedo.clone(), channels),
    fn is_constant(&self) -> bool {
        true
    }
}

/// Lambert's BRDF.
pub type Lambert = Shaped<Flat>;

/// A shape that is 1 at all pairs.
#[derive(Clone, Copy, Debug)]
pub struct Flat;

impl Lambert {
    /// A diffuse reflector of the given albedo.
    pub fn new(albedo: Spectrum, channels: Channels) -> Self {
        Self::on_base(BLACK, (&albedo, FRAC_1_PI), Flat, channels)
    }
}

impl Shape for Flat {
    fn conserves_energy(&self) -> bool {
        true
    }

    #[inline]
    fn value(&self, _pair: &DirectionPair) -> f64 {
        1.0
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        pair.omega_i.cos_theta().max(0.0) / PI
    }
}
