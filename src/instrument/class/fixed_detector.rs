//! A fixed detector, a source on an arm, the sample on two axes.

use super::solve::{Aligned, align, yaw_and_pitch};
use super::{AxisTemplate, Class, Ends, X, Y};
use crate::geometry::DirectionPair;
use crate::schedule::Positions;

/// `fixed-detector-3-axis`. The arm stands at twice the difference angle, so that grids in
/// half/difference coordinates need the fewest moves of it.
pub(super) const CLASS: Class = Class {
    name: "fixed-detector-3-axis",
    summary: "source on an arm, sample on two axes, detector fixed; isotropic materials (Cornell)",
    axes: &[
        AxisTemplate::on_base("source_arm", Y),
        AxisTemplate::on_base("sample_yaw", Y),
        AxisTemplate::on(1, "sample_tilt", X),
    ],
    ends: Ends {
        light: Some(0),
        sensor: None,
        sample: Some(2),
    },
    isotropic_only: true,
    inverse,
};

fn inverse(pair: &DirectionPair, _: bool, visit: &mut dyn FnMut(Positions)) {
    let aligned = align(pair.omega_o, pair.omega_i);
    let mirrored = aligned.mirrored();
    for Aligned { angle, sample } in [aligned, mirrored] {
        for [yaw, tilt] in yaw_and_pitch(sample.z_axis) {
            visit([angle, yaw, tilt, 0.0]);
        }
    }
}
