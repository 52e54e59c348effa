//! The findings that a study prints at its end, as texts and as a table of its own.

use super::order::{best_of_each, error_of, is_printed, sampling, subject, whole};
use crate::error::{count, listed};
use crate::experiment::{
    Allowance, Calibrated, Calibration, Choice, Duel, Duels, Explained, Factor, Findings, Line,
    Metric, NONE, Ranking, Scope, are_named,
};
use crate::report::acquisition::table::{TextTable, error, headed, starred};
use crate::report::{each_once, first_of_each};
use crate::statistics::{Paired, SIGNIFICANCE, Verdict};
use std::fmt::Write as _;

/// Name of a choice's reconstruction, with sample set and instrument if there are several.
pub(super) fn method(choice: &Choice, findings: &Findings) -> String {
    method_but_for(choice, findings, None)
}

/// Name of a choice's reconstruction beside a [`subject`], which has the sample set where a report is about these.
pub(super) fn method_beside(choice: &Choice, findings: &Findings) -> String {
    let is_said = findings.factor == Factor::SampleSet;
    method_but_for(choice, findings, is_said.then_some(Factor::SampleSet))
}

/// Name of a choice's reconstruction without the level of a factor.
pub(super) fn method_but_for(
    choice: &Choice,
    findings: &Findings,
    factor: Option<Factor>,
) -> String {
    let several = |of: fn(&Choice) -> &String| {
        let lines = findings.rankings.iter().flat_map(|r| &r.lines);
        lines.map(|l| of(&l.choice)).any(|v| v != of(choice))
    };
    let mut parts = Vec::new();
    if factor != Some(Factor::Reconstruction) {
        parts.push(choice.reconstruction.clone());
    }
    if are_named(&choice.coordinates) {
        parts.push(format!("in {}", choice.coordinates));
    }
    if factor != Some(Factor::SampleSet) && several(|c| &c.sample_set) {
        parts.push(format!("of {}", choice.sample_set));
    }
    if factor != Some(Factor::Instrument) && several(|c| &c.instrument) {
        parts.push(format!("on {}", choice.instrument));
    }
    parts.join(" ")
}

/// The error of each sampling by its best reconstruction, by `nrmse` and moments; by `nrmse` duels with the first parametrization
/// and the shares of the variance; over all truths.
pub fn study_text(findings: &Findings) -> String {
    let mut out = String::new();
    let of_all = |s: &Scope| s.metric == Metric::Nrmse && s.truth.is_none();
    let is_shown = |s: &Scope| is_printed(&s.metric) && s.truth.is_none() && s.materials > 0;
    for ranking in findings.rankings.iter().filter(|r| is_shown(&r.scope)) {
        errors_of_each(findings, ranking, &mut out);
        let duels = duels_of(findings, ranking);
        let Some(duels) = duels.filter(|d| of_all(&d.scope)) else {
            continue;
        };
        for reference in references(findings, duels) {
            let methods = match reference == NONE {
                true => beside_none(duels),
                false => in_own_coordinates(ranking, findings.factor),
            };
            for method in methods {
                against_reference(findings, duels, &method, &reference, &mut out);
            }
        }
    }
    for explained in findings.explained.iter().filter(|e| of_all(&e.scope)) {
        shares(explained, &mut out);
    }
    out
}

/// The duels of the scope of a ranking.
pub(super) fn duels_of<'f>(findings: &'f Findings, ranking: &Ranking) -> Option<&'f Duels> {
    let mut all = findings.duels.iter();
    all.find(|d| d.scope == ranking.scope)
}

/// The allowances as headings.
pub(super) fn headings(findings: &Findings) -> Vec<&str> {
    let all = findings.allowances.iter();
    all.map(|a| a.trim_end_matches(" poses")).collect()
}

fn errors_of_each(findings: &Findings, ranking: &Ranking, out: &mut String) {
    let scope = &ranking.scope;
    let mut lines = best_of_each(ranking, findings.factor);
    let of = |choice: &Choice| subject(findings.factor, choice);
    let all: Vec<String> = ranking.lines.iter().map(|l| of(&l.choice)).collect();
    lines.sort_by_key(|l| all.iter().position(|name| *name == of(&l.choice)));
    let allowances = 0..findings.allowances.len();
    let means = lines.iter().map(|line| {
        let choice = &line.choice;
        let name = format!("{}, {}", of(choice), method_beside(choice, findings));
        let means = allowances.clone().map(|a| whole(line, a).map(|c| c.mean));
        (name, means.collect())
    });
    let means: Vec<(String, Vec<Option<f64>>)> = means.collect();
    let title = error_of(scope, "");
    let columns = starred(&title, &headings(findings), &means, |i, a, star| {
        let median = whole(lines[i], a).map(|c| c.median);
        format!("{}{star} ({})", error(means[i].1[a]), error(median))
    });
    let _ = write!(out, "\n{columns}");
    let left_out = match scope.left_out.join(", ") {
        names if names.is_empty() => names,
        names => format!(" (left out: {names})"),
    };
    let _ = writeln!(
        out,
        "Geometric mean (and median) over {}{left_out} of the error of each sampling by the reconstruction that is \
         best over all budgets; * best of its column. {}",
        count(scope.materials, "material"),
        filled(&lines)
    );
}

/// How equal the numbers of readings of lines are.
fn filled(lines: &[&Line]) -> String {
    let allowances = lines.first().map_or(0, |line| line.cells.len());
    let spread = (0..allowances).filter_map(|a| {
        let readings = || lines.iter().filter_map(|l| Some(whole(l, a)?.readings));
        Some(readings().reduce(f64::max)? / readings().reduce(f64::min)?)
    });
    let spread = spread.map(|s| format!("{:.1}", 100.0 * (s - 1.0)));
    format!(
        "A budget is an upper limit: the most readings of a column are {} % more than the least.",
        listed(spread)
    )
}

/// A choice for each reconstruction in the schedule's own coordinates that is used at every
/// allowance; what a factor compares counts as one.
fn in_own_coordinates(ranking: &Ranking, factor: Factor) -> Vec<Choice> {
    let everywhere = |line: &&Line| line.cells.iter().all(Option::is_some);
    let choices = ranking.lines.iter().filter(everywhere).map(|l| &l.choice);
    let own = choices.filter(|c| !are_named(&c.coordinates)).cloned();
    first_of_each(own, |a, b| are_alike(factor, METHOD, a, b))
}

/// What a method is, beside its coordinates.
const METHOD: [Factor; 3] = [
    Factor::Reconstruction,
    Factor::SampleSet,
    Factor::Instrument,
];

/// True if two choices have the same levels of some factors, but for the one that a report is about.
fn are_alike(
    about: Factor,
    kept: impl IntoIterator<Item = Factor>,
    a: &Choice,
    b: &Choice,
) -> bool {
    let mut kept = kept.into_iter().filter(|k| *k != about);
    kept.all(|k| k.level(a) == k.level(b))
}

/// One choice each of the reconstructions, in the coordinates of the schedule or in their default ones, that are compared with
/// the same of a sample set of no parametrization.
pub(super) fn beside_none(duels: &Duels) -> Vec<Choice> {
    let guided = |duel: &Duel| {
        let guided = match [&duel.a, &duel.b].map(|c| c.parametrization == NONE) {
            [true, _] => &duel.b,
            [false, true] => &duel.a,
            [false, false] => return None,
        };
        (!are_named(&guided.coordinates)).then(|| guided.clone())
    };
    let methods = duels.duels.iter().filter_map(guided);
    first_of_each(methods, |a, b| {
        are_alike(Factor::Parametrization, METHOD, a, b)
    })
}

/// A duel as the choice that is not the reference, the reference, and ratios of the errors of the first to those of
/// the second, one per name of [`compared_at`]; `None` if neither side is it.
pub(super) fn against(
    findings: &Findings,
    duel: &Duel,
    reference: &str,
) -> Option<([Choice; 2], Vec<Option<Paired>>)> {
    let is = |choice: &Choice| findings.factor.level(choice) == reference;
    let overall = (findings.allowances.len() > 1).then_some(duel.overall);
    let cells = duel.cells.iter().copied().chain(overall);
    let (a, b) = (duel.a.clone(), duel.b.clone());
    if is(&b) {
        return Some(([a, b], cells.collect()));
    }
    let turned = |p: Option<Paired>| p.map(|p| p.inverted());
    is(&a).then(|| ([b, a], cells.map(turned).collect()))
}

/// What ratios stand at: every allowance, and all of them together where there are several.
pub(super) fn compared_at(findings: &Findings) -> Vec<String> {
    let mut names = findings.allowances.clone();
    names.extend((names.len() > 1).then(|| "all".to_owned()));
    names
}

/// The levels of the factor that others are compared with, of those that there are: the reference, and no parametrization.
pub(super) fn references(findings: &Findings, duels: &Duels) -> Vec<String> {
    let none = (findings.factor == Factor::Parametrization).then(|| NONE.to_owned());
    let all = each_once(findings.reference.clone().into_iter().chain(none));
    let sides = || duels.duels.iter().flat_map(|d| [&d.b, &d.a]);
    let is_there = |name: &String| sides().any(|c| findings.factor.level(c) == name);
    all.into_iter().filter(is_there).collect()
}

/// True if a choice has the challenger's level of the factor.
pub(super) fn is_challenger(findings: &Findings, choice: &Choice) -> bool {
    Some(findings.factor.level(choice)) == findings.challenger.as_deref()
}

/// A choice as the level of the factor: a parametrization with its warps.
pub(super) fn level(findings: &Findings, choice: &Choice) -> String {
    match findings.factor {
        Factor::Parametrization => sampling(choice),
        Factor::Warp => format!("{} {}", choice.parametrization, choice.warp),
        factor => format!("{}, {}", factor.level(choice), sampling(choice)),
    }
}

/// Writes ratios against the reference: a line per level over all truths, for the challenger also
/// one per truth.
fn against_reference(
    findings: &Findings,
    duels: &Duels,
    best: &Choice,
    reference: &str,
    out: &mut String,
) {
    let scope = &duels.scope;
    let rows = ratios(findings, duels, best, reference).into_iter();
    let named = rows.map(|r| (format!("  {}", r.name), r.cells));
    let mut named: Vec<(String, Vec<Option<Paired>>)> = named.collect();
    let others = findings.duels.iter().filter(|d| {
        d.scope.truth.is_some()
            && d.scope.metric == scope.metric
            && d.scope.measure == scope.measure
    });
    for other in others {
        let mut asked = ratios(findings, other, best, reference);
        asked.retain(|r| is_challenger(findings, &r.choice));
        let truth = other.scope.truth.as_deref().unwrap_or_default();
        for row in asked {
            let name = format!("    {}, {truth} ({})", row.name, other.scope.materials);
            named.push((name, row.cells));
        }
    }
    if named.is_empty() {
        return;
    }
    let text = format!(
        "error / that of {reference}, {}{}",
        match method_but_for(best, findings, Some(findings.factor)) {
            method if method.is_empty() => method,
            method => format!("{method}, "),
        },
        scope.measure
    );
    let mut headings = headings(findings);
    headings.extend((headings.len() > 1).then_some("all"));
    let mut columns = headed(&text, &headings);
    for (mut row, cells) in named {
        for cell in cells {
            let Some(cell) = cell else {
                row += "\t- ";
                continue;
            };
            let verdict = cell.verdict();
            row += &format!("\t{:.3}{}", cell.ratio, mark(verdict));
            if let Some([low, high]) = cell.interval {
                row += &format!(" {low:.2}–{high:.2}");
            }
            if verdict == Verdict::Undecided {
                row += &format!(", p {}", p_text(cell.p));
            }
        }
        columns.row(&row);
    }
    let _ = write!(out, "\n{columns}");
    let _ = writeln!(
        out,
        "Ratio{} and its 95 % interval over materials: + better, - worse, = no difference within the band, \
         ? undecided: {}; all: of each material its mean over the budgets, p as it is.",
        at_readings(findings),
        undecided(findings)
    );
}

/// At which readings ratios stand.
pub(super) fn at_readings(findings: &Findings) -> &'static str {
    let all = findings.allowances.iter();
    match all.filter(|a| !Allowance::is_time(a)).count() {
        0 | 1 => "",
        n if n == findings.allowances.len() => {
            " at equal readings, where budgets enclose them (between two, errors go straight in log-log)"
        }
        _ => {
            " at equal readings, where a number was allowed and budgets enclose them (between two, errors go straight \
             in log-log)"
        }
    }
}

/// What leaves a comparison undecided: the threshold of p, its test and its correction.
pub(super) fn undecided(findings: &Findings) -> String {
    format!(
        "the 95 % interval holds 1, or p is not below {SIGNIFICANCE} (Wilcoxon's signed-rank test over \
         materials, adjusted by Holm over the {})",
        count(findings.allowances.len(), "budget")
    )
}

/// A p-value.
pub(super) fn p_text(p: Option<f64>) -> String {
    match p {
        None => "–".into(),
        Some(p) if p < 1e-4 => "< 0.0001".into(),
        Some(p) if p < 0.01 => format!("{p:.4}"),
        Some(p) if p < 0.1 => format!("{p:.3}"),
        Some(p) => format!("{p:.2}"),
    }
}

fn mark(verdict: Verdict) -> char {
    match verdict {
        Verdict::Better => '+',
        Verdict::Worse => '-',
        Verdict::Same => '=',
        Verdict::Undecided => '?',
    }
}

/// A level of the factor against the reference at every allowance.
pub(super) struct Against {
    /// The level, and behind a stroke the warp of the reference where it is another.
    pub name: String,
    /// The choice with this level.
    pub choice: Choice,
    /// Ratio of its error to that of the reference, one per name of [`compared_at`].
    pub cells: Vec<Option<Paired>>,
}

/// The duels of choices that are as `best` but for what is sampled and for the factor, against the
/// reference.
pub(super) fn ratios(
    findings: &Findings,
    duels: &Duels,
    best: &Choice,
    reference: &str,
) -> Vec<Against> {
    let factor = findings.factor;
    let named = |d: &Duel| {
        let ([choice, reference], cells) = against(findings, d, reference)?;
        let name = level(findings, &choice);
        let name = match reference.warp.as_str() {
            _ if factor != Factor::Parametrization => name,
            _ if reference.parametrization == NONE => name,
            warp if warp == choice.warp => name,
            "none" => format!("{name} / unwarped"),
            warp => format!("{name} / {warp}"),
        };
        Some(Against {
            name,
            choice,
            cells,
        })
    };
    let kept = || METHOD.into_iter().chain([Factor::Coordinates]);
    let all = duels.duels.iter();
    let mine = all.filter(|d| are_alike(factor, kept(), &d.a, best));
    mine.filter_map(named).collect()
}

fn shares(explained: &Explained, out: &mut String) {
    let of = match explained.scattered {
        true => "scattered readings",
        false => "grids",
    };
    let error = error_of(&explained.scope, "");
    let _ = writeln!(out, "\nWhat explains the variance of ln {error}, {of}:");
    let named = named_shares(&explained.factors, &explained.shares);
    for (name, share) in named.into_iter().take(8) {
        let _ = writeln!(out, "  {:>5.1} %  {name}", 100.0 * share);
    }
}

/// Shares by name, the largest first; without factors of a single level, which explain nothing by
/// construction.
pub(super) fn named_shares(
    factors: &[&str],
    shares: &crate::statistics::Shares,
) -> Vec<(String, f64)> {
    let varied = |f: usize| shares.levels[f] > 1;
    let mains = factors.iter().zip(&shares.mains).enumerate();
    let mains = mains.filter(|(f, _)| varied(*f));
    let mut named: Vec<(String, f64)> = mains.map(|(_, (f, s))| ((*f).to_owned(), *s)).collect();
    let pairs = shares.pairs.iter();
    let pairs = pairs.filter(|(i, j, _)| varied(*i) && varied(*j));
    named.extend(pairs.map(|&(i, j, s)| (format!("{} × {}", factors[i], factors[j]), s)));
    named.push(("rest".into(), shares.rest));
    named.sort_by(|a, b| b.1.total_cmp(&a.1));
    named
}

/// What the cells of [`calibrations`] hold.
pub(super) const LEGEND: &str = "Error over the error that the reconstruction expected of itself: the median over \
                                 materials, what 90 % of materials are below, and under the cosine measure the share \
                                 of materials below the bound that is stated for 90 %.";

/// A table for each metric and measure.
pub(super) fn calibrations(findings: &Findings) -> Vec<TextTable> {
    let line = |line: &Calibration| {
        let [sampling, method] = [sampling(&line.choice), method(&line.choice, findings)];
        let cells = line.cells.iter().map(calibrated);
        (format!("{sampling}, {method}"), cells.collect())
    };
    let table = |of: &[Calibration]| TextTable {
        title: format!("{} over expected, {}", of[0].metric.name(), of[0].measure),
        head: headings(findings).into_iter().map(String::from).collect(),
        lines: of.iter().map(line).collect(),
    };
    let all = &findings.calibrations;
    all.chunk_by(Calibration::is_of_same_error)
        .map(table)
        .collect()
}

fn calibrated(cell: &Option<Calibrated>) -> String {
    let Some(cell) = cell else {
        return "–".into();
    };
    let ninth = cell.ninth.map_or("–".into(), |r| format!("{r:.2}"));
    let below = cell.below.map(|b| format!(" {:.0} %", 100.0 * b));
    format!("{:.2} {ninth}{}", cell.median, below.unwrap_or_default())
}

/// All tables as a text; empty if nothing was expected.
pub fn calibration(findings: &Findings) -> String {
    let out: String = calibrations(findings).iter().map(TextTable::text).collect();
    match out.is_empty() {
        true => out,
        false => format!("{out}\n{LEGEND}\n"),
    }
}
