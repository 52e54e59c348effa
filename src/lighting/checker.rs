//! A pattern of bright and dark fields between circles of latitude and meridians.

use super::{Lighting, RADIANCE};
use crate::brdf::{Limited, Spectrum};
use crate::error::{ParameterError, left_open};
use crate::geometry::Direction;

light! {
    "checker": "bright and dark fields of equal angles, which show blur and warp", [
        "",
        "step_deg = 10\ndark = 0.1",
    ]
    /// A checker pattern, as a config writes it.
    pub struct CheckerSpec {
        /// Height and width of a field, degrees; 180 divided by it is a whole number.
        step_deg: f64 = 15.0, in left_open(0.0, 180.0), check whole_fields;
        /// Radiance of bright fields; the one at the zenith and azimuth 0 is bright.
        bright: Spectrum = Spectrum::Grey(1.0), in RADIANCE;
        /// Radiance of dark fields.
        dark: Spectrum = Spectrum::Grey(0.05), in RADIANCE;
    }
    label: [step_deg],
    build: Clone::clone,
}

/// Otherwise two fields of one colour would meet at azimuth 0.
fn whole_fields(spec: &CheckerSpec) -> Result<(), ParameterError> {
    let fields = 180.0 / spec.step_deg;
    if (fields - fields.round()).abs() > 1e-9 * fields {
        let allowed = "180 divided by a whole number";
        return Err(ParameterError::new("step_deg", spec.step_deg, allowed));
    }
    Ok(())
}

impl Lighting for CheckerSpec {
    fn radiance(&self, omega: Direction) -> [f64; 3] {
        let step = self.step_deg.to_radians();
        let field = (omega.theta() / step).floor() + (omega.phi() / step).floor();
        let is_bright = field.rem_euclid(2.0) == 0.0;
        if is_bright { &self.bright } else { &self.dark }.rgb()
    }
}
