//! Sheets of diagrams as SVG.

pub(in crate::report) mod axis;
pub(in crate::report) mod canvas;
mod forest;
mod labelled;
pub(in crate::report) mod plot;
#[cfg(test)]
mod tests;

pub use forest::forest_svg;
pub use labelled::labelled;

use crate::report::each_once;
use axis::Ruler;
use canvas::{Align, Canvas, Ink, Lettering, all_fitted, fitted, text_width};
use plot::{Mark, Panel, Series, palette};

const MARGIN: f64 = 16.0;
const TITLE: f64 = 17.0;
const PANEL_TITLE: f64 = 13.0;
const LABEL: f64 = 12.0;
const LEGEND: f64 = 11.5;
/// Height of a line of the legend.
const LEGEND_LINE: f64 = 17.0;
/// Width of the stroke in front of a name.
const KEY: f64 = 24.0;
pub(in crate::report) const FRAME: Ink = [90, 90, 90];
pub(in crate::report) const GRID: Ink = [228, 228, 228];
const FAINT: Ink = [130, 130, 130];

/// Draws panels row after row, `columns` in a row (at least one), below a title.
///
/// Names of series stand below the panels: once if every panel has the same ones, else below each.
/// Equal panels give equal bytes.
pub fn svg(title: &str, panels: &[Panel], columns: usize) -> String {
    let sheet = Sheet::new(title, panels, columns);
    Canvas::draw(sheet.size, |canvas| sheet.draw(canvas))
}

/// Layout of a sheet.
struct Sheet<'a> {
    title: &'a str,
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
    fn new(title: &'a str, panels: &'a [Panel], columns: usize) -> Self {
        let columns = columns.clamp(1, panels.len().max(1));
        let plot = if columns == 1 {
            [560.0, 340.0]
        } else {
            [380.0, 250.0]
        };
        Self::sized(title, panels, columns, plot)
    }

    /// The layout with frames of a given width and height, pixels.
    fn sized(title: &'a str, panels: &'a [Panel], columns: usize, plot: [f64; 2]) -> Self {
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
        let mut named = entries.iter().filter(|e| !e.is_empty());
        let first = named.next();
        let shared = panels.len() > 1 && named.all(|e| Some(e) == first);
        let mut top = MARGIN;
        if !title.is_empty() {
            top += 2.0 * TITLE;
        }
        let mut placed = Vec::with_capacity(panels.len());
        let mut rest = panels.iter().zip(rulers).zip(&entries).peekable();
        while rest.peek().is_some() {
            let row: Vec<_> = rest.by_ref().take(columns).collect();
            if row.iter().any(|((p, _), _)| !p.title.is_empty()) {
                top += 2.0 * PANEL_TITLE;
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
        let legend = first.filter(|_| shared).map(|entries| {
            let legend = Legend::new(entries.clone(), width - 2.0 * MARGIN);
            let at = top + 4.0;
            top = at + legend.height();
            (legend, at)
        });
        let colors = panels.iter().flat_map(|p| &p.series).map(|s| s.color);
        Self {
            title,
            panels: placed,
            legend,
            plot,
            size: [width, top + MARGIN],
            colors: colors.max().map_or(0, |c| c.saturating_add(1)),
        }
    }

    fn draw(&self, canvas: &mut Canvas) {
        let [width, _] = self.size;
        let how = Lettering::new(TITLE, Align::Middle).bold();
        let title = fitted(self.title, 1.08 * TITLE, width - 2.0 * MARGIN);
        canvas.text([0.5 * width, MARGIN + 0.7 * TITLE], &title, how);
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
        let label = fitted(&panel.x.label, LABEL, w + placed.left);
        let below = y1 + 4.0 + 1.3 * axis::SIZE + LABEL;
        canvas.text([x0 + 0.5 * w, below], &label, how);
        let label = fitted(&panel.y.label, LABEL, h + 20.0);
        let before = x0 - placed.left + 0.5 * LABEL + 6.0;
        canvas.text([before, y0 + 0.5 * h], &label, how.upwards());
        let how = Lettering::new(PANEL_TITLE, Align::Middle);
        let title = fitted(&panel.title, 1.08 * PANEL_TITLE, w + placed.left);
        canvas.text([x0 + 0.5 * w, y0 - PANEL_TITLE], &title, how.bold());
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
        if series.mark == Mark::Points {
            let radius = if points.len() > 150 { 1.6 } else { 2.6 };
            for p in points.into_iter().flatten().filter(|&p| inside(p)) {
                canvas.dot(p, radius, ink);
            }
            return;
        }
        let Some(dashes) = series.mark.dashes() else {
            let corners: Vec<_> = points.into_iter().flatten().collect();
            return canvas.area(&corners, ink, 0.16);
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

/// The parts of a line inside a frame, without points too close to their neighbours to be
/// distinguished.
fn clipped(points: &[[f64; 2]], frame: [[f64; 2]; 2]) -> Vec<Vec<[f64; 2]>> {
    const APART: f64 = 0.1;
    let mut parts: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut open = false;
    for ends in points.windows(2) {
        let (a, b) = (ends[0], ends[1]);
        let mut t = [0.0f64, 1.0f64];
        for i in 0..2 {
            let d = b[i] - a[i];
            for (edge, sign) in [(frame[i][0], 1.0), (frame[i][1], -1.0)] {
                // Inside where sign (a + t d − edge) ≥ 0.
                let (at, slope) = (sign * (a[i] - edge), sign * d);
                if slope == 0.0 {
                    // A line along the edge is off it by rounding.
                    if at < -1e-6 {
                        t = [1.0, 0.0];
                    }
                } else if slope > 0.0 {
                    t[0] = t[0].max(-at / slope);
                } else {
                    t[1] = t[1].min(-at / slope);
                }
            }
        }
        if !(t[0] <= t[1]) {
            open = false;
            continue;
        }
        let [from, to] = t.map(|t| [0, 1].map(|i| a[i] + t * (b[i] - a[i])));
        if !open || t[0] > 0.0 {
            parts.push(vec![from]);
        }
        if let Some(part) = parts.last_mut() {
            let last = part[part.len() - 1];
            // The first two stay, so that a short line is still one.
            if part.len() == 1 || (to[0] - last[0]).hypot(to[1] - last[1]) >= APART {
                part.push(to);
            }
        }
        open = t[1] >= 1.0;
    }
    parts
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
            match mark.dashes() {
                Some(dashes) => canvas.dashed(&key, ink, sheet.stroke() + 0.5, dashes),
                None => canvas.dot([x + 0.5 * KEY, y], 2.8, ink),
            }
            let how = Lettering::new(LEGEND, Align::Start);
            canvas.text([x + KEY + 6.0, y], &names[i], how);
        }
    }
}
