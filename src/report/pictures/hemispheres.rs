//! Pictures of parametrizations on the hemisphere of light directions (Fig. 1 of Barla et al.
//! 2015).

use super::dome::{Dome, From};
use super::plot::{BELOW, LEFT, MARGIN, NAME, Plane, Plot, middles, text, text_upwards};
use crate::geometry::DirectionPair;
use crate::parametrization::{Axis, ParametrizationSpec, Unit};
use crate::registry::Entry;
use crate::report::svg::canvas::{Canvas, Ink};

const SIDE: f64 = 150.0;
const PIXELS: usize = 200;
const GAP: f64 = 12.0;

/// Isolines of the first axis and of the second.
const ISOLINES: [Ink; 2] = [[255, 205, 140], [150, 205, 255]];

/// A row per parametrization: its colours in the square of its first two axes (the first is orange,
/// the second blue), then the hemisphere seen along the mirror direction and along the sensor
/// ("back") for each view elevation (degrees, in [0, 90)). Isolines every 10° or 0.1.
pub fn hemispheres_svg(
    parametrizations: &[Entry<ParametrizationSpec>],
    theta_o_deg: &[f64],
) -> String {
    let planes: Vec<_> = parametrizations.iter().map(Plane::new).collect();
    let views = theta_o_deg.len() as f64;
    let row = SIDE + BELOW + GAP;
    let top = 92.0;
    let first = MARGIN + NAME + LEFT;
    let mirror = first + SIDE + 3.0 * GAP;
    let back = mirror + views * (SIDE + GAP) + 2.0 * GAP;
    let width = back + views * (SIDE + GAP) + MARGIN - GAP;
    let height = top + planes.len() as f64 * row + 24.0 + MARGIN;
    let title = "Coordinates on the hemisphere of light directions";
    Canvas::titled(title, [width, height], 24.0, |canvas| {
        let middle = 0.5 * width;
        text(canvas, [first + 0.5 * SIDE, 58.0], "colours", 13.0, true);
        let groups = [
            (mirror, From::Mirror, "seen along the mirror direction"),
            (back, From::Back, "seen along the sensor (back direction)"),
        ];
        for (x, _, name) in groups {
            let middle = x + 0.5 * (views * (SIDE + GAP) - GAP);
            text(canvas, [middle, 54.0], name, 13.0, true);
            for (i, theta) in theta_o_deg.iter().enumerate() {
                let middle = x + i as f64 * (SIDE + GAP) + 0.5 * SIDE;
                let title = format!("θ_o = {theta}°");
                text(canvas, [middle, 76.0], &title, 12.5, false);
            }
        }
        for (j, plane) in planes.iter().enumerate() {
            let y = top + j as f64 * row;
            let at = [MARGIN + 0.5 * NAME - 4.0, y + 0.5 * SIDE];
            text_upwards(canvas, at, plane.name);
            let plot = |x: f64| Plot::new([x, y], SIDE);
            let key = plot(first);
            let values: Vec<_> = middles(PIXELS).map(Some).collect();
            colours(canvas, &key, plane, &values);
            key.axes(canvas, plane, None);
            for (x, from, _) in groups {
                for (i, theta) in theta_o_deg.iter().enumerate() {
                    let plot = plot(x + i as f64 * (SIDE + GAP));
                    let dome = Dome::new(from, theta.to_radians());
                    let values: Vec<_> =
                        dome.pairs(PIXELS).iter().map(|p| place(plane, p)).collect();
                    colours(canvas, &plot, plane, &values);
                    dome.outline(canvas, &plot);
                }
            }
        }
        let says = |plane: &Plane| format!("{}: {}, {}", plane.name, plane.x.label, plane.y.label);
        let axes: Vec<_> = planes.iter().map(says).collect();
        let caption = format!(
            "orange: first axis, blue: second axis, isolines every 10° or 0.1   ({})   \
             dot: mirror direction, circle: sensor, cross: normal",
            axes.join("; ")
        );
        let below = height - MARGIN - 4.0;
        text(canvas, [middle, below], &caption, 11.5, false);
    })
}

/// Places along the first two axes, in [0, 1].
pub(super) fn place(plane: &Plane, pair: &Option<DirectionPair>) -> Option<[f64; 2]> {
    let coords = plane.form.forward(pair.as_ref()?);
    let along = |axis: &Axis, v: f64| (v - axis.range[0]) / axis.length();
    Some([along(&plane.x, coords[0]), along(&plane.y, coords[1])])
}

fn colours(canvas: &mut Canvas, plot: &Plot, plane: &Plane, values: &[Option<[f64; 2]>]) {
    let colour = |v: &Option<[f64; 2]>| match v {
        // Bent a little, so that small coordinates are not all black.
        Some(v) => {
            let [a, b] = v.map(|v| v.powf(0.8));
            [230.0 * a + 10.0 * b, 135.0 * a + 95.0 * b, 235.0 * b].map(|c| c as u8)
        }
        None => [255; 3],
    };
    let pixels: Vec<_> = values.iter().map(colour).collect();
    plot.raster(canvas, &pixels);
    for (which, axis) in [&plane.x, &plane.y].into_iter().enumerate() {
        let along: Vec<_> = values.iter().map(|v| v.map(|v| v[which])).collect();
        let steps = match axis.unit {
            Unit::Radian => 9,
            Unit::One => 10,
        };
        for i in 1..steps {
            let level = f64::from(i) / f64::from(steps);
            plot.isolines(canvas, &along, level, ISOLINES[which], 0.9);
        }
    }
}
