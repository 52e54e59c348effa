//! A realised machine: one instrument of its kind, with the offsets and errors that it happens to
//! have.

mod pixels;
mod plan;
mod session;

pub use session::Session;

use super::detector::Detector;
use super::machine::Machine;
use super::motion::Motion;
use super::optics::{Optics, Tolerance};
use super::spec::InstrumentSpec;
use crate::error::ParameterError;
use crate::sampling::{Random, RandomStream};
use crate::schedule::{Itinerary, MAX_AXES, Positions};
use rand_distr::{Distribution, StandardNormal};

/// The parts of an instrument that are simulated. Parts left out cost nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Parts {
    /// True if ranges of axes, collisions and limits of angles are respected.
    pub limits: bool,
    /// True if light and sensor have finite apertures.
    pub apertures: bool,
    /// True if positions, lamp, tile and sensor have errors.
    pub noise: bool,
}

impl Parts {
    /// The whole instrument.
    pub const ALL: Parts = Parts {
        limits: true,
        apertures: true,
        noise: true,
    };
    /// No part beyond axes and motion.
    pub const NONE: Parts = Parts {
        limits: false,
        apertures: false,
        noise: false,
    };

    /// Half-angles of the apertures of source and detector, degrees; 0 without apertures.
    fn half_angles_deg(self, spec: &InstrumentSpec) -> [f64; 2] {
        match self.apertures {
            true => [spec.source.half_angle_deg, spec.detector.half_angle_deg],
            false => [0.0; 2],
        }
    }
}

impl Default for Parts {
    fn default() -> Self {
        Parts::ALL
    }
}

/// An instrument that can plan and measure.
#[derive(Debug)]
pub struct Bench {
    machine: Machine,
    motion: Motion,
    optics: Optics,
    /// Specification, for spots on the sample and for uncertainties.
    spec: InstrumentSpec,
    parts: Parts,
    errors: Option<Errors>,
}

/// Errors of a realisation, drawn once.
#[derive(Debug)]
struct Errors {
    detector: Detector,
    /// Ratio of the tile's reflectance to its certified one.
    tile: f64,
    /// Relative change of the lamp in an hour.
    drift: f64,
    /// Offset of every axis, rad.
    offsets: Positions,
    /// Numbers of the distortion of all its pictures, pixels.
    distortion: [f64; 6],
    /// Apertures for derivatives by position, with a looser tolerance than for values.
    rough: Optics,
}

/// Streams of a realisation. Sample sets take the streams of their seed from 0 on, one per point
/// that is tried; seeds are often equal, and the numbers drawn from them must not be.
const TILE: u64 = 1 << 48;
const DRIFT: u64 = TILE + 1;
const AXES: u64 = TILE + 2;

/// Streams of the distortion of pictures.
const PIXELS: u64 = TILE + 64;

/// Streams of the noise of a session, one per pose.
const NOISE: u64 = 2 << 48;

/// Streams of the errors of a picture, by the number of its first pose.
const PICTURE: u64 = 3 << 48;

/// Tolerance of the averages of a picture. A reading is the mean of 7 to 28 of them, at directions that are known less well.
const OF_PIXELS: Tolerance = Tolerance {
    relative: 2e-2,
    absolute: 1e-12,
    refinement: 500,
};

/// Tolerance of the averages in a derivative: eight of them go into the uncertainty of one reading,
/// which needs no third digit.
const ROUGH: Tolerance = Tolerance {
    relative: 3e-2,
    absolute: 1e-12,
    refinement: 5000,
};

fn normal(stream: &mut RandomStream) -> f64 {
    StandardNormal.sample(stream)
}

impl Bench {
    /// An instrument of a preset. Benches of one `realisation` have the same errors of tile, lamp
    /// and axes; of different ones, independent errors.
    ///
    /// # Errors
    /// As [`InstrumentSpec::check`].
    pub fn new(
        spec: &InstrumentSpec,
        parts: Parts,
        realisation: u64,
    ) -> Result<Self, ParameterError> {
        let mut machine = Machine::new(spec)?;
        if !parts.limits {
            machine = machine.without_limits();
        }
        let motion = Motion::new(spec, &machine);
        let [source, detector] = parts.half_angles_deg(spec).map(f64::to_radians);
        let optics = |tolerance| Optics::new(source, detector, tolerance);
        let camera = machine.camera();
        let errors = parts.noise.then(|| {
            let random = Random::new(realisation);
            let draw = |index: u64| normal(&mut random.stream(index));
            let mut offsets = [0.0; MAX_AXES];
            for (i, axis) in machine.axes().iter().enumerate() {
                offsets[i] = axis.bias * draw(AXES + i as u64);
            }
            Errors {
                detector: Detector::new(spec),
                tile: 1.0 + spec.calibration.uncertainty * draw(TILE),
                drift: spec.source.drift_per_hour * draw(DRIFT),
                offsets,
                distortion: camera
                    .map_or([0.0; 6], |camera| camera.distortion(|k| draw(PIXELS + k))),
                rough: optics(if camera.is_some() { OF_PIXELS } else { ROUGH }),
            }
        });
        Ok(Self {
            optics: optics(match camera {
                Some(_) => OF_PIXELS,
                None => Tolerance::default(),
            }),
            machine,
            motion,
            spec: spec.clone(),
            parts,
            errors,
        })
    }

    /// Its axes and limits.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// A session along an itinerary of this instrument. The noise of a pose depends on the seed and
    /// its number, not on the order of the visits.
    pub fn session<'a>(&'a self, itinerary: &'a Itinerary, seed: u64) -> Session<'a> {
        Session {
            bench: self,
            itinerary,
            seed,
        }
    }
}
