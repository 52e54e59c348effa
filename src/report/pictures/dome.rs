//! The hemisphere of light directions, seen from outside in parallel projection.

use super::plot::{DARK, Plot, circle, middles};
use crate::geometry::{Direction, DirectionPair};
use crate::report::svg::canvas::Canvas;
use glam::DVec3;

/// Viewpoint on the hemisphere; light and sensor lie in the plane y = 0, the sensor at
/// azimuth 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum From {
    /// The mirror direction is in the middle.
    Mirror,
    /// The sensor is in the middle.
    Back,
}

/// A view of the hemisphere; its unit disk fills the plot.
pub(super) struct Dome {
    right: DVec3,
    up: DVec3,
    towards: DVec3,
    omega_o: Direction,
}

impl Dome {
    pub(crate) fn new(from: From, theta_o: f64) -> Self {
        let (s, c) = theta_o.sin_cos();
        let x = match from {
            From::Mirror => -s,
            From::Back => s,
        };
        let towards = DVec3::new(x, 0.0, c);
        let up = DVec3::new(-x.signum() * c, 0.0, s);
        Self {
            right: up.cross(towards),
            up,
            towards,
            omega_o: Direction::from_spherical(theta_o, 0.0),
        }
    }

    /// The pair with the light at each pixel, `None` beside the hemisphere.
    pub(crate) fn pairs(&self, side: usize) -> Vec<Option<DirectionPair>> {
        let pair = |p: [f64; 2]| {
            let [x, y] = p.map(|t| 2.0 * t - 1.0);
            let z2 = 1.0 - x * x - y * y;
            if z2 <= 0.0 {
                return None;
            }
            let omega = x * self.right + y * self.up + z2.sqrt() * self.towards;
            (omega.z > 0.0).then(|| DirectionPair::new(Direction::from_unit(omega), self.omega_o))
        };
        middles(side).map(pair).collect()
    }

    fn place(&self, v: DVec3) -> [f64; 2] {
        [self.right, self.up].map(|axis| 0.5 + 0.5 * v.dot(axis))
    }

    /// Outline, the part of the rim that is seen, and the directions that matter: a dot for the
    /// mirror direction, a circle for the sensor, a cross for the normal.
    pub(crate) fn outline(&self, canvas: &mut Canvas, plot: &Plot) {
        let circle = |a: DVec3, b: DVec3| circle(240).map(move |[c, s]| c * a + s * b);
        let silhouette = circle(self.right, self.up).map(|v| (v, v.z >= -1e-9));
        let rim = circle(DVec3::X, DVec3::Y).map(|v| (v, v.dot(self.towards) >= -1e-9));
        for line in [silhouette.collect::<Vec<_>>(), rim.collect()] {
            for run in line.split(|(_, seen)| !seen) {
                let points: Vec<_> = run.iter().map(|(v, _)| self.place(*v)).collect();
                plot.line(canvas, &points, DARK, 1.3);
            }
        }
        let o = self.omega_o.vector();
        let mirror = DVec3::new(-o.x, 0.0, o.z);
        if mirror.dot(self.towards) >= 0.0 {
            let at = plot.place(self.place(mirror));
            canvas.dot(at, 4.2, [255; 3]);
            canvas.dot(at, 3.0, DARK);
        }
        if o.dot(self.towards) >= 0.0 {
            let at = plot.place(self.place(o));
            canvas.dot(at, 4.6, DARK);
            canvas.dot(at, 3.0, [255; 3]);
        }
        let [x, y] = plot.place(self.place(DVec3::Z));
        for (ink, width) in [(DARK, 3.4), ([255; 3], 1.6)] {
            canvas.line(&[[x - 4.5, y], [x + 4.5, y]], ink, width);
            canvas.line(&[[x, y - 4.5], [x, y + 4.5]], ink, width);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_is_what_it_is_seen_along_and_up_is_up() {
        let side = 101;
        let middle = side * side / 2;
        for theta in [0.0, 0.3, 1.2] {
            let mirror = Dome::new(From::Mirror, theta).pairs(side);
            let back = Dome::new(From::Back, theta).pairs(side);
            let pair = mirror[middle].unwrap();
            assert!(pair.half().truncate().length() < 1e-12 && pair.half().z > 0.0);
            assert!(back[middle].unwrap().separation() < 1e-12);
            // Seen from outside, right and up and towards the eye are right-handed: with the
            // normal up, +y is to the left of the mirror direction and to the right of the sensor.
            for (pairs, sign) in [(&mirror, -1.0), (&back, 1.0)] {
                let right = pairs[middle + 20].unwrap().omega_i.vector();
                assert!((right.y - sign * 0.396).abs() < 0.01, "{theta} {right}");
                let up = pairs[middle - 20 * side].map(|p| p.omega_i.vector());
                let down = pairs[middle + 20 * side].map(|p| p.omega_i.vector());
                assert!(theta == 0.0 || up.unwrap().z > down.map_or(0.0, |v| v.z));
            }
        }
        // At the horizon half the disk is the hemisphere.
        let low = Dome::new(From::Mirror, 1.57).pairs(side);
        let seen = low.iter().flatten().count() as f64 / (side * side) as f64;
        assert!((seen - std::f64::consts::PI / 8.0).abs() < 0.02);
    }
}
