//! Figures inside the page.

use super::{Media, Picture};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};

/// Figures side by side, on white also on a dark page: the meaning of their colours must not
/// change.
pub(super) fn figures(pictures: &[Picture]) -> Markup {
    html! {
        div.panels {
            @for picture in pictures {
                figure.paper {
                    @match &picture.media {
                        Media::Svg(text) => {
                            div role="img" aria-label=(picture.alt) { (PreEscaped(inline(text))) }
                        }
                        Media::Png(bytes) => {
                            img alt=(picture.alt)
                                src={ "data:image/png;base64," (STANDARD.encode(bytes)) };
                        }
                    }
                    figcaption { (picture.caption) }
                }
            }
        }
    }
}

/// A diagram of the report itself: its lines and letters take the colours of the page.
pub(super) fn chart(svg: &str, label: &str, caption: &str) -> Markup {
    html! {
        figure.chart {
            div role="img" aria-label=(label) { (PreEscaped(inline(svg))) }
            @if !caption.is_empty() { figcaption { (caption) } }
        }
    }
}

/// An SVG file as part of a page: without the head of a file.
fn inline(svg: &str) -> &str {
    svg.find("<svg").map_or("", |start| &svg[start..])
}
