//! Light and sensor on arms of their own, the sample on a turntable.

use super::solve::{turn, yaw_and_pitch};
use super::{AxisTemplate, Class, Ends};
use crate::geometry::DirectionPair;
use crate::schedule::Positions;
use glam::DMat3;
use std::f64::consts::PI;

/// `dual-arm-turntable`. Grids in spherical coordinates are its natural ones.
#[derive(Debug)]
pub(super) struct DualArm;

const AXES: [AxisTemplate; 4] = [
    AxisTemplate {
        role: "turntable",
        parent: None,
        vector: [0.0, 0.0, 1.0],
    },
    AxisTemplate {
        role: "light_arm",
        parent: None,
        vector: [0.0, 1.0, 0.0],
    },
    AxisTemplate {
        role: "sensor_arm",
        parent: None,
        vector: [0.0, 1.0, 0.0],
    },
    AxisTemplate {
        role: "sensor_tilt",
        parent: Some(2),
        vector: [1.0, 0.0, 0.0],
    },
];

impl Class for DualArm {
    fn name(&self) -> &'static str {
        "dual-arm-turntable"
    }

    fn summary(&self) -> &'static str {
        "light on an arm, sensor on another that tilts, sample on a turntable (UTIA)"
    }

    fn axes(&self) -> &'static [AxisTemplate] {
        &AXES
    }

    fn ends(&self) -> Ends {
        Ends {
            light: Some(1),
            sensor: Some(3),
            sample: Some(0),
        }
    }

    fn isotropic_only(&self) -> bool {
        false
    }

    fn inverse(&self, pair: &DirectionPair, turn_freely: bool, visit: &mut dyn FnMut(Positions)) {
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
}
