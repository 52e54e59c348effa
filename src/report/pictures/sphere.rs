//! A sphere of a material under distant light, and the filter that the material is on it (Fig. 8 of
//! Zubiaga et al. 2015).
//!
//! The camera looks from +x at the sphere, in parallel projection, with +z up and +y to the right:
//! the middle of a map ([`crate::lighting::MapSpec`]) is mirrored in the middle of the sphere. At
//! each point the tangent lies in the plane of normal and view, on the side of the view, so that
//! every view has azimuth 0.

use crate::moments::Moments;
use crate::numeric::luminance;
use crate::parametrization::view_centered;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use exr::prelude::{Image, SpecificChannels, WritableImage};
use glam::DVec3;
use std::f64::consts::TAU;
use std::fmt::Write as _;
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
    pub(crate) fn at(x: f64, y: f64) -> Self {
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

    /// Writes a PNG: radiance over `white`, clipped at 1, in sRGB; transparent beside the sphere.
    ///
    /// # Errors
    /// Whatever `out` reports.
    pub fn write_png(&self, white: f64, out: &mut impl Write) -> io::Result<()> {
        let pixel = |i: usize| with_alpha(self.shown(i, white), self.coverage(i));
        let pixels: Vec<_> = (0..self.pixels.len()).map(pixel).collect();
        super::png::write_png(&pixels, self.resolution, out)
    }

    /// A pixel in sRGB: radiance over `white`, clipped at 1.
    pub(super) fn shown(&self, pixel: usize, white: f64) -> [u8; 3] {
        let rgb = self.pixels[pixel].unwrap_or_default();
        rgb.map(|v| encoded(v / white))
    }

    /// Writes an OpenEXR file with `A`, the share of a pixel that the sphere covers, and linear `R`, `G`,
    /// `B`, which are multiplied by it.
    ///
    /// # Errors
    /// Whatever `out` reports.
    pub(crate) fn write_exr(&self, out: &mut (impl Write + Seek)) -> io::Result<()> {
        let size = (self.resolution, self.resolution);
        let limit = f64::from(f32::MAX);
        let pixel = |p: exr::math::Vec2<usize>| {
            let i = p.y() * self.resolution + p.x();
            let share = self.coverage(i);
            // Infinity would spread in viewers.
            let pixel = self.pixels[i].unwrap_or_default();
            let [r, g, b] = pixel.map(|v| (share * v).min(limit) as f32);
            (r, g, b, share as f32)
        };
        let image = Image::from_channels(size, SpecificChannels::rgba(pixel));
        let writer = image.write().non_parallel();
        writer.to_buffered(out).map_err(io::Error::other)
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
        let omega_i = Frame::at(x, y).camera(view_centered(theta, phi).vector());
        // A mirror's normal is halfway to the camera; none shows what comes from behind exactly.
        let n = (omega_i + DVec3::Z).try_normalize().unwrap_or(DVec3::X);
        [n.x, n.y]
    }

    /// The ellipse of one standard deviation, closed.
    pub fn outline(&self) -> Vec<[f64; 2]> {
        const STEPS: usize = 120;
        let [tt, tp, pp] = self.covariance;
        // Cholesky's root of the covariance.
        let a = tt.max(0.0).sqrt();
        let b = if a > 0.0 { tp / a } else { 0.0 };
        let c = (pp - b * b).max(0.0).sqrt();
        let at = |i: usize| {
            let (s, co) = (TAU * i as f64 / STEPS as f64).sin_cos();
            self.seen(self.mean[0] + a * co, self.mean[1] + b * co + c * s)
        };
        (0..=STEPS).map(at).collect()
    }
}

/// The picture with filters over it: in red each point and, dashed, all of its elevation, in blue
/// the mean and the ellipse of one standard deviation, drawn where a mirror would show the light
/// that comes from there. The picture is inside the file.
///
/// # Errors
/// If it cannot be written as PNG.
pub fn sphere_svg(
    title: &str,
    image: &SphereImage,
    white: f64,
    ellipses: &[FilterEllipse],
) -> io::Result<String> {
    const SIDE: f64 = 640.0;
    const TOP: f64 = 36.0;
    let mut png = Vec::new();
    image.write_png(white, &mut png)?;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{SIDE}\" height=\"{h}\" \
         viewBox=\"0 0 {SIDE} {h}\">\n\
         <rect width=\"{SIDE}\" height=\"{h}\" fill=\"#FFFFFF\"/>\n\
         <text x=\"{m}\" y=\"24\" text-anchor=\"middle\" font-family=\"sans-serif\" \
         font-size=\"16\" font-weight=\"bold\">{title}</text>\n\
         <image x=\"0\" y=\"{TOP}\" width=\"{SIDE}\" height=\"{SIDE}\" \
         href=\"data:image/png;base64,{png}\"/>\n",
        h = SIDE + TOP,
        m = 0.5 * SIDE,
        title = escaped(title),
        png = STANDARD.encode(&png),
    );
    let place = |[x, y]: [f64; 2]| [0.5 * SIDE * (1.0 + x), TOP + 0.5 * SIDE * (1.0 - y)];
    // Writing to a string does not fail.
    for e in ellipses {
        let [x, y] = place([0.0, 0.0]);
        let r = 0.5 * SIDE * e.theta_o.sin();
        let _ = writeln!(
            out,
            "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{r:.2}\" fill=\"none\" stroke=\"#E02010\" \
             stroke-width=\"1.2\" stroke-dasharray=\"5 4\"/>"
        );
    }
    for e in ellipses {
        let points = e.outline().into_iter().map(|p| {
            let [x, y] = place(p);
            format!("{x:.2},{y:.2}")
        });
        let points = points.collect::<Vec<_>>().join(" ");
        for (ink, width) in [("#FFFFFF", 4.0), ("#0050E0", 2.2)] {
            let _ = writeln!(
                out,
                "<polygon points=\"{points}\" fill=\"none\" stroke=\"{ink}\" \
                 stroke-width=\"{width}\" stroke-linejoin=\"round\"/>"
            );
        }
        let mean = place(e.seen(e.mean[0], e.mean[1]));
        let dots = [(mean, "#0050E0", 3.5), (place(e.point()), "#E02010", 4.0)];
        for ([x, y], ink, r) in dots {
            let _ = writeln!(
                out,
                "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{r}\" fill=\"{ink}\" stroke=\"#FFFFFF\"/>"
            );
        }
    }
    Ok(out + "</svg>\n")
}

fn escaped(text: &str) -> String {
    let text: String = text.chars().filter(|c| !c.is_control()).collect();
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}
