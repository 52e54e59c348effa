//! Rankings: every choice at every allowance, against the best.

use super::super::tables::method;
use super::verdict::number;
use super::{p_text, sampling_name, scope_title, sorted};
use crate::experiment::study::{Cell, Findings, Line, Ranking};
use crate::report::table::error;
use crate::statistics::Verdict;
use maud::{Markup, html};

/// Lines that are seen without asking for more.
const SHOWN: usize = 12;

/// How to read the tables.
pub(super) fn legend(findings: &Findings) -> Markup {
    html! {
        p {
            "Each cell: the geometric mean of the error over materials; its ratio to the least of the "
            "column with its 95 % interval; p (signed rank, adjusted by Holm over the column), and on how "
            "many materials it is better and worse than that. "
            b { "★" } " is the least of the column, " b { "≈" }
            " what cannot be told from it. Order: slope of ln error on ln readings. The lines stand by "
            "their mean ratio to the best"
            @if findings.allowances.len() > 1 { " over the budgets they are used at" }
            ". All of it is in " code { "ranking.csv" } "."
        }
    }
}

/// A ranking of a scope, folded away but for the first.
pub(super) fn table(findings: &Findings, ranking: &Ranking, number: usize) -> Markup {
    let lines = sorted(ranking);
    let (shown, rest) = lines.split_at(lines.len().min(SHOWN));
    html! {
        details.page id={ "ranking-" (number) } open[number == 0] {
            summary { (scope_title(&ranking.scope)) }
            (part(findings, shown, 1))
            @if !rest.is_empty() {
                details {
                    summary { "The other " (rest.len()) }
                    (part(findings, rest, SHOWN + 1))
                }
            }
        }
    }
}

fn part(findings: &Findings, lines: &[&Line], first: usize) -> Markup {
    html! {
        div.wide {
            table.ranking {
                thead {
                    tr {
                        th scope="col" { "#" }
                        th scope="col" { "sampled in" }
                        th scope="col" { "reconstructed by" }
                        @for at in &findings.allowances { th scope="col" { (at) } }
                        th scope="col" { "order" }
                    }
                }
                tbody {
                    @for (i, line) in lines.iter().enumerate() {
                        tr {
                            td { (first + i) }
                            th scope="row" { (sampling_name(&line.choice)) }
                            td { (method(&line.choice, findings)) }
                            @for cell in &line.cells { (self::cell(cell.as_ref())) }
                            td.number {
                                @if let Some(order) = &line.order {
                                    (signed(order.slope))
                                    @if let Some([low, high]) = order.interval {
                                        small { (signed(low)) " … " (signed(high)) }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn cell(cell: Option<&Cell>) -> Markup {
    let Some(cell) = cell else {
        return html! { td.number { "–" } };
    };
    let verdict = cell.against_best.map(|p| p.verdict());
    let near = matches!(verdict, Some(Verdict::Same | Verdict::Undecided));
    html! {
        td.number.best[cell.place == Some(1)].near[near] {
            b { (error(Some(cell.mean))) }
            @if cell.place == Some(1) { " ★" } @else if near { " ≈" }
            @if cell.place.is_none() { small { "not all materials" } }
            @if let Some(paired) = &cell.against_best {
                small {
                    "×" (number(paired.ratio))
                    @if let Some([low, high]) = paired.interval {
                        " [" (number(low)) ", " (number(high)) "]"
                    }
                }
                small { "p " (p_text(paired.p)) ", " (paired.wins) "/" (paired.losses) }
            }
        }
    }
}

fn signed(slope: f64) -> String {
    format!("{slope:.2}").replace('-', "−")
}
