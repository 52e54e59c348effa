//! A canvas for diagrams: lines, dots, areas and texts at positions in pixels.

use crate::error::Error;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

/// Coordinates in a file are whole numbers, which are short: tenths of a pixel.
const UNITS: f64 = 10.0;

/// R, G, B in sRGB.
pub(in crate::report) type Ink = [u8; 3];

pub(in crate::report) const BLACK: Ink = [0, 0, 0];

/// Alignment of a text to its position.
#[derive(Clone, Copy)]
pub(in crate::report) enum Align {
    /// The text starts there.
    Start,
    /// The middle of the text is there.
    Middle,
    /// The text ends there.
    End,
}

/// Size, weight and alignment of a text, which is centred vertically on its position.
#[derive(Clone, Copy)]
pub(in crate::report) struct Lettering {
    /// Font size, pixels.
    pub size: f64,
    pub align: Align,
    pub bold: bool,
    /// True if it is read from below.
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
#[derive(Default)]
pub(in crate::report) struct Canvas {
    /// Tags, one per line.
    drawn: String,
    /// Tags of pictures, which lie below everything else.
    images: String,
}

impl Canvas {
    /// A white picture of a size in pixels with what `body` draws, as an SVG text.
    ///
    /// # Errors
    /// Errors of `body`.
    pub fn draw(
        size: [f64; 2],
        body: impl FnOnce(&mut Canvas) -> Result<(), Error>,
    ) -> Result<String, Error> {
        let [width, height] = size.map(|s| s.clamp(1.0, 1e5).ceil());
        let mut canvas = Canvas::default();
        body(&mut canvas)?;
        let (drawn, images) = (subscripts(&canvas.drawn), canvas.images);
        let mut paper = Canvas::default();
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        paper.area(&corners, [255; 3], 1.0);
        let (paper, w, h) = (paper.drawn, width * UNITS, height * UNITS);
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {w} {h}\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n\
             {paper}{images}{drawn}</svg>\n"
        ))
    }

    /// A PNG below everything that is drawn, stretched to a size from its upper left corner.
    pub fn image(&mut self, at: [f64; 2], size: [f64; 2], png: &[u8]) {
        let [x, y] = at.map(|v| (v * UNITS).round());
        let [w, h] = size.map(|v| (v * UNITS).round());
        self.images += &format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" \
             preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>\n",
            STANDARD.encode(png)
        );
    }

    /// A line through points.
    pub fn line(&mut self, points: &[[f64; 2]], ink: Ink, width: f64) {
        if points.len() < 2 {
            return;
        }
        self.tag(format_args!(
            "<polyline fill=\"none\" opacity=\"1\" stroke=\"{}\" stroke-width=\"{}\" points=\"{}\"/>",
            hex(ink),
            (width * UNITS).round(),
            listed(points)
        ));
    }

    /// Writes a tag on a line of its own.
    fn tag(&mut self, tag: std::fmt::Arguments<'_>) {
        // Writing to a string does not fail.
        let _ = writeln!(self.drawn, "{tag}");
    }

    /// A line of dashes through points.
    pub fn dashes(&mut self, points: &[[f64; 2]], ink: Ink, width: f64) {
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
                    self.line(&dash, ink, width);
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
            self.line(&dash, ink, width);
        }
    }

    /// A filled disk.
    pub fn dot(&mut self, centre: [f64; 2], radius: f64, ink: Ink) {
        let [x, y] = units(centre);
        self.tag(format_args!(
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\" opacity=\"1\" fill=\"{}\" stroke=\"none\" stroke-width=\"10\"/>",
            (radius * UNITS).round(),
            hex(ink)
        ));
    }

    /// A filled polygon.
    pub fn area(&mut self, corners: &[[f64; 2]], ink: Ink, opacity: f64) {
        self.tag(format_args!(
            "<polygon opacity=\"{opacity}\" fill=\"{}\" points=\"{}\"/>",
            hex(ink),
            listed(corners)
        ));
    }

    /// A text in one line.
    pub fn text(&mut self, at: [f64; 2], text: &str, how: Lettering) {
        // XML has no way to write control characters.
        let text: String = text.chars().filter(|c| !c.is_control()).collect();
        if text.is_empty() {
            return;
        }
        let [x, y] = units(at);
        let anchor = match how.align {
            Align::Start => "start",
            Align::Middle => "middle",
            Align::End => "end",
        };
        let weight = if how.bold {
            " font-weight=\"bold\""
        } else {
            ""
        };
        let turn = match how.upwards {
            true => format!(" transform=\"rotate(270, {x}, {y})\""),
            false => String::new(),
        };
        self.tag(format_args!(
            "<text x=\"{x}\" y=\"{y}\" dy=\"0.5ex\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" \
             font-size=\"{}\" opacity=\"1\" fill=\"{}\"{weight}{turn}>\n{}\n</text>",
            (10.0 * how.size * UNITS).round() / 10.0,
            hex(how.ink),
            escaped(&text)
        ));
    }
}

/// A text without the characters that XML gives a meaning.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&apos;",
            c => out.push(c),
        }
    }
    out
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

fn hex([r, g, b]: Ink) -> String {
    format!("#{r:02X}{g:02X}{b:02X}")
}

fn units(p: [f64; 2]) -> [i64; 2] {
    p.map(|v| (v * UNITS).round() as i64)
}

/// Points as a tag lists them.
fn listed(points: &[[f64; 2]]) -> String {
    let point = |&p: &[f64; 2]| {
        let [x, y] = units(p);
        format!("{x},{y} ")
    };
    points.iter().map(point).collect()
}

/// Estimated width of a text in a sans-serif font, pixels; rather too wide than too narrow.
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
