//! Lambert's ideal diffuse reflector.
//!
//! f_r = rho/π for every pair above the horizon, `rho` the albedo in [0, 1].

use super::spectrum::scaled;
use super::{Brdf, BrdfSpec, BuildError, Channels, Presence, SampleBrdf, Spectrum, Tables};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::registry::{self, Entry};
use crate::sampling;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_PI, PI};

const KIND: &str = "lambert";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "ideal diffuse reflector, albedo/π",
    examples: &["albedo = 0.5", "albedo = [1.0, 0.9, 0.2]"],
    read: |table| Ok(Box::new(registry::parse::<LambertSpec>(table)?)),
};

/// Lambert's reflector, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LambertSpec {
    /// Albedo in [0, 1].
    pub albedo: Spectrum,
}

impl Default for LambertSpec {
    fn default() -> Self {
        Self {
            albedo: Spectrum::Grey(0.5),
        }
    }
}

impl BrdfSpec for LambertSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        KIND.into()
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        Ok(self.albedo.check("albedo", 0.0, 1.0, channels)?)
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        Ok(Box::new(Lambert::new(self.albedo.clone(), channels)))
    }

    fn tables(&self) -> Tables {
        Tables::NONE
    }
}

/// Lambert's BRDF.
#[derive(Clone, Debug)]
pub struct Lambert {
    channels: Channels,
    /// rho/π, one a channel.
    value: Vec<f64>,
}

impl Lambert {
    /// A diffuse reflector of the given albedo.
    pub fn new(albedo: Spectrum, channels: Channels) -> Self {
        Self {
            value: scaled(&albedo, &channels, FRAC_1_PI),
            channels,
        }
    }
}

impl Brdf for Lambert {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::FULL
    }

    fn conserves_energy(&self) -> bool {
        true
    }

    fn is_mirrored(&self) -> bool {
        true
    }

    #[inline]
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let on = f64::from(u8::from(pair.is_above_horizon()));
        for (out, value) in out.iter_mut().zip(&self.value) {
            *out = on * value;
        }
        Presence::Present
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        Some(self)
    }
}

impl SampleBrdf for Lambert {
    fn sample(&self, _omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        Some(sampling::cosine_hemisphere(u))
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        pair.omega_i.cos_theta().max(0.0) / PI
    }
}
