//! A slice of a BRDF as pictures: a map in its own chart, and a lobe in space (Fig. 3 of Zubiaga et al.
//! 2015).

use super::plot::{Plot, Swatch, bar, circle, hatched, log_ticks, swatches, text};
use super::png::encoded;
use crate::moments::{Batch, Kind, Slice};
use crate::parametrization::view_centered;
use crate::report::svg::canvas::{Align, BLACK, Canvas, Ink, Lettering};
use crate::report::svg::plot::ramp;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use std::io::{self, Write};

/// The values of a slice at the middles of equal cells of its chart, θ to the right and φ up.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatSlice {
    resolution: usize,
    /// Values, sr⁻¹, row after row from φ = 90° downwards; `None` without data.
    values: Vec<Option<f64>>,
}

impl FlatSlice {
    pub(crate) const MAX_RESOLUTION: usize = 4096;

    /// Looks at `resolution` × `resolution` directions; clamped to [1, 4096].
    pub fn new(slice: &Slice<'_>, resolution: usize) -> Self {
        let resolution = resolution.clamp(1, Self::MAX_RESOLUTION);
        let rows = (0..resolution).into_par_iter().flat_map_iter(|row| {
            let columns = 0..resolution;
            values(slice, columns.map(|column| angles(resolution, row, column)))
        });
        Self {
            resolution,
            values: rows.collect(),
        }
    }

    /// The range of colours that shows every one of these slices: their largest value and the
    /// smallest above 0, but not less than a millionth of the largest. (0.1, 1) if all is black.
    pub fn range(slices: &[FlatSlice]) -> [f64; 2] {
        let shown = || slices.iter().flat_map(|s| &s.values).flatten().copied();
        let hi = shown().fold(0.0, f64::max);
        if hi <= 0.0 {
            return [0.1, 1.0];
        }
        let lo = shown().filter(|v| *v >= 1e-6 * hi).fold(hi, f64::min);
        // A constant has no range of its own: a colour from the middle.
        if lo > 0.999 * hi {
            [0.1 * hi, 10.0 * hi]
        } else {
            [lo, hi]
        }
    }

    /// `theta_deg`, `phi_deg` (middles of cells) and `value` (sr⁻¹, empty without data); errors are those of `out`.
    pub(crate) fn write_csv(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "theta_deg,phi_deg,value")?;
        for (i, value) in self.values.iter().enumerate() {
            let (row, column) = (i / self.resolution, i % self.resolution);
            let [theta, phi] = angles(self.resolution, row, column).map(f64::to_degrees);
            let value = value.map_or(String::new(), |v| v.to_string());
            writeln!(out, "{theta:.9},{phi:.9},{value}")?;
        }
        Ok(())
    }

    /// A PNG file of at least 540 pixels a side: colours from dark violet over blue and green to
    /// yellow in equal steps of the logarithm over `range` (sr⁻¹, both ends above 0); grey
    /// hatching where there is no data.
    pub fn png(&self, range: [f64; 2]) -> Vec<u8> {
        let cell = 540usize.div_ceil(self.resolution);
        let side = cell * self.resolution;
        let [lo, hi] = range.map(f64::ln);
        let pixel = |i: usize| {
            let [x, y] = [i % side, i / side];
            match self.values[y / cell * self.resolution + x / cell] {
                Some(v) => ramp((v.ln() - lo) / (hi - lo)),
                None => hatched(i, side, 4),
            }
        };
        let pixels: Vec<_> = (0..side * side).map(pixel).collect();
        encoded(&pixels, side)
    }
}

/// θ and φ (rad) of the middle of a cell.
fn angles(resolution: usize, row: usize, column: usize) -> [f64; 2] {
    let middle = |i: usize| PI * ((i as f64 + 0.5) / resolution as f64 - 0.5);
    [middle(column), -middle(row)]
}

/// Values of a slice at angles θ and φ; `None` without data.
fn values(slice: &Slice<'_>, angles: impl Iterator<Item = [f64; 2]>) -> Vec<Option<f64>> {
    let mut batch = Batch::default();
    for [theta, phi] in angles {
        batch.push(slice, view_centered(theta, phi));
    }
    slice.evaluate(&mut batch);
    let found = batch.values().iter().zip(batch.kinds());
    found
        .map(|(&v, &kind)| (kind != Kind::Missing).then_some(v))
        .collect()
}

/// Length of a drawn lobe as a function of ρ in its direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Radius {
    /// ρ / max.
    Linear,
    /// (ρ / max)^(1/3), which also shows what is a thousand times below the peak.
    #[default]
    CubeRoot,
}

/// Directions of the mesh along one angle, closer about `middle`, which is one of them.
fn graded(middle: f64, half: i32) -> Vec<f64> {
    let step = |i: i32| {
        let t = f64::from(i) / f64::from(half);
        let end = if i < 0 { -FRAC_PI_2 } else { FRAC_PI_2 };
        middle + (end - middle) * (0.25 * t.abs() + 0.75 * t.abs().powi(3))
    };
    (-half..=half).map(step).collect()
}

const SIZE: [f64; 2] = [1040.0, 530.0];
const MAP: Plot = Plot::new([76.0, 54.0], 360.0);
/// Radius of the unit sphere, pixels.
const SCALE: f64 = 240.0;
const MIDDLE: [f64; 2] = [770.0, 350.0];
/// Direction of the eye: elevation above the tangent plane and azimuth from −y, degrees.
const EYE_DEG: [f64; 2] = [18.0, -22.0];
const BLUE: Ink = [0x00, 0x58, 0xd0];
const RED: Ink = [0xd0, 0x20, 0x10];
const GREY: Ink = [120, 120, 120];

/// Direction of the eye, and its axes to the right and up.
struct Eye {
    towards: DVec3,
    right: DVec3,
    up: DVec3,
}

impl Eye {
    fn new() -> Self {
        let [elevation, azimuth] = EYE_DEG.map(f64::to_radians);
        let (se, ce) = elevation.sin_cos();
        let (sa, ca) = azimuth.sin_cos();
        let towards = DVec3::new(sa * ce, -ca * ce, se);
        let right = DVec3::new(ca, sa, 0.0);
        Self {
            towards,
            right,
            up: towards.cross(right),
        }
    }

    fn place(&self, p: DVec3) -> [f64; 2] {
        [
            MIDDLE[0] + SCALE * p.dot(self.right),
            MIDDLE[1] - SCALE * p.dot(self.up),
        ]
    }
}

/// A shape to paint: a face of the lobe or a piece of a line.
struct Piece {
    depth: f64,
    points: Vec<[f64; 2]>,
    ink: Ink,
    /// Width of a line; a face if `None`.
    width: Option<f64>,
}

/// A slice as an SVG: left its map over θ and φ with the scale of colours, `range` (sr⁻¹); right the lobe
/// ρ(θ, φ) in space, seen in parallel projection, radius as `radius` says, farther faces painted
/// first. The circle is the rim of the hemisphere of radius 1; black is the normal, blue the view, red the
/// mirror direction. Faces without data are left open.
pub fn slice_svg(
    title: &str,
    slice: &Slice<'_>,
    flat: &FlatSlice,
    range: [f64; 2],
    radius: Radius,
) -> String {
    let eye = Eye::new();
    let theta_o = slice.theta_o;
    let (thetas, phis) = (graded(-theta_o, 36), graded(0.0, 30));
    let angles = || {
        let with_all = |&theta: &f64| phis.iter().map(move |&phi| [theta, phi]);
        thetas.iter().flat_map(with_all)
    };
    let values = values(slice, angles());
    let max = values.iter().flatten().copied().fold(0.0, f64::max);
    let (radius, says): (fn(f64) -> f64, _) = match radius {
        Radius::Linear => (|share| share, "ρ / max"),
        Radius::CubeRoot => (f64::cbrt, "cube root of ρ / max"),
    };
    let length = |v: f64| if max > 0.0 { radius(v / max) } else { 0.0 };
    let tip = |(v, [theta, phi]): (&Option<f64>, [f64; 2])| {
        Some(view_centered(theta, phi).vector() * length((*v)?))
    };
    let tips: Vec<_> = values.iter().zip(angles()).map(tip).collect();
    let mut pieces = Vec::new();
    let mut open = 0;
    for i in 1..thetas.len() {
        for j in 1..phis.len() {
            let at = |i: usize, j: usize| tips[i * phis.len() + j];
            let corners = [at(i - 1, j - 1), at(i, j - 1), at(i, j), at(i - 1, j)];
            match corners {
                [Some(a), Some(b), Some(c), Some(d)] => {
                    pieces.extend(face(&eye, [a, b, c, d]));
                }
                _ => open += 1,
            }
        }
    }
    let [view, mirror] = [theta_o, -theta_o].map(|t| view_centered(t, 0.0).vector() * 1.2);
    // In pieces, so that the lobe can hide some of them.
    for (to, ink) in [(DVec3::Z * 1.15, BLACK), (view, BLUE), (mirror, RED)] {
        let points = (0..=60).map(|i| DVec3::ZERO.lerp(to, f64::from(i) / 60.0));
        pieces.extend(segments(&eye, points, ink, 2.2));
    }
    let rim = circle(180).map(|[c, s]| DVec3::new(c, s, 0.0));
    pieces.extend(segments(&eye, rim, GREY, 1.2));
    pieces.sort_by(|a, b| a.depth.total_cmp(&b.depth));

    let share = open as f64 / ((thetas.len() - 1) * (phis.len() - 1)) as f64;
    let mut caption = format!(
        "radius: {says}; max = {}",
        match max {
            m if m == 0.0 || (1e-3..1e5).contains(&m) => format!("{m:.4} sr⁻¹"),
            m => format!("{m:.3e} sr⁻¹"),
        }
    );
    if open > 0 {
        caption += &format!("; {:.1} % of the faces have no data", 100.0 * share);
    }
    Canvas::titled(title, SIZE, 22.0, |canvas| {
        for piece in &pieces {
            match piece.width {
                Some(width) => canvas.line(&piece.points, piece.ink, width),
                None => canvas.area(&piece.points, piece.ink, 1.0),
            }
        }
        text(canvas, [MIDDLE[0], SIZE[1] - 20.0], &caption, 11.5, false);
        // In columns of their own: the three directions may be one.
        let legend = [("normal", BLACK), ("view", BLUE), ("mirror", RED)];
        for (i, (name, ink)) in legend.into_iter().enumerate() {
            let x = MIDDLE[0] + 90.0 * (i as f64 - 1.4);
            let y = SIZE[1] - 42.0;
            canvas.line(&[[x, y], [x + 22.0, y]], ink, 2.2);
            canvas.text([x + 28.0, y], name, Lettering::new(12.0, Align::Start));
        }
        map(canvas, flat, range, theta_o)
    })
}

/// Draws the map with its axes, the view, the mirror direction, and the scale of colours.
fn map(canvas: &mut Canvas, flat: &FlatSlice, range: [f64; 2], theta_o: f64) {
    canvas.image(MAP.at, [MAP.side; 2], &flat.png(range));
    MAP.frame(canvas);
    for degrees in [-90, -60, -30, 0, 30, 60, 90] {
        let t = 0.5 + f64::from(degrees) / 180.0;
        let number = degrees.to_string().replace('-', "−");
        MAP.tick(canvas, true, t, &number);
        MAP.tick(canvas, false, t, &number);
    }
    MAP.label(canvas, true, "θ (°)", 0.0);
    MAP.label(canvas, false, "φ (°)", 40.0);
    for (theta, ink) in [(theta_o, BLUE), (-theta_o, RED), (0.0, BLACK)] {
        let at = MAP.place([0.5 + theta.to_degrees() / 180.0, 0.5]);
        canvas.dot(at, 4.4, [255; 3]);
        canvas.dot(at, 3.0, ink);
    }
    let below = [MAP.at[0] + 0.5 * MAP.side, MAP.at[1] + MAP.side + 44.0];
    let says = "ρ (sr⁻¹), one scale for all views; dots: normal, view, mirror";
    let ticks = log_ticks(range, MAP.side);
    bar(canvas, below, MAP.side, ramp, &ticks, says);
    if flat.values.contains(&None) {
        swatches(canvas, [below[0], below[1] + 62.0], &[Swatch::NO_DATA]);
    }
}

fn face(eye: &Eye, corners: [DVec3; 4]) -> Option<Piece> {
    let [a, b, c, d] = corners;
    let middle = 0.25 * (a + b + c + d);
    let normal = (c - a).cross(d - b).try_normalize()?;
    // Both sides are shown; the light is at the eye, a little from above.
    let light = (eye.towards + 0.6 * eye.up - 0.3 * eye.right).normalize();
    let side = if normal.dot(eye.towards) < 0.0 {
        -1.0
    } else {
        1.0
    };
    let bright = 0.35 + 0.65 * (side * normal).dot(light).max(0.0);
    let ink = [236.0, 190.0, 110.0].map(|c: f64| (c * bright) as u8);
    let flat = corners.map(|p| eye.place(p));
    let points = (0..4).map(|i| {
        let mut p = flat[i];
        for other in [flat[(i + 1) % 4], flat[(i + 3) % 4]] {
            let [x, y] = [0, 1].map(|k| flat[i][k] - other[k]);
            // Every side reaches over its neighbours: faces that only touch let the paper
            // shine through.
            let far = x.hypot(y).max(1e-3);
            p = [p[0] + 0.6 * x / far, p[1] + 0.6 * y / far];
        }
        p
    });
    Some(Piece {
        depth: middle.dot(eye.towards),
        points: points.collect(),
        ink,
        width: None,
    })
}

/// A line through points, piece by piece.
fn segments(eye: &Eye, points: impl Iterator<Item = DVec3>, ink: Ink, width: f64) -> Vec<Piece> {
    let points: Vec<DVec3> = points.collect();
    let piece = |ends: &[DVec3]| Piece {
        depth: (0.5 * (ends[0] + ends[1])).dot(eye.towards),
        points: ends.iter().map(|p| eye.place(*p)).collect(),
        ink,
        width: Some(width),
    };
    points.windows(2).map(piece).collect()
}
