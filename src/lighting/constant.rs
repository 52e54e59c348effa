//! Equal radiance from every direction.

use super::{Lighting, RADIANCE};
use crate::brdf::Spectrum;
use crate::geometry::Direction;

light! {
    "constant": "the same radiance from everywhere", ["", "radiance = [1.0, 0.9, 0.8]"]
    /// Constant light, as a config writes it.
    pub struct ConstantSpec {
        /// Radiance.
        radiance: Spectrum = Spectrum::Grey(1.0), in RADIANCE;
    }
    label: [],
    build: Clone::clone,
}

impl Lighting for ConstantSpec {
    fn radiance(&self, _omega: Direction) -> [f64; 3] {
        self.radiance.rgb()
    }
}
