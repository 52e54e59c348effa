//! Spherical: elevation and azimuth of each direction.
//!
//! theta_i, phi_i, theta_o, phi_o (rad); isotropic: theta_i, theta_o and the signed
//! delta_phi = phi_i − phi_o. Elevations in [0, π/2]. J = sin theta_i sin theta_o.
//! Degenerate: phi at theta = 0. Every point of the box is above the horizon.

use super::{Azimuth, Chart, Form, ParametrizationSpec, Quantity, Radial, Unit, entry};
use crate::geometry::DirectionPair;
use crate::registry::Entry;
use std::f64::consts::FRAC_PI_2;

/// The spherical chart.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spherical;

/// The registry entry.
pub(super) const ENTRY: Entry<ParametrizationSpec> = entry::<Form<Spherical>>(
    "elevation and azimuth of each direction",
    &[
        "",
        "warp = { theta_i = { kind = \"power\", exponent = 0.7 } }",
    ],
);

impl Chart for Spherical {
    const NAME: &'static str = "spherical";
    const RADIAL: [Radial; 2] = [
        Radial {
            symbol: "theta_i",
            label: "θ_i",
            unit: Unit::Radian,
            max: FRAC_PI_2,
            quantity: Quantity::Angle,
        },
        Radial {
            symbol: "theta_o",
            label: "θ_o",
            unit: Unit::Radian,
            max: FRAC_PI_2,
            quantity: Quantity::Angle,
        },
    ];
    const AZIMUTH: [Azimuth; 2] = [
        Azimuth {
            symbol: "phi_i",
            label: "φ_i",
        },
        Azimuth {
            symbol: "phi_o",
            label: "φ_o",
        },
    ];
    const RELATIVE: Azimuth = Azimuth {
        symbol: "delta_phi",
        label: "Δφ",
    };
    const LIFTED: [&'static str; 2] = ["Δφ", "φ_o"];
    const EXCHANGE: bool = true;
    const NESTED: bool = false;
    const PEAK_AT_START: bool = false;
    const ROUND_TRIP: [f64; 2] = [2e-15; 2];
    const SINGULAR: bool = false;
    const RADIAL_DENSITY: f64 = 1.0;

    #[inline]
    fn absolute(&self, pair: &DirectionPair) -> [f64; 4] {
        let (i, o) = (pair.omega_i, pair.omega_o);
        [i.theta(), i.phi(), o.theta(), o.phi()]
    }

    #[inline]
    fn relative(&self, pair: &DirectionPair) -> [f64; 3] {
        let (i, o) = (pair.omega_i, pair.omega_o);
        let (a, b) = (i.vector(), o.vector());
        // One atan2 of cross and dot: subtracting two azimuths would lose digits near ±π.
        let sin = b.x * a.y - b.y * a.x;
        let cos = a.x * b.x + a.y * b.y;
        [i.theta(), o.theta(), azimuth(sin, cos)]
    }

    #[inline]
    fn inverse(&self, [theta_i, phi_i, theta_o, phi_o]: [f64; 4]) -> Option<DirectionPair> {
        Some(DirectionPair::from_spherical(
            theta_i, phi_i, theta_o, phi_o,
        ))
    }

    #[inline]
    fn lift(&self, [theta_i, theta_o, delta]: [f64; 3]) -> [f64; 4] {
        [theta_i, delta, theta_o, 0.0]
    }

    #[inline]
    fn jacobian(&self, [theta_i, _, theta_o, _]: [f64; 4]) -> f64 {
        theta_i.sin() * theta_o.sin()
    }
}

/// `atan2` that returns 0 for the zero vector whatever the signs of its zeros.
#[inline]
pub(super) fn azimuth(sin: f64, cos: f64) -> f64 {
    (sin + 0.0).atan2(cos + 0.0)
}
