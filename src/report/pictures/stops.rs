//! The pairs that one stop of an instrument that takes pictures reads, in each parametrization.

use super::hemispheres::place;
use super::plot::{BELOW, LEFT, MARGIN, NAME, Plane, Plot, text, text_upwards};
use crate::geometry::{DirectionPair, Symmetry};
use crate::parametrization::{ParametrizationSpec, usual_form};
use crate::registry::Entry;
use crate::report::svg::canvas::Canvas;
use crate::report::svg::plot::palette;
use crate::schedule::{Draws, Pictures, StopAngle};

const SIDE: f64 = 190.0;
const TOP: f64 = 74.0;

/// Pairs of a stop that are drawn.
const PAIRS: usize = 100;

/// A column per parametrization, its first two axes. In the upper row dots of one colour are pairs of one θ_d, which a camera reads at a
/// stop before a sphere, in the lower one pairs of one θ_i, which it reads in a mirror; both at these angles, degrees.
pub fn stops_svg(parametrizations: &[Entry<ParametrizationSpec>], angles_deg: &[f64]) -> String {
    let planes: Vec<_> = parametrizations.iter().map(Plane::new).collect();
    let rows = [
        (StopAngle::ThetaD, "sphere: stops of one θ_d"),
        (StopAngle::ThetaI, "mirror: stops of one θ_i"),
    ];
    let (column, row) = (LEFT + SIDE + MARGIN, SIDE + BELOW + MARGIN);
    let width = MARGIN + NAME + planes.len() as f64 * column;
    let height = TOP + rows.len() as f64 * row + 20.0;
    let title = "Pairs of one stop of instruments that take pictures";
    Canvas::titled(title, [width, height], 24.0, |canvas| {
        let left = |k: usize| MARGIN + NAME + LEFT + k as f64 * column;
        for (k, plane) in planes.iter().enumerate() {
            text(
                canvas,
                [left(k) + 0.5 * SIDE, TOP - 16.0],
                plane.name,
                13.0,
                true,
            );
        }
        for (j, (stop, name)) in rows.into_iter().enumerate() {
            let y = TOP + j as f64 * row;
            text_upwards(canvas, [MARGIN + 0.5 * NAME, y + 0.5 * SIDE], name);
            let pairs = pairs(stop, angles_deg);
            for (k, plane) in planes.iter().enumerate() {
                let plot = Plot::new([left(k), y], SIDE);
                for (i, pairs) in pairs.iter().enumerate() {
                    let ink = palette(i, angles_deg.len());
                    let places = pairs.iter().filter_map(|pair| place(plane, &Some(*pair)));
                    places.for_each(|at| canvas.dot(plot.place(at), 1.4, ink));
                }
                plot.axes(canvas, plane, None);
            }
        }
        for (i, angle) in angles_deg.iter().enumerate() {
            let x = 0.5 * width + 60.0 * (i as f64 - 0.5 * angles_deg.len() as f64);
            canvas.dot([x, height - 16.0], 4.0, palette(i, angles_deg.len()));
            text(
                canvas,
                [x + 22.0, height - 12.0],
                &format!("{angle}°"),
                11.5,
                false,
            );
        }
    })
}

/// Pairs of stops at these angles.
fn pairs(stop: StopAngle, angles_deg: &[f64]) -> Vec<Vec<DirectionPair>> {
    let form = usual_form(Symmetry::FULL);
    let set = Pictures {
        stop,
        ..Pictures::default()
    };
    let mut draws = Draws::new(1, &*form);
    let mut picture = |angle: &f64| {
        let at = [angle.to_radians(), 0.0];
        let poses = draws.picture(&set, &*form, at, PAIRS, |_| true);
        poses.into_iter().map(|pose| pose.pair).collect()
    };
    angles_deg.iter().map(&mut picture).collect()
}
