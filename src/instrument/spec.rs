//! Specification of an instrument: every key of its TOML file, in the units of the file.

mod checks;
#[cfg(feature = "experiments")]
mod origins;

use crate::error::ParameterError;
use crate::measurement::WIDEST_DEG;
use crate::registry::keys;
use serde::{Deserialize, Serialize};

/// Name of the fixed base as parent of axes and bodies.
pub(super) const BASE: &str = "base";
/// Name of the light in collisions.
pub(super) const LIGHT: &str = "light";
/// Name of the sensor in collisions.
pub(super) const SENSOR: &str = "sensor";

/// A table of an instrument file: its keys, the check of each that is a number by a function of [`checks`], and what must hold
/// of it and those before together.
macro_rules! part {
    (
        $(#[$about:meta])*
        pub struct $Name:ident {
            $(
                $(#[$attribute:meta])*
                $key:ident: $type:ty $(, $check:ident($($limit:expr),*))? $(=> $then:ident)?;
            )*
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $Name {
            $($(#[$attribute])* pub $key: $type,)*
        }

        impl $Name {
            /// Checks every number of the table at `path`.
            fn check(&self, path: &str) -> Result<(), ParameterError> {
                $(
                    $(checks::$check(&format!("{path}.{}", stringify!($key)), self.$key, $($limit),*)?;)?
                    $(self.$then(path)?;)?
                )*
                Ok(())
            }
        }
    };
}

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
    /// What it reads at a stop, if axes are imaged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<PictureSpec>,
    /// Sources of the numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub provenance: Vec<Provenance>,
}

part! {
    /// A rotation axis.
    pub struct AxisSpec {
        /// Its name, unique: letters, digits, `-`, `_`.
        name: String;
        /// The axis it is mounted on, or `base`.
        parent: String;
        /// Its direction in the frame of its parent while that stands at 0; unit length.
        vector: [f64; 3];
        /// Lowest position.
        min_deg: f64, finite();
        /// Highest position.
        max_deg: f64, finite() => check_range;
        /// Highest speed, degrees per second.
        speed_deg_per_s: f64, above();
        /// Acceleration and deceleration, degrees per second².
        acceleration_deg_per_s2: f64, above();
        /// Smallest step; positions are rounded to it. 0: none.
        #[serde(default)]
        resolution_deg: f64, in_closed(0.0, WIDEST_DEG);
        /// Standard deviation of the position from one approach to the next.
        #[serde(default)]
        repeatability_deg: f64, in_closed(0.0, WIDEST_DEG);
        /// Standard deviation of the offset that every position of one instrument shares.
        #[serde(default)]
        bias_deg: f64, in_closed(0.0, WIDEST_DEG);
        /// True if the axis turns round without end: it then takes the shorter way. Its range is a
        /// full turn or more.
        #[serde(default)]
        wraps: bool;
        /// True if a picture covers the axis: poses that differ in it alone share a stop.
        #[serde(default, skip_serializing_if = "is_false")]
        imaged: bool;
    }
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

keys! {
    /// Limits of an instrument beside the ranges of its axes.
    #[derive(PartialEq)]
    pub struct LimitsSpec {
        /// Largest angle of the light from the sample normal.
        theta_i_max_deg: f64 = 90.0;
        /// Largest angle of the sensor from the sample normal.
        theta_o_max_deg: f64 = 90.0;
        /// Smallest angle between light and sensor; closer, one hides the sample from the other.
        separation_min_deg: f64 = 0.0;
        /// Parts that must keep apart.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        collision: Vec<CollisionSpec> = Vec::new();
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

part! {
    /// The light.
    pub struct SourceSpec {
        /// Half-angle of the disk of directions it shines from, seen from the sample.
        half_angle_deg: f64, in_closed(0.0, WIDEST_DEG);
        /// Diameter of the beam.
        beam_mm: f64, above();
        /// Standard deviation of its relative change in one hour.
        #[serde(default)]
        drift_per_hour: f64, at_least_0();
    }
}

part! {
    /// The sensor: counts electrons, digitises them.
    pub struct DetectorSpec {
        /// Half-angle of the disk of directions it collects, seen from the sample.
        half_angle_deg: f64, in_closed(0.0, WIDEST_DEG);
        /// Diameter of the spot it sees, at normal view.
        view_mm: f64, above();
        /// Electrons per second from the reference tile, light and sensor at the normal.
        reference_rate: f64, above();
        /// Electrons at full scale.
        full_scale: f64, above();
        /// Bits of the converter.
        bits: u32, counted(32);
        /// Standard deviation of one reading, electrons.
        read_noise: f64, at_least_0();
        /// Electrons per second without light.
        dark_rate: f64, at_least_0();
        /// True if light arrives in quanta.
        shot_noise: bool;
        /// Exposures of every pose, from the shortest to the longest in equal ratios.
        exposures: usize, counted(32);
        /// The shortest exposure.
        exposure_min_s: f64, above();
        /// The longest exposure.
        exposure_max_s: f64, above();
        /// Share of readings that an unreported fault multiplies or divides by 1.5 to 5.
        #[serde(default, skip_serializing_if = "is_zero")]
        outliers: f64, in_closed(0.0, 1.0) => check_exposures;
    }
}

impl PictureSpec {
    /// True if camera or lamp are so near that directions vary over a picture: readings then lie on no lattice.
    pub(crate) fn is_near(&self) -> bool {
        self.camera_radii > 0.0 || self.lamp_radii > 0.0
    }
}

fn is_zero(share: &f64) -> bool {
    *share == 0.0
}

fn is_false(value: &bool) -> bool {
    !value
}

part! {
    /// The picture that an instrument with imaged axes takes at a stop. Exposures, full scale and bits are those of the
    /// detector, which is one pixel.
    pub struct PictureSpec {
        /// Radius of the picture of the sphere, or of the hemisphere in a mirror, pixels.
        radius_px: f64, radius();
        /// Distance of the camera from the centre of the sphere, radii of the sphere; 0: far.
        #[serde(default)]
        camera_radii: f64, distance();
        /// The same of the lamp.
        #[serde(default)]
        lamp_radii: f64, distance();
        /// Largest radius of the disk of pixels that a reading is the mean of, pixels.
        patch_px: f64, above();
        /// Standard deviation of the centre of all pictures of one instrument, pixels, in either direction.
        #[serde(default)]
        centre_px: f64, at_least_0();
        /// Standard deviation of the linear distortion of all pictures of one instrument, pixels at `radius_px`, in either direction.
        #[serde(default)]
        map_px: f64, at_least_0();
        /// Standard deviation of the direction of the light of one picture, degrees, in either direction.
        #[serde(default)]
        lamp_deg: f64, in_closed(0.0, WIDEST_DEG);
        /// Relative standard deviation of the scale of one picture.
        #[serde(default)]
        scale: f64, below(1.0);
        /// Positions of each axis that is not imaged that differ by no more are one stop, degrees.
        same_stop_deg: f64, in_closed(0.0, 1.0);
    }
}

part! {
    /// Scan mode, and times beside motion and exposures.
    pub struct TimingSpec {
        /// Stop at every pose, or read while one axis sweeps.
        scan: Scan;
        /// Waiting after a move, until vibrations are gone.
        settle_s: f64, at_least_0();
        /// Electronics and control, per pose.
        overhead_s: f64, at_least_0();
        /// Highest rate of readings in a sweep.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        sample_rate_hz: Option<f64> => check_rate;
    }
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

part! {
    /// Calibration: signals become values relative to a diffuse tile of known reflectance.
    pub struct CalibrationSpec {
        /// Reflectance of the tile, its f_r times π.
        reflectance: f64, in_left_open(0.0, 1.0);
        /// Relative standard uncertainty of that reflectance.
        uncertainty: f64, below(1.0);
        /// Time between two readings of the tile; 0: only one, before the start.
        every_minutes: f64, at_least_0();
        /// Time of one reading of the tile.
        seconds: f64, at_least_0();
    }
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
