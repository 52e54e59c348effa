//! A sphere of a material under distant light, and the filter that the material is on it (Fig. 8 of
//! Zubiaga et al. 2015).
//!
//! The camera looks from +x at the sphere, in parallel projection, with +z up and +y to the right:
//! the middle of a map ([`crate::lighting::MapSpec`]) is mirrored in the middle of the sphere. At
//! each point the tangent lies in the plane of normal and view, on the side of the view, so that
//! every view has azimuth 0.

use super::plot::circle;
use crate::moments::Moments;
use crate::numeric::luminance;
use crate::parametrization::view_centered;
use crate::report::pictures::slice::{Channels32, Pixel, push_layer, write_channels};
use crate::report::svg::canvas::{Align, Canvas, Ink, Lettering};
use glam::DVec3;
use std::io::{self, Seek, Write};

/// The picture of a sphere that fills its square.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereImage {
    /// Width and height in pixels.
    pub resolution: usize,
    /// Radiance (linear R, G, B) of the part of a pixel that the sphere covers, row after row from the
    /// top; `None` beside the sphere.
    pub pixels: Vec<Option<[f64; 3]>>,
}

/// Parts of a pixel on the edge of the sphere along each side.
const PARTS: usize = 4;

/// Where a pixel is looked at: in its middle if the sphere covers it whole, else in the middles of
/// those of its parts that are on the sphere. Places on the unit disk, x to the right and y up; second
/// the share of the pixel that the sphere covers.
pub(super) fn places(resolution: usize, pixel: usize) -> (Vec<[f64; 2]>, f64) {
    let [row, column] = [pixel / resolution, pixel % resolution];
    let at = |i: usize, t: f64| 2.0 * (i as f64 + t) / resolution as f64 - 1.0;
    let place = |u: f64, v: f64| [at(column, u), -at(row, v)];
    let inside = |[x, y]: &[f64; 2]| x.hypot(*y) < 1.0;
    let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
    if corners.iter().all(|&[u, v]| inside(&place(u, v))) {
        return (vec![place(0.5, 0.5)], 1.0);
    }
    let middle = |i: usize| (i as f64 + 0.5) / PARTS as f64;
    let parts = (0..PARTS * PARTS).map(|i| place(middle(i % PARTS), middle(i / PARTS)));
    let covered: Vec<_> = parts.filter(inside).collect();
    let share = covered.len() as f64 / (PARTS * PARTS) as f64;
    (covered, share)
}

/// From the camera's frame (x right, y up, z towards it) to that of the light.
pub(super) fn world(v: DVec3) -> DVec3 {
    DVec3::new(v.z, v.x, v.y)
}

/// The local frame of a point of the sphere, in the camera's.
pub(super) struct Frame {
    t: DVec3,
    b: DVec3,
    n: DVec3,
}

impl Frame {
    /// At a place of the unit disk, x to the right and y up.
    pub(crate) fn new(x: f64, y: f64) -> Self {
        let sin = x.hypot(y);
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        // In the middle every tangent is right.
        let [cp, sp] = if sin > 0.0 {
            [x / sin, y / sin]
        } else {
            [1.0, 0.0]
        };
        let n = DVec3::new(x, y, cos);
        // (view − cos n)/sin, worked out.
        let t = DVec3::new(-cos * cp, -cos * sp, sin);
        Self {
            t,
            b: n.cross(t),
            n,
        }
    }

    pub(crate) fn camera(&self, local: DVec3) -> DVec3 {
        local.x * self.t + local.y * self.b + local.z * self.n
    }

    /// From the camera's frame to the local one; the inverse of [`camera`](Self::camera).
    pub(crate) fn local(&self, v: DVec3) -> DVec3 {
        DVec3::new(v.dot(self.t), v.dot(self.b), v.dot(self.n))
    }
}

impl SphereImage {
    /// Radiance that is to be white: a hundredth of the sphere has more luminance, or the largest
    /// if those are alike.
    pub fn white(&self) -> f64 {
        let lit = self.pixels.iter().flatten().map(|p| luminance(*p));
        let mut lit: Vec<f64> = lit.collect();
        lit.sort_by(f64::total_cmp);
        let white = lit.get(lit.len() * 99 / 100).copied().unwrap_or(1.0);
        if white > 0.0 { white } else { 1.0 }
    }

    /// Share of a pixel that the sphere covers.
    pub fn coverage(&self, pixel: usize) -> f64 {
        places(self.resolution, pixel).1
    }

    /// A PNG file: radiance over `white`, clipped at 1, in sRGB; transparent beside the sphere.
    pub fn png(&self, white: f64) -> Vec<u8> {
        let pixel = |i: usize| with_alpha(self.shown(i, white), self.coverage(i));
        let pixels: Vec<_> = (0..self.pixels.len()).map(pixel).collect();
        super::png::encoded(&pixels, self.resolution)
    }

    /// A pixel in sRGB: radiance over `white`, clipped at 1.
    pub(super) fn shown(&self, pixel: usize, white: f64) -> [u8; 3] {
        let rgb = self.pixels[pixel].unwrap_or_default();
        rgb.map(|v| encoded(v / white))
    }

    /// Writes an OpenEXR file with `A`, the share of a pixel that the sphere covers, and linear `R`, `G`,
    /// `B`, which are multiplied by it; errors are those of `out`.
    pub(crate) fn write_exr(&self, out: &mut (impl Write + Seek)) -> io::Result<()> {
        let mut list = Channels32::new();
        push_layer(&mut list, "", &["R", "G", "B"], &self.covered());
        write_channels(self.resolution, list, out)
    }

    /// Radiance multiplied by the share of a pixel that the sphere covers, and that share.
    pub(super) fn covered(&self) -> Vec<Pixel> {
        let pixel = |(i, rgb): (usize, &Option<[f64; 3]>)| {
            let share = rgb.map_or(0.0, |_| self.coverage(i));
            (rgb.unwrap_or_default().map(|v| share * v), share)
        };
        self.pixels.iter().enumerate().map(pixel).collect()
    }
}

/// A linear value, 1 is white, in sRGB.
pub(super) fn encoded(v: f64) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let v = if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * v).round() as u8
}

/// A colour that covers a share of its pixel.
pub(super) fn with_alpha([r, g, b]: [u8; 3], share: f64) -> [u8; 4] {
    [r, g, b, (255.0 * share).round() as u8]
}

/// Mean and covariance of a slice, at a point of the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterEllipse {
    /// View elevation of the point, rad; it lies sin θ_o from the middle of the picture.
    pub theta_o: f64,
    /// Azimuth of the point about the middle of the picture, rad, from the right upwards.
    pub azimuth: f64,
    /// (µ_θ, µ_φ), rad.
    pub mean: [f64; 2],
    /// Σ₂₀, Σ₁₁, Σ₀₂, rad².
    pub covariance: [f64; 3],
}

impl FilterEllipse {
    /// The ellipse of a slice's moments at `theta_o`; `None` if it has no mean or no covariance.
    pub(crate) fn new(theta_o: f64, azimuth: f64, moments: &Moments) -> Option<Self> {
        Some(Self {
            theta_o,
            azimuth,
            mean: moments.mean()?,
            covariance: moments.covariance()?,
        })
    }

    /// The point itself, on the unit disk: x to the right, y up.
    pub fn point(&self) -> [f64; 2] {
        let (s, c) = self.azimuth.sin_cos();
        [c, s].map(|v| v * self.theta_o.sin())
    }

    /// Place on the unit disk where a mirror shows light from angles θ, φ of the point's slice.
    pub fn seen(&self, theta: f64, phi: f64) -> [f64; 2] {
        let [x, y] = self.point();
        let omega_i = Frame::new(x, y).camera(view_centered(theta, phi).vector());
        // A mirror's normal is halfway to the camera; none shows what comes from behind exactly.
        let n = (omega_i + DVec3::Z).try_normalize().unwrap_or(DVec3::X);
        [n.x, n.y]
    }

    /// The ellipse of one standard deviation, closed.
    pub fn outline(&self) -> Vec<[f64; 2]> {
        let [tt, tp, pp] = self.covariance;
        // Cholesky's root of the covariance.
        let a = tt.max(0.0).sqrt();
        let b = if a > 0.0 { tp / a } else { 0.0 };
        let c = (pp - b * b).max(0.0).sqrt();
        let at =
            |[co, s]: [f64; 2]| self.seen(self.mean[0] + a * co, self.mean[1] + b * co + c * s);
        circle(120).map(at).collect()
    }
}

/// The picture with filters over it, and what their lines are below it: in red each point and, dashed, all of its elevation, in blue
/// the mean and the ellipse of one standard deviation, drawn where a mirror would show the light
/// that comes from there. The picture is inside the file.
pub fn sphere_svg(
    title: &str,
    image: &SphereImage,
    white: f64,
    ellipses: &[FilterEllipse],
) -> String {
    const SIDE: f64 = 640.0;
    const TOP: f64 = 36.0;
    const RED: Ink = [0xe0, 0x20, 0x10];
    const BLUE: Ink = [0x00, 0x50, 0xe0];
    const WHITE: Ink = [255; 3];
    const DASHES: &str = "60 45";
    const BELOW: f64 = 34.0;
    let place = |[x, y]: [f64; 2]| [0.5 * SIDE * (1.0 + x), TOP + 0.5 * SIDE * (1.0 - y)];
    Canvas::titled(title, [SIDE, SIDE + TOP + BELOW], 18.0, |canvas| {
        canvas.image([0.0, TOP], [SIDE; 2], &image.png(white));
        for e in ellipses {
            let elevation = circle(120).map(|p| place(p.map(|v| v * e.theta_o.sin())));
            let elevation: Vec<_> = elevation.collect();
            canvas.dashed(&elevation, RED, 1.2, DASHES);
        }
        for e in ellipses {
            let outline: Vec<_> = e.outline().into_iter().map(place).collect();
            canvas.line(&outline, WHITE, 4.0);
            canvas.line(&outline, BLUE, 2.2);
            let mean = e.seen(e.mean[0], e.mean[1]);
            for (at, ink, radius) in [(mean, BLUE, 3.5), (e.point(), RED, 4.0)] {
                canvas.dot(place(at), radius + 0.5, WHITE);
                canvas.dot(place(at), radius - 0.5, ink);
            }
        }
        let y = TOP + SIDE + 0.5 * BELOW;
        canvas.dot([42.0, y], 3.5, RED);
        canvas.dashed(&[[180.0, y], [204.0, y]], RED, 1.8, DASHES);
        canvas.line(&[[350.0, y], [374.0, y]], BLUE, 2.2);
        canvas.dot([362.0, y], 3.5, BLUE);
        let names = [
            (54.0, "view of a slice"),
            (211.0, "its elevation"),
            (381.0, "mean, one standard deviation"),
        ];
        for (x, name) in names {
            canvas.text([x, y], name, Lettering::new(12.0, Align::Start));
        }
    })
}
