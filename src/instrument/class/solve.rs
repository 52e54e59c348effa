//! Solutions that the inverse kinematics of the classes share.

use crate::geometry::{Direction, DirectionPair};
use crate::numeric::wrap_angle;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// A sample turned so that one arm stands on lab z and the other in the x–z plane.
pub(super) struct Aligned {
    /// Position of the moving arm, rad: the angle between the arms, with either sign.
    pub(super) angle: f64,
    /// From the sample's frame to the lab: its columns are the tangent, the bitangent, the normal.
    pub(super) sample: DMat3,
}

/// Turns the sample until `fixed` is lab z and `arm` is z turned by the angle between them about y; and then all by π about lab
/// z, so that the arm is at minus that angle.
///
/// Half and back vector, h and k = (`arm` − `fixed`)/2, are then z and x turned by half that angle
/// about y, and h × k is y. Two right-handed frames laid on each other, so that no pair comes out
/// as its mirror image.
pub(super) fn align(fixed: Direction, arm: Direction) -> [Aligned; 2] {
    let (h, k) = DirectionPair::new(arm, fixed).half_and_back();
    let (cos, sin) = (h.length(), k.length());
    let theta_d = sin.atan2(cos);
    let (h, k) = if cos >= sin {
        let h = h / cos;
        (h, perpendicular(k, h))
    } else {
        let k = k / sin;
        (perpendicular(h, k), k)
    };
    let local = DMat3::from_cols(k, h.cross(k), h);
    let (angle, sample) = (
        2.0 * theta_d,
        DMat3::from_rotation_y(theta_d) * local.transpose(),
    );
    let turned = |v: DVec3| DVec3::new(-v.x, -v.y, v.z);
    let [x, y, z] = [sample.x_axis, sample.y_axis, sample.z_axis].map(turned);
    let mirrored = Aligned {
        angle: turn(-angle),
        sample: DMat3::from_cols(x, y, z),
    };
    [Aligned { angle, sample }, mirrored]
}

/// `v` made perpendicular to `unit` and of unit length. Where `v` has no direction (arms on each
/// other, or opposed), the sample normal stands in for it, and where that lies along `unit` the
/// tangent: then nothing turns that need not.
fn perpendicular(v: DVec3, unit: DVec3) -> DVec3 {
    let across = |v: DVec3| v - unit * v.dot(unit);
    for v in [v, DVec3::Z] {
        let Some(v) = Direction::try_new(v) else {
            continue;
        };
        let once = across(v.vector());
        // Less is rounding. Once more, for what rounding left along `unit`.
        if once.length_squared() > 1e-12 {
            return across(once.normalize()).normalize();
        }
    }
    across(across(DVec3::X).normalize()).normalize()
}

/// Both ways to make `v` from z: by `pitch` about x, then by `yaw` about y; as `[yaw, pitch]`.
pub(super) fn yaw_and_pitch(v: DVec3) -> [[f64; 2]; 2] {
    // `+ 0.0` turns −0 into +0: atan2(±0, −0) would be ±π.
    let yaw = turn((v.x + 0.0).atan2(v.z + 0.0));
    let pitch = (0.0 - v.y).atan2(v.x.hypot(v.z));
    [[yaw, pitch], [turn(yaw + PI), turn(PI - pitch)]]
}

/// The angle in (−π, π] that is the same position.
pub(super) fn turn(angle: f64) -> f64 {
    let angle = wrap_angle(angle) + 0.0;
    if angle <= -PI { PI } else { angle }
}
