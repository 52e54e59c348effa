//! What an acquisition for moments needs: readings until errors are below their levels, and whether what is sampled best for the
//! BRDF is sampled best for its moments.

use super::findings::{headings, method_beside};
use super::order::{is_printed, subject, whole};
use super::table::TextTable;
use crate::experiment::{Findings, LevelLine, Levels, Line, Metric, Needed, Ranking};
use crate::moments::VIEW_BANDS;
use crate::report::each_once;

/// What the cells of [`tables`] hold.
pub(super) const LEGEND: &str = "Readings until half of the materials stay below the level, and the 95 % interval of that median; ≤: the \
                                 fewest that were tried, >: the most. Each sampling by the reconstruction that needs the fewest over all \
                                 views, or brings the most materials there.";

/// A table for each error of moments that has a level: samplings against bands of views.
pub(super) fn tables(findings: &Findings) -> Vec<TextTable> {
    let all = findings.levels.iter();
    let all: Vec<&Levels> = all.filter(|of| of.scope.truth.is_none()).collect();
    let of_all_views = all.iter().filter(|of| of.scope.metric.is_of_all_views());
    of_all_views.map(|of| table(findings, of, &all)).collect()
}

fn table(findings: &Findings, of: &Levels, all: &[&Levels]) -> TextTable {
    let name = of.scope.metric.name();
    let kind = |levels: &Levels| match levels.scope.metric {
        Metric::Moment(_, kind) => Some(kind),
        _ => None,
    };
    let bands = all
        .iter()
        .filter(|l| !l.scope.metric.is_of_all_views() && kind(l) == kind(of));
    let columns: Vec<&Levels> = std::iter::once(of).chain(bands.copied()).collect();
    let band = |levels: &Levels| match levels.scope.metric {
        Metric::Moment(band @ 1.., _) => {
            let [from, to] = VIEW_BANDS[band];
            format!("{from:.0}°–{to:.0}°")
        }
        _ => "all views".into(),
    };
    let lines = fewest(findings, of).into_iter().map(|line| {
        let cells = columns.iter().map(|levels| {
            let own = levels.lines.iter().find(|l| l.choice == line.choice);
            own.map_or("–".into(), cell)
        });
        (name_of(findings, &line.choice), cells.collect())
    });
    TextTable {
        title: format!("readings until {name} ≤ {}", of.level),
        head: columns.iter().map(|l| band(l)).collect(),
        lines: lines.collect(),
    }
}

/// Of the choices of each sampling the one that needs the fewest readings, in the order of the rows.
fn fewest<'f>(findings: &Findings, of: &'f Levels) -> Vec<&'f LevelLine> {
    let sampling = |line: &LevelLine| subject(findings.factor, &line.choice);
    each_once(of.lines.iter().map(sampling))
        .into_iter()
        .filter_map(|name| {
            let own = of.lines.iter().filter(|line| sampling(line) == name);
            own.reduce(|least, line| if line.is_before(least) { line } else { least })
        })
        .collect()
}

fn name_of(findings: &Findings, choice: &crate::experiment::Choice) -> String {
    format!(
        "{}, {}",
        subject(findings.factor, choice),
        method_beside(choice, findings)
    )
}

fn cell(line: &LevelLine) -> String {
    let text = |needed: Needed| match needed {
        Needed::AtMost(n) => format!("≤ {n:.0}"),
        Needed::About(n) => format!("{n:.0}"),
        Needed::MoreThan(n) => format!("> {n:.0}"),
    };
    let interval = line.interval.map(|ends| ends.map(text));
    let interval = interval.map_or(String::new(), |[low, high]| format!(" [{low}, {high}]"));
    format!("{}{interval}", text(line.half))
}

/// The line with the least mean at an allowance.
fn best(ranking: &Ranking, a: usize) -> Option<&Line> {
    let mut lines = ranking.lines.iter();
    lines.find(|l| whole(l, a).is_some_and(|cell| cell.place == Some(1)))
}

/// For each printed error and allowance the choice with the least mean, and how many times more the choice errs that has the
/// least `nrmse`, with its interval; `None` without errors of moments.
pub(super) fn guides(findings: &Findings) -> Option<TextTable> {
    let all = findings.rankings.iter().filter(|r| {
        r.scope.truth.is_none() && is_printed(&r.scope.metric) && r.scope.materials > 0
    });
    let all: Vec<&Ranking> = all.collect();
    let of_brdf = all.iter().find(|r| r.scope.metric == Metric::Nrmse)?;
    let of_moments = all.iter().filter(|r| r.scope.metric.is_of_moments());
    let mut lines = Vec::new();
    for ranking in of_moments {
        for (a, allowance) in headings(findings).into_iter().enumerate() {
            let (Some(own), Some(of_brdf)) = (best(ranking, a), best(of_brdf, a)) else {
                continue;
            };
            let same = ranking.lines.iter().find(|l| l.choice == of_brdf.choice);
            let ratio = match same.and_then(|l| whole(l, a)?.against_best) {
                _ if own.choice == of_brdf.choice => "is the same".to_owned(),
                None => "–".to_owned(),
                Some(paired) => {
                    let interval = paired.interval;
                    let interval = interval.map(|[low, high]| format!(" [{low:.2}, {high:.2}]"));
                    format!("× {:.2}{}", paired.ratio, interval.unwrap_or_default())
                }
            };
            let cells = vec![
                allowance.to_owned(),
                name_of(findings, &own.choice),
                name_of(findings, &of_brdf.choice),
                ratio,
            ];
            lines.push((ranking.scope.metric.name().to_owned(), cells));
        }
    }
    (!lines.is_empty()).then(|| TextTable {
        title: "error".into(),
        head: ["budget", "least by", "least nrmse by", "which errs"]
            .map(String::from)
            .to_vec(),
        lines,
    })
}

/// All tables as a text; empty without errors of moments.
pub fn levels_text(findings: &Findings) -> String {
    let tables = tables(findings);
    let mut out: String = tables.iter().map(TextTable::text).collect();
    if !out.is_empty() {
        out += &format!("{LEGEND}\n");
    }
    out + &guides(findings).map_or(String::new(), |table| table.text())
}
