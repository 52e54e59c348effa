//! A fixed detector, a source on an arm, the sample on two axes.

use super::solve::{Aligned, align, yaw_and_pitch};
use super::{AxisTemplate, Class, Ends};
use crate::geometry::DirectionPair;
use crate::schedule::Positions;

/// `fixed-detector-3-axis`. The arm stands at twice the difference angle, so that grids in
/// half/difference coordinates need the fewest moves of it.
#[derive(Debug)]
pub(super) struct FixedDetector;

const AXES: [AxisTemplate; 3] = [
    AxisTemplate {
        role: "source_arm",
        parent: None,
        vector: [0.0, 1.0, 0.0],
    },
    AxisTemplate {
        role: "sample_yaw",
        parent: None,
        vector: [0.0, 1.0, 0.0],
    },
    AxisTemplate {
        role: "sample_tilt",
        parent: Some(1),
        vector: [1.0, 0.0, 0.0],
    },
];

impl Class for FixedDetector {
    fn name(&self) -> &'static str {
        "fixed-detector-3-axis"
    }

    fn summary(&self) -> &'static str {
        "source on an arm, sample on two axes, detector fixed; isotropic materials (Cornell)"
    }

    fn axes(&self) -> &'static [AxisTemplate] {
        &AXES
    }

    fn ends(&self) -> Ends {
        Ends {
            light: Some(0),
            sensor: None,
            sample: Some(2),
        }
    }

    fn isotropic_only(&self) -> bool {
        true
    }

    fn inverse(&self, pair: &DirectionPair, _: bool, visit: &mut dyn FnMut(Positions)) {
        let aligned = align(pair.omega_o, pair.omega_i);
        let mirrored = aligned.mirrored();
        for Aligned { angle, sample } in [aligned, mirrored] {
            for [yaw, tilt] in yaw_and_pitch(sample.z_axis) {
                visit([angle, yaw, tilt, 0.0]);
            }
        }
    }
}
