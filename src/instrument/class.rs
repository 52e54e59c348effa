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

impl AxisTemplate {
    /// An axis on the base.
    const fn on_base(role: &'static str, vector: [f64; 3]) -> Self {
        Self {
            role,
            parent: None,
            vector,
        }
    }

    /// An axis on another one.
    const fn on(parent: usize, role: &'static str, vector: [f64; 3]) -> Self {
        Self {
            role,
            parent: Some(parent),
            vector,
        }
    }
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// Finds every solution for a pair: see [`Class::inverse`].
type Inverse = fn(&DirectionPair, bool, &mut dyn FnMut(Positions));

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
    inverse: Inverse,
}

impl Class {
    /// Every solution for a pair, the preferred one first, angles in (−π, π]; where there is a
    /// whole family (light or sensor on an axis), members of it. If `turn_freely` the pair may be
    /// turned about the normal (the material is isotropic), and an axis that would do so stays at 0.
    pub fn inverse(
        &self,
        pair: &DirectionPair,
        turn_freely: bool,
        visit: &mut dyn FnMut(Positions),
    ) {
        (self.inverse)(pair, turn_freely, visit);
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
    const ALL: [Class; 4] = [
        fixed_detector::CLASS,
        fixed_source::CLASS,
        dual_arm::CLASS,
        robot_sample::CLASS,
    ];
    &ALL
}
