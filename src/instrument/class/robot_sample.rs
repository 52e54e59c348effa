//! A fixed light, a sensor on a ring, a robot that turns the sample.

use super::solve::{Aligned, align, yaw_and_pitch};
use super::{AxisTemplate, Class, Ends, X, Y, Z};
use crate::geometry::DirectionPair;
use crate::schedule::Positions;
use glam::DMat3;

/// `robot-sample`. Any pair in or out of the plane of the ring, and any turn about the normal.
pub(super) const CLASS: Class = Class {
    name: "robot-sample",
    summary: "light fixed, sensor on a ring, a robot turns the sample (NIST ROSI, PTB)",
    axes: &[
        AxisTemplate::on_base("ring", Y),
        AxisTemplate::on_base("robot_yaw", Y),
        AxisTemplate::on(1, "robot_pitch", X),
        AxisTemplate::on(2, "robot_roll", Z),
    ],
    ends: Ends {
        light: None,
        sensor: Some(0),
        sample: Some(3),
    },
    isotropic_only: false,
    inverse,
};

fn inverse(pair: &DirectionPair, turn_freely: bool, visit: &mut dyn FnMut(Positions)) {
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
