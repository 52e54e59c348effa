//! Ratios with their intervals, one below the other.

use super::canvas::{Align, Canvas, Lettering, all_fitted, fitted, text_width};
use super::{FAINT, FRAME, GRID, LABEL, LEGEND, MARGIN, axis, palette};
use crate::report::svg::marker::Shape;
use crate::report::svg::plot::{Axis, Forest};
use axis::Ruler;

const LINE: f64 = 17.0;
/// Width of the axis: with the notes beside it narrow enough for a narrow screen.
const WIDTH: f64 = 230.0;
/// Largest width of a name above its lines, pixels.
const WIDEST: f64 = 420.0;

/// Draws groups of ratios on a logarithmic axis, each below its name, with a line at 1 and the band of
/// no difference.
pub fn forest_svg(forest: &Forest) -> String {
    let lines = || forest.groups.iter().flat_map(|g| &g.lines);
    let ends = lines().flat_map(|l| {
        let interval = l.interval.into_iter().flatten();
        interval.chain([l.ratio])
    });
    let values: Vec<f64> = ends.chain([1.0 / forest.band, forest.band]).collect();
    let x = Ruler::new(&Axis::log(&forest.label), values.into_iter(), WIDTH, true);
    let widest = |names: &mut dyn Iterator<Item = &String>| {
        let widths = names.map(|n| text_width(n, LEGEND));
        widths.fold(0.0, f64::max)
    };
    let groups: Vec<&str> = forest.groups.iter().map(|g| g.name.as_str()).collect();
    let groups = all_fitted(&groups, LEGEND, WIDEST);
    let line = widest(&mut lines().map(|l| &l.name));
    let note = widest(&mut lines().map(|l| &l.note));
    let left = MARGIN + line + 10.0;
    let rows = lines().count() as f64 + 1.4 * groups.len() as f64;
    let bottom = MARGIN + rows * LINE;
    let beside = left + WIDTH + 12.0 + note;
    // Bold letters are wider.
    let width = beside.max(MARGIN + 1.08 * widest(&mut groups.iter())) + MARGIN;
    let size = [width, bottom + 2.0 * axis::SIZE + 2.0 * LABEL + 8.0];
    let place = |v: f64| x.place(v).map(|t| left + t.clamp(0.0, 1.0) * WIDTH);
    Canvas::titled("", size, 0.0, |canvas| {
        // Beside the lines of each group: its name, above them, may be wide and stays clear.
        let mut top = MARGIN;
        for group in &forest.groups {
            let start = top + 1.2 * LINE;
            top += (1.4 + group.lines.len() as f64) * LINE;
            let across = |at: f64| [[at, start], [at, top]];
            if let (Some(a), Some(b)) = (place(1.0 / forest.band), place(forest.band)) {
                canvas.block([a, start], [b, top], GRID);
            }
            for (t, _) in &x.labelled {
                canvas.line(&across(left + t * WIDTH), GRID, 0.8);
            }
            if let Some(one) = place(1.0) {
                canvas.line(&across(one), FRAME, 1.2);
            }
        }
        let mut how = Lettering::new(axis::SIZE, Align::Middle);
        for t in &x.minor {
            let at = left + t * WIDTH;
            canvas.line(&[[at, bottom], [at, bottom + 3.0]], FRAME, 0.8);
        }
        for (t, label) in &x.labelled {
            let at = left + t * WIDTH;
            canvas.line(&[[at, bottom], [at, bottom + 5.0]], FRAME, 0.8);
            canvas.text([at, bottom + 6.0 + 0.6 * axis::SIZE], label, how);
        }
        canvas.line(&[[left, bottom], [left + WIDTH, bottom]], FRAME, 0.8);
        how.size = LABEL;
        let label = fitted(&forest.label, LABEL, width - 2.0 * MARGIN);
        let below = bottom + 4.0 + 1.3 * axis::SIZE + LABEL;
        let half = 0.5 * text_width(&label, LABEL);
        let middle = (left + 0.5 * WIDTH).clamp(half, (width - half).max(half));
        canvas.text([middle, below], &label, how);
        let mut y = MARGIN + 0.9 * LINE;
        for (of, name) in forest.groups.iter().zip(&groups) {
            let ink = palette(of.color, 0);
            let how = Lettering::new(LEGEND, Align::Start);
            canvas.text([MARGIN, y], name, how.bold());
            y += LINE;
            for line in &of.lines {
                let to_end = Lettering::new(LEGEND, Align::End);
                canvas.text([left - 10.0, y], &line.name, to_end);
                let values = format!("{name}\n{} {}", line.name, line.note);
                canvas.tooltip(&values, |canvas| {
                    let ends = line.interval.map(|i| i.map(place));
                    if let Some([Some(a), Some(b)]) = ends {
                        let dashes = of.mark.dashes().unwrap_or_default();
                        canvas.dashed(&[[a, y], [b, y]], ink, 1.7, dashes);
                        for end in [a, b] {
                            canvas.line(&[[end, y - 3.0], [end, y + 3.0]], ink, 1.2);
                        }
                    }
                    if let Some(at) = place(line.ratio) {
                        canvas.marker(Shape::of(of.color), [at, y], 3.6, ink);
                    }
                });
                canvas.text([left + WIDTH + 12.0, y], &line.note, how.ink(FAINT));
                y += LINE;
            }
            y += 0.4 * LINE;
        }
    })
}
