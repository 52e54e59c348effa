//! Kinematic classes: their axes, how these hang from each other, and their inverse kinematics.
//!
//! Lab frame: right-handed, fixed. While every axis stands at 0, the light, the sensor and the
//! sample normal all point along lab z, and the sample's tangent t along lab x. An axis turns what
//! hangs from it by its position about its vector; `light`, `sensor` and `sample` name the axis each
//! end hangs from (`None`: the base).

mod solve;

use crate::geometry::DirectionPair;
use crate::schedule::Positions;
use glam::DMat3;
use solve::{Aligned, align, turn, yaw_and_pitch};
use std::f64::consts::PI;

/// An axis that a class requires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisTemplate {
    /// Name in the class's description; a preset may give another.
    pub role: &'static str,
    /// Number of the axis it is mounted on, `None` for the base.
    pub parent: Option<usize>,
    /// Its unit vector in the frame of its parent while that stands at 0.
    pub vector: [f64; 3],
}

/// An axis on another one, or on the base.
const fn axis(parent: Option<usize>, role: &'static str, vector: [f64; 3]) -> AxisTemplate {
    AxisTemplate {
        role,
        parent,
        vector,
    }
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// A kinematic class: a topology and its inverse kinematics.
#[derive(Clone, Copy, Debug)]
pub struct Class {
    /// Name in instrument files.
    pub name: &'static str,
    /// One-line description for lists.
    pub summary: &'static str,
    /// The axes, in the order of [`Positions`]; parents come before their children.
    pub axes: &'static [AxisTemplate],
    /// The axes that light, sensor and sample hang from.
    pub ends: Ends,
    /// True if the class cannot turn the sample about its normal: it measures a pair up to that
    /// turn, and so isotropic materials only.
    pub isotropic_only: bool,
    /// The axes, if any, that one picture can cover: both of the sample (a sphere of the material before a camera), or both
    /// of the sensor (a mirror around the sample).
    pub imaged: &'static [usize],
    /// Every solution for a pair, the preferred one first, angles in (−π, π]; where there is a
    /// whole family (light or sensor on an axis), members of it. If it may turn freely the pair may be
    /// turned about the normal (the material is isotropic), and an axis that would do so stays at 0.
    pub inverse: fn(pair: &DirectionPair, turn_freely: bool, visit: &mut dyn FnMut(Positions)),
}

impl Class {
    /// True if the sample hangs from the last axis that a picture can cover: then the picture is of a sphere.
    pub(super) fn is_sphere(&self) -> bool {
        !self.imaged.is_empty() && self.imaged.last().copied() == self.ends.sample
    }
}

/// The axes that light, sensor and sample hang from; `None` is the base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// Position of the light's axis in [`Class::axes`].
    pub light: Option<usize>,
    /// Position of the sensor's axis.
    pub sensor: Option<usize>,
    /// Position of the sample's axis.
    pub sample: Option<usize>,
}

/// Every class a preset can name.
pub fn classes() -> &'static [Class] {
    const ALL: [Class; 4] = [FIXED_DETECTOR, FIXED_SOURCE, DUAL_ARM, ROBOT_SAMPLE];
    &ALL
}

/// A fixed detector, a source on an arm, the sample on two axes. The arm stands at twice the difference angle, so that grids in
/// half/difference coordinates need the fewest moves of it.
const FIXED_DETECTOR: Class = Class {
    name: "fixed-detector-3-axis",
    summary: "source on an arm, sample on two axes, detector fixed; isotropic materials (Cornell)",
    axes: &[
        axis(None, "source_arm", Y),
        axis(None, "sample_yaw", Y),
        axis(Some(1), "sample_tilt", X),
    ],
    ends: Ends {
        light: Some(0),
        sensor: None,
        sample: Some(2),
    },
    isotropic_only: true,
    imaged: &[1, 2],
    inverse: |pair, _, visit| {
        for Aligned { angle, sample } in align(pair.omega_o, pair.omega_i) {
            for [yaw, tilt] in yaw_and_pitch(sample.z_axis) {
                visit([angle, yaw, tilt, 0.0]);
            }
        }
    },
};

/// A fixed light, the sample on two axes, a detector on two. The sample holds still while the detector scans the outgoing
/// hemisphere.
const FIXED_SOURCE: Class = Class {
    name: "fixed-source-4-axis",
    summary: "light fixed, sample on two axes, detector on two (pgII, NIST STARR)",
    axes: &[
        axis(None, "sample_theta", Y),
        axis(Some(0), "sample_phi", Z),
        axis(None, "detector_yaw", Y),
        axis(Some(2), "detector_pitch", X),
    ],
    ends: Ends {
        light: None,
        sensor: Some(3),
        sample: Some(1),
    },
    isotropic_only: false,
    imaged: &[2, 3],
    inverse: |pair, turn_freely, visit| {
        let theta_i = pair.omega_i.theta();
        // A sample tilted by theta > 0 and not turned sees the fixed light at azimuth π. Light at
        // the normal has no azimuth: the sample need not turn.
        let phi_i = match pair.omega_i.sin_theta() {
            0.0 => PI,
            _ => pair.omega_i.phi(),
        };
        for (theta, own) in [(theta_i, PI), (-theta_i, 0.0)] {
            // To the lab: first about the normal, which the sample does unless it may stay.
            let about_normal = own - phi_i;
            let lab = DMat3::from_rotation_y(theta) * DMat3::from_rotation_z(about_normal);
            let phi = if turn_freely { 0.0 } else { turn(about_normal) };
            for [yaw, pitch] in yaw_and_pitch(lab * pair.omega_o.vector()) {
                visit([turn(theta), phi, yaw, pitch]);
            }
        }
    },
};

/// Light and sensor on arms of their own, the sample on a turntable. Grids in spherical coordinates are its natural ones.
const DUAL_ARM: Class = Class {
    name: "dual-arm-turntable",
    summary: "light on an arm, sensor on another that tilts, sample on a turntable (UTIA)",
    axes: &[
        axis(None, "turntable", Z),
        axis(None, "light_arm", Y),
        axis(None, "sensor_arm", Y),
        axis(Some(2), "sensor_tilt", X),
    ],
    ends: Ends {
        light: Some(1),
        sensor: Some(3),
        sample: Some(0),
    },
    isotropic_only: false,
    imaged: &[],
    inverse: |pair, turn_freely, visit| {
        let (theta_i, phi_i) = (pair.omega_i.theta(), pair.omega_i.phi());
        for (light, own) in [(theta_i, 0.0), (-theta_i, PI)] {
            // The azimuth at which the arm holds the light, less the one it is to have.
            let about_normal = own - phi_i;
            let sensor = DMat3::from_rotation_z(about_normal) * pair.omega_o.vector();
            let table = if turn_freely { 0.0 } else { turn(about_normal) };
            for [arm, tilt] in yaw_and_pitch(sensor) {
                visit([table, turn(light), arm, tilt]);
            }
        }
    },
};

/// A fixed light, a sensor on a ring, a robot that turns the sample: any pair in or out of the plane of the ring, and any turn
/// about the normal.
const ROBOT_SAMPLE: Class = Class {
    name: "robot-sample",
    summary: "light fixed, sensor on a ring, a robot turns the sample (NIST ROSI, PTB)",
    axes: &[
        axis(None, "ring", Y),
        axis(None, "robot_yaw", Y),
        axis(Some(1), "robot_pitch", X),
        axis(Some(2), "robot_roll", Z),
    ],
    ends: Ends {
        light: None,
        sensor: Some(0),
        sample: Some(3),
    },
    isotropic_only: false,
    imaged: &[],
    inverse: |pair, turn_freely, visit| {
        for Aligned { angle, sample } in align(pair.omega_i, pair.omega_o) {
            for [yaw, pitch] in yaw_and_pitch(sample.z_axis) {
                let roll = if turn_freely {
                    0.0
                } else {
                    // What is left of the tangent when yaw and pitch are taken back.
                    let back = DMat3::from_rotation_x(-pitch) * DMat3::from_rotation_y(-yaw);
                    let t = back * sample.x_axis;
                    turn(t.y.atan2(t.x))
                };
                visit([angle, yaw, pitch, roll]);
            }
        }
    },
};
