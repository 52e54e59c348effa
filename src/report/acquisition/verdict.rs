//! The answer of a study in a few sentences: what its materials show, and what they cannot.

use super::findings::{against, duels_of, is_challenger, level, method, method_but_for, p_text};
use super::order::{error_of, sampling};
use super::table::error;
use crate::error::count;
use crate::experiment::{Choice, Duel, Factor, Findings, Line, NONE, OWN, Ranking, are_named};
use crate::report::{each_once, grouped};
use crate::statistics::{Paired, SIGNIFICANCE, Verdict, least_p};

/// A sampling and the reference, all else equal; the same two for all truths, errors and measures.
pub(super) type Pair = [Choice; 2];

/// The comparison of a pair in one ranking, at every allowance.
pub(super) struct Contest {
    pub pair: Pair,
    pub cells: Vec<Option<Paired>>,
}

impl Contest {
    pub(super) fn new(findings: &Findings, ranking: &Ranking, pair: &Pair) -> Option<Self> {
        let reference = findings.reference.as_deref()?;
        let all = duels_of(findings, ranking)?.duels.iter();
        let mut all = all.filter_map(|d| against(findings, d, reference));
        let (pair, mut cells) = all.find(|(sides, _)| sides == pair)?;
        // Without that of all allowances together.
        cells.truncate(findings.allowances.len());
        Some(Self { pair, cells })
    }

    fn cell(&self, a: usize) -> Option<&Paired> {
        self.cells.get(a)?.as_ref()
    }

    /// True if no difference between so few materials can be a finding.
    fn has_too_few(&self, cell: &Paired) -> bool {
        let tests = self.cells.iter().flatten().filter(|c| c.p.is_some());
        cell.verdict() == Verdict::Undecided && least_p(cell.n, tests.count()) >= SIGNIFICANCE
    }

    /// What the materials cannot show, where they are too few.
    pub(super) fn limit(&self, a: usize) -> Option<String> {
        let cell = self.cell(a).filter(|cell| self.has_too_few(cell))?;
        Some(format!(
            "{} cannot show that others follow",
            count(cell.n, "material")
        ))
    }

    /// The sentence about the comparison at an allowance, with its numbers.
    pub(super) fn said(&self, findings: &Findings, a: usize) -> Option<String> {
        let (cell, at) = (self.cell(a)?, findings.allowances.get(a)?);
        let [x, y] = names(findings, &self.pair);
        let n = count(cell.n, "material");
        let interval = cell.interval.map_or(String::new(), |[low, high]| {
            format!(" (95 % {}–{})", share(low), share(high))
        });
        // Of a part of an error, or so many times it.
        let (times, of) = match share(cell.ratio) {
            part if part.contains('/') => (part, " of"),
            number => (number + " times", ""),
        };
        let ratio = times + &interval;
        let counts = match cell.wins > cell.losses {
            true => format!("better on {} of {n}, worse on {}", cell.wins, cell.losses),
            false => format!("worse on {} of {n}, better on {}", cell.losses, cell.wins),
        };
        Some(match cell.verdict() {
            Verdict::Worse | Verdict::Better => {
                format!("{x} errs {ratio} as much as {y} at {at}: {counts}")
            }
            Verdict::Same => format!(
                "there is no difference between {x} and {y} at {at}: {x} errs {ratio} as much, \
                 within the band of {:.1} %",
                100.0 * (cell.band - 1.0)
            ),
            Verdict::Undecided if self.has_too_few(cell) => {
                format!("the error of {x} at {at} is {ratio}{of} that of {y}: {counts}")
            }
            Verdict::Undecided => format!(
                "it is undecided whether {x} or {y} errs less at {at} (p {}): {x} errs {ratio} as much, {counts}",
                p_text(cell.p)
            ),
        })
    }

    /// The ratio at an allowance, and where the materials suffice for one its verdict.
    fn short(&self, a: usize) -> Option<String> {
        let cell = self.cell(a)?;
        Some(match self.has_too_few(cell) {
            true => share(cell.ratio),
            false => format!("{} ({})", share(cell.ratio), said(cell)),
        })
    }
}

/// The sentences about the first ranking of all materials, and those about the others.
pub(super) struct Answer<'a> {
    pub ranking: Option<&'a Ranking>,
    pub pair: Option<Pair>,
    pub contest: Option<Contest>,
    pub sentences: Vec<String>,
    /// The ratio of the pair by the other errors and pairs.
    pub others: Option<String>,
}

impl<'a> Answer<'a> {
    pub(super) fn new(findings: &'a Findings) -> Self {
        let mut rankings = of_all(findings).into_iter();
        let ranking = rankings.next();
        let pair = ranking.and_then(|r| pair(findings, r));
        let a = middle(findings);
        let at = |a: usize| findings.allowances.get(a).map_or("", String::as_str);
        let contest_of = |ranking: &Ranking| Contest::new(findings, ranking, pair.as_ref()?);
        let contest = ranking.and_then(contest_of);
        let mut sentences: Vec<String> = match ranking {
            None => vec!["There are no results.".into()],
            Some(ranking) => leaders(findings, ranking, a).into_iter().collect(),
        };
        if let Some(contest) = &contest {
            if let Some(said) = contest.said(findings, a) {
                let own = match contest.pair[0].coordinates.as_str() {
                    OWN => " in their own coordinates",
                    _ => "",
                };
                sentences.push(match method_of(findings, &contest.pair) {
                    by if by.is_empty() => format!("All else equal{own}, {said}."),
                    by => format!("By {by}{own}, {said}."),
                });
            }
            let ratio = |a: usize| Some(format!("{} at {}", contest.short(a)?, at(a)));
            let ratios: Vec<String> = (0..contest.cells.len()).filter_map(ratio).collect();
            if ratios.len() > 1 {
                sentences.push(format!("The ratio is {}.", ratios.join(", ")));
            }
            sentences.extend(contest.limit(a).map(|limit| format!("{limit}.")));
        }
        let other = |ranking: &Ranking| {
            let short = contest_of(ranking)?.short(a)?;
            Some(format!("{short} by {}", error_of(&ranking.scope, " pairs")))
        };
        let others = rankings.filter(|r| r.scope.metric.is_of_all_views());
        let others: Vec<String> = others.filter_map(other).collect();
        let others = others.join("; ");
        Self {
            ranking,
            contest,
            sentences,
            others: (!others.is_empty())
                .then(|| format!("By the other errors and pairs it is at {} {others}.", at(a))),
            pair,
        }
    }
}

/// The sentences of a study as lines of a text.
pub fn verdict_text(findings: &Findings) -> String {
    format!("\n{}\n", Answer::new(findings).sentences.join("\n"))
}

/// The rankings over all truths.
pub(super) fn of_all(findings: &Findings) -> Vec<&Ranking> {
    let all = findings.rankings.iter();
    all.filter(|r| r.scope.truth.is_none()).collect()
}

/// The sentence about the best choice of each allowance, with the error at allowance `a`.
fn leaders(findings: &Findings, ranking: &Ranking, a: usize) -> Option<String> {
    let scope = &ranking.scope;
    if scope.materials == 0 {
        let all = scope.left_out.join(", ");
        return Some(format!("No material tells the choices apart: {all}."));
    }
    let best = |a: usize| {
        let cell = |l: &Line| *l.cells.get(a)?;
        let is_best = |l: &&Line| cell(l).is_some_and(|c| c.place == Some(1));
        ranking.lines.iter().find(is_best)
    };
    let allowances = findings.allowances.iter().enumerate();
    let bests = allowances.filter_map(|(a, at)| Some((&best(a)?.choice, at.as_str())));
    let groups = grouped(bests);
    let names = each_once(groups.iter().map(|(choice, _)| named(choice)));
    let by = |(choice, at): &(&Choice, Vec<&str>)| {
        let by = format!("by {} at {}", method(choice, findings), at.join(", "));
        match names.len() {
            1 => by,
            _ => format!("{} {by}", named(choice)),
        }
    };
    let each: Vec<String> = groups.iter().map(by).collect();
    let each = each.join("; ");
    let these = match scope.materials {
        1 => "this material".into(),
        n => format!("these {}", count(n, "material")),
    };
    let found = match &names[..] {
        [] => return None,
        [one] if findings.allowances.len() > 1 => {
            format!("{one} errs least at every budget on {these}: {each}")
        }
        [one] => format!("{one} {each} errs least on {these}"),
        _ => format!("on {these} err least: {each}"),
    };
    let mean = best(a).and_then(|line| line.cells[a]).map(|c| c.mean);
    let least = match (mean, findings.allowances.get(a)) {
        (Some(mean), Some(at)) => format!(
            ". The least error at {at} is {} {}{}",
            scope.metric.name(),
            error(Some(mean)),
            match scope.materials {
                1 => String::new(),
                n => format!(", the geometric mean over {}", count(n, "material")),
            },
        ),
        _ => String::new(),
    };
    let pairs = match scope.measure.as_str() {
        "" => String::new(),
        measure => format!(", {measure} pairs"),
    };
    Some(format!(
        "Of {} to sample and to reconstruct, {found}{least}{pairs}.",
        count(ranking.lines.len(), "way")
    ))
}

/// The pair of the verdict: challenger and reference where both exist, else the best and the
/// reference; in the reconstruction with the smallest error of the reference.
fn pair(findings: &Findings, ranking: &Ranking) -> Option<Pair> {
    let a = middle(findings);
    let reference = findings.reference.as_deref()?;
    let is_own =
        |d: &&Duel| !are_named(&d.a.coordinates) && d.cells.get(a).is_some_and(Option::is_some);
    let own = duels_of(findings, ranking)?.duels.iter().filter(is_own);
    let all = own.filter_map(|d| Some(against(findings, d, reference)?.0));
    let all: Vec<Pair> = all.collect();
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

/// What both of a pair are reconstructed by; empty if that is what differs.
pub(super) fn method_of(findings: &Findings, pair: &Pair) -> String {
    match findings.factor {
        Factor::Parametrization if pair[0].sample_set != pair[1].sample_set => {
            method_but_for(&pair[0], findings, Some(Factor::SampleSet))
        }
        factor => method_but_for(&pair[0], findings, Some(factor)),
    }
}

/// The samplings of a pair with their warps, and with their sample sets where these differ; or the levels of what else differs.
pub(super) fn names(findings: &Findings, pair: &Pair) -> [String; 2] {
    if pair[0].parametrization == pair[1].parametrization && pair[0].warp == pair[1].warp {
        return pair.each_ref().map(|choice| level(findings, choice));
    }
    let differ = pair[0].sample_set != pair[1].sample_set;
    pair.each_ref().map(|choice| match differ {
        true if choice.parametrization != NONE => {
            format!("{} in {}", choice.sample_set, named(choice))
        }
        _ => named(choice),
    })
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

/// Position of the middle allowance, which stands for all where there is room for one.
pub(super) fn middle(findings: &Findings) -> usize {
    findings.allowances.len().saturating_sub(1) / 2
}

/// The verdict of a comparison, and the p that leaves it undecided.
pub(super) fn said(cell: &Paired) -> String {
    match (cell.verdict(), cell.p) {
        (Verdict::Undecided, None) => "too few materials".into(),
        (Verdict::Undecided, p) => format!("undecided, p {}", p_text(p)),
        (verdict, _) => verdict.to_string(),
    }
}

/// A ratio for a sentence: a small one as a part, `1/57`.
fn share(ratio: f64) -> String {
    match ratio {
        r if r < 0.1 => format!("1/{:.0}", 1.0 / r),
        r => number(r),
    }
}

/// A ratio with enough digits to differ from 1.
pub(super) fn number(ratio: f64) -> String {
    match ratio {
        r if (r - 1.0).abs() < 0.05 => format!("{r:.3}"),
        r if (0.01..10.0).contains(&r) => format!("{r:.2}"),
        r if (10.0..1e4).contains(&r) => format!("{r:.0}"),
        r => format!("{r:.1e}"),
    }
}
