//! Samplings against the reference, all else equal.

use super::super::tables::{against, leader, method, reference};
use super::charts;
use super::verdict::number;
use super::{p_text, sampling_name, scope_title};
use crate::error::Error;
use crate::experiment::study::{Choice, Duels, Factor, Findings};
use crate::statistics::Paired;
use maud::{Markup, html};

/// A sampling against the reference at every allowance.
pub(super) struct Against {
    pub choice: Choice,
    pub cells: Vec<Option<Paired>>,
}

/// Forest plots and tables of every scope.
pub(super) fn section(findings: &Findings) -> Result<Markup, Error> {
    let all = findings.duels.iter().zip(&findings.rankings);
    let mut parts = Vec::new();
    for (duels, ranking) in all {
        let (Some(reference), Some(best)) = (reference(duels), leader(ranking)) else {
            continue;
        };
        let rows = rows(duels, &best, &reference);
        if rows.is_empty() {
            continue;
        }
        let by = method(&best, findings);
        let title = format!("{}; by {by}", scope_title(&duels.scope));
        let label = format!("error / that of {reference}");
        let chart = charts::forest(&rows, findings, &label, &title)?;
        parts.push(html! {
            details.page open[parts.is_empty()] {
                summary { (title) }
                @if let Some(chart) = chart { (chart) }
                (table(findings, &rows, &reference))
            }
        });
    }
    Ok(html! {
        p {
            "Error of each sampling over that of the reference, unwarped against unwarped and warped "
            "against warped, with the reconstruction that ranks best: the geometric mean of the ratio "
            "over materials with its 95 % interval. Left of 1 is better; the band about 1 counts as no "
            "difference. p is adjusted over the budgets (Holm)."
        }
        @if parts.is_empty() { p { "There is only one parametrization." } }
        @for part in &parts { (part) }
    })
}

fn rows(duels: &Duels, best: &Choice, reference: &str) -> Vec<Against> {
    let mine = duels.duels.iter().filter(|d| {
        d.factor == Factor::Sampling
            && d.a.reconstruction == best.reconstruction
            && d.a.coordinates == best.coordinates
            && d.a.sample_set == best.sample_set
            && d.a.instrument == best.instrument
    });
    let rows = mine.filter_map(|d| against(d, reference));
    rows.map(|(choice, cells)| Against { choice, cells })
        .collect()
}

fn table(findings: &Findings, rows: &[Against], reference: &str) -> Markup {
    html! {
        div.wide {
            table.duels {
                thead {
                    tr {
                        th scope="col" { "sampled in" }
                        th scope="col" { "at" }
                        th scope="col" { "error / " (reference) }
                        th scope="col" { "95 %" }
                        th scope="col" { "p" }
                        th scope="col" { "better on" }
                        th scope="col" { "worse on" }
                        th scope="col" { "alike on" }
                        th scope="col" { "verdict" }
                    }
                }
                @for row in rows {
                    tbody {
                        @for (i, (cell, at)) in row.cells.iter().zip(&findings.allowances)
                            .filter_map(|(c, at)| Some((c.as_ref()?, at))).enumerate() {
                            tr {
                                th scope="row" { @if i == 0 { (sampling_name(&row.choice)) } }
                                td { (at) }
                                td.number { (number(cell.ratio)) }
                                td.number {
                                    @if let Some([low, high]) = cell.interval {
                                        (number(low)) " – " (number(high))
                                    }
                                }
                                td.number { (p_text(cell.p)) }
                                td.number { (cell.wins) }
                                td.number { (cell.losses) }
                                td.number { (cell.ties) }
                                td { (cell.verdict()) }
                            }
                        }
                    }
                }
            }
        }
    }
}
