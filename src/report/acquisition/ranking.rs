//! Tables at the end of an experiment: of one with instruments errors at equal readings and at equal minutes, by
//! instrument, with the unreachable poses and the errors they cause; else mean errors of all choices.

use super::order::{by, is_printed, sampling};
use super::table::{error, starred};
use crate::error::count;
use crate::experiment::{Choice, Metric, Row};
use crate::report::{Columns, each_once};
use crate::schedule::Unreachable;
use crate::statistics::{compares, geometric_mean};

/// Most materials that are shown one by one; more are shown as a geometric mean.
const ONE_BY_ONE: usize = 4;

/// Sampling, sample set and reconstruction: the identity of a line.
type Parts = [String; 3];

fn choice(row: &Row) -> Parts {
    let choice = row.choice();
    [sampling(&choice), row.sample_set.clone(), by(&choice)]
}

/// Lines and columns of all tables, each once, in the order of the rows.
struct Layout<'r> {
    /// Choices with their names: the sampling, and of the rest what differs between choices.
    lines: Vec<(Parts, String)>,
    instruments: Vec<&'r str>,
}

/// Tables of choices (parametrization, warp and so on) against instruments.
pub fn instruments(rows: &[&Row]) -> String {
    let choices = each_once(rows.iter().map(|r| choice(r)));
    let differs = |i: &usize| *i == 0 || choices.iter().any(|c| c[*i] != choices[0][*i]);
    let name = |choice: &Parts| {
        let parts = (0..choice.len()).filter(differs);
        let parts: Vec<&str> = parts.map(|i| choice[i].as_str()).collect();
        parts.join(" ")
    };
    let layout = Layout {
        lines: choices.iter().map(|c| (c.clone(), name(c))).collect(),
        instruments: each_once(rows.iter().map(|r| r.instrument.as_str())),
    };
    let materials = each_once(rows.iter().map(|r| r.material.as_str()));
    let (subject, groups) = match materials.len() {
        0..=ONE_BY_ONE => {
            let each = materials.iter().map(|m| ((*m).to_owned(), Some(*m)));
            ("", each.collect())
        }
        n => (", geometric mean", vec![(count(n, "material"), None)]),
    };
    let measures = each_once(rows.iter().map(|r| r.measure.as_str()));
    let mut out = String::new();
    for label in each_once(rows.iter().map(|r| r.allowed.as_str())) {
        let here = rows.iter().copied().filter(|r| r.allowed == label);
        let here: Vec<&Row> = here.collect();
        for metric in printed(rows) {
            for (of, measure) in measured(rows, metric) {
                let of = match metric.is_of_moments() {
                    true => of.to_owned(),
                    false => format!("{}, {of}", metric.name()),
                };
                for (group, material) in &groups {
                    let title = format!("{group} at {label}: {of}{subject}");
                    let mine = |r: &Row| {
                        r.measure == measure && material.is_none_or(|m: &str| m == r.material)
                    };
                    let of = |r: &Row| mine(r).then(|| r.value(metric.name())).flatten();
                    out +=
                        &layout.table(&title, &here, of, |v, star| format!("{}{star}", error(v)));
                }
            }
        }
        let Some(first) = measures.first() else {
            continue;
        };
        // Schedules are the same for every measure.
        let once: Vec<&Row> = here.into_iter().filter(|r| r.measure == *first).collect();
        // Grids have whole numbers of nodes: what is allowed is not used up.
        let readings = |r: &Row| Some(r.readings as f64);
        let minutes = |r: &Row| Some(r.instrument_seconds? / 60.0);
        let shown = |digits: usize| {
            move |v: Option<f64>, _| v.map_or("- ".into(), |v| format!("{v:.digits$} "))
        };
        out += &layout.table(&format!("readings at {label}"), &once, readings, shown(0));
        if once.iter().any(|r| r.stops.is_some_and(|n| n < r.readings)) {
            let stops = |r: &Row| Some(r.stops? as f64);
            out += &layout.table(&format!("stops at {label}"), &once, stops, shown(0));
        }
        out += &layout.table(&format!("minutes at {label}"), &once, minutes, shown(1));
        for instrument in &layout.instruments {
            out += &layout.reach(instrument, label, &once);
        }
    }
    out
}

impl Layout<'_> {
    /// Table of the unreachable poses of an instrument, reasons and the errors they cause: a line per choice.
    fn reach(&self, instrument: &str, label: &str, rows: &[&Row]) -> String {
        let mine = || rows.iter().filter(|r| r.instrument == instrument);
        let is_met = |reason: &&str| mine().any(|r| lost_to(r, reason) > 0);
        let reasons: Vec<&str> = Unreachable::NAMES.into_iter().filter(is_met).collect();
        if reasons.is_empty() {
            return format!("\n{instrument} reaches every pose of {label}\n");
        }
        let headings: String = reasons.iter().map(|r| format!("\t>{r}")).collect();
        let mut columns = Columns::new(&format!("\t>all{headings}\t>of nrmse"));
        for (own, name) in &self.lines {
            let rows = || mine().filter(|r| choice(r) == *own);
            let poses: usize = rows().map(|r| r.poses).sum();
            let share = |n: usize| match poses {
                0 => "-".into(),
                poses => format!("{:.1}%", 100.0 * (n as f64 / poses as f64)),
            };
            let lost = |reason: &str| rows().map(|r| lost_to(r, reason)).sum::<usize>();
            let all = share(Unreachable::NAMES.into_iter().map(lost).sum());
            let each: Vec<String> = reasons.iter().map(|r| share(lost(r))).collect();
            // Shares, as errors of unlike materials cannot be averaged.
            let cost = |r: &&Row| Some(r.value("hole_nrmse")? / r.value("nrmse")?);
            let costs: Vec<f64> = rows().filter_map(cost).collect();
            let mean = costs.iter().sum::<f64>() / costs.len() as f64;
            let cost = match costs.is_empty() {
                true => "-".into(),
                // `+ 0.0` after rounding: no −0 %.
                false => format!("{}%", (100.0 * mean).round() + 0.0),
            };
            columns.row(&format!("  {name}\t{all}\t{}\t{cost}", each.join("\t")));
        }
        let measure = rows.first().map_or("", |r| r.measure.as_str());
        format!(
            "\nout of reach of {instrument} at {label}, and the share of nrmse, {measure}, that it makes\n{columns}"
        )
    }

    /// A line per choice, a column per instrument: geometric means of a value of the rows, as `show` writes them with
    /// the star of the least of a column.
    fn table(
        &self,
        title: &str,
        rows: &[&Row],
        of: impl Fn(&Row) -> Option<f64>,
        show: impl Fn(Option<f64>, char) -> String,
    ) -> String {
        let cell = |own: &Parts, instrument: &str| {
            let mine = |r: &&&Row| r.instrument == instrument && choice(r) == *own;
            let values: Vec<f64> = rows.iter().filter(mine).filter_map(|r| of(r)).collect();
            geometric_mean(&values)
        };
        let lines = self.lines.iter().map(|(own, name)| {
            let cells = self.instruments.iter().map(|i| cell(own, i));
            (name.clone(), cells.collect())
        });
        let lines: Vec<(String, Vec<Option<f64>>)> = lines.collect();
        let columns = starred("", &self.instruments, &lines, |i, k, star| {
            show(lines[i].1[k], star)
        });
        format!("\n{title}\n{columns}")
    }
}

/// Number of a row's poses that are unreachable for a reason.
fn lost_to(row: &Row, reason: &str) -> usize {
    let parts = row.unreachable.split(';').filter_map(|p| p.split_once(':'));
    let counts = parts.filter(|(name, _)| *name == reason);
    counts.filter_map(|(_, n)| n.parse::<usize>().ok()).sum()
}

/// The geometric mean of `nrmse`, and of errors of moments where rows have them, over materials and seeds, by measure and budget;
/// the best of each column is marked. A mean that lacks rows others have is in brackets and not marked. Materials that some choice
/// reconstructs exactly (Lambert on a grid) are left out: they say nothing about which is better.
pub fn ranking(rows: &[&Row]) -> String {
    let metrics = printed(rows);
    metrics.map(|metric| ranked(rows, metric)).collect()
}

/// The metrics that are printed of some rows.
fn printed<'r>(rows: &'r [&Row]) -> impl Iterator<Item = Metric> + use<'r> {
    let all = Metric::ALL.into_iter().filter(is_printed);
    all.filter(|m| m.is_asked(rows))
}

fn ranked(rows: &[&Row], metric: Metric) -> String {
    let value = |r: &&Row| r.value(metric.name());
    let materials = each_once(rows.iter().map(|r| r.material.as_str()));
    let (materials, exact): (Vec<&str>, Vec<&str>) = materials.into_iter().partition(|m| {
        let mine = rows.iter().filter(|r| r.material == *m);
        compares(mine.filter_map(value))
    });
    let compared = |r: &&Row| materials.contains(&r.material.as_str());
    let rows: Vec<&Row> = rows.iter().copied().filter(compared).collect();
    if rows.is_empty() {
        return String::new();
    }
    let exact = match exact.join(", ") {
        names if names.is_empty() => names,
        names => format!(" (exact by a choice and left out: {names})"),
    };
    let mut out = format!(
        "\nGeometric mean of {} over {}{exact}; * best of its budget.\n",
        metric.name(),
        count(materials.len(), "material")
    );
    let budgets = each_once(rows.iter().map(|r| r.budget));
    let choices = each_once(rows.iter().map(|r| r.choice()));
    let first = &choices[0].sample_set;
    let sets = choices.iter().any(|c| c.sample_set != *first);
    let name = |c: &Choice| match sets {
        true => format!("{} {} {}", sampling(c), c.sample_set, by(c)),
        false => format!("{} {}", sampling(c), by(c)),
    };
    for (of, measure) in measured(&rows, metric) {
        // Errors of each choice and budget.
        let errors = |c: &Choice, budget: usize| -> Vec<f64> {
            let is_own = |r: &&&Row| r.measure == measure && r.budget == budget && r.choice() == *c;
            rows.iter().filter(is_own).filter_map(value).collect()
        };
        let by_budget = |c| budgets.iter().map(|&b| errors(c, b)).collect();
        let cells: Vec<Vec<Vec<f64>>> = choices.iter().map(by_budget).collect();
        let is_whole = |cell: &[f64], k: usize| {
            !cell.is_empty() && cells.iter().all(|line| line[k].len() <= cell.len())
        };
        let lines = choices.iter().zip(&cells).map(|(c, line)| {
            let whole = line.iter().enumerate().map(|(k, cell)| {
                let mean = geometric_mean(cell);
                mean.filter(|_| is_whole(cell, k))
            });
            (name(c), whole.collect())
        });
        let lines: Vec<(String, Vec<Option<f64>>)> = lines.collect();
        let columns = starred(&format!("ranking, {of}"), &budgets, &lines, |i, k, star| {
            let cell = &cells[i][k];
            let text = error(geometric_mean(cell));
            match is_whole(cell, k) || cell.is_empty() {
                true => format!("{text}{star}"),
                false => format!("({text}) "),
            }
        });
        out += &format!("\n{columns}");
    }
    out
}

/// What the tables of a metric are of, and the measure of their rows: each measure, or for moments, which are the same for all, the
/// first.
fn measured<'r>(rows: &[&'r Row], metric: Metric) -> Vec<(&'r str, &'r str)> {
    let mut measures = each_once(rows.iter().map(|r| r.measure.as_str()));
    if metric.is_of_moments() {
        measures.truncate(1);
        return measures.iter().map(|m| (metric.name(), *m)).collect();
    }
    measures.iter().map(|m| (*m, *m)).collect()
}
