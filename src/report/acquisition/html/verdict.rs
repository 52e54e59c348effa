//! The answer in a few sentences, and what may be unfair about it.

use super::super::findings::undecided;
use super::super::verdict::{Answer, Contest, Pair, method_of, middle, names};
use super::charts::{self, Looks};
use crate::brdf::Favours;
use crate::error::count;
use crate::experiment::{Findings, Metric, Ranking};
use maud::{Markup, html};

pub(super) fn section(findings: &Findings, looks: &Looks) -> Markup {
    let answer = Answer::new(findings);
    let (pair, contest) = (answer.pair.as_ref(), answer.contest.as_ref());
    let all = || answer.sentences.iter().chain(&answer.others);
    let is_open = all().any(|sentence| sentence.contains("undecided"));
    let left_out = answer.ranking.map(|r| r.scope.left_out.join(", "));
    let ranking = answer.ranking;
    let chart = ranking.and_then(|r| charts::decisive(findings, r, contest, looks));
    let is_limited = contest.is_some_and(|c| c.limit(middle(findings)).is_some());
    let caveats = findings.truths.iter();
    let caveats = caveats.filter_map(|truth| caveat(findings, truth, pair, is_limited));
    let caveats: Vec<Markup> = caveats.collect();
    html! {
        div.answer {
            div.verdict {
                @for sentence in &answer.sentences { p { (sentence) } }
                @if let Some(others) = &answer.others { p.small { (others) } }
                @if let Some(names) = left_out.filter(|names| !names.is_empty()) {
                    p.small { "Left out: " (names) "." }
                }
                @if is_open { p.small { "Undecided: " (undecided(findings)) "." } }
            }
            @if let Some(chart) = chart { (chart) }
        }
        @if !caveats.is_empty() {
            h3 { "Caveats" }
            @for caveat in &caveats { (caveat) }
        }
    }
}

/// A note on a truth: the coordinates it favours, and whether the verdict differs on it; `None` if no material of it is compared.
/// `is_limited`: it has been said that all materials are too few.
fn caveat(
    findings: &Findings,
    truth: &str,
    pair: Option<&Pair>,
    is_limited: bool,
) -> Option<Markup> {
    let a = middle(findings);
    let favours = Favours::ALL.into_iter().find(|f| f.name() == truth);
    let reason = favours.map_or(
        "Too few are alike to be told apart by what their formulas favour.",
        Favours::summary,
    );
    let of_truth = |r: &&Ranking| r.scope.truth.as_deref() == Some(truth);
    let mut own = findings.rankings.iter().filter(of_truth);
    let own = own.find(|r| r.scope.metric == Metric::Nrmse);
    if own.is_none() && findings.truths.len() > 1 {
        return None;
    }
    let biased = favours.is_some_and(Favours::is_biased);
    let said = own.and_then(|ranking| {
        let pair = pair?;
        let at = findings.allowances.get(a)?;
        let by = match method_of(findings, pair) {
            by if by.is_empty() => by,
            by => format!(", by {by}"),
        };
        let contest = Contest::new(findings, ranking, pair);
        let limit = contest.as_ref().filter(|_| !is_limited).and_then(|c| c.limit(a));
        let limit = limit.map_or(String::new(), |limit| format!("; {limit}"));
        Some(match contest.and_then(|c| c.said(findings, a)) {
            Some(said) => format!("On these alone{by}, {said}{limit}."),
            None => {
                let [x, y] = names(findings, pair);
                format!("On these alone {x} and {y} cannot be compared at {at}{by}: none has both errors.")
            }
        })
    });
    Some(html! {
        p.note.warning[biased] {
            b {
                @if biased { "⚠ " }
                "Truth “" (truth) "”"
                @if let Some(own) = own { " (" (count(own.scope.materials, "material")) ")" }
                ". "
            }
            (reason)
            @if let Some(said) = said { " " (said) }
        }
    })
}
