//! Where a view that moves stands.

use super::Along;
use std::f64::consts::{FRAC_PI_2, PI};

/// A view after it moved by t, and how it goes on from there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// The way t, rad.
    pub t: f64,
    /// Elevation of the view, rad, ≥ 0.
    pub theta_o: f64,
    /// Azimuth of the view, rad.
    pub phi_o: f64,
    /// First and second derivative of the elevation by t.
    pub elevation: [f64; 2],
    /// Derivative of the azimuth by t.
    pub turn: f64,
}

impl Along {
    /// The view of elevation `theta_o` (rad, in [0, π/2)) after it moved by t.
    pub(super) fn place(self, theta_o: f64, t: f64) -> Place {
        let still = Place {
            t,
            theta_o,
            phi_o: 0.0,
            elevation: [0.0; 2],
            turn: 0.0,
        };
        match self {
            Self::Theta => {
                let side = if theta_o + t < 0.0 { -1.0 } else { 1.0 };
                Place {
                    theta_o: side * (theta_o + t),
                    phi_o: if side < 0.0 { PI } else { 0.0 },
                    elevation: [side, 0.0],
                    ..still
                }
            }
            Self::Phi => {
                let (x, y) = (theta_o.sin() * t.cos(), t.sin());
                let (sin, cos) = (x.hypot(y), theta_o.cos() * t.cos());
                if sin < 1e-6 {
                    // At the normal: the view sets out across the plane.
                    return Place {
                        theta_o: 0.0,
                        phi_o: FRAC_PI_2,
                        elevation: [1.0, 0.0],
                        ..still
                    };
                }
                let first = theta_o.cos() * t.sin() / sin;
                Place {
                    theta_o: sin.atan2(cos),
                    phi_o: (y + 0.0).atan2(x + 0.0),
                    // cos θ = cos θ_o cos t, differentiated twice.
                    elevation: [first, (1.0 - first * first) * cos / sin],
                    turn: theta_o.sin() / (sin * sin),
                    ..still
                }
            }
            Self::Azimuth => Place {
                phi_o: t / theta_o.sin(),
                turn: theta_o.sin().recip(),
                ..still
            },
        }
    }

    /// The range of t in which the view of elevation `theta_o` (rad) stays at least `LAST_VIEW` from the horizon, and is at each
    /// azimuth once.
    pub(super) fn range(self, theta_o: f64) -> [f64; 2] {
        let last = super::LAST_VIEW;
        match self {
            Self::Theta => [-last - theta_o, last - theta_o],
            Self::Phi => [-last, last],
            Self::Azimuth => [-PI * theta_o.sin(), PI * theta_o.sin()],
        }
    }
}
