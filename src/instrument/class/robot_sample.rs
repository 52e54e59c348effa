//! A fixed light, a sensor on a ring, a robot that turns the sample.

use super::solve::{Aligned, align, yaw_and_pitch};
use super::{AxisTemplate, Class, Ends};
use crate::geometry::DirectionPair;
use crate::schedule::Positions;
use glam::DMat3;

/// `robot-sample`. Any pair in or out of the plane of the ring, and any turn about the normal.
#[derive(Debug)]
pub(super) struct RobotSample;

const AXES: [AxisTemplate; 4] = [
    AxisTemplate {
        role: "ring",
        parent: None,
        vector: [0.0, 1.0, 0.0],
    },
    AxisTemplate {
        role: "robot_yaw",
        parent: None,
        vector: [0.0, 1.0, 0.0],
    },
    AxisTemplate {
        role: "robot_pitch",
        parent: Some(1),
        vector: [1.0, 0.0, 0.0],
    },
    AxisTemplate {
        role: "robot_roll",
        parent: Some(2),
        vector: [0.0, 0.0, 1.0],
    },
];

impl Class for RobotSample {
    fn name(&self) -> &'static str {
        "robot-sample"
    }

    fn summary(&self) -> &'static str {
        "light fixed, sensor on a ring, a robot turns the sample (NIST ROSI, PTB)"
    }

    fn axes(&self) -> &'static [AxisTemplate] {
        &AXES
    }

    fn ends(&self) -> Ends {
        Ends {
            light: None,
            sensor: Some(0),
            sample: Some(3),
        }
    }

    fn isotropic_only(&self) -> bool {
        false
    }

    fn inverse(&self, pair: &DirectionPair, turn_freely: bool, visit: &mut dyn FnMut(Positions)) {
        let aligned = align(pair.omega_i, pair.omega_o);
        let mirrored = aligned.mirrored();
        for Aligned { angle, sample } in [aligned, mirrored] {
            for [yaw, pitch] in yaw_and_pitch(sample.z_axis) {
                let roll = if turn_freely {
                    0.0
                } else {
                    // What is left of the tangent when yaw and pitch are taken back.
                    let back = DMat3::from_rotation_x(-pitch) * DMat3::from_rotation_y(-yaw);
                    let t = back * sample.x_axis;
                    super::solve::turn(t.y.atan2(t.x))
                };
                visit([angle, yaw, pitch, roll]);
            }
        }
    }
}
