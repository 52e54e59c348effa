//! A diagram whose lines carry their names at their ends: it reads in grey too.

use super::canvas::{Align, Canvas, Lettering, all_fitted, text_width};
use super::{LEGEND, MARGIN, Sheet, palette};
use crate::report::svg::marker::Shape;
use crate::report::svg::plot::{Mark, Panel, Series};

/// Width and height of the frame: the diagram can be read on a narrow screen, and two stand side by
/// side on a wide one.
const PLOT: [f64; 2] = [280.0, 240.0];
/// Distance of the lines of two names.
const LINE: f64 = 14.0;
/// Room between the frame and a name.
const GAP: f64 = 14.0;
/// Largest width of a name, pixels.
const WIDEST: f64 = 180.0;

/// Draws one panel, with marks on its points, whose tooltips are their values, and the names of its lines
/// right of them, if they have any.
pub fn labelled(panel: &Panel) -> String {
    let mut bare = panel.clone();
    for series in &mut bare.series {
        series.name.clear();
    }
    let panels = [bare];
    // A line for each name.
    let named = panel.series.iter().filter(|s| !s.name.is_empty()).count();
    let plot = [PLOT[0], PLOT[1].max(LINE * named as f64)];
    let mut sheet = Sheet::new("", &panels, 1, plot);
    let lines = panel.series.iter().filter(|s| s.mark != Mark::Area);
    let lines: Vec<&Series> = lines.collect();
    let names: Vec<&str> = lines.iter().map(|s| s.name.as_str()).collect();
    let names = all_fitted(&names, LEGEND, WIDEST);
    let widest = names.iter().map(|n| text_width(n, LEGEND));
    let widest = widest.fold(0.0, f64::max);
    let placed = &sheet.panels[0];
    let right = placed.at[0] + sheet.plot[0];
    sheet.size[0] = sheet.size[0].max(right + GAP + widest + MARGIN);
    Canvas::titled("", sheet.size, 0.0, |canvas| {
        sheet.draw(canvas);
        let placed = &sheet.panels[0];
        let mut ends = Vec::new();
        for (series, name) in lines.into_iter().zip(names) {
            let ink = palette(series.color, sheet.colors);
            let mut end = None;
            for &point in &series.points {
                let (Some(at), Some(y)) = (sheet.position(placed, point), point.1) else {
                    continue;
                };
                let values = format!(
                    "{}\n{} {}\n{} {}",
                    series.name,
                    panel.x.label,
                    short(point.0),
                    panel.y.label,
                    short(y)
                );
                let shape = Shape::of(series.color);
                canvas.tooltip(&values, |canvas| canvas.marker(shape, at, 3.2, ink));
                end = Some(at);
            }
            let end = end.filter(|_| !name.is_empty());
            ends.extend(end.map(|end| (end, ink, name)));
        }
        ends.sort_by(|a, b| a.0[1].total_cmp(&b.0[1]));
        let [top, bottom] = [placed.at[1], placed.at[1] + sheet.plot[1]].map(|y| y - 0.5 * LINE);
        let mut heights: Vec<f64> = ends.iter().map(|e| e.0[1]).collect();
        spread(&mut heights, top + LINE, bottom);
        for ((end, ink, name), height) in ends.into_iter().zip(heights) {
            let at = [right + GAP, height];
            let bend = [right + 3.0, end[1]];
            canvas.line(&[end, bend, [at[0] - 3.0, height]], ink, 0.4);
            canvas.text(at, &name, Lettering::new(LEGEND, Align::Start));
        }
    })
}

/// A value with three digits.
fn short(value: f64) -> String {
    match value.abs() {
        v if (1e-3..1e4).contains(&v) => {
            let decimals = (2.0 - v.log10().floor()).max(0.0) as usize;
            format!("{value:.decimals$}")
        }
        0.0 => "0".into(),
        v if (1e4..1e7).contains(&v) => format!("{value:.0}"),
        _ => format!("{value:.2e}"),
    }
}

/// Moves sorted heights between `top` and `bottom` apart by a line each, as little as possible.
fn spread(heights: &mut [f64], top: f64, bottom: f64) {
    // Names that touch form a block about the mean of where they would be.
    let mut blocks: Vec<(f64, usize)> = Vec::new();
    for &height in heights.iter() {
        let mut block = (height.clamp(top, bottom.max(top)), 1);
        while let Some(&(middle, count)) = blocks.last() {
            let apart = 0.5 * LINE * (count + block.1) as f64;
            if block.0 - middle >= apart {
                break;
            }
            let all = count + block.1;
            let mean = (middle * count as f64 + block.0 * block.1 as f64) / all as f64;
            block = (mean, all);
            blocks.pop();
        }
        let half = 0.5 * LINE * (block.1 - 1) as f64;
        block.0 = block.0.min(bottom - half).max(top + half);
        blocks.push(block);
    }
    let placed = blocks.iter().flat_map(|&(middle, count)| {
        (0..count).map(move |i| middle + LINE * (i as f64 - 0.5 * (count - 1) as f64))
    });
    for (height, place) in heights.iter_mut().zip(placed) {
        *height = place;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_do_not_lie_over_one_another() {
        let cases: [&[f64]; 4] = [
            &[50.0],
            &[50.0, 50.0, 50.0],
            &[0.0, 1.0, 90.0, 200.0, 200.0, 500.0],
            &[10.0, 100.0, 190.0],
        ];
        for case in cases {
            let mut heights = case.to_vec();
            spread(&mut heights, 5.0, 195.0);
            for pair in heights.windows(2) {
                assert!(pair[1] - pair[0] >= LINE - 1e-9, "{case:?} {heights:?}");
            }
            assert!(heights[0] >= 5.0 - 1e-9 && heights[case.len() - 1] <= 195.0 + 1e-9);
        }
        let mut far = [10.0, 100.0, 190.0];
        spread(&mut far, 5.0, 195.0);
        assert_eq!(far, [10.0, 100.0, 190.0]);
    }
}
