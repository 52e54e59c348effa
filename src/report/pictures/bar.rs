//! Legends of colours: bars with numbers, and what colours off the bar mean.

use super::plot::{FRAME, OUTSIDE, text};
use crate::report::pictures::png::encoded;
use crate::report::svg::axis::Ruler;
use crate::report::svg::canvas::{Align, Canvas, Ink, Lettering, text_width};
use crate::report::svg::plot::Axis;

/// The colours of the stripes where there are no data.
pub(super) const NO_DATA: [Ink; 2] = [[150; 3], [190; 3]];

/// Height of a bar, pixels.
const HEIGHT: f64 = 14.0;

/// Places in [0, 1] on a logarithmic scale, and the numbers there.
pub(super) fn log_ticks(ends: [f64; 2], length: f64) -> Vec<(f64, String)> {
    let axis = Axis::log("").within(ends);
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
