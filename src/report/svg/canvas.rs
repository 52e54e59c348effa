//! A canvas for diagrams: lines, dots, areas and texts at positions in pixels.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

/// Coordinates in a file are whole numbers, which are short: tenths of a pixel.
const UNITS: f64 = 10.0;

/// Font sizes of a title and of the notes below it, heights of their lines, and room at both sides, pixels.
const TITLE: f64 = 16.5;
const TITLE_LINE: f64 = 21.0;
const NOTE: f64 = 12.0;
const NOTE_LINE: f64 = 17.0;
const SIDES: f64 = 14.0;

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
    pub(crate) fn new(size: f64, align: Align) -> Self {
        Self {
            size,
            align,
            bold: false,
            upwards: false,
            ink: BLACK,
        }
    }

    pub(crate) fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub(crate) fn upwards(self) -> Self {
        Self {
            upwards: true,
            ..self
        }
    }

    pub(crate) fn ink(self, ink: Ink) -> Self {
        Self { ink, ..self }
    }

    /// Smaller letters, down to half of these, for a text that is wider than `width` pixels.
    pub(crate) fn within(self, text: &str, width: f64) -> Self {
        let share = (width / text_width(text, self.size)).clamp(0.5, 1.0);
        let size = self.size * share;
        Self { size, ..self }
    }
}

/// A picture under construction; x to the right and y down, in pixels.
#[derive(Default)]
pub(in crate::report) struct Canvas {
    /// Tags, one per line.
    drawn: String,
    /// Tags of pictures, which lie below everything else.
    images: String,
    /// Tags of texts, which lie above everything else.
    texts: String,
    /// The stroke of the last tag, if that is a line that further ones may join.
    open: Option<Stroke>,
}

/// Colour, width in units and dashes of a line.
#[derive(Clone, Copy, PartialEq)]
struct Stroke {
    ink: Ink,
    width: i64,
    /// Lengths of its strokes and gaps; empty of one stroke.
    dashes: &'static str,
}

impl Canvas {
    /// A white picture of a size in pixels with what `body` draws, as an SVG text. Further lines of its title are notes in
    /// smaller letters; the middle of the first one is at the height `y`. A title is never cut: one that is wider than the
    /// picture has several lines, and what `body` draws is lower by these.
    pub(crate) fn titled(
        title: &str,
        [width, height]: [f64; 2],
        y: f64,
        body: impl FnOnce(&mut Canvas),
    ) -> String {
        let mut canvas = Canvas::default();
        body(&mut canvas);
        let mut above = Canvas::default();
        let mut lower = -TITLE_LINE;
        for (i, part) in title.lines().enumerate() {
            let (size, line) = if i == 0 {
                (TITLE, TITLE_LINE)
            } else {
                (NOTE, NOTE_LINE)
            };
            let mut how = Lettering::new(size, Align::Middle);
            how.bold = i == 0;
            for text in wrapped(part, 1.08 * size, width - 2.0 * SIDES) {
                lower += line;
                above.text([0.5 * width, y + lower], &text, how);
            }
        }
        let lower = lower.max(0.0);
        let [width, height] = [width, height + lower].map(|s| s.clamp(1.0, 1e5).ceil());
        let (drawn, images, texts) = (canvas.drawn, canvas.images, subscripts(&canvas.texts));
        let (above, w, h) = (subscripts(&above.texts), width * UNITS, height * UNITS);
        let (start, end) = match lower * UNITS {
            0.0 => (String::new(), ""),
            y => (format!("<g transform=\"translate(0 {y})\">\n"), "</g>\n"),
        };
        // The paper has a class, so that a page may take it away.
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {w} {h}\" stroke-linejoin=\"round\" stroke-linecap=\"round\" \
             font-family=\"sans-serif\" text-anchor=\"middle\">\n\
             <rect class=\"paper\" width=\"{w}\" height=\"{h}\" fill=\"#FFFFFF\"/>\n\
             {start}{images}{drawn}{texts}{end}{above}</svg>\n"
        )
    }

    /// A PNG below everything that is drawn, stretched to a size from its upper left corner.
    pub(crate) fn image(&mut self, at: [f64; 2], size: [f64; 2], png: &[u8]) {
        let [x, y] = at.map(|v| (v * UNITS).round());
        let [w, h] = size.map(|v| (v * UNITS).round());
        self.images += &format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" \
             preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>\n",
            STANDARD.encode(png)
        );
    }

    /// A line through points.
    pub(crate) fn line(&mut self, points: &[[f64; 2]], ink: Ink, width: f64) {
        self.dashed(points, ink, width, "");
    }

    /// A thin line around a box, from its upper left corner to its lower right one.
    pub(crate) fn frame(&mut self, [x0, y0]: [f64; 2], [x1, y1]: [f64; 2], ink: Ink) {
        self.line(
            &[[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]],
            ink,
            0.8,
        );
    }

    /// A line through points whose strokes and gaps have lengths of their own, units; empty: one stroke.
    pub(crate) fn dashed(
        &mut self,
        points: &[[f64; 2]],
        ink: Ink,
        width: f64,
        dashes: &'static str,
    ) {
        if points.len() < 2 {
            return;
        }
        let stroke = Stroke {
            ink,
            width: (width * UNITS).round() as i64,
            dashes,
        };
        const END: &str = "\"/>\n";
        if self.open == Some(stroke) {
            // A tag for each of hundreds of isolines would be most of a file.
            self.drawn.truncate(self.drawn.len() - END.len());
        } else {
            let (ink, width) = (hex(ink), stroke.width);
            let dashes = match dashes {
                "" => String::new(),
                lengths => format!(" stroke-dasharray=\"{lengths}\""),
            };
            self.drawn += &format!(
                "<path fill=\"none\" stroke=\"{ink}\" stroke-width=\"{width}\"{dashes} d=\""
            );
        }
        self.drawn += &steps(points);
        self.drawn += END;
        self.open = Some(stroke);
    }

    /// Writes a tag on a line of its own.
    fn tag(&mut self, tag: std::fmt::Arguments<'_>) {
        self.open = None;
        // Writing to a string does not fail.
        let _ = writeln!(self.drawn, "{tag}");
    }

    /// What `body` draws, with a text that is shown where the pointer rests on it.
    pub(crate) fn tooltip(&mut self, text: &str, body: impl FnOnce(&mut Self)) {
        let keep = |c: &char| *c == '\n' || !c.is_control();
        let text: String = text.chars().filter(keep).collect();
        self.tag(format_args!("<g><title>{}</title>", escaped(&text)));
        body(self);
        self.tag(format_args!("</g>"));
    }

    /// A filled disk.
    pub(crate) fn dot(&mut self, centre: [f64; 2], radius: f64, ink: Ink) {
        let [x, y] = units(centre);
        self.tag(format_args!(
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\" fill=\"{}\"/>",
            (radius * UNITS).round(),
            hex(ink)
        ));
    }

    /// A filled box, from its upper left corner to its lower right one.
    pub(crate) fn block(&mut self, [x0, y0]: [f64; 2], [x1, y1]: [f64; 2], ink: Ink) {
        self.area(&[[x0, y0], [x1, y0], [x1, y1], [x0, y1]], ink, 1.0);
    }

    /// A filled polygon.
    pub(crate) fn area(&mut self, corners: &[[f64; 2]], ink: Ink, opacity: f64) {
        let opacity = match opacity {
            1.0 => String::new(),
            other => format!(" opacity=\"{other}\""),
        };
        self.tag(format_args!(
            "<path fill=\"{}\"{opacity} d=\"{}z\"/>",
            hex(ink),
            steps(corners)
        ));
    }

    /// A text in one line.
    pub(crate) fn text(&mut self, at: [f64; 2], text: &str, how: Lettering) {
        // XML has no way to write control characters.
        let text: String = text.chars().filter(|c| !c.is_control()).collect();
        if text.is_empty() {
            return;
        }
        // Half the height of small letters lower, the text is centred.
        let [x, y] = units([at[0], at[1] + 0.265 * how.size]);
        let anchor = match how.align {
            Align::Start => " text-anchor=\"start\"",
            Align::Middle => "",
            Align::End => " text-anchor=\"end\"",
        };
        let weight = match how.bold {
            true => " font-weight=\"bold\"",
            false => "",
        };
        let turn = match how.upwards {
            true => {
                let [x, y] = units(at);
                format!(" transform=\"rotate(270, {x}, {y})\"")
            }
            false => String::new(),
        };
        let fill = match how.ink {
            BLACK => String::new(),
            ink => format!(" fill=\"{}\"", hex(ink)),
        };
        // Writing to a string does not fail.
        let _ = writeln!(
            self.texts,
            "<text x=\"{x}\" y=\"{y}\"{anchor} font-size=\"{}\"{fill}{weight}{turn}>\n{}\n</text>",
            (10.0 * how.size * UNITS).round() / 10.0,
            escaped(&text)
        );
    }
}

/// A text without the characters that XML gives a meaning.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    let text = text.replace('>', "&gt;").replace('"', "&quot;");
    text.replace('\'', "&apos;")
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

/// A line of a path: its first point, then the steps between points, which are shorter to write.
fn steps(points: &[[f64; 2]]) -> String {
    let mut out = String::new();
    let mut last = [0, 0];
    for (i, point) in points.iter().enumerate() {
        let at = units(*point);
        let [x, y] = match i {
            0 => at,
            _ => [at[0] - last[0], at[1] - last[1]],
        };
        let lead = match i {
            0 => "M",
            1 => "l",
            _ if x < 0 => "",
            _ => " ",
        };
        let between = if y < 0 { "" } else { " " };
        out += &format!("{lead}{x}{between}{y}");
        last = at;
    }
    out
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

/// The text in lines of at most `width` pixels, at least one: between words, and within one that is wider.
pub(in crate::report) fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let fits = |text: &str| text_width(text, size) <= width;
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        let joined = match lines[last].as_str() {
            "" => word.to_owned(),
            line => format!("{line} {word}"),
        };
        if fits(&joined) {
            lines[last] = joined;
            continue;
        }
        if !lines[last].is_empty() {
            lines.push(String::new());
        }
        for letter in word.chars() {
            let last = lines.len() - 1;
            let longer = format!("{}{letter}", lines[last]);
            match fits(&longer) || lines[last].is_empty() {
                true => lines[last] = longer,
                false => lines.push(letter.into()),
            }
        }
    }
    lines
}

/// The text, or its two ends with an ellipsis between them if it is wider than `width` pixels.
pub(in crate::report) fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.into();
    }
    let letters: Vec<char> = text.chars().collect();
    let cut = |kept: usize| -> String {
        let (head, tail) = (kept.div_ceil(2), kept / 2);
        let end = &letters[letters.len() - tail..];
        let parts = [&letters[..head], &['…'], end];
        parts.concat().into_iter().collect()
    };
    let fits = |kept: &usize| text_width(&cut(*kept), size) <= width;
    let kept = (0..letters.len()).rev().find(fits);
    cut(kept.unwrap_or(0))
}

/// The texts, shortened to `width` pixels as long as those that differ still do: else by what all of
/// those alike begin with, or not at all.
pub(in crate::report) fn all_fitted(texts: &[&str], size: f64, width: f64) -> Vec<String> {
    let mut out: Vec<String> = texts.iter().map(|t| fitted(t, size, width)).collect();
    let taken = |out: &[String], i: usize| {
        let mut others = texts.iter().zip(out);
        others.any(|(t, label)| *t != texts[i] && *label == out[i])
    };
    for i in 0..texts.len() {
        if taken(&out, i) {
            let label = out[i].clone();
            let group: Vec<usize> = (0..texts.len()).filter(|&k| out[k] == label).collect();
            let first = texts[group[0]];
            let begins = |n: &usize| group.iter().all(|&k| texts[k].starts_with(&first[..*n]));
            let ends = first.char_indices().map(|(n, _)| n);
            let common = ends.take_while(begins).last().unwrap_or(0);
            for k in group {
                out[k] = fitted(&format!("…{}", &texts[k][common..]), size, width);
            }
        }
    }
    match (0..texts.len()).any(|i| taken(&out, i)) {
        true => texts.iter().map(|t| (*t).to_owned()).collect(),
        false => out,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_that_differ_still_do_when_they_are_cut() {
        let long = "half-difference theta_h:square-root;theta_d:square-root";
        let names: Vec<String> = ["", " on b", " on c", " of grid on b", " of sobol on b"]
            .into_iter()
            .flat_map(|end| [format!("{long}{end}"), format!("{end}{long}")])
            .chain((0..9).map(|i| format!("{long}{i}{long}")))
            .chain((0..9).map(|i| format!("é{i}")))
            .collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        for width in [0.0, 20.0, 60.0, 100.0, 150.0, 300.0, 1000.0] {
            let labels = all_fitted(&names, 10.0, width);
            for (i, a) in names.iter().enumerate() {
                for (k, b) in names.iter().enumerate() {
                    assert_eq!(a == b, labels[i] == labels[k], "{a} {b} at {width}");
                }
            }
        }
        // Where there is room nothing is cut, and what is cut keeps both of its ends.
        assert_eq!(all_fitted(&names, 10.0, 1e4), names);
        let short = fitted("hybrid h_bar:square-root;k:arcsine", 10.0, 120.0);
        assert!(short.starts_with("hybrid") && short.ends_with("arcsine"));
        assert!(text_width(&short, 10.0) <= 120.0);
    }

    #[test]
    fn titles_are_whole_and_within_the_picture() {
        let long =
            "Relative error of the reconstruction of a/very/long/path/without/a/single/space.csv";
        for width in [40.0, 90.0, 200.0, 3000.0] {
            let lines = wrapped(long, 12.0, width);
            assert!(lines.iter().all(|line| text_width(line, 12.0) <= width));
            assert_eq!(lines.concat().replace(' ', ""), long.replace(' ', ""));
            assert_eq!(lines.len() == 1, width == 3000.0);
        }
        let svg = |title: &str| Canvas::titled(title, [200.0, 50.0], 20.0, |_| ());
        let height = |title: &str| -> f64 {
            let svg = svg(title);
            let (_, rest) = svg.split_once("height=\"").unwrap();
            rest[..rest.find('"').unwrap()].parse().unwrap()
        };
        assert!(height("short") == 50.0 && height(long) > 70.0);
        assert!(height("short\na note") > 50.0 && !svg(long).contains('…'));
    }

    #[test]
    fn steps_lead_through_the_points() {
        let points = [[0.0, 1.0], [-2.55, 3.0], [-2.55, -1e3], [7.0, 0.0]];
        assert_eq!(steps(&points), "M0 10l-26 20 0-10030 96 10000");
    }
}
