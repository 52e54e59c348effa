//! Rankings: every choice at every allowance, against the best.

use super::super::findings::{method, p_text};
use super::super::order::sorted;
use super::super::verdict::number;
use super::{fold, sampling_name, scope_title};
use crate::error::{count, listed};
use crate::experiment::{Cell, Findings, Line, Ranking};
use crate::report::acquisition::table::error;
use crate::statistics::{Paired, SIGNIFICANCE, Verdict, least_p};
use maud::{Markup, html};

/// Number of lines that are visible without unfolding.
const SHOWN: usize = 12;

/// The rankings that compare materials.
pub(super) fn shown(findings: &Findings) -> Vec<&Ranking> {
    let all = findings.rankings.iter();
    all.filter(|r| r.scope.materials > 0).collect()
}

/// The tables of all rankings, below an explanation.
pub(super) fn section(findings: &Findings) -> Option<Markup> {
    let shown = shown(findings);
    (!shown.is_empty()).then(|| {
        html! {
            (legend(findings))
            @for (i, ranking) in shown.into_iter().enumerate() { (table(findings, ranking, i)) }
        }
    })
}

fn legend(findings: &Findings) -> Markup {
    html! {
        p {
            "Each cell: the geometric mean of the error over materials; its ratio to the least of the "
            "column with its 95 % interval; p (signed rank, adjusted by Holm over the column), and on how "
            "many materials it is better and worse than that; the geometric mean of the readings. A budget is an "
            "upper limit: grids fill it unequally. "
            b { "★" } " is the least of the column, " b { "≈" }
            " what does not differ from it for sure: the interval holds 1 or p is not below " (SIGNIFICANCE)
            ", or the interval lies within the band of no difference. Order: slope of ln error on ln readings. The lines stand by "
            "their mean ratio to the best"
            @if findings.allowances.len() > 1 { " over the budgets that all of them have" }
            ". All of it is in " code { "ranking.csv" } "."
        }
    }
}

/// The table of a ranking: further lines are folded away, and all of it unless `number` is 0.
fn table(findings: &Findings, ranking: &Ranking, number: usize) -> Markup {
    let mut lines = sorted(ranking);
    lines.retain(|line| line.cells.iter().any(Option::is_some));
    let allowances = 0..findings.allowances.len();
    let separable = allowances.map(|a| least(ranking, a) < SIGNIFICANCE);
    let separable: Vec<bool> = separable.collect();
    let (shown, rest) = lines.split_at(lines.len().min(SHOWN));
    let body = html! {
        @if let Some(note) = too_few(findings, ranking) { p.note { (note) } }
        @if !ranking.scope.left_out.is_empty() {
            p.note { "Left out: " (ranking.scope.left_out.join(", ")) "." }
        }
        (part(findings, shown, 1, &separable))
        @if !rest.is_empty() {
            (fold(false, "", count(rest.len(), "more line"), part(findings, rest, SHOWN + 1, &separable)))
        }
    };
    let id = format!("ranking-{number}");
    fold(number == 0, &id, scope_title(&ranking.scope), body)
}

/// The comparisons of a column with its best.
fn comparisons(ranking: &Ranking, a: usize) -> impl Iterator<Item = Paired> {
    let lines = ranking.lines.iter();
    lines.filter_map(move |l| l.cells[a].and_then(|c| c.against_best))
}

/// The smallest p-value that any comparison of a column can reach.
fn least(ranking: &Ranking, a: usize) -> f64 {
    let materials = comparisons(ranking, a).map(|p| p.n).max();
    // Others are no tests.
    let tests = comparisons(ranking, a).filter(|p| p.p.is_some()).count();
    materials.map_or(0.0, |n| least_p(n, tests))
}

/// A warning if there are too few materials for a significant difference of any of so many choices from the best.
fn too_few(findings: &Findings, ranking: &Ranking) -> Option<String> {
    let allowances = 0..findings.allowances.len();
    let few = allowances.filter(|a| least(ranking, *a) >= SIGNIFICANCE);
    let few: Vec<usize> = few.collect();
    let p = few.iter().map(|a| least(ranking, *a)).fold(1.0, f64::min);
    let all = few.iter().flat_map(|a| comparisons(ranking, *a));
    let most = all.map(|p| p.n).max()?;
    let n = count(most, "material");
    let are = if most == 1 { "is" } else { "are" };
    let at = few.iter().map(|a| findings.allowances[*a].as_str());
    let at = match few.len() == findings.allowances.len() {
        true => String::new(),
        false => format!(" at {}", listed(at)),
    };
    Some(format!(
        "{n} {are} too few to separate so many choices{at}; one that is worse than the best on all of \
         them would have p {}. No ≈ is set there; the ratios and their intervals are what there is to \
         go by.",
        p_text(Some(p))
    ))
}

/// Some lines; `separable`: the columns in which a difference from the best can be significant.
fn part(findings: &Findings, lines: &[&Line], first: usize, separable: &[bool]) -> Markup {
    let allowed = findings.allowances.iter().map(String::as_str);
    let head = ["#", "sampled in", "reconstructed by"].into_iter();
    let head = head.chain(allowed).chain(["order"]);
    let rows = html! {
        tbody {
            @for (i, line) in lines.iter().enumerate() {
                tr {
                    td { (first + i) }
                    th scope="row" { (sampling_name(&line.choice)) }
                    td.by { (method(&line.choice, findings)) }
                    @for (cell, separable) in line.cells.iter().zip(separable) {
                        (self::cell(cell.as_ref(), *separable))
                    }
                    td {
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
    };
    super::table(Some("ranking sorts"), "", head, rows)
}

fn cell(cell: Option<&Cell>, separable: bool) -> Markup {
    let Some(cell) = cell else {
        return html! { td { "–" } };
    };
    let verdict = cell.against_best.map(|p| p.verdict());
    let near = separable && matches!(verdict, Some(Verdict::Same | Verdict::Undecided));
    html! {
        td.best[cell.place == Some(1)].near[near] {
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
                small {
                    @if paired.p.is_some() { "p " (p_text(paired.p)) ", " }
                    (paired.wins) "/" (paired.losses)
                }
            }
            small { (format!("{:.0}", cell.readings)) " readings" }
        }
    }
}

fn signed(slope: f64) -> String {
    format!("{slope:.2}").replace('-', "−")
}
