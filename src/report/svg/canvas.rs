//! What the diagrams draw with: lines, dots, areas and texts at positions in pixels.

use crate::error::Error;
use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontDesc, FontFamily, FontStyle, FontTransform};
use plotters::style::{RGBAColor, ShapeStyle, TextStyle};

/// The backend's coordinates are whole numbers: tenths of a pixel.
const UNITS: f64 = 10.0;

/// R, G, B in sRGB.
pub(in crate::report) type Ink = [u8; 3];

pub(in crate::report) const BLACK: Ink = [0, 0, 0];

/// Where a text lies relative to its position.
#[derive(Clone, Copy)]
pub(in crate::report) enum Align {
    /// Starts there.
    Start,
    /// Its middle is there.
    Middle,
    /// Ends there.
    End,
}

/// How a text looks; centred vertically on its position.
#[derive(Clone, Copy)]
pub(in crate::report) struct Lettering {
    /// Font size, pixels.
    pub size: f64,
    pub align: Align,
    pub bold: bool,
    /// Read from below.
    pub upwards: bool,
    pub ink: Ink,
}

impl Lettering {
    pub fn new(size: f64, align: Align) -> Self {
        Self {
            size,
            align,
            bold: false,
            upwards: false,
            ink: BLACK,
        }
    }
}

/// A picture under construction; x to the right and y down, in pixels.
pub(in crate::report) struct Canvas<'a> {
    backend: SVGBackend<'a>,
    /// Tags of pictures, which lie below everything else.
    images: String,
}

impl Canvas<'_> {
    /// A white picture of a size in pixels with what `body` draws, as an SVG text.
    pub fn draw(
        size: [f64; 2],
        body: impl FnOnce(&mut Canvas<'_>) -> Result<(), Error>,
    ) -> Result<String, Error> {
        let [width, height] = size.map(|s| s.clamp(1.0, 1e5).ceil());
        let units = [width, height].map(|s| (s * UNITS) as u32);
        let mut text = String::new();
        let mut canvas = Canvas {
            backend: SVGBackend::with_string(&mut text, units.into()),
            images: String::new(),
        };
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        canvas.area(&corners, [255; 3], 1.0)?;
        body(&mut canvas)?;
        canvas.backend.present().map_err(failed)?;
        let images = std::mem::take(&mut canvas.images);
        drop(canvas);
        // The paper is drawn first.
        if let Some(paper) = text.find("/>") {
            text.insert_str(paper + 2, &images);
        }
        let text = subscripts(&text);
        // The first tag gives the size in units; what is shown has one pixel per ten of them.
        let rest = text.find('>').map_or("", |end| &text[end..]);
        let [w, h] = units;
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {w} {h}\" stroke-linejoin=\"round\" stroke-linecap=\"round\"{rest}"
        ))
    }

    /// A PNG below everything that is drawn, stretched to a size from its upper left corner.
    #[cfg(feature = "exr")]
    pub fn image(&mut self, at: [f64; 2], size: [f64; 2], png: &[u8]) {
        let [x, y] = at.map(|v| (v * UNITS).round());
        let [w, h] = size.map(|v| (v * UNITS).round());
        self.images += &format!(
            "\n<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" \
             preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>",
            crate::report::sphere::base64(png)
        );
    }

    /// A line through points.
    pub fn line(&mut self, points: &[[f64; 2]], ink: Ink, width: f64) -> Result<(), Error> {
        if points.len() < 2 {
            return Ok(());
        }
        let style = style(ink, 1.0, width);
        let points: Vec<_> = points.iter().map(|&p| units(p)).collect();
        self.backend.draw_path(points, &style).map_err(failed)
    }

    /// A line of dashes through points.
    pub fn dashes(&mut self, points: &[[f64; 2]], ink: Ink, width: f64) -> Result<(), Error> {
        const PATTERN: [f64; 2] = [6.0, 4.0];
        let (mut on, mut left) = (true, PATTERN[0]);
        let mut dash: Vec<[f64; 2]> = points.first().copied().into_iter().collect();
        for ends in points.windows(2) {
            let [a, b] = [ends[0], ends[1]];
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let mut done = 0.0;
            while length - done > left {
                done += left;
                let t = done / length;
                let at = [0, 1].map(|i| a[i] + t * (b[i] - a[i]));
                if on {
                    dash.push(at);
                    self.line(&dash, ink, width)?;
                }
                on = !on;
                left = PATTERN[usize::from(!on)];
                dash = vec![at];
            }
            left -= length - done;
            if on {
                dash.push(b);
            }
        }
        if on {
            self.line(&dash, ink, width)
        } else {
            Ok(())
        }
    }

    /// A filled disk.
    pub fn dot(&mut self, centre: [f64; 2], radius: f64, ink: Ink) -> Result<(), Error> {
        let radius = (radius * UNITS).round() as u32;
        let style = style(ink, 1.0, 1.0);
        let drawn = self
            .backend
            .draw_circle(units(centre), radius, &style, true);
        drawn.map_err(failed)
    }

    /// A filled polygon.
    pub fn area(&mut self, corners: &[[f64; 2]], ink: Ink, opacity: f64) -> Result<(), Error> {
        let corners: Vec<_> = corners.iter().map(|&p| units(p)).collect();
        let style = style(ink, opacity, 1.0);
        self.backend.fill_polygon(corners, &style).map_err(failed)
    }

    /// A text in one line.
    pub fn text(&mut self, at: [f64; 2], text: &str, how: Lettering) -> Result<(), Error> {
        // XML has no way to write control characters.
        let text: String = text.chars().filter(|c| !c.is_control()).collect();
        if text.is_empty() {
            return Ok(());
        }
        let weight = if how.bold {
            FontStyle::Bold
        } else {
            FontStyle::Normal
        };
        // The backend divides sizes by 1.24.
        let size = how.size * 1.24 * UNITS;
        let font = FontDesc::new(FontFamily::SansSerif, size, weight);
        let font = if how.upwards {
            font.transform(FontTransform::Rotate270)
        } else {
            font
        };
        let align = match how.align {
            Align::Start => HPos::Left,
            Align::Middle => HPos::Center,
            Align::End => HPos::Right,
        };
        let [r, g, b] = how.ink;
        let color = RGBAColor(r, g, b, 1.0);
        let style = TextStyle::from(font)
            .color(&color)
            .pos(Pos::new(align, VPos::Center));
        self.backend
            .draw_text(&text, &style, units(at))
            .map_err(failed)
    }
}

/// Sets the letter after a Greek one and an underscore lower: `θ_h` reads as in print.
fn subscripts(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    for (i, part) in svg.split('>').enumerate() {
        if i > 0 {
            out.push('>');
        }
        let end = part.find('<').unwrap_or(part.len());
        let (text, tag) = part.split_at(end);
        let mut before = None;
        for piece in text.split('_') {
            let greek = before.is_some_and(|c| ('α'..='ω').contains(&c));
            match piece.chars().next() {
                Some(index) if greek && index.is_ascii_lowercase() => {
                    // What follows is raised again, by the same length in its own size.
                    out += &format!(
                        "<tspan dy=\"0.3em\" font-size=\"70%\">{index}</tspan>\
                         <tspan dy=\"-0.21em\">{}</tspan>",
                        &piece[index.len_utf8()..]
                    );
                }
                _ => {
                    if before.is_some() {
                        out.push('_');
                    }
                    out += piece;
                }
            }
            before = piece.chars().next_back().or(Some('_'));
        }
        out += tag;
    }
    out
}

fn style(ink: Ink, opacity: f64, width: f64) -> ShapeStyle {
    let [r, g, b] = ink;
    ShapeStyle {
        color: RGBAColor(r, g, b, opacity),
        filled: true,
        stroke_width: (width * UNITS).round() as u32,
    }
}

fn units(p: [f64; 2]) -> (i32, i32) {
    let [x, y] = p.map(|v| (v * UNITS).round() as i32);
    (x, y)
}

fn failed(e: impl std::fmt::Display) -> Error {
    Error::Internal(format!("cannot draw: {e}"))
}

/// About how wide a text is in a sans-serif font, pixels; rather too wide than too narrow.
pub(in crate::report) fn text_width(text: &str, size: f64) -> f64 {
    let em = |c: char| match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '|' | '!' | '\'' => 0.32,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | ' ' | '/' | '-' | '·' => 0.42,
        '⁰'..='⁹' | '⁻' | '¹' | '²' | '³' => 0.45,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 1.0,
        c if c.is_ascii_uppercase() => 0.75,
        c if c.is_ascii() => 0.64,
        // Letters of other alphabets, some of them as wide as high.
        c if (c as u32) < 0x2e80 => 0.7,
        _ => 1.05,
    };
    text.chars().map(em).sum::<f64>() * size
}

/// The text, or its beginning and an ellipsis if it is wider than `width` pixels.
pub(in crate::report) fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.into();
    }
    let mut out = String::new();
    for c in text.chars() {
        out.push(c);
        if text_width(&out, size) + size > width {
            out.pop();
            break;
        }
    }
    out + "…"
}
