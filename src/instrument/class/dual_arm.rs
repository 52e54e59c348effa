//! Light and sensor on arms of their own, the sample on a turntable.

use super::solve::{turn, yaw_and_pitch};
use super::{AxisTemplate, Class, Ends, X, Y, Z};
use crate::geometry::DirectionPair;
use crate::schedule::Positions;
use glam::DMat3;
use std::f64::consts::PI;

/// `dual-arm-turntable`. Grids in spherical coordinates are its natural ones.
pub(super) const CLASS: Class = Class {
    name: "dual-arm-turntable",
    summary: "light on an arm, sensor on another that tilts, sample on a turntable (UTIA)",
    axes: &[
        AxisTemplate::on_base("turntable", Z),
        AxisTemplate::on_base("light_arm", Y),
        AxisTemplate::on_base("sensor_arm", Y),
        AxisTemplate::on(2, "sensor_tilt", X),
    ],
    ends: Ends {
        light: Some(1),
        sensor: Some(3),
        sample: Some(0),
    },
    isotropic_only: false,
    inverse,
};

fn inverse(pair: &DirectionPair, turn_freely: bool, visit: &mut dyn FnMut(Positions)) {
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
}
