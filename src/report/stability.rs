//! What a walk over the extreme cases found, for people and for programs.

use super::Columns;
#[cfg(feature = "pictures")]
use super::acquisition::{frame, html_table};
use crate::error::count;
use crate::stability::{Finding, Verdict};
#[cfg(feature = "pictures")]
use maud::html as page;

/// Characters of a case that a table for people has room for.
const ROOM: usize = 64;

/// Cells of a finding behind its error: conditioning, ratio, allowed, cases, evaluations, seconds and verdict.
fn cells(f: &Finding) -> [String; 7] {
    [
        format!("{:.1e}", f.conditioning),
        format!("{:.2}", f.ratio),
        f.allowed.to_string(),
        f.cases.to_string(),
        f.evaluations.to_string(),
        format!("{:.2}", f.seconds),
        f.verdict.name().into(),
    ]
}

/// A table for each family, and how many laws hold.
pub fn stability_table(findings: &[Finding]) -> String {
    let mut out = String::new();
    for family in findings.chunk_by(|a, b| a.family == b.family) {
        let line = |f: &Finding| {
            let at: String = f.at.chars().take(ROOM).collect();
            let (error, cells) = (f.error, cells(f).join("\t"));
            format!(
                "{}\t{}\t{error:.1e}\t{}\t{cells}\t{at}",
                f.member, f.law, f.unit
            )
        };
        let columns = Columns::with_rows(
            "member\tlaw\t>error\t\t>conditioning\t>ratio\t>allowed\t>cases\t>evaluations\t>seconds\t\tworst at",
            family.iter().map(line),
        );
        out += &format!("{}\n{columns}\n", family[0].family);
    }
    out + &sentence(findings) + "\n"
}

/// How many laws hold, and in how many cases.
fn sentence(findings: &[Finding]) -> String {
    let cases: u64 = findings.iter().map(|f| f.cases).sum();
    let with = |verdict| findings.iter().filter(|f| f.verdict == verdict).count();
    let [held, broken, left] = [Verdict::Holds, Verdict::Broken, Verdict::Interrupted].map(with);
    let mut text = format!(
        "{held} of {} hold in {cases} cases",
        count(findings.len(), "law")
    );
    if broken > 0 {
        text += &format!("; broken: {broken}");
    }
    if left > 0 {
        text += &format!("; interrupted before {left} were checked");
    }
    text + "."
}

/// The findings of laws that do not hold.
pub fn broken(findings: &[Finding]) -> impl Iterator<Item = &Finding> {
    findings.iter().filter(|f| f.verdict == Verdict::Broken)
}

/// A page that needs no other: what does not hold first, then a table for each family.
#[cfg(feature = "pictures")]
pub(crate) fn stability_html(findings: &[Finding]) -> String {
    let broken: Vec<&Finding> = broken(findings).collect();
    let body = page! {
        main {
        section id="verdict" {
            h2 { "Verdict" }
            p { (sentence(findings)) }
            p {
                "An error is judged by the conditioning of its case: what one rounding of the input changes, and one of "
                "the result. The ratio is the error over the conditioning; of laws that hold or not, the number of "
                "violations."
            }
            @if !broken.is_empty() { (table("broken", broken.iter().copied())) }
        }
        @for family in findings.chunk_by(|a, b| a.family == b.family) {
            section id=(family[0].family) {
                h2 { (family[0].family) }
                (table(family[0].family, family.iter()))
            }
        }
        }
    };
    frame(
        "Stability",
        "What becomes of digits at the edges of every domain?",
        body,
    )
}

#[cfg(feature = "pictures")]
fn table<'a>(caption: &str, findings: impl Iterator<Item = &'a Finding>) -> maud::Markup {
    let head =
        "member,law,error,conditioning,ratio,allowed,cases,evaluations,seconds,verdict,worst at";
    let rows = page! {
        tbody {
            @for f in findings {
                tr {
                    th scope="row" { (f.member) }
                    td { (f.law) }
                    td { (format!("{:.1e} {}", f.error, f.unit)) }
                    @for cell in cells(f) { td { (cell) } }
                    td { (f.at) }
                }
            }
        }
    };
    html_table(None, caption, head.split(','), rows)
}
