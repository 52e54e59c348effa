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

    /// The range of t of a view of elevation `theta_o` (rad): up to the elevation `LAST_VIEW` on either side, as long a way across, or
    /// each azimuth once.
    pub(super) fn range(self, theta_o: f64) -> [f64; 2] {
        let last = super::LAST_VIEW;
        match self {
            Self::Theta => [-last - theta_o, last - theta_o],
            Self::Phi => [-last, last],
            Self::Azimuth => [-PI * theta_o.sin(), PI * theta_o.sin()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Direction;
    use crate::parametrization::view_centered;
    use glam::DVec3;

    #[test]
    fn places_are_where_the_view_is_and_goes() {
        let about_normal = |v: DVec3, a: f64| glam::DMat3::from_rotation_z(a) * v;
        for along in [Along::Theta, Along::Phi, Along::Azimuth] {
            for (theta_o, t) in [
                (0.5, 0.0),
                (0.5, 0.3),
                (0.5, -0.2),
                (0.2, -0.5),
                (1.2, 0.25),
            ] {
                let place = along.place(theta_o, t);
                let true_view = match along {
                    Along::Theta => view_centered(theta_o + t, 0.0).vector(),
                    Along::Phi => view_centered(theta_o, t).vector(),
                    Along::Azimuth => {
                        about_normal(view_centered(theta_o, 0.0).vector(), t / theta_o.sin())
                    }
                };
                let view = Direction::from_spherical(place.theta_o, place.phi_o).vector();
                assert!(
                    (view - true_view).length() < 1e-12,
                    "{along:?} {theta_o} {t}"
                );
                let h = 1e-4;
                let [before, after] = [t - h, t + h].map(|t| along.place(theta_o, t));
                let first = (after.theta_o - before.theta_o) / (2.0 * h);
                let second = (after.theta_o + before.theta_o - 2.0 * place.theta_o) / (h * h);
                let turn = (after.phi_o - before.phi_o) / (2.0 * h);
                assert!((first - place.elevation[0]).abs() < 1e-6, "{place:?}");
                assert!((second - place.elevation[1]).abs() < 1e-5, "{place:?}");
                assert!((turn - place.turn).abs() < 1e-6, "{place:?}");
            }
        }
    }
}
