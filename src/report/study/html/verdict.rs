//! The answer in a few sentences, and what may be unfair about it.

use super::super::tables::{method, reference, sampling};
use super::middle;
use crate::brdf::Favours;
use crate::experiment::study::{Choice, Duels, Factor, Findings, Metric, Ranking, Scope};
use crate::report::table::error;
use crate::statistics::{FEWEST, Paired, Verdict};
use maud::{Markup, html};

/// The parametrization that the paper argues for.
const CHALLENGER: &str = "hybrid";

/// One sampling against the reference, all else equal.
struct Contest {
    challenger: Choice,
    reference: Choice,
    cells: Vec<Option<Paired>>,
}

pub(super) fn section(findings: &Findings) -> Markup {
    let of_all = |s: &&Ranking| s.scope.truth.is_none();
    let rankings: Vec<&Ranking> = findings.rankings.iter().filter(of_all).collect();
    let a = middle(findings);
    let others = rankings.iter().skip(1);
    let others: Vec<String> = others.filter_map(|r| in_short(findings, r, a)).collect();
    html! {
        div.verdict {
            @if let Some(ranking) = rankings.first() {
                @for sentence in sentences(findings, ranking, a) { p { (sentence) } }
            } @else {
                p { "There are no results." }
            }
            @if !others.is_empty() {
                p { "By the other errors and pairs the same ratio is " (others.join("; ")) "." }
            }
        }
        h3 { "What may be unfair about it" }
        @for truth in &findings.truths { (fairness(findings, truth, a)) }
    }
}

/// The best choice, the contest, and how it goes with the budget.
fn sentences(findings: &Findings, ranking: &Ranking, a: usize) -> Vec<String> {
    let mut out = Vec::new();
    let scope = &ranking.scope;
    let first = |l: &&_| place(l, a) == Some(1);
    if let (Some(best), Some(at)) = (ranking.lines.iter().find(first), findings.allowances.get(a)) {
        let mean = best.cells[a].map(|c| c.mean);
        out.push(format!(
            "Of {} ways to sample and to reconstruct, {} sampled and reconstructed by {} errs least at {at}: \
             {} {} in the geometric mean over {}, {} pairs.",
            ranking.lines.len(),
            sampling(&best.choice),
            method(&best.choice, findings),
            scope.metric.name(),
            error(mean),
            materials(scope.materials),
            scope.measure,
        ));
    }
    let Some(contest) = contest(findings, scope, a) else {
        return out;
    };
    let (x, y) = (&contest.challenger, &contest.reference);
    let how = format!(
        "Sampled and reconstructed in their own coordinates by {}{},",
        x.reconstruction,
        warped(x, y)
    );
    if let (Some(Some(cell)), Some(at)) = (contest.cells.get(a), findings.allowances.get(a)) {
        let (x, y) = (&x.parametrization, &y.parametrization);
        out.push(format!("{how} {}.", said(cell, x, y, at)));
    }
    let ratios: Vec<String> = (contest.cells.iter().zip(&findings.allowances))
        .filter_map(|(cell, at)| {
            let cell = cell.as_ref()?;
            Some(format!(
                "{} ({}) at {at}",
                number(cell.ratio),
                cell.verdict()
            ))
        })
        .collect();
    if ratios.len() > 1 {
        out.push(format!(
            "With the budget this ratio goes: {}.",
            ratios.join(", ")
        ));
    }
    out
}

/// What a comparison says, with its numbers.
fn said(cell: &Paired, x: &str, y: &str, at: &str) -> String {
    let n = cell.n;
    let ratio = match cell.interval {
        Some([low, high]) => format!(
            "{} times (95 % {}–{})",
            number(cell.ratio),
            number(low),
            number(high)
        ),
        None => format!("{} times", number(cell.ratio)),
    };
    let counts = format!(
        "worse on {} of {}, better on {}",
        cell.losses,
        materials(n),
        cell.wins
    );
    match cell.verdict() {
        Verdict::Worse => format!("{x} errs {ratio} as much as {y} at {at}: {counts}"),
        Verdict::Better => format!(
            "{x} errs {ratio} as much as {y} at {at}: better on {} of {}, worse on {}",
            cell.wins,
            materials(n),
            cell.losses
        ),
        Verdict::Same => format!(
            "there is no difference between {x} and {y} at {at}: {x} errs {ratio} as much, \
             within the band of {:.1} %",
            100.0 * (cell.band - 1.0)
        ),
        Verdict::Undecided if n < FEWEST => format!(
            "{x} errs {ratio} as much as {y} at {at}; undecided, as {} are too few to tell: {counts}",
            materials(n)
        ),
        Verdict::Undecided => format!(
            "it is undecided whether {x} or {y} errs less at {at}: {x} errs {ratio} as much, {counts}"
        ),
    }
}

/// The contest by another error or measure.
fn in_short(findings: &Findings, ranking: &Ranking, a: usize) -> Option<String> {
    let contest = contest(findings, &ranking.scope, a)?;
    let cell = (*contest.cells.get(a)?)?;
    let interval = cell.interval.map_or(String::new(), |[low, high]| {
        format!(", 95 % {}–{}", number(low), number(high))
    });
    Some(format!(
        "{} ({}{interval}; {}, {} pairs, by {})",
        number(cell.ratio),
        cell.verdict(),
        ranking.scope.metric.name(),
        ranking.scope.measure,
        contest.challenger.reconstruction
    ))
}

/// The duel to speak of: hybrid against half-difference where both are there, else the best against
/// the reference; by the reconstruction that serves the reference best.
fn contest(findings: &Findings, scope: &Scope, a: usize) -> Option<Contest> {
    let duels: &Duels = findings.duels.iter().find(|d| d.scope == *scope)?;
    let ranking = findings.rankings.iter().find(|r| r.scope == *scope)?;
    let name = reference(duels)?;
    let own = duels
        .duels
        .iter()
        .filter(|d| d.factor == Factor::Sampling && d.a.coordinates == "own");
    let all: Vec<Contest> = own
        .filter_map(|d| {
            if d.b.parametrization == name {
                Some(Contest {
                    challenger: d.a.clone(),
                    reference: d.b.clone(),
                    cells: d.cells.clone(),
                })
            } else if d.a.parametrization == name {
                Some(Contest {
                    challenger: d.b.clone(),
                    reference: d.a.clone(),
                    cells: d.cells.iter().map(|p| p.map(|p| p.inverted())).collect(),
                })
            } else {
                None
            }
        })
        .filter(|c| c.cells.get(a).is_some_and(Option::is_some))
        .collect();
    let known = all
        .iter()
        .any(|c| c.challenger.parametrization == CHALLENGER);
    let mean = |choice: &Choice| {
        let line = ranking.lines.iter().find(|l| l.choice == *choice);
        let cell = line.and_then(|l| *l.cells.get(a)?);
        cell.map_or(f64::INFINITY, |c| c.mean)
    };
    let key = |c: &Contest| (mean(&c.reference), mean(&c.challenger));
    all.into_iter()
        .filter(|c| !known || c.challenger.parametrization == CHALLENGER)
        .min_by(|x, y| {
            let (x, y) = (key(x), key(y));
            x.0.total_cmp(&y.0).then(x.1.total_cmp(&y.1))
        })
}

/// A truth, what it favours, and whether the verdict is another on it.
fn fairness(findings: &Findings, truth: &str, a: usize) -> Markup {
    let favours = Favours::ALL.into_iter().find(|f| f.name() == truth);
    let reason = favours.map_or(
        "Too few are alike to be told apart by what their formulas favour.",
        Favours::reason,
    );
    let own = findings
        .rankings
        .iter()
        .find(|r| r.scope.truth.as_deref() == Some(truth) && r.scope.metric == Metric::Nrmse);
    let biased = favours.is_some_and(|f| f != Favours::Neither);
    let said = own.and_then(|ranking| {
        let contest = contest(findings, &ranking.scope, a)?;
        let cell = (*contest.cells.get(a)?)?;
        let (x, y) = (&contest.challenger, &contest.reference);
        let at = findings.allowances.get(a)?;
        let said = said(&cell, &x.parametrization, &y.parametrization, at);
        Some(format!("On these alone, by {}, {said}.", x.reconstruction))
    });
    html! {
        p.note.warning[biased] {
            b {
                @if biased { "⚠ " }
                "Truth “" (truth) "”"
                @if let Some(own) = own { " (" (materials(own.scope.materials)) ")" }
                ". "
            }
            (reason)
            @if let Some(said) = said { " " (said) }
        }
    }
}

fn place(line: &crate::experiment::study::Line, a: usize) -> Option<usize> {
    line.cells.get(a)?.as_ref()?.place
}

/// How two choices are warped, in brackets.
fn warped(x: &Choice, y: &Choice) -> String {
    match (x.warp.as_str(), y.warp.as_str()) {
        ("none", "none") => String::new(),
        (a, b) if a == b => format!(" (both warped {a})"),
        (a, b) => format!(" (warped {a} and {b})"),
    }
}

fn materials(n: usize) -> String {
    match n {
        1 => "1 material".into(),
        n => format!("{n} materials"),
    }
}

/// A ratio with as many digits as tell it from 1.
pub(super) fn number(ratio: f64) -> String {
    match ratio {
        r if (r - 1.0).abs() < 0.05 => format!("{r:.3}"),
        r if (0.01..10.0).contains(&r) => format!("{r:.2}"),
        r if (10.0..1e4).contains(&r) => format!("{r:.0}"),
        r => format!("{r:.1e}"),
    }
}
