//! Figures inside the page, their pictures in fewer bytes: a page holds hundreds of them.

use super::Picture;
use crate::report::pictures::png::{Rgba, file, read};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, Render, html};
use png::{ColorType, Compression, Filter};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// What a PNG inside a page begins with.
const PNG: &str = "data:image/png;base64,";

/// Figures side by side. Their letters take the colour of the page; what is a picture in them keeps its
/// own, as it has a meaning.
pub(super) fn figures(pictures: &[Picture]) -> Markup {
    let plates = pictures.par_iter().map(|picture| {
        html! {
            figure.plate {
                div.wide { (inline(&picture.svg, &picture.caption)) }
                figcaption { (picture.caption) }
            }
        }
    });
    let plates: Vec<Markup> = plates.collect();
    html! {
        div.panels { @for plate in &plates { (plate) } }
    }
}

/// A diagram of the report itself: its lines and letters take the colours of the page.
pub(super) fn chart(svg: &str, label: &str, caption: &str) -> Markup {
    html! {
        figure.chart {
            (inline(svg, label))
            @if !caption.is_empty() { figcaption { (caption) } }
        }
    }
}

/// An SVG file as part of a page: without the head of a file, with a text for those who cannot see it,
/// and with the pictures in it in fewer bytes.
fn inline(svg: &str, label: &str) -> Markup {
    let Some((_, rest)) = svg.split_once("<svg") else {
        return Markup::default();
    };
    let label = label.render().into_string();
    let mut out = format!("<svg role=\"img\" aria-label=\"{label}\"");
    for (i, part) in rest.split(PNG).enumerate() {
        if i == 0 {
            out += part;
            continue;
        }
        let (file, after) = part.split_at(part.find('"').unwrap_or(part.len()));
        let small = STANDARD.decode(file).ok().and_then(|png| shrunk(&png));
        out += PNG;
        out += &small.map_or_else(|| file.to_owned(), |png| STANDARD.encode(png));
        out += after;
    }
    PreEscaped(out)
}

/// A picture whose file is more than this share of its pixels is noisy.
const NOISY: f64 = 0.12;

/// Steps of a channel, less one, of a picture that is not noisy, which are too small to be seen, and
/// of one that is, where the noise hides them.
const STEPS: [u32; 2] = [63, 23];

/// Steps of the opacity, less one: edges are few.
const OPACITY: u32 = 3;

/// A PNG of the same picture within half a step of a channel; `None` if the file cannot be read or
/// gets no smaller.
fn shrunk(png: &[u8]) -> Option<Vec<u8>> {
    let (picture, bytes) = read(png)?;
    let noisy = least(&picture).len() as f64 > NOISY * bytes as f64;
    let file = least(&stepped(picture, STEPS[usize::from(noisy)]));
    (file.len() < png.len()).then_some(file)
}

/// The picture with so many steps of a channel, and one.
fn stepped(mut picture: Rgba, steps: u32) -> Rgba {
    let step = |v: u8, n: u32| (((u32::from(v) * n + 127) / 255 * 255 + n / 2) / n) as u8;
    for pixel in &mut picture.pixels {
        let [r, g, b, a] = *pixel;
        let [r, g, b] = [r, g, b].map(|v| if a == 0 { 0 } else { step(v, steps) });
        *pixel = [r, g, b, step(a, OPACITY)];
    }
    picture
}

/// The smallest file of a picture: grey, of a palette or of all colours, with a filter or without.
fn least(picture: &Rgba) -> Vec<u8> {
    let pixels = || picture.pixels.iter().copied();
    let opaque = pixels().all(|p| p[3] == 255);
    let mut palette: BTreeMap<(u32, [u8; 4]), u8> = BTreeMap::new();
    // By brightness, so that neighbours on the palette are alike.
    let key = |p: [u8; 4]| {
        let [r, g, b, _] = p.map(u32::from);
        (3 * r + 6 * g + b, p)
    };
    for pixel in pixels() {
        palette.insert(key(pixel), 0);
        if palette.len() > 256 {
            break;
        }
    }
    let few = palette.len() <= 256;
    for (place, index) in palette.values_mut().zip(0..=255) {
        *place = index;
    }
    let (color, bytes): (_, Vec<u8>) = if opaque && pixels().all(|p| p[0] == p[1] && p[1] == p[2]) {
        (ColorType::Grayscale, pixels().map(|p| p[0]).collect())
    } else if few {
        let places = pixels().map(|p| palette[&key(p)]);
        (ColorType::Indexed, places.collect())
    } else if opaque {
        let colours = pixels().flat_map(|[r, g, b, _]| [r, g, b]);
        (ColorType::Rgb, colours.collect())
    } else {
        (ColorType::Rgba, pixels().flatten().collect())
    };
    let palette = (color == ColorType::Indexed).then(|| {
        let colours = || palette.keys().map(|(_, colour)| colour);
        let opacities = (!opaque).then(|| colours().map(|c| c[3]).collect());
        (
            colours().flat_map(|c| &c[..3]).copied().collect(),
            opacities,
        )
    });
    // Noise is smaller without a filter, all else with one.
    let [plain, filtered] = [Filter::NoFilter, Filter::Adaptive]
        .map(|filter| (filter, Compression::Balanced))
        .map(|how| file(picture.size, color, &bytes, palette.as_ref(), how));
    if filtered.len() < plain.len() {
        filtered
    } else {
        plain
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::pictures::png::encoded;

    #[test]
    fn pictures_stay_within_half_a_step() {
        let smooth = |x: u32, y: u32| [(x + y) as u8, (2 * x) as u8, 40, 255];
        let noise = |x: u32, y: u32| {
            let v = x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b);
            let [r, g, b, _] = (v ^ v >> 15).wrapping_mul(0x2c1b_3c6d).to_be_bytes();
            [r, g, b, if x < 48 { 0 } else { 255 }]
        };
        let grey = |x: u32, y: u32| [(x ^ y) as u8, (x ^ y) as u8, (x ^ y) as u8, 255];
        let few = |x: u32, y: u32| [(x / 8) as u8, 99 - (y / 8) as u8, 7, 255];
        let of = |f: &dyn Fn(u32, u32) -> [u8; 4]| -> Vec<[u8; 4]> {
            let places = (0..96).flat_map(|y| (0..96).map(move |x| (x, y)));
            places.map(|(x, y)| f(x, y)).collect()
        };
        let all = [
            (of(&smooth), 0),
            (of(&grey), 0),
            (of(&few), 0),
            (of(&noise), 1),
        ];
        for (pixels, noisy) in all {
            // Half a step, and the rounding of 127 / 255.
            let most = (128 / STEPS[noisy] + 1) as u8;
            for is_opaque in [true, false] {
                let mut before = pixels.clone();
                let file = if is_opaque {
                    let colours: Vec<_> = pixels.iter().map(|p| [p[0], p[1], p[2]]).collect();
                    before.iter_mut().for_each(|p| p[3] = 255);
                    encoded(&colours, 96)
                } else {
                    encoded(&pixels, 96)
                };
                let small = shrunk(&file).unwrap_or_else(|| file.clone());
                assert!(small.len() <= file.len() && (noisy == 0 || small.len() < file.len()));
                let found = read(&small).unwrap().0.pixels;
                // What cannot be seen has no colour.
                let seen = found.iter().zip(&before).filter(|(_, b)| b[3] > 0);
                let off = seen.flat_map(|(a, b)| [0, 1, 2, 3].map(|c| a[c].abs_diff(b[c])));
                let off = off.max().unwrap();
                assert!(off <= most && (noisy == 0) == (off < 4), "{off}");
            }
        }
        assert!(shrunk(b"no picture").is_none());
    }
}
