//! What a study prints at its end, as texts and as a table of its own.

use crate::experiment::study::{
    Cell, Choice, Duel, Duels, Explained, Factor, Findings, Metric, OWN, Ranking, Scope,
};
use crate::report::table::error;
use crate::statistics::{Paired, Verdict};
use std::fmt::Write as _;

/// A parametrization with its warps.
pub(super) fn sampling(choice: &Choice) -> String {
    match choice.warp.as_str() {
        "none" => choice.parametrization.clone(),
        warp => format!("{} {warp}", choice.parametrization),
    }
}

/// So many materials.
pub(super) fn materials(n: usize) -> String {
    match n {
        1 => "1 material".into(),
        n => format!("{n} materials"),
    }
}

/// How a choice reconstructs; `sets` and `instruments`: whether there are several to be told apart.
pub(super) fn method(choice: &Choice, findings: &Findings) -> String {
    let several = |of: fn(&Choice) -> &String| {
        let lines = findings.rankings.iter().flat_map(|r| &r.lines);
        lines.map(|l| of(&l.choice)).any(|v| v != of(choice))
    };
    let mut parts = vec![choice.reconstruction.clone()];
    if choice.coordinates != OWN {
        parts.push(format!("in {}", choice.coordinates));
    }
    if several(|c| &c.sample_set) {
        parts.push(format!("of {}", choice.sample_set));
    }
    if several(|c| &c.instrument) {
        parts.push(format!("on {}", choice.instrument));
    }
    parts.join(" ")
}

/// The error of the best reconstruction of each sampling, duels with the first parametrization, and
/// what explains how much; of all truths, by `nrmse`.
pub fn study_text(findings: &Findings) -> String {
    let mut out = String::new();
    let of_all = |s: &Scope| s.metric == Metric::Nrmse && s.truth.is_none();
    for ranking in findings.rankings.iter().filter(|r| of_all(&r.scope)) {
        best_of_each(findings, ranking, &mut out);
        let duels = findings.duels.iter().find(|d| d.scope == ranking.scope);
        for method in in_own_coordinates(ranking) {
            if let Some(duels) = duels {
                against_reference(findings, duels, &method, &mut out);
            }
        }
    }
    for explained in findings.explained.iter().filter(|e| of_all(&e.scope)) {
        shares(explained, &mut out);
    }
    out
}

fn title(out: &mut String, text: &str, width: usize, allowances: &[String]) {
    let _ = write!(out, "\n{text:<width$}");
    for allowance in allowances {
        let _ = write!(out, " {:>9} ", allowance.trim_end_matches(" poses"));
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
}

fn best_of_each(findings: &Findings, ranking: &Ranking, out: &mut String) {
    let mut names: Vec<String> = Vec::new();
    for line in &ranking.lines {
        let name = sampling(&line.choice);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let scope = &ranking.scope;
    let text = format!("{}, {}", scope.metric.name(), scope.measure);
    let width = names.iter().map(|n| n.chars().count() + 2).max();
    let width = width.unwrap_or(0).max(text.len());
    title(out, &text, width, &findings.allowances);
    let cell = |name: &str, a: usize| {
        let mine = ranking.lines.iter().filter(|l| sampling(&l.choice) == name);
        let cells = mine.filter_map(|l| l.cells[a].filter(|c| c.place.is_some()));
        cells.min_by(|x, y| x.mean.total_cmp(&y.mean))
    };
    for name in &names {
        let _ = write!(out, "{:<width$}", format!("  {name}"));
        for a in 0..findings.allowances.len() {
            let best = cell(name, a);
            let mark = match best {
                Some(cell) if cell.place == Some(1) => '*',
                _ => ' ',
            };
            let _ = write!(out, " {:>9}{mark}", error(best.map(|c| c.mean)));
        }
        out.truncate(out.trim_end().len());
        out.push('\n');
    }
    let left_out = match scope.left_out.join(", ") {
        names if names.is_empty() => names,
        names => format!(" (left out: {names})"),
    };
    let _ = writeln!(
        out,
        "Geometric mean over {}{left_out} of the error of the best reconstruction; * best of its column. A budget \
         is an upper limit: grids fill it unequally.",
        materials(scope.materials)
    );
}

/// The choice with the best mean place, of those that are used at every allowance.
pub(super) fn leader(ranking: &Ranking) -> Option<Choice> {
    let places = |cells: &[Option<Cell>]| {
        let places: Option<Vec<usize>> = cells.iter().map(|c| c.as_ref()?.place).collect();
        Some(places?.iter().sum::<usize>())
    };
    let all = ranking.lines.iter();
    let placed = all.filter_map(|l| Some((places(&l.cells)?, &l.choice)));
    placed.min_by_key(|(sum, _)| *sum).map(|(_, c)| c.clone())
}

/// A choice for each reconstruction in the schedule's own coordinates that is used at every
/// allowance.
fn in_own_coordinates(ranking: &Ranking) -> Vec<Choice> {
    let mut methods: Vec<Choice> = Vec::new();
    let like = |a: &Choice, b: &Choice| {
        a.reconstruction == b.reconstruction
            && a.sample_set == b.sample_set
            && a.instrument == b.instrument
    };
    for line in &ranking.lines {
        let choice = &line.choice;
        let everywhere = line.cells.iter().all(Option::is_some);
        if everywhere && choice.coordinates == OWN && !methods.iter().any(|m| like(m, choice)) {
            methods.push(choice.clone());
        }
    }
    methods
}

/// What the duels of a report are against: the parametrization everybody knows, or the first.
const REFERENCE: &str = "half-difference";

/// The parametrization that Barla et al. (2015) argue for.
pub(super) const CHALLENGER: &str = "hybrid";

/// The duel as one against the reference, turned round if need be.
fn against(duel: &Duel, reference: &str) -> Option<(Choice, Vec<Option<Paired>>)> {
    if duel.b.parametrization == reference {
        return Some((duel.a.clone(), duel.cells.clone()));
    }
    let turned = |p: &Option<Paired>| p.map(|p| p.inverted());
    (duel.a.parametrization == reference)
        .then(|| (duel.b.clone(), duel.cells.iter().map(turned).collect()))
}

/// The parametrization that others are compared with.
pub(super) fn reference(duels: &Duels) -> Option<String> {
    let sides = || duels.duels.iter().flat_map(|d| [&d.b, &d.a]);
    let known = sides().find(|c| c.parametrization == REFERENCE);
    let chosen = known.or_else(|| sides().next());
    chosen.map(|c| c.parametrization.clone())
}

/// Ratios against the reference: a line a sampling over all truths, and for hybrid one a truth.
fn against_reference(findings: &Findings, duels: &Duels, best: &Choice, out: &mut String) {
    let Some(reference) = reference(duels) else {
        return;
    };
    let scope = &duels.scope;
    let rows = ratios(duels, best, &reference);
    let mut named: Vec<(String, Vec<Option<Paired>>)> = rows
        .into_iter()
        .map(|r| (format!("  {}", r.name), r.cells))
        .collect();
    let others = findings.duels.iter().filter(|d| {
        d.scope.truth.is_some()
            && d.scope.metric == scope.metric
            && d.scope.measure == scope.measure
    });
    for other in others {
        let rows = ratios(other, best, &reference);
        // As it is, and as it is warped first.
        let hybrids = rows
            .into_iter()
            .filter(|r| r.choice.parametrization == CHALLENGER);
        let truth = other.scope.truth.as_deref().unwrap_or_default();
        for row in hybrids.take(2) {
            let name = format!("    {}, {truth} ({})", row.name, other.scope.materials);
            named.push((name, row.cells));
        }
    }
    let Some(width) = named.iter().map(|n| n.0.chars().count()).max() else {
        return;
    };
    let text = format!(
        "error / that of {reference}, {}, {}",
        method(best, findings),
        scope.measure
    );
    let width = width.max(text.chars().count());
    title(out, &text, width, &findings.allowances);
    for (name, cells) in named {
        let _ = write!(out, "{name:<width$}");
        for cell in cells {
            let (ratio, mark) = match cell {
                Some(cell) => (format!("{:.3}", cell.ratio), mark(cell.verdict())),
                None => ("-".into(), ' '),
            };
            let _ = write!(out, " {ratio:>9}{mark}");
        }
        out.truncate(out.trim_end().len());
        out.push('\n');
    }
    let _ = writeln!(
        out,
        "+ better, - worse, = no difference within the band, ? undecided (95 % interval and \
         Wilcoxon test over materials)."
    );
}

fn mark(verdict: Verdict) -> char {
    match verdict {
        Verdict::Better => '+',
        Verdict::Worse => '-',
        Verdict::Same => '=',
        Verdict::Undecided => '?',
    }
}

/// A sampling against the reference at every allowance.
pub(super) struct Against {
    /// The sampling, and behind a stroke the warp of the reference where it is another.
    pub name: String,
    /// The sampling.
    pub choice: Choice,
    /// Its error over that of the reference.
    pub cells: Vec<Option<Paired>>,
}

/// The duels of samplings that reconstruct as `best` does, against the reference.
pub(super) fn ratios(duels: &Duels, best: &Choice, reference: &str) -> Vec<Against> {
    let mine = duels.duels.iter().filter(|d| {
        d.factor == Factor::Sampling
            && d.a.reconstruction == best.reconstruction
            && d.a.coordinates == best.coordinates
            && d.a.sample_set == best.sample_set
            && d.a.instrument == best.instrument
    });
    let named = |d: &Duel| {
        let (choice, cells) = against(d, reference)?;
        let other = if d.b.parametrization == reference {
            &d.b.warp
        } else {
            &d.a.warp
        };
        let name = match other.as_str() {
            warp if warp == choice.warp => sampling(&choice),
            "none" => format!("{} / unwarped", sampling(&choice)),
            warp => format!("{} / {warp}", sampling(&choice)),
        };
        Some(Against {
            name,
            choice,
            cells,
        })
    };
    mine.filter_map(named).collect()
}

fn shares(explained: &Explained, out: &mut String) {
    let Explained {
        scope,
        factors,
        shares,
        ..
    } = explained;
    let of = if explained.scattered {
        "scattered readings"
    } else {
        "grids"
    };
    let _ = writeln!(
        out,
        "\nWhat explains the variance of ln {}, {}, {of}:",
        scope.metric.name(),
        scope.measure
    );
    for (name, share) in named_shares(factors, shares).into_iter().take(8) {
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
