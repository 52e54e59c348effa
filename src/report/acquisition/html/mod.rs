//! `report.html`: the findings of a study, in one file that needs no other but the picture of wall times, without which it is
//! the same wherever it is made.
//!
//! No font, no request, and no script but one, which is constant, sorts tables and inflates long parts that are opened: its own policy
//! forbids them. Every text goes through the escaping of the templates; names of materials are file
//! names, and may hold anything.

mod charts;
mod duels;
mod figure;
mod made_by;
mod materials;
mod ranking;
mod verdict;

pub use charts::{study_curves, study_timings};

use super::findings::{self, LEGEND, named_shares};
use super::levels;
use super::order::error_of;
use super::table::TextTable;
use crate::error::count;
use crate::experiment::{Choice, Explained, Findings, Metric, Plan, Row, Scope};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use charts::Looks;
use figure::figures;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use maud::{DOCTYPE, Markup, PreEscaped, Render, html as page};
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};
use std::io::Write;

const STYLE: &str = include_str!("style.css");

/// Sorts tables, and inflates long parts where they are opened. It holds no data, and without it all but those parts is there.
const SCRIPT: &str = include_str!("script.js");

/// Content security policy of a report: nothing is loaded but [`TIMES`], a picture beside it, and nothing is run but [`SCRIPT`],
/// which is named by its SHA-256.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data: 'self' file:; \
                      script-src 'sha256-TM/5jOM3ALzjy+DpHg0cOxyyjgi4N5zfkS5nQS6U8l0='";

/// A figure of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Text below the figure, also for those who cannot see it.
    pub caption: String,
    /// The text of an SVG file, on white.
    pub svg: String,
}

/// The figures of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialPictures {
    /// Its name in the rows.
    pub material: String,
    /// Its figures, in their order.
    pub pictures: Vec<Picture>,
}

/// The report of a study: verdict, rankings, comparisons, curves, a section per material, and the
/// manifest. `general` are figures of the study itself, `pictures` those of its materials.
pub fn html(
    plan: &Plan,
    rows: &[&Row],
    findings: &Findings,
    manifest: &serde_json::Value,
    general: &[Picture],
    pictures: &[MaterialPictures],
) -> String {
    let title = plan.report.title.as_deref().unwrap_or("Acquisition study");
    let question = plan.question.as_deref().unwrap_or_default().trim();
    let materials = materials::tables(rows, &findings.allowances);
    let looks = Looks::new(findings);
    let of_materials: Vec<Markup> = materials
        .par_iter()
        .enumerate()
        .map(|(i, m)| {
            let own = pictures.iter().find(|p| p.material == m.name);
            let curves = charts::of_material(m, &looks);
            materials::section(i, m, &findings.allowances, own, curves)
        })
        .collect();
    let of_materials = Section {
        body: (!materials.is_empty()).then(materials::legend),
        contents: page! {
            " " span.many {
                @for (i, m) in materials.iter().enumerate() {
                    @if i > 0 { " · " }
                    a href={ "#material-" (i) } { (m.name) }
                }
            }
        },
        below: page! { @for section in of_materials { (section) } },
        ..Section::new("materials", "Materials", None)
    };
    let ranking = Section {
        contents: rankings(findings),
        ..Section::new("ranking", "Ranking", ranking::section(findings))
    };
    let verdict = verdict::section(findings, &looks);
    let duels = duels::section(findings, &looks);
    let curves = charts::curves(findings, &looks);
    let expected = calibrations(findings, &looks);
    let figures = (!general.is_empty()).then(|| figures(general));
    let made_by = made_by::section(manifest, &plan.resolved);
    let mut sections = vec![
        Section::new("verdict", "Verdict", Some(verdict)),
        ranking,
        Section::new("duels", "Comparisons in pairs", duels),
        Section::new("curves", "Error against cost", curves),
        Section::new("calibration", "Expected errors", expected),
        Section::new("levels", "Readings for moments", levels(findings)),
        Section::new("variance", "Shares of the variance", variance(findings)),
        Section::new("figures", "Coordinates", figures),
        of_materials,
        Section::new("manifest", "Config and inputs", Some(made_by)),
    ];
    sections.retain(|section| section.body.is_some());
    let body = page! {
        nav aria-label="Contents" {
            details {
                summary { "Contents" }
                ol {
                    @for of in &sections { li { a href={ "#" (of.id) } { (of.title) } (of.contents) } }
                }
            }
        }
        main {
            @for of in &sections {
                section id=(of.id) { h2 { (of.title) } @if let Some(body) = &of.body { (body) } }
                (of.below)
            }
        }
    };
    let heading = if question.is_empty() { title } else { question };
    frame(title, heading, body)
}

/// A page that needs no other file, with a title and a heading.
pub(crate) fn frame(title: &str, heading: &str, body: Markup) -> String {
    let page = page! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    p.kind { "gonio · " (title) }
                    h1 { (heading) }
                }
                (body)
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}

/// A section of a report, which the contents list.
#[derive(Default)]
struct Section {
    id: &'static str,
    title: &'static str,
    /// `None`: the report has no such section.
    body: Option<Markup>,
    /// What stands behind its title in the contents.
    contents: Markup,
    below: Markup,
}

impl Section {
    fn new(id: &'static str, title: &'static str, body: Option<Markup>) -> Self {
        Self {
            id,
            title,
            body,
            ..Self::default()
        }
    }
}

/// The rankings in the contents, if there are several.
fn rankings(findings: &Findings) -> Markup {
    let shown = ranking::shown(findings);
    page! {
        @if shown.len() > 1 {
            ul {
                @for (i, ranking) in shown.iter().enumerate() {
                    li { a href={ "#ranking-" (i) } { (scope_title(&ranking.scope)) } }
                }
            }
        }
    }
}

/// Parts below one another, the first open, the others folded away.
fn folded(parts: impl IntoIterator<Item = (String, Markup)>) -> Markup {
    let parts = parts.into_iter().enumerate();
    page! { @for (i, (title, body)) in parts { (fold(i == 0, "", title, body)) } }
}

/// Bytes from which on a part that is folded away is deflated: studies have hundreds of tables and figures, which would take longer to
/// load than to read.
const LONG: usize = 24_000;

/// A part with a title, open or folded away, with an id unless it is empty.
fn fold(open: bool, id: &str, title: impl Render, body: Markup) -> Markup {
    let id = (!id.is_empty()).then_some(id);
    let long = (!open && body.0.len() > LONG).then(|| deflated(&body.0));
    // Pictures of pixels are deflated already.
    let long = long.filter(|deflated| 4 * deflated.len() < 3 * body.0.len());
    page! {
        details id=[id] open[open] {
            summary { (title) }
            @if let Some(deflated) = long {
                div data-deflated=(deflated) {}
                noscript { p.note { "To show this part needs a script." } }
            } @else { (body) }
        }
    }
}

/// A text, deflated (RFC 1951), in base 64.
fn deflated(text: &str) -> String {
    let mut out = DeflateEncoder::new(Vec::new(), Compression::best());
    let written = out.write_all(text.as_bytes()).and_then(|()| out.finish());
    STANDARD.encode(written.unwrap_or_else(|_| unreachable!("memory takes all")))
}

/// A table that scrolls where it is wider than the page: the texts of its head, and its rows.
pub(crate) fn table<T: Render>(
    class: Option<&str>,
    caption: &str,
    head: impl IntoIterator<Item = T>,
    rows: Markup,
) -> Markup {
    page! {
        div.wide {
            table class=[class] {
                @if !caption.is_empty() { caption { (caption) } }
                thead { tr { @for text in head { th scope="col" { (text) } } } }
                (rows)
            }
        }
    }
}

/// Title of a scope: its truths, materials, measure and metric.
fn scope_title(scope: &Scope) -> String {
    let materials = count(scope.materials, "material");
    let of = match &scope.truth {
        None => format!("all {materials}"),
        Some(truth) => format!("{materials} of truth “{truth}”"),
    };
    format!("{}, {of}", error_of(scope, " pairs"))
}

/// Errors beside expected ones.
fn calibrations(findings: &Findings, looks: &Looks) -> Option<Markup> {
    (!findings.calibrations.is_empty()).then(|| {
        page! {
            p { (LEGEND) }
            div.panels { @for chart in charts::calibrated(findings, looks) { (chart) } }
            @for of in findings::calibrations(findings) { (of_texts(&of)) }
        }
    })
}

/// What errors of moments need.
fn levels(findings: &Findings) -> Option<Markup> {
    let tables = levels::tables(findings);
    (!tables.is_empty()).then(|| {
        page! {
            p { (levels::LEGEND) }
            @for of in &tables { (of_texts(of)) }
            @if let Some(guides) = levels::guides(findings) {
                p { "Is what is sampled best for the BRDF sampled best for its moments?" }
                (of_texts(&guides))
            }
        }
    })
}

fn of_texts(of: &TextTable) -> Markup {
    let head = std::iter::once("").chain(of.head.iter().map(String::as_str));
    table(
        None,
        &of.title,
        head,
        page! {
            tbody {
                @for (name, cells) in &of.lines {
                    tr {
                        th scope="row" { (name) }
                        @for cell in cells { td { (cell.replace(" %", "\u{a0}%")) } }
                    }
                }
            }
        },
    )
}

/// Shares of the variance as bars.
fn variance(findings: &Findings) -> Option<Markup> {
    let of = |metric: Metric| {
        let mine = findings.explained.iter();
        let mine: Vec<_> = mine.filter(|e| e.scope.metric == metric).collect();
        (!mine.is_empty()).then(|| {
            (
                metric.name().to_owned(),
                page! { div.panels { @for explained in mine { (bars(explained)) } } },
            )
        })
    };
    (!findings.explained.is_empty()).then(|| page! {
        p {
            "How much of the variance of the logarithm of the error each factor explains by itself, "
            "and two together (×) beyond that."
        }
        (folded(Metric::ALL.into_iter().filter_map(of)))
    })
}

fn bars(explained: &Explained) -> Markup {
    let of = match explained.scattered {
        true => "scattered readings",
        false => "in the schedule's own coordinates",
    };
    let shares = named_shares(&explained.factors, &explained.shares);
    page! {
        table.bars {
            caption { (error_of(&explained.scope, " pairs")) ", " (of) }
            @for (name, share) in shares.iter().take(8) {
                tr {
                    th scope="row" { (name) }
                    td { (format!("{:.1} %", 100.0 * share)) }
                    td.bar {
                        span style=(format!("width:{:.1}%", (100.0 * share).clamp(0.0, 100.0))) {}
                    }
                }
            }
        }
    }
}

/// A parametrization with its warps, for people.
fn sampling_name(choice: &Choice) -> Markup {
    page! {
        (choice.parametrization)
        @if choice.warp != "none" { " " small { (choice.warp) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::read::DeflateDecoder;
    use std::io::Read;

    #[test]
    fn long_parts_that_are_folded_away_are_deflated() {
        let body = |n: usize| page! { @for i in 0..n { p { "row " (i) " <" } } };
        let found = |open, n| fold(open, "a", "title", body(n)).into_string();
        for (open, n) in [(true, 4000), (false, 10)] {
            assert!(found(open, n).contains(&body(n).into_string()));
        }
        let folded = found(false, 4000);
        let (_, deflated) = folded.split_once("data-deflated=\"").unwrap();
        let (deflated, _) = deflated.split_once('"').unwrap();
        let bytes = STANDARD.decode(deflated).unwrap();
        let mut text = String::new();
        DeflateDecoder::new(&bytes[..])
            .read_to_string(&mut text)
            .unwrap();
        assert_eq!(text, body(4000).into_string());
        assert!(folded.len() < text.len() / 4);
    }
}
