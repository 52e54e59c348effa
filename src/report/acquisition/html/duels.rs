//! Samplings against the reference, all else equal.

use super::super::findings::{
    Against, at_readings, beside_none, compared_at, method, p_text, ratios, references, undecided,
};
use super::super::verdict::{number, said};
use super::charts::{self, Looks};
use super::{fold, folded, scope_title};
use crate::experiment::{Cell, Choice, Findings, NONE, Ranking};
use maud::{Markup, html};

/// Forest plots and tables of every scope.
pub(super) fn section(findings: &Findings, looks: &Looks) -> Option<Markup> {
    let all = findings.duels.iter().zip(&findings.rankings);
    let mut parts = Vec::new();
    for (duels, ranking) in all {
        for reference in references(findings, duels) {
            let by = match reference == NONE {
                true => beside_none(duels),
                false => leader(ranking).into_iter().collect(),
            };
            for best in by {
                let rows = ratios(findings, duels, &best, &reference);
                if rows.iter().all(|row| row.cells.iter().all(Option::is_none)) {
                    continue;
                }
                let by = method(&best, findings);
                let against = match reference == NONE {
                    true => ", against no parametrization",
                    false => "",
                };
                let title = format!("{}; by {by}{against}", scope_title(&duels.scope));
                let label = format!("error / that of {reference}");
                let chart = charts::forest(&rows, findings, looks, &label, &title);
                let part = html! {
                    @if let Some(chart) = chart { (chart) }
                    (fold(false, "", "The same as a table", table(findings, &rows, &reference)))
                };
                parts.push((title, part));
            }
        }
    }
    (!parts.is_empty()).then(|| html! {
        p {
            "Error of each sampling over that of the reference, with the reconstruction that ranks best: "
            "the geometric mean of the ratio over materials" (at_readings(findings)) " with its 95 % interval. Each warp stands "
            "against the one at its place in the reference's list; of lists that differ in length the "
            "end of the shorter also stands against the rest of the longer. Behind a stroke: the warp of "
            "the reference, where it is another. Left of 1 is better; the band about 1 counts as no "
            "difference. Undecided: " (undecided(findings)) "; all: of each material its mean over the budgets, p as it is."
        }
        (folded(parts))
    })
}

fn table(findings: &Findings, rows: &[Against], reference: &str) -> Markup {
    let ratio = format!("error / {reference}");
    let counts = "p\tbetter on\tworse on\talike on\tverdict".split('\t');
    let head = ["sampled in", "at", &ratio, "95 %"]
        .into_iter()
        .chain(counts);
    let rows = html! {
        @for row in rows {
            tbody {
                @for (i, (cell, at)) in row.cells.iter().zip(compared_at(findings))
                    .filter_map(|(c, at)| Some((c.as_ref()?, at))).enumerate() {
                    tr {
                        th scope="row" { @if i == 0 { (row.name) } @else { span { (row.name) } } }
                        td { (at) }
                        td { (number(cell.ratio)) }
                        td {
                            @if let Some([low, high]) = cell.interval {
                                (number(low)) " – " (number(high))
                            }
                        }
                        td { (p_text(cell.p)) }
                        td { (cell.wins) }
                        td { (cell.losses) }
                        td { (cell.ties) }
                        td { (said(cell)) }
                    }
                }
            }
        }
    };
    super::table(Some("duels sorts"), "", head, rows)
}

/// The choice with the best mean place, of those that are used at every allowance.
fn leader(ranking: &Ranking) -> Option<Choice> {
    let places = |cells: &[Option<Cell>]| {
        let places: Option<Vec<usize>> = cells.iter().map(|c| c.as_ref()?.place).collect();
        Some(places?.iter().sum::<usize>())
    };
    let all = ranking.lines.iter();
    let placed = all.filter_map(|l| Some((places(&l.cells)?, &l.choice)));
    placed.min_by_key(|(sum, _)| *sum).map(|(_, c)| c.clone())
}
