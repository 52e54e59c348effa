//! Squares with a raster, isolines and axes, and legends of colours: the parts of plates.

use super::contours::isolines;
use crate::geometry::Symmetry;
use crate::parametrization::{Axis, Coords, Parametrization, ParametrizationSpec, Unit};
use crate::registry::Entry;
use crate::report::pictures::png::encoded;
use crate::report::svg::axis::Ruler;
use crate::report::svg::canvas::{Align, Canvas, Ink, Lettering, text_width};
use crate::report::svg::plot::Axis as PlotAxis;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

pub(super) const FRAME: Ink = [110, 110, 110];
pub(super) const DARK: Ink = [30, 30, 30];

/// Directions below the horizon: no colour of any scale.
pub(super) const OUTSIDE: Ink = [226; 3];

const TICK: f64 = 10.0;
const LABEL: f64 = 12.5;

/// Margins of a plot with axes, left of its square and below it, pixels.
pub(super) const LEFT: f64 = 54.0;
pub(super) const BELOW: f64 = 42.0;

/// Margin of a plate, and width of the names of its rows, pixels.
pub(super) const MARGIN: f64 = 16.0;
pub(super) const NAME: f64 = 26.0;

/// The first two axes of a parametrization, and planes of it.
pub(super) struct Plane {
    pub form: Arc<dyn Parametrization>,
    pub name: &'static str,
    pub x: Axis,
    pub y: Axis,
    /// Label of the coordinate that is fixed.
    pub azimuth: &'static str,
    /// Its range, degrees.
    pub azimuth_deg: [f64; 2],
    /// Label of the azimuth that is 0 in all planes, by which an anisotropic BRDF differs.
    pub turn: &'static str,
}

impl Plane {
    pub(crate) fn new(entry: &Entry<ParametrizationSpec>) -> Self {
        let form = entry.form(Symmetry::FULL);
        let [x, y, z] = form.axes() else {
            unreachable!("isotropic forms have three axes");
        };
        let [azimuth, turn] = form.plane_labels();
        Self {
            name: entry.kind,
            x: *x,
            y: *y,
            azimuth,
            azimuth_deg: z.range.map(f64::to_degrees),
            turn,
            form,
        }
    }

    /// Coordinates of a point of the square, both parts in [0, 1].
    pub(crate) fn coords(&self, [u, v]: [f64; 2], phi: f64) -> Coords {
        let along = |axis: &Axis, t: f64| axis.range[0] + t * axis.length();
        [along(&self.x, u), along(&self.y, v), phi, 0.0]
    }

    /// The upper edge of what is physical: for each place on the first axis the largest on the
    /// second, in [0, 1].
    fn edge(&self, phi: f64) -> Vec<[f64; 2]> {
        const STEPS: usize = 240;
        let inside = |p| self.form.inverse(&self.coords(p, phi)).is_some();
        let mut edge = Vec::with_capacity(STEPS + 2);
        for i in 0..=STEPS {
            // Closer at the end, where circles are steep.
            let u = (FRAC_PI_2 * i as f64 / STEPS as f64).sin().min(1.0 - 1e-9);
            let [mut lo, mut hi] = [0.0, 1.0];
            for _ in 0..40 {
                let middle = 0.5 * (lo + hi);
                if inside([u, middle]) {
                    lo = middle;
                } else {
                    hi = middle;
                }
            }
            edge.push([u, lo]);
        }
        edge.push([1.0, 0.0]);
        edge
    }
}

/// Name of an axis, with its unit.
pub(in crate::report) fn label(axis: &Axis) -> String {
    match axis.unit {
        Unit::Radian => format!("{} (°)", axis.label),
        Unit::One => axis.label.into(),
    }
}

/// A coordinate with its unit, without the last digits that radians leave.
pub(in crate::report) fn coordinate(axis: &Axis, value: f64) -> String {
    let unit = match axis.unit {
        Unit::Radian => "°",
        Unit::One => "",
    };
    format!("{}{unit}", (axis.file_value(value) * 1e6).round() / 1e6)
}

/// A square of a plate.
#[derive(Clone, Copy)]
pub(super) struct Plot {
    /// Upper left corner.
    pub at: [f64; 2],
    pub side: f64,
}

impl Plot {
    pub(crate) const fn new(at: [f64; 2], side: f64) -> Self {
        Self { at, side }
    }

    /// Position, pixels, of a point of the unit square; the second coordinate upwards.
    pub(crate) fn place(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [
            self.at[0] + u * self.side,
            self.at[1] + (1.0 - v) * self.side,
        ]
    }

    /// Square pixels, row after row from the top, all over the plot.
    pub(crate) fn raster(&self, canvas: &mut Canvas, pixels: &[[u8; 3]]) {
        let columns = pixels.len().isqrt();
        let png = encoded(pixels, columns);
        canvas.image(self.at, [self.side; 2], &png);
    }

    /// Lines where values at the pixels' centres are `level`.
    pub(crate) fn isolines(
        &self,
        canvas: &mut Canvas,
        values: &[Option<f64>],
        level: f64,
        ink: Ink,
        width: f64,
    ) {
        let columns = values.len().isqrt();
        for line in isolines(values, columns, level) {
            let place = |[x, y]: [f64; 2]| {
                let [u, v] = [x, y].map(|i| (i + 0.5) / columns as f64);
                self.place([u, 1.0 - v])
            };
            let line: Vec<_> = line.into_iter().map(place).collect();
            canvas.line(&thinned(&line), ink, width);
        }
    }

    /// A line through points of the unit square.
    pub(crate) fn line(&self, canvas: &mut Canvas, points: &[[f64; 2]], ink: Ink, width: f64) {
        let points: Vec<_> = points.iter().map(|p| self.place(*p)).collect();
        canvas.line(&points, ink, width);
    }

    /// Draws [`OUTSIDE`] over coordinates that are not physical, their edge, frame, ticks and axis names.
    pub(crate) fn axes(&self, canvas: &mut Canvas, plane: &Plane, phi: Option<f64>) {
        if let Some(phi) = phi {
            let edge: Vec<_> = plane.edge(phi).iter().map(|p| self.place(*p)).collect();
            let edge = thinned(&edge);
            let corners = [[1.0, 1.0], [0.0, 1.0]].map(|p| self.place(p));
            canvas.area(&[&edge[..], &corners].concat(), OUTSIDE, 1.0);
            canvas.line(&edge, DARK, 1.3);
        }
        self.frame(canvas);
        for (axis, horizontal) in [(&plane.x, true), (&plane.y, false)] {
            // Thirds in degrees, quarters with the ends and the middle written.
            let parts = match axis.unit {
                Unit::Radian => 3,
                Unit::One => 4,
            };
            for i in 0..=parts {
                let t = f64::from(i) / f64::from(parts);
                let value = axis.file_value(axis.range[0] + t * axis.length());
                let text = match axis.unit {
                    Unit::Radian => format!("{value:.0}"),
                    Unit::One if i % 2 == 0 => format!("{value}"),
                    Unit::One => String::new(),
                };
                self.tick(canvas, horizontal, t, &text);
            }
            self.label(canvas, horizontal, &label(axis), 33.0);
        }
    }

    /// Draws a tick at a place in [0, 1] below the plot, or left of it, with a text.
    pub(crate) fn tick(&self, canvas: &mut Canvas, horizontal: bool, t: f64, text: &str) {
        if horizontal {
            let [x, y] = self.place([t, 0.0]);
            canvas.line(&[[x, y], [x, y + 4.0]], FRAME, 0.8);
            canvas.text([x, y + 11.0], text, Lettering::new(TICK, Align::Middle));
        } else {
            let [x, y] = self.place([0.0, t]);
            canvas.line(&[[x, y], [x - 4.0, y]], FRAME, 0.8);
            canvas.text([x - 7.0, y], text, Lettering::new(TICK, Align::End));
        }
    }

    /// Writes the name of an axis below the plot, or upwards, so far left of it.
    pub(crate) fn label(&self, canvas: &mut Canvas, horizontal: bool, text: &str, left: f64) {
        let how = Lettering::new(LABEL, Align::Middle);
        if horizontal {
            let [x, y] = self.place([0.5, 0.0]);
            canvas.text([x, y + 27.0], text, how);
        } else {
            let [x, y] = self.place([0.0, 0.5]);
            canvas.text([x - left, y], text, how.upwards());
        }
    }

    pub(crate) fn frame(&self, canvas: &mut Canvas) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        self.line(canvas, &corners, FRAME, 0.8);
    }
}

/// The line without points that lie on it to a sixth of a pixel (Ramer, Douglas and Peucker).
fn thinned(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    const OFF: f64 = 1.0 / 6.0;
    let Some(last) = line.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut kept = vec![false; line.len()];
    kept[0] = true;
    kept[last] = true;
    let mut open = vec![[0, last]];
    while let Some([from, to]) = open.pop() {
        let [a, b] = [line[from], line[to]];
        let d = [b[0] - a[0], b[1] - a[1]];
        let length = d[0].hypot(d[1]);
        let off = |p: [f64; 2]| {
            let e = [p[0] - a[0], p[1] - a[1]];
            // The ends of a closed line are one point.
            if length > 0.0 {
                (d[0] * e[1] - d[1] * e[0]).abs() / length
            } else {
                e[0].hypot(e[1])
            }
        };
        let between = from + 1..to;
        let Some(farthest) = between.max_by(|&i, &k| off(line[i]).total_cmp(&off(line[k]))) else {
            continue;
        };
        if off(line[farthest]) > OFF {
            kept[farthest] = true;
            open.extend([[from, farthest], [farthest, to]]);
        }
    }
    let points = line.iter().zip(kept).filter(|(_, kept)| *kept);
    points.map(|(p, _)| *p).collect()
}

/// The middles of the pixels of a square, row after row from the top.
pub(super) fn middles(side: usize) -> impl Iterator<Item = [f64; 2]> {
    let middle = move |i: usize| (i as f64 + 0.5) / side as f64;
    (0..side * side).map(move |i| [middle(i % side), 1.0 - middle(i / side)])
}

/// Points (cos, sin) of a circle of radius 1 at `steps` equal steps, the first again at the end.
pub(super) fn circle(steps: usize) -> impl Iterator<Item = [f64; 2]> {
    (0..=steps).map(move |i| {
        let (s, c) = (TAU * i as f64 / steps as f64).sin_cos();
        [c, s]
    })
}

/// Draws a text with its middle at `at`.
pub(crate) fn text(canvas: &mut Canvas, at: [f64; 2], text: &str, size: f64, bold: bool) {
    let how = Lettering::new(size, Align::Middle);
    canvas.text(at, text, Lettering { bold, ..how });
}

pub(super) fn text_upwards(canvas: &mut Canvas, at: [f64; 2], text: &str) {
    let how = Lettering::new(13.0, Align::Middle);
    canvas.text(at, text, how.bold().upwards());
}

/// The colours of the stripes where there are no data.
const NO_DATA: [Ink; 2] = [[150; 3], [190; 3]];

/// The colour of a pixel without data, `columns` to a row, of stripes so many pixels wide.
pub(super) fn hatched(pixel: usize, columns: usize, stripe: usize) -> Ink {
    NO_DATA[(pixel % columns + pixel / columns) / stripe % 2]
}

/// Height of a bar, pixels.
const HEIGHT: f64 = 14.0;

/// Places in [0, 1] on a logarithmic scale, and the numbers there.
pub(super) fn log_ticks(ends: [f64; 2], length: f64) -> Vec<(f64, String)> {
    let axis = PlotAxis::log("").within(ends);
    Ruler::new(&axis, std::iter::empty(), length, true).labelled
}

/// Draws a bar of colours from its left end (0) to its right (1), the numbers of `ticks` below it and a
/// caption below these, 44 pixels high in all.
pub(super) fn bar(
    canvas: &mut Canvas,
    [middle, y]: [f64; 2],
    length: f64,
    colour: impl Fn(f64) -> Ink,
    ticks: &[(f64, String)],
    caption: &str,
) {
    const STEPS: usize = 256;
    let colours = (0..STEPS).map(|i| colour((i as f64 + 0.5) / STEPS as f64));
    let png = encoded(&colours.collect::<Vec<_>>(), STEPS);
    let (left, below) = (middle - 0.5 * length, y + HEIGHT);
    canvas.image([left, y], [length, HEIGHT], &png);
    canvas.frame([left, y], [left + length, below], FRAME);
    for (t, number) in ticks {
        let x = left + length * t;
        canvas.line(&[[x, below], [x, below + 3.0]], FRAME, 0.8);
        let how = Lettering::new(10.0, Align::Middle);
        canvas.text([x, below + 11.0], number, how);
    }
    text(canvas, [middle, below + 28.0], caption, 11.5, false);
}

/// What a colour means; every other stripe has the second one.
#[derive(Clone, Copy)]
pub(super) struct Swatch<'a> {
    pub ink: Ink,
    pub stripes: Option<Ink>,
    pub name: &'a str,
}

impl<'a> Swatch<'a> {
    pub(crate) const OUTSIDE: Self = Swatch::new(OUTSIDE, "below the horizon");
    pub(crate) const NO_DATA: Self = Swatch {
        stripes: Some(NO_DATA[1]),
        ..Swatch::new(NO_DATA[0], "no data")
    };

    pub(crate) const fn new(ink: Ink, name: &'a str) -> Self {
        Self {
            ink,
            stripes: None,
            name,
        }
    }
}

/// Draws boxes with their names, in a line about `middle`.
pub(super) fn swatches(canvas: &mut Canvas, [middle, y]: [f64; 2], all: &[Swatch<'_>]) {
    let length = |s: &Swatch<'_>| 40.0 + text_width(s.name, 11.5);
    let mut x = middle - 0.5 * all.iter().map(length).sum::<f64>();
    for swatch in all {
        let (right, above, below) = (x + 16.0, y - 6.0, y + 6.0);
        canvas.block([x, above], [right, below], swatch.ink);
        for from in [x + 1.0, x + 8.0] {
            if let Some(ink) = swatch.stripes {
                let ends = [[from, below - 1.5], [from + 7.0, above + 1.5]];
                canvas.line(&ends, ink, 2.5);
            }
        }
        canvas.frame([x, above], [right, below], FRAME);
        let how = Lettering::new(11.5, Align::Start);
        canvas.text([x + 21.0, y], swatch.name, how);
        x += length(swatch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parametrization;

    #[test]
    fn the_edge_of_the_horizon_is_where_formulas_put_it() {
        let edge =
            |name: &str, phi: f64| Plane::new(&parametrization::find(name).unwrap()).edge(phi);
        // In the plane of incidence the outer direction is θ_h + θ_d from the normal, and the
        // longer projection |h̄| + |k̄|; across it |h̄|² + |k̄|² = 1, and |k| = |k̄|.
        for [u, v] in edge("half-difference", 0.0) {
            assert!((u + v - 1.0).abs() < 1e-6 || u == 1.0);
        }
        for [u, v] in edge("orthographic", 0.0) {
            assert!((u + v - 1.0).abs() < 1e-6 || u == 1.0);
        }
        for name in ["orthographic", "hybrid"] {
            for [u, v] in edge(name, FRAC_PI_2) {
                assert!((u * u + v * v - 1.0).abs() < 1e-6 || u == 1.0);
            }
        }
        for [_, v] in edge("spherical", 0.3) {
            assert!(v > 1.0 - 1e-6 || v == 0.0);
        }
    }

    #[test]
    fn thin_lines_are_the_same_lines() {
        let arc = |i: usize| {
            let (s, c) = (0.01 * i as f64).sin_cos();
            [80.0 * c, 80.0 * s]
        };
        let line: Vec<_> = (0..=628).map(arc).collect();
        let thin = thinned(&line);
        assert!(thin.len() < 120 && thin[0] == line[0] && thin.last() == line.last());
        for w in thin.windows(2) {
            let middle = [0, 1].map(|d| 0.5 * (w[0][d] + w[1][d]));
            assert!((middle[0].hypot(middle[1]) - 80.0).abs() < 0.1);
        }
        assert_eq!(thinned(&[[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]]).len(), 2);
        assert!(thinned(&[]).is_empty());
    }
}
