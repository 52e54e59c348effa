//! The lit and the seen spot on the sample.

use crate::geometry::DirectionPair;
use crate::instrument::InstrumentSpec;
use crate::registry::named;

named! {
    /// Relation of the lit and the seen spot.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Filling {
        /// The sensor sees the whole lit spot: the signal follows cos θ_o.
        UnderFilled = "under-filled",
        /// The seen spot lies within the lit one: the signal follows cos θ_i.
        OverFilled = "over-filled",
        /// The one along one axis, the other across: the signal depends on both.
        Mixed = "under-filled one way, over-filled the other",
    }
}

/// Long axes of the two spots on the sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Long axis of the lit spot, mm.
    pub lit_mm: f64,
    /// Long axis of the seen spot, mm.
    pub seen_mm: f64,
    /// Relation of the two spots.
    pub filling: Filling,
}

/// Signal of a diffuse sample relative to that at the normal, over cos θ_i: the seen part of the
/// lit spot.
///
/// The irradiance falls with cos θ_i and the seen area with 1/cos θ_o, of which the sensor collects
/// cos θ_o; light and view overlap along both axes of their ellipses. Over-filled this is 1, and the
/// signal follows cos θ_i; under-filled it follows cos θ_o.
pub fn collected(spec: &InstrumentSpec, pair: &DirectionPair) -> f64 {
    let spot = footprint(spec, pair);
    let across = spec.source.beam_mm.min(spec.detector.view_mm);
    pair.omega_o.cos_theta() * spot.lit_mm.min(spot.seen_mm) / across
}

/// The spots of a pair. A round beam of diameter d meets the sample in an ellipse of axes d / cos θ
/// and d; long axes are compared with each other, and short axes, as if light and sensor were in one
/// plane with the normal.
pub fn footprint(spec: &InstrumentSpec, pair: &DirectionPair) -> Footprint {
    let (beam, view) = (spec.source.beam_mm, spec.detector.view_mm);
    let lit_mm = beam / pair.omega_i.cos_theta();
    let seen_mm = view / pair.omega_o.cos_theta();
    let filling = match (seen_mm >= lit_mm, view >= beam) {
        (true, true) => Filling::UnderFilled,
        (false, false) => Filling::OverFilled,
        (true, false) | (false, true) => Filling::Mixed,
    };
    Footprint {
        lit_mm,
        seen_mm,
        filling,
    }
}
