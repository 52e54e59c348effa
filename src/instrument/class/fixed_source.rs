//! A fixed light, the sample on two axes, a detector on two.

use super::solve::{turn, yaw_and_pitch};
use super::{AxisTemplate, Class, Ends, X, Y, Z};
use crate::geometry::DirectionPair;
use crate::schedule::Positions;
use glam::DMat3;
use std::f64::consts::PI;

/// `fixed-source-4-axis`. The sample holds still while the detector scans the outgoing hemisphere.
pub(super) const CLASS: Class = Class {
    name: "fixed-source-4-axis",
    summary: "light fixed, sample on two axes, detector on two (pgII, NIST STARR)",
    axes: &[
        AxisTemplate::on_base("sample_theta", Y),
        AxisTemplate::on(0, "sample_phi", Z),
        AxisTemplate::on_base("detector_yaw", Y),
        AxisTemplate::on(2, "detector_pitch", X),
    ],
    ends: Ends {
        light: None,
        sensor: Some(3),
        sample: Some(1),
    },
    isotropic_only: false,
    inverse,
};

fn inverse(pair: &DirectionPair, turn_freely: bool, visit: &mut dyn FnMut(Positions)) {
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
}
