//! A diagram whose lines carry their names at their ends: it reads in grey too.

use super::canvas::{Align, Canvas, Lettering, fitted, text_width};
use super::{LEGEND, MARGIN, Sheet, palette};
use crate::error::Error;
use crate::report::svg::plot::{Mark, Panel, Series};

/// Width and height of the frame: two diagrams stand side by side on a page.
const PLOT: [f64; 2] = [340.0, 270.0];
/// Distance of the lines of two names.
const LINE: f64 = 14.0;
/// Room between the frame and a name.
const GAP: f64 = 14.0;
/// Largest width of a name, pixels.
const WIDEST: f64 = 150.0;

/// Draws one panel, with dots on its points and the names of its lines right of them.
///
/// # Errors
/// [`Error::Internal`] if drawing fails, which it should not.
pub fn labelled(panel: &Panel) -> Result<String, Error> {
    let mut bare = panel.clone();
    for series in &mut bare.series {
        series.name.clear();
    }
    let dots = panel.series.iter().map(|s| Series {
        name: String::new(),
        mark: Mark::Points,
        ..s.clone()
    });
    bare.series.extend(dots);
    let panels = [bare];
    let mut sheet = Sheet::sized("", &panels, 1, PLOT);
    let names = panel.series.iter().map(|s| text_width(&s.name, LEGEND));
    let widest = names.fold(0.0, f64::max).min(WIDEST);
    let placed = &sheet.panels[0];
    let right = placed.at[0] + sheet.plot[0];
    sheet.size[0] = sheet.size[0].max(right + GAP + widest + MARGIN);
    Canvas::draw(sheet.size, |canvas| {
        sheet.draw(canvas);
        let placed = &sheet.panels[0];
        let mut ends: Vec<(f64, [f64; 2], &Series)> = panel
            .series
            .iter()
            .filter_map(|s| {
                let end = s.points.iter().rev().find_map(|&p| sheet.at(placed, p))?;
                Some((end[1], end, s))
            })
            .collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [top, bottom] = [placed.at[1], placed.at[1] + sheet.plot[1]].map(|y| y - 0.5 * LINE);
        let mut heights: Vec<f64> = ends.iter().map(|e| e.0).collect();
        spread(&mut heights, top + LINE, bottom);
        for ((_, end, series), height) in ends.into_iter().zip(heights) {
            let ink = palette(series.color, sheet.colors);
            let at = [right + GAP, height];
            canvas.line(&[end, [right + 3.0, end[1]]], ink, 0.4);
            canvas.line(&[[right + 3.0, end[1]], [at[0] - 3.0, height]], ink, 0.4);
            let name = fitted(&series.name, LEGEND, WIDEST);
            canvas.text(at, &name, Lettering::new(LEGEND, Align::Start));
        }
        Ok(())
    })
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

    #[test]
    fn every_line_has_its_name() {
        let series = |name: &str, color, last| Series {
            name: name.into(),
            color,
            mark: Mark::Line,
            points: vec![(1.0, Some(2.0)), (3.0, last)],
        };
        let panel = Panel {
            series: vec![
                series("one", 0, Some(1.0)),
                series("two", 1, None),
                series("<three>", 2, Some(1.0)),
            ],
            ..Panel::default()
        };
        let text = labelled(&panel).unwrap();
        for name in ["\none\n", "\ntwo\n", "\n&lt;three&gt;\n"] {
            assert_eq!(text.matches(name).count(), 1, "{name}");
        }
        // The one above 1 keeps clear of axes alone.
        assert!(labelled(&Panel::default()).unwrap().contains("no data"));
    }
}
