//! Kinematic classes: their axes, how these hang from each other, and their inverse kinematics.
//!
//! Lab frame: right-handed, fixed. While every axis stands at 0, the light, the sensor and the
//! sample normal all point along lab z, and the sample's tangent t along lab x. An axis turns what
//! hangs from it by its position about its vector; `light`, `sensor` and `sample` name the axis each
//! end hangs from (`None`: the base).

mod dual_arm;
mod fixed_detector;
mod fixed_source;
mod robot_sample;
mod solve;

use crate::geometry::DirectionPair;
use crate::schedule::Positions;
use std::fmt::Debug;

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

/// A kinematic class: a topology and its inverse kinematics.
pub trait Class: Debug + Send + Sync {
    /// Name in instrument files.
    fn name(&self) -> &'static str;

    /// One-line description for lists.
    fn summary(&self) -> &'static str;

    /// The axes, in the order of [`Positions`]; parents come before their children.
    fn axes(&self) -> &'static [AxisTemplate];

    /// The axes that light, sensor and sample hang from.
    fn ends(&self) -> Ends;

    /// True if the class cannot turn the sample about its normal: it measures a pair up to that
    /// turn, and so isotropic materials only.
    fn isotropic_only(&self) -> bool;

    /// Every solution for a pair, the preferred one first, angles in (−π, π]; where there is a
    /// whole family (light or sensor on an axis), members of it. If `turn_freely` the pair may be
    /// turned about the normal (the material is isotropic), and an axis that would do so stays at 0.
    fn inverse(&self, pair: &DirectionPair, turn_freely: bool, visit: &mut dyn FnMut(Positions));
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
pub fn classes() -> Vec<Box<dyn Class>> {
    vec![
        Box::new(fixed_detector::FixedDetector),
        Box::new(fixed_source::FixedSource),
        Box::new(dual_arm::DualArm),
        Box::new(robot_sample::RobotSample),
    ]
}
