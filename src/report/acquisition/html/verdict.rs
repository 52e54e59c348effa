//! The answer in a few sentences, and what may be unfair about it.

use super::super::findings::{against, is_challenger, method, p_text, undecided};
use super::super::order::sampling;
use super::charts::{self, Looks};
use super::{middle, number, said};
use crate::brdf::Favours;
use crate::error::count;
use crate::experiment::{Choice, Duels, Findings, Line, Metric, NONE, OWN, Ranking, are_named};
use crate::report::acquisition::table::error;
use crate::statistics::{Paired, SIGNIFICANCE, Verdict, least_p};
use maud::{Markup, html};

/// A sampling and the reference, all else equal; the same two for all truths, errors and measures.
type Pair = [Choice; 2];

/// The comparison of a pair in one ranking, at every allowance.
struct Contest<'a> {
    pair: &'a Pair,
    ranking: &'a Ranking,
    cells: Vec<Option<Paired>>,
}

impl<'a> Contest<'a> {
    fn new(findings: &Findings, ranking: &'a Ranking, pair: &'a Pair) -> Option<Self> {
        let duels = findings.duels.iter().find(|d| d.scope == ranking.scope)?;
        let mut all = duels
            .duels
            .iter()
            .filter_map(|d| against(findings, d, findings.reference.as_deref()?));
        let (_, mut cells) = all.find(|(sides, _)| sides == pair)?;
        // Without that of all allowances together.
        cells.truncate(findings.allowances.len());
        Some(Self {
            pair,
            ranking,
            cells,
        })
    }

    fn cell(&self, a: usize) -> Option<&Paired> {
        self.cells.get(a)?.as_ref()
    }

    /// The sentence about the comparison at an allowance, with its numbers.
    fn said(&self, a: usize, at: &str) -> Option<String> {
        let cell = self.cell(a)?;
        let [x, y] = names(self.pair);
        let n = count(cell.n, "material");
        let ratio = match cell.interval {
            Some([low, high]) => format!(
                "{} times (95 % {}–{})",
                number(cell.ratio),
                number(low),
                number(high)
            ),
            None => format!("{} times", number(cell.ratio)),
        };
        let counts = match cell.verdict() {
            Verdict::Better => format!("better on {} of {n}, worse on {}", cell.wins, cell.losses),
            _ => format!("worse on {} of {n}, better on {}", cell.losses, cell.wins),
        };
        let tests = self.cells.iter().flatten().filter(|c| c.p.is_some());
        Some(match cell.verdict() {
            Verdict::Worse | Verdict::Better => {
                format!("{x} errs {ratio} as much as {y} at {at}: {counts}")
            }
            Verdict::Same => format!(
                "there is no difference between {x} and {y} at {at}: {x} errs {ratio} as much, \
                 within the band of {:.1} %",
                100.0 * (cell.band - 1.0)
            ),
            Verdict::Undecided if least_p(cell.n, tests.count()) >= SIGNIFICANCE => format!(
                "at {at} the error of {x} is {ratio} that of {y} ({counts}{}); {n} cannot show that others follow",
                cell.p
                    .map_or(String::new(), |p| format!(", p {}", p_text(Some(p)))),
            ),
            Verdict::Undecided => format!(
                "it is undecided whether {x} or {y} errs less at {at} (p {}): {x} errs {ratio} as much, {counts}",
                p_text(cell.p)
            ),
        })
    }
}

/// The samplings of a pair with their warps, and with their sample sets where these differ.
fn names(pair: &Pair) -> [String; 2] {
    let differ = pair[0].sample_set != pair[1].sample_set;
    pair.each_ref().map(|choice| match differ {
        true if choice.parametrization != NONE => {
            format!("{} in {}", choice.sample_set, named(choice))
        }
        _ => named(choice),
    })
}

pub(super) fn section(findings: &Findings, looks: &Looks) -> Markup {
    let of_all = |s: &&Ranking| s.scope.truth.is_none();
    let rankings: Vec<&Ranking> = findings.rankings.iter().filter(of_all).collect();
    let a = middle(findings);
    let pair = rankings.first().and_then(|r| pair(findings, r, a));
    let pair = pair.as_ref();
    let others = rankings.iter().skip(1);
    let short = |r: &&Ranking| in_short(&Contest::new(findings, r, pair?)?, a);
    let others: Vec<String> = others.filter_map(short).collect();
    let contest = rankings
        .first()
        .and_then(|&r| Contest::new(findings, r, pair?));
    let chart = match &contest {
        Some(c) => charts::decisive(findings, c.ranking, c.pair.each_ref(), &c.cells, looks),
        None => None,
    };
    html! {
        div.answer {
            div.verdict {
                @if let Some(ranking) = rankings.first() {
                    @for sentence in sentences(findings, ranking, contest.as_ref(), a) { p { (sentence) } }
                } @else {
                    p { "There are no results." }
                }
                @if !others.is_empty() {
                    p.small { "By the other errors and pairs the same ratio is " (others.join("; ")) "." }
                }
                @if contest.is_some() { p.small { "Undecided: " (undecided(findings)) "." } }
            }
            @if let Some(chart) = chart { (chart) }
        }
        h3 { "Caveats" }
        @for truth in &findings.truths { (fairness(findings, truth, pair, a)) }
    }
}

/// Sentences about the best choice, the comparison, and its course with the budget.
fn sentences(
    findings: &Findings,
    ranking: &Ranking,
    contest: Option<&Contest<'_>>,
    a: usize,
) -> Vec<String> {
    let mut out = Vec::new();
    let scope = &ranking.scope;
    let first = |l: &&_| place(l, a) == Some(1);
    if let (Some(best), Some(at)) = (ranking.lines.iter().find(first), findings.allowances.get(a)) {
        let mean = best.cells[a].map(|c| c.mean);
        out.push(format!(
            "Of {} ways to sample and to reconstruct, {} sampled and reconstructed by {} errs least at {at}: \
             {} {} in the geometric mean over {}, {} pairs.",
            ranking.lines.len(),
            named(&best.choice),
            method(&best.choice, findings),
            scope.metric.name(),
            error(mean),
            count(scope.materials, "material"),
            scope.measure,
        ));
    }
    let Some(contest) = contest else {
        return out;
    };
    let at = |a: usize| findings.allowances.get(a).map_or("", String::as_str);
    if let Some(said) = contest.said(a, at(a)) {
        out.push(format!(
            "{} by {}, {said}.",
            match contest.pair[0].coordinates.as_str() {
                OWN => "Sampled and reconstructed in their own coordinates",
                _ => "Reconstructed",
            },
            contest.pair[0].reconstruction,
        ));
    }
    let ratios: Vec<String> = (0..contest.cells.len())
        .filter_map(|a| {
            let cell = contest.cell(a)?;
            Some(format!(
                "{} ({}) at {}",
                number(cell.ratio),
                said(cell),
                at(a)
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

/// The comparison by another error or measure, in short.
fn in_short(contest: &Contest, a: usize) -> Option<String> {
    let cell = contest.cell(a)?;
    let interval = cell.interval.map_or(String::new(), |[low, high]| {
        format!(", 95 % {}–{}", number(low), number(high))
    });
    let scope = &contest.ranking.scope;
    Some(format!(
        "{} ({}{interval}; {}, {} pairs)",
        number(cell.ratio),
        said(cell),
        scope.metric.name(),
        scope.measure,
    ))
}

/// The pair of the verdict: challenger and reference where both exist, else the best and the
/// reference; in the reconstruction with the smallest error of the reference.
fn pair(findings: &Findings, ranking: &Ranking, a: usize) -> Option<Pair> {
    let duels: &Duels = findings.duels.iter().find(|d| d.scope == ranking.scope)?;
    let own = duels
        .duels
        .iter()
        .filter(|d| !are_named(&d.a.coordinates))
        .filter(|d| d.cells.get(a).is_some_and(Option::is_some));
    let reference = findings.reference.as_deref()?;
    let all: Vec<Pair> = own
        .filter_map(|d| Some(against(findings, d, reference)?.0))
        .collect();
    let known = all.iter().any(|[c, _]| is_challenger(findings, c));
    let mean = |choice: &Choice| {
        let line = ranking.lines.iter().find(|l| l.choice == *choice);
        let cell = line.and_then(|l| *l.cells.get(a)?);
        cell.map_or(f64::INFINITY, |c| c.mean)
    };
    let key = |[challenger, reference]: &Pair| (mean(reference), mean(challenger));
    all.into_iter()
        .filter(|[c, _]| !known || is_challenger(findings, c))
        .min_by(|x, y| {
            let (x, y) = (key(x), key(y));
            x.0.total_cmp(&y.0).then(x.1.total_cmp(&y.1))
        })
}

/// A note on a truth: the coordinates it favours, and whether the verdict differs on it.
fn fairness(findings: &Findings, truth: &str, pair: Option<&Pair>, a: usize) -> Markup {
    let favours = Favours::ALL.into_iter().find(|f| f.name() == truth);
    let reason = favours.map_or(
        "Too few are alike to be told apart by what their formulas favour.",
        Favours::summary,
    );
    let own = findings
        .rankings
        .iter()
        .find(|r| r.scope.truth.as_deref() == Some(truth) && r.scope.metric == Metric::Nrmse);
    let biased = favours.is_some_and(Favours::is_biased);
    let said = own.and_then(|ranking| {
        let pair = pair?;
        let at = findings.allowances.get(a)?;
        let by = &pair[0].reconstruction;
        let contest = Contest::new(findings, ranking, pair);
        let said = contest.and_then(|c| c.said(a, at));
        Some(match said {
            Some(said) => format!("On these alone, by {by}, {said}."),
            None => {
                let [x, y] = names(pair);
                format!("On these alone {x} and {y} cannot be compared at {at} by {by}: none has both errors.")
            }
        })
    });
    html! {
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
    }
}

fn place(line: &Line, a: usize) -> Option<usize> {
    line.cells.get(a)?.as_ref()?.place
}

/// A sampling with its warps, even where there are none: others of the same name may have some; without a parametrization the
/// sample set.
fn named(choice: &Choice) -> String {
    match choice.warp.as_str() {
        NONE if choice.parametrization == NONE => choice.sample_set.clone(),
        "none" => format!("unwarped {}", choice.parametrization),
        _ => sampling(choice),
    }
}
