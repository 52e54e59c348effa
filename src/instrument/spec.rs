//! Specification of an instrument: every key of its TOML file, in the units of the file.

mod checks;
#[cfg(feature = "experiments")]
mod origins;

use serde::{Deserialize, Serialize};

/// Name of the fixed base as parent of axes and bodies.
pub(super) const BASE: &str = "base";
/// Name of the light in collisions.
pub(super) const LIGHT: &str = "light";
/// Name of the sensor in collisions.
pub(super) const SENSOR: &str = "sensor";

/// An instrument as its file describes it. Keys that end in `_deg` are degrees, `_mm` millimetres,
/// `_s` seconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstrumentSpec {
    /// Its name in results and files: letters, digits, `-`, `_`.
    pub name: String,
    /// Description in one sentence, for `gonio list`.
    pub about: String,
    /// Name of its kinematic class, see [`classes`](super::classes).
    pub class: String,
    /// Its axes, in the order of the class.
    pub axis: Vec<AxisSpec>,
    /// Further solid parts that a collision can name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body: Vec<BodySpec>,
    /// Limits beside the ranges of its axes.
    #[serde(default)]
    pub limits: LimitsSpec,
    /// Its light.
    pub source: SourceSpec,
    /// Its sensor.
    pub detector: DetectorSpec,
    /// Scan mode, and times beside motion.
    pub timing: TimingSpec,
    /// Reference tile and its readings.
    pub calibration: CalibrationSpec,
    /// Sources of the numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub provenance: Vec<Provenance>,
}

/// A rotation axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSpec {
    /// Its name, unique: letters, digits, `-`, `_`.
    pub name: String,
    /// The axis it is mounted on, or `base`.
    pub parent: String,
    /// Its direction in the frame of its parent while that stands at 0; unit length.
    pub vector: [f64; 3],
    /// Lowest position.
    pub min_deg: f64,
    /// Highest position.
    pub max_deg: f64,
    /// Highest speed, degrees per second.
    pub speed_deg_per_s: f64,
    /// Acceleration and deceleration, degrees per second².
    pub acceleration_deg_per_s2: f64,
    /// Smallest step; positions are rounded to it. 0: none.
    #[serde(default)]
    pub resolution_deg: f64,
    /// Standard deviation of the position from one approach to the next.
    #[serde(default)]
    pub repeatability_deg: f64,
    /// Standard deviation of the offset that every position of one instrument shares.
    #[serde(default)]
    pub bias_deg: f64,
    /// True if the axis turns round without end: it then takes the shorter way. Its range is a
    /// full turn or more.
    #[serde(default)]
    pub wraps: bool,
}

/// A solid part, thin and straight, seen from the sample as one direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// Its name; `light` and `sensor` are taken.
    pub name: String,
    /// The axis it is mounted on, or `base`.
    pub axis: String,
    /// Its direction from the sample while all axes stand at 0; unit length.
    pub direction: [f64; 3],
}

/// Limits of an instrument beside the ranges of its axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LimitsSpec {
    /// Largest angle of the light from the sample normal.
    pub theta_i_max_deg: f64,
    /// Largest angle of the sensor from the sample normal.
    pub theta_o_max_deg: f64,
    /// Smallest angle between light and sensor; closer, one hides the sample from the other.
    pub separation_min_deg: f64,
    /// Parts that must keep apart.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub collision: Vec<CollisionSpec>,
}

impl Default for LimitsSpec {
    fn default() -> Self {
        Self {
            theta_i_max_deg: 90.0,
            theta_o_max_deg: 90.0,
            separation_min_deg: 0.0,
            collision: Vec::new(),
        }
    }
}

/// Two parts that must keep apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CollisionSpec {
    /// `light`, `sensor` or the name of a body.
    pub between: [String; 2],
    /// Smallest angle between them, seen from the sample.
    pub angle_min_deg: f64,
}

/// The light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceSpec {
    /// Half-angle of the disk of directions it shines from, seen from the sample.
    pub half_angle_deg: f64,
    /// Diameter of the beam.
    pub beam_mm: f64,
    /// Standard deviation of its relative change in one hour.
    #[serde(default)]
    pub drift_per_hour: f64,
}

/// The sensor: counts electrons, digitises them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorSpec {
    /// Half-angle of the disk of directions it collects, seen from the sample.
    pub half_angle_deg: f64,
    /// Diameter of the spot it sees, at normal view.
    pub view_mm: f64,
    /// Electrons per second from the reference tile, light and sensor at the normal.
    pub reference_rate: f64,
    /// Electrons at full scale.
    pub full_scale: f64,
    /// Bits of the converter.
    pub bits: u32,
    /// Standard deviation of one reading, electrons.
    pub read_noise: f64,
    /// Electrons per second without light.
    pub dark_rate: f64,
    /// True if light arrives in quanta.
    pub shot_noise: bool,
    /// Exposures of every pose, from the shortest to the longest in equal ratios.
    pub exposures: usize,
    /// The shortest exposure.
    pub exposure_min_s: f64,
    /// The longest exposure.
    pub exposure_max_s: f64,
    /// Share of readings that a fault nobody notices multiplies or divides by 1.5 to 5.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub outliers: f64,
}

fn is_zero(share: &f64) -> bool {
    *share == 0.0
}

/// Scan mode, and times beside motion and exposures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimingSpec {
    /// Stop at every pose, or read while one axis sweeps.
    pub scan: Scan,
    /// Waiting after a move, until vibrations are gone.
    pub settle_s: f64,
    /// Electronics and control, per pose.
    pub overhead_s: f64,
    /// Highest rate of readings in a sweep.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_rate_hz: Option<f64>,
}

/// Scan mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scan {
    /// The arms stop at every pose.
    Stop,
    /// Visits that follow each other along one axis in one direction are read in one sweep.
    Fly,
}

/// Calibration: signals become values relative to a diffuse tile of known reflectance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationSpec {
    /// Reflectance of the tile, its f_r times π.
    pub reflectance: f64,
    /// Relative standard uncertainty of that reflectance.
    pub uncertainty: f64,
    /// Time between two readings of the tile; 0: only one, before the start.
    pub every_minutes: f64,
    /// Time of one reading of the tile.
    pub seconds: f64,
}

/// Source of some numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The keys it is about, e.g. `detector.bits`, `axis.sensor_arm.max_deg`; `*` stands for any
    /// one name or key: `axis.*.speed_deg_per_s`, `timing.*`. Of several entries about a key the
    /// first counts.
    pub fields: Vec<String>,
    /// Kind of source.
    pub tag: Tag,
    /// The publication, or why this value.
    pub source: String,
}

/// Kind of source of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tag {
    /// Read in a publication.
    Published,
    /// Recalled from a publication.
    Recalled,
    /// A usual value for this kind of instrument.
    Generic,
}
