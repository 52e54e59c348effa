//! Sheets of diagrams as SVG.

pub(in crate::report) mod axis;
pub(in crate::report) mod canvas;
mod clip;
mod forest;
mod labelled;
pub(in crate::report) mod marker;
pub(in crate::report) mod plot;
#[cfg(test)]
mod tests;

pub use forest::forest_svg;
pub use labelled::labelled;

use crate::report::each_once;
use axis::Ruler;
use canvas::{Align, Canvas, Ink, Lettering, all_fitted, text_width, wrapped};
use clip::{clipped, clipped_area};
use marker::Shape;
use plot::{Mark, Panel, Series, palette};

const MARGIN: f64 = 16.0;
const TITLE: f64 = 17.0;
const PANEL_TITLE: f64 = 13.0;
/// Height of a line of a panel's title.
const PANEL_LINE: f64 = 17.0;
const LABEL: f64 = 12.0;
const LEGEND: f64 = 11.5;
/// Height of a line of the legend.
const LEGEND_LINE: f64 = 17.0;
/// Width of the stroke in front of a name.
const KEY: f64 = 24.0;
/// The most points of a line that are marked.
const MARKED: usize = 12;
pub(in crate::report) const FRAME: Ink = [90, 90, 90];
pub(in crate::report) const GRID: Ink = [228, 228, 228];
const FAINT: Ink = [130, 130, 130];

/// Draws panels row after row, `columns` in a row (at least one), below a title, whose further lines are notes in
/// smaller letters. Names of series stand below the panels: once if no two are of one colour and mark, else below each.
pub fn svg(title: &str, panels: &[Panel], columns: usize) -> String {
    let columns = columns.clamp(1, panels.len().max(1));
    let plot = if columns == 1 {
        [560.0, 340.0]
    } else {
        [380.0, 250.0]
    };
    let sheet = Sheet::new(title, panels, columns, plot);
    Canvas::titled(title, sheet.size, MARGIN + 0.7 * TITLE, |canvas| {
        sheet.draw(canvas)
    })
}

/// Layout of a sheet.
struct Sheet<'a> {
    panels: Vec<Placed<'a>>,
    /// The legend of all panels, and the height at which it starts.
    legend: Option<(Legend<'a>, f64)>,
    /// Width and height of each plot.
    plot: [f64; 2],
    size: [f64; 2],
    colors: usize,
}

/// A panel and its position.
struct Placed<'a> {
    panel: &'a Panel,
    x: Ruler,
    y: Ruler,
    /// Upper left corner of the frame.
    at: [f64; 2],
    /// Room left of the frame.
    left: f64,
    legend: Option<Legend<'a>>,
}

impl<'a> Sheet<'a> {
    /// The layout with `columns` frames in a row, of a given width and height, pixels.
    fn new(title: &'a str, panels: &'a [Panel], columns: usize, plot: [f64; 2]) -> Self {
        let rulers = panels.iter().map(|panel| {
            let points = || panel.series.iter().flat_map(|s| s.points.iter());
            let shown = |p: &(f64, Option<f64>)| p.1.filter(|y| y.is_finite()).map(|_| p.0);
            let x = Ruler::new(&panel.x, points().filter_map(shown), plot[0], true);
            let y = Ruler::new(&panel.y, points().filter_map(|p| p.1), plot[1], false);
            (x, y)
        });
        let rulers: Vec<_> = rulers.collect();
        let labels = rulers.iter().flat_map(|(_, y)| &y.labelled);
        let widest = labels.map(|(_, l)| text_width(l, axis::SIZE));
        let left = 10.0 + widest.fold(20.0, f64::max) + 10.0 + LABEL;
        let labels = rulers.iter().filter_map(|(x, _)| x.labelled.last());
        let last = labels.map(|(_, l)| 0.5 * text_width(l, axis::SIZE));
        let right = 6.0 + last.fold(8.0, f64::max);
        let cell = left + plot[0] + right;
        let width = 2.0 * MARGIN + columns as f64 * cell;

        let entries: Vec<_> = panels.iter().map(entries).collect();
        // One for all panels, if a colour and a mark have the same name in all.
        let union = each_once(entries.iter().flatten().copied());
        let looks = each_once(union.iter().map(|(_, color, mark)| (*color, *mark)));
        let shared = panels.len() > 1 && !union.is_empty() && looks.len() == union.len();
        let mut top = MARGIN;
        if !title.is_empty() {
            top += 2.0 * TITLE;
        }
        let mut placed = Vec::with_capacity(panels.len());
        let mut rest = panels.iter().zip(rulers).zip(&entries).peekable();
        while rest.peek().is_some() {
            let row: Vec<_> = rest.by_ref().take(columns).collect();
            let titles = row.iter().map(|((p, _), _)| p.title.as_str());
            let titles = titles.filter(|title| !title.is_empty());
            let lines = titles.map(|title| wrapped(title, 1.08 * PANEL_TITLE, plot[0]).len());
            if let Some(most) = lines.max() {
                top += 2.0 * PANEL_TITLE + (most - 1) as f64 * PANEL_LINE;
            }
            let mut lowest = 0.0f64;
            for (i, ((panel, (x, y)), entries)) in row.into_iter().enumerate() {
                let legend = (!shared && !entries.is_empty())
                    .then(|| Legend::new(entries.clone(), plot[0] + right));
                lowest = lowest.max(legend.as_ref().map_or(0.0, |l| l.height() + 6.0));
                placed.push(Placed {
                    panel,
                    x,
                    y,
                    at: [MARGIN + i as f64 * cell + left, top],
                    left,
                    legend,
                });
            }
            top += plot[1] + 2.0 * axis::SIZE + 2.0 * LABEL + 8.0 + lowest;
        }
        let legend = shared.then(|| {
            let legend = Legend::new(union, width - 2.0 * MARGIN);
            let at = top + 4.0;
            top = at + legend.height();
            (legend, at)
        });
        let colors = panels.iter().flat_map(|p| &p.series).map(|s| s.color);
        Self {
            panels: placed,
            legend,
            plot,
            size: [width, top + MARGIN],
            colors: colors.max().map_or(0, |c| c.saturating_add(1)),
        }
    }

    fn draw(&self, canvas: &mut Canvas) {
        for placed in &self.panels {
            self.axes(canvas, placed);
            for series in &placed.panel.series {
                self.series(canvas, placed, series);
            }
            if let Some(legend) = &placed.legend {
                let [x, y] = placed.at;
                let below = y + self.plot[1] + 2.0 * axis::SIZE + 2.0 * LABEL;
                legend.draw(canvas, self, [x, below]);
            }
        }
        if let Some((legend, at)) = &self.legend {
            legend.draw(canvas, self, [MARGIN + 20.0, *at]);
        }
    }

    fn axes(&self, canvas: &mut Canvas, placed: &Placed<'_>) {
        let [w, h] = self.plot;
        let [x0, y0] = placed.at;
        let (x1, y1) = (x0 + w, y0 + h);
        let panel = placed.panel;
        for t in placed.x.labelled.iter().map(|l| l.0) {
            canvas.line(&[[x0 + t * w, y0], [x0 + t * w, y1]], GRID, 0.8);
        }
        for t in placed.y.labelled.iter().map(|l| l.0) {
            canvas.line(&[[x0, y1 - t * h], [x1, y1 - t * h]], GRID, 0.8);
        }
        canvas.frame([x0, y0], [x1, y1], FRAME);
        let mut how = Lettering::new(axis::SIZE, Align::Middle);
        for t in &placed.x.minor {
            canvas.line(&[[x0 + t * w, y1], [x0 + t * w, y1 - 3.0]], FRAME, 0.7);
        }
        for (t, label) in &placed.x.labelled {
            let x = x0 + t * w;
            canvas.line(&[[x, y1], [x, y1 - 5.0]], FRAME, 0.9);
            canvas.text([x, y1 + 4.0 + 0.6 * axis::SIZE], label, how);
        }
        how.align = Align::End;
        for t in &placed.y.minor {
            canvas.line(&[[x0, y1 - t * h], [x0 + 3.0, y1 - t * h]], FRAME, 0.7);
        }
        for (t, label) in &placed.y.labelled {
            let y = y1 - t * h;
            canvas.line(&[[x0, y], [x0 + 5.0, y]], FRAME, 0.9);
            canvas.text([x0 - 5.0, y], label, how);
        }
        let how = Lettering::new(LABEL, Align::Middle);
        let below = y1 + 4.0 + 1.3 * axis::SIZE + LABEL;
        let fitted = how.within(&panel.x.label, w + placed.left);
        canvas.text([x0 + 0.5 * w, below], &panel.x.label, fitted);
        let before = x0 - placed.left + 0.5 * LABEL + 6.0;
        let fitted = how.within(&panel.y.label, h + 20.0);
        canvas.text([before, y0 + 0.5 * h], &panel.y.label, fitted.upwards());
        let bold = Lettering::new(PANEL_TITLE, Align::Middle).bold();
        let title = wrapped(&panel.title, 1.08 * PANEL_TITLE, w);
        for (i, line) in title.iter().rev().enumerate() {
            let y = y0 - PANEL_TITLE - i as f64 * PANEL_LINE;
            canvas.text([x0 + 0.5 * w, y], line, bold);
        }
        let drawn = |s: &Series| s.points.iter().any(|&p| self.position(placed, p).is_some());
        if !panel.series.iter().any(drawn) {
            let middle = [x0 + 0.5 * w, y0 + 0.5 * h];
            canvas.text(middle, "no data", how.ink(FAINT));
        }
    }

    /// Position of a point, pixels; may be outside the frame; `None` if an axis cannot show it.
    fn position(&self, placed: &Placed<'_>, (x, y): (f64, Option<f64>)) -> Option<[f64; 2]> {
        let [x, y] = [placed.x.place(x)?, placed.y.place(y?)?];
        Some([
            placed.at[0] + x * self.plot[0],
            placed.at[1] + (1.0 - y) * self.plot[1],
        ])
    }

    fn series(&self, canvas: &mut Canvas, placed: &Placed<'_>, series: &Series) {
        let ink = palette(series.color, self.colors);
        let frame = [
            [placed.at[0], placed.at[0] + self.plot[0]],
            [placed.at[1], placed.at[1] + self.plot[1]],
        ];
        let inside =
            |p: [f64; 2]| (0..2).all(|i| p[i] >= frame[i][0] - 0.5 && p[i] <= frame[i][1] + 0.5);
        let points: Vec<_> = series
            .points
            .iter()
            .map(|&p| self.position(placed, p))
            .collect();
        let shape = Shape::of(series.color);
        if series.mark == Mark::Points {
            let radius = if points.len() > 150 { 1.6 } else { 2.8 };
            for p in points.into_iter().flatten().filter(|&p| inside(p)) {
                canvas.marker(shape, p, radius, ink);
            }
            return;
        }
        let Some(dashes) = series.mark.dashes() else {
            let corners: Vec<_> = points.into_iter().flatten().collect();
            let corners = clipped_area(&corners, frame);
            if !corners.is_empty() {
                canvas.area(&corners, ink, 0.16);
            }
            return;
        };
        for run in points.split(Option::is_none) {
            let run: Vec<_> = run.iter().flatten().copied().collect();
            if let [only] = run[..] {
                // A line through one point would not be seen.
                if inside(only) {
                    canvas.dot(only, 1.4 * self.stroke(), ink);
                }
            }
            for line in clipped(&run, frame) {
                canvas.dashed(&line, ink, self.stroke(), dashes);
            }
        }
        if series.name.is_empty() || entries(placed.panel).len() < 2 {
            return;
        }
        // Of curves on one another each shows some of its own.
        let every = points.len().div_ceil(MARKED);
        let first = series.color % every.max(1);
        let marked = points.into_iter().skip(first).step_by(every.max(1));
        for p in marked.flatten().filter(|&p| inside(p)) {
            canvas.marker(shape, p, 1.9 * self.stroke(), ink);
        }
    }

    /// Width of lines: thin where there are many.
    fn stroke(&self) -> f64 {
        if self.colors > plot::CYCLE.len() {
            1.0
        } else {
            1.7
        }
    }
}

impl Mark {
    /// Lengths of the strokes and gaps of the line through points, tenths of a pixel; round ends make strokes longer by
    /// a width. Empty: one stroke; `None` of marks without a line.
    fn dashes(self) -> Option<&'static str> {
        match self {
            Self::Line => Some(""),
            Self::Dashed => Some("60 45"),
            Self::Dotted => Some("1 38"),
            Self::DashDotted => Some("70 40 1 40"),
            Self::Points | Self::Area => None,
        }
    }
}

/// Name, colour and mark of a series in a legend.
type Entry<'a> = (&'a str, usize, Mark);

/// The named series of a panel, each once.
fn entries(panel: &Panel) -> Vec<Entry<'_>> {
    let named = panel.series.iter().filter(|s| !s.name.is_empty());
    each_once(named.map(|s| (s.name.as_str(), s.color, s.mark)))
}

/// Names in columns, read downwards.
struct Legend<'a> {
    entries: Vec<Entry<'a>>,
    lines: usize,
    /// Width of a column.
    column: f64,
}

impl<'a> Legend<'a> {
    fn new(entries: Vec<Entry<'a>>, width: f64) -> Self {
        let widest = entries.iter().map(|e| text_width(e.0, LEGEND));
        let column = (KEY + 6.0 + widest.fold(0.0, f64::max) + 18.0).min(width);
        let columns = ((width + 18.0) / column).floor().max(1.0) as usize;
        Self {
            lines: entries.len().div_ceil(columns),
            entries,
            column,
        }
    }

    fn height(&self) -> f64 {
        LEGEND_LINE * self.lines as f64
    }

    fn draw(&self, canvas: &mut Canvas, sheet: &Sheet<'_>, at: [f64; 2]) {
        let names: Vec<&str> = self.entries.iter().map(|e| e.0).collect();
        let names = all_fitted(&names, LEGEND, self.column - KEY - 6.0);
        for (i, (_, color, mark)) in self.entries.iter().enumerate() {
            let x = at[0] + (i / self.lines) as f64 * self.column;
            let y = at[1] + ((i % self.lines) as f64 + 0.5) * LEGEND_LINE;
            let ink = palette(*color, sheet.colors);
            let key = [[x, y], [x + KEY, y]];
            // A little wider than in the plot: short strokes look alike.
            if let Some(dashes) = mark.dashes() {
                canvas.dashed(&key, ink, sheet.stroke() + 0.5, dashes);
            }
            if self.entries.len() > 1 || mark.dashes().is_none() {
                canvas.marker(Shape::of(*color), [x + 0.5 * KEY, y], 3.2, ink);
            }
            let how = Lettering::new(LEGEND, Align::Start);
            canvas.text([x + KEY + 6.0, y], &names[i], how);
        }
    }
}
