//! Figures inside the page.

use super::Picture;
use super::shrink::shrunk;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, Render, html};
use rayon::prelude::*;

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
