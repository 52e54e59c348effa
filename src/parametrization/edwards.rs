//! The halfway vector disk (Edwards et al. 2006): the projected direction of the light, and the half vector scaled to
//! h' = (ω_i·n / h·n) h, the height of ω_i, of which h' − ω_i lies in the unit disk for every ω_o above the horizon.
//!
//! With h = ω_i + ω_o: (u, v) = (ω_i,z ω_o − ω_o,z ω_i)_xy / h_z. Back: ω_o = 2 (ω_i·h') h' / |h'|² − ω_i, whose height is
//! ω_i,z (1 − u² − v²) / |h'|². The mirror direction is (u, v) = −(ω_i,x, ω_i,y), retro-reflection the centre, the horizon of ω_o
//! the edge; where the light is on the horizon all ω_o above it are the one point −(ω_i,x, ω_i,y). Exchanging light and sensor
//! changes the coordinates: of the two images of a reciprocal BRDF one is the representative, as with all [`Maps`].

use super::{Axis, AxisKind, Coords, Maps, ParametrizationSpec, Quantity, mapped_entry};
use crate::geometry::DirectionPair;
use crate::numeric::{HORIZON_SLACK, safe_sqrt};
use crate::registry::Entry;
use glam::{DVec2, DVec3, Vec3Swizzles};
use std::f64::consts::PI;

/// (ω_i,x, ω_i,y, u, v); isotropic: sin θ_i, and (u, v) along and across the azimuth of ω_i.
pub struct Edwards;

/// The registry entry.
pub(super) const ENTRY: Entry<ParametrizationSpec> = mapped_entry::<Edwards>(
    "projected light, and half vector in the unit disk (Edwards et al.); not reciprocal, slower",
    &["", "warp = {}"],
);

impl Maps for Edwards {
    const KIND: &'static str = "edwards";
    // Of a reciprocal BRDF the steeper direction is the light: near the horizon of the light coordinates crowd.
    const SMALLEST: bool = true;
    const ROUND_TRIP: [f64; 2] = [1e-9, PI];

    fn axes(isotropic: bool) -> Vec<Axis> {
        let axis = |symbol, label| Axis::straight(symbol, label, [-1.0, 1.0]);
        if !isotropic {
            let [x, y] = [axis("omega_i_x", "ω_i,x"), axis("omega_i_y", "ω_i,y")];
            return vec![x, y, axis("u", "u"), axis("v", "v")];
        }
        let sine = Axis {
            range: [0.0, 1.0],
            kind: AxisKind::Radial,
            quantity: Quantity::Length,
            ..axis("sin_theta_i", "sin θ_i")
        };
        vec![sine, axis("u", "u"), axis("v", "v")]
    }

    fn forward(pair: &DirectionPair, isotropic: bool) -> Coords {
        let [i, o] = [pair.omega_i.vector(), pair.omega_o.vector()];
        let height = i.z + o.z;
        let disk = match height > 0.0 {
            true => (o.xy() * i.z - i.xy() * o.z) / height,
            false => -i.xy(),
        };
        if !isotropic {
            return [i.x, i.y, disk.x, disk.y];
        }
        // Under light along the normal only the length of (u, v) has a meaning.
        let along = i.xy().try_normalize();
        let along = along.unwrap_or(disk.normalize_or(DVec2::X));
        let sine = i.xy().length();
        [sine, along.dot(disk), along.perp_dot(disk), 0.0]
    }

    fn inverse(coords: &Coords, isotropic: bool) -> Option<DirectionPair> {
        let [i, h] = light_and_half(coords, isotropic)?;
        let (length2, inside) = (h.length_squared(), 1.0 - (h - i).length_squared());
        let o = h * (2.0 * i.dot(h) / length2) - i;
        // Of light on the horizon the one point holds all ω_o: any is right.
        let o = o.with_z(i.z * inside.max(0.0) / length2).try_normalize();
        let mirror = DVec3::new(-i.x, -i.y, i.z);
        Some(DirectionPair::from_unit([i, o.unwrap_or(mirror)]))
    }

    /// dω_i = d(ω_i,x ω_i,y) / ω_i,z, and dω_o = 4 (ω_o·h) dω_h with dω_h = ω_i,z du dv / |h'|³.
    fn jacobian(coords: &Coords, isotropic: bool) -> Option<f64> {
        let [i, h] = light_and_half(coords, isotropic)?;
        let turn = if isotropic { coords[0] } else { 1.0 };
        Some(4.0 * turn * i.dot(h) / h.length_squared().powi(2))
    }
}

/// ω_i and h' at coordinates; `None` outside the disks, but for rounding.
fn light_and_half(&[a, b, c, d]: &Coords, isotropic: bool) -> Option<[DVec3; 2]> {
    let (xy, disk) = match isotropic {
        true => (DVec2::new(a, 0.0), DVec2::new(b, c)),
        false => (DVec2::new(a, b), DVec2::new(c, d)),
    };
    let [z2, inside] = [xy, disk].map(|v| 1.0 - v.length_squared());
    let is_radius = !isotropic || a >= 0.0;
    let is_inside = z2 >= -HORIZON_SLACK && inside >= -HORIZON_SLACK;
    (is_radius && is_inside).then(|| {
        let i = xy.extend(safe_sqrt(z2));
        [i, i + disk.extend(0.0)]
    })
}
