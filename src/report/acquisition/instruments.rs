//! Tables of an experiment with instruments: errors at equal readings and at equal minutes, by
//! instrument, with the unreachable poses and the errors they cause.

use super::order::sampling;
use super::table::{error, star};
use crate::error::count;
use crate::experiment::{OWN, Row};
use crate::report::{Columns, each_once};
use crate::schedule::Unreachable;
use crate::statistics::geometric_mean;

/// Most materials that are shown one by one; more are shown as a geometric mean.
const ONE_BY_ONE: usize = 4;

/// Tables of choices (parametrization, warp and so on) against instruments.
pub fn instruments(rows: &[&Row]) -> String {
    let levels = Levels {
        measures: each_once(rows.iter().map(|r| r.measure.clone())),
        materials: each_once(rows.iter().map(|r| r.material.clone())),
        instruments: each_once(rows.iter().map(|r| r.instrument.clone())),
        choices: each_once(rows.iter().map(|r| Choice::of(r))),
        allowances: each_once(rows.iter().map(|r| r.allowed.clone())),
    };
    levels.tables(rows)
}

/// A line of a table.
#[derive(Clone, PartialEq)]
struct Choice {
    label: String,
    sample_set: String,
    reconstruction: String,
}

impl Choice {
    fn of(row: &Row) -> Self {
        Self {
            label: sampling(&row.choice()),
            sample_set: row.sample_set.clone(),
            reconstruction: match row.coordinates.as_str() {
                OWN => row.reconstruction.clone(),
                other => format!("{} in {other}", row.reconstruction),
            },
        }
    }
}

/// Levels of each column that the tables are laid out by, each once, in the order of the rows.
struct Levels {
    measures: Vec<String>,
    materials: Vec<String>,
    instruments: Vec<String>,
    choices: Vec<Choice>,
    /// Size limits of the schedules.
    allowances: Vec<String>,
}

impl Levels {
    fn tables(&self, rows: &[&Row]) -> String {
        let mut out = String::new();
        for label in &self.allowances {
            let here: Vec<&Row> = rows
                .iter()
                .copied()
                .filter(|r| r.allowed == *label)
                .collect();
            let (subject, groups) = if self.materials.len() <= ONE_BY_ONE {
                let each = self.materials.iter().map(|m| (m.clone(), Some(m)));
                ("", each.collect::<Vec<_>>())
            } else {
                let all = count(self.materials.len(), "material");
                (", geometric mean", vec![(all, None)])
            };
            for measure in &self.measures {
                for (group, material) in &groups {
                    let title = format!("{group} at {label}: nrmse, {measure}{subject}");
                    let of = |r: &Row| {
                        let mine = material.is_none_or(|m| *m == r.material);
                        (mine && r.measure == *measure)
                            .then(|| r.value("nrmse"))
                            .flatten()
                    };
                    out += &self.table(&title, &here, of, error, true);
                }
            }
            let Some(first) = self.measures.first() else {
                continue;
            };
            // Schedules are the same for every measure.
            let once = |r: &Row| r.measure == *first;
            let minutes = |r: &Row| {
                let seconds = r.instrument_seconds?;
                once(r).then_some(seconds / 60.0)
            };
            let readings = |r: &Row| once(r).then_some(r.readings as f64);
            // Grids have whole numbers of nodes: what is allowed is not used up.
            let whole = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.0}"));
            let title = format!("readings at {label}");
            out += &self.table(&title, &here, readings, whole, false);
            let tenth = |v: Option<f64>| v.map_or("-".into(), |v| format!("{v:.1}"));
            let title = format!("minutes at {label}");
            out += &self.table(&title, &here, minutes, tenth, false);
            out += &self.reach(label, &here, first);
        }
        out
    }

    /// Table of unreachable poses, reasons and the errors they cause: a line per choice.
    fn reach(&self, label: &str, here: &[&Row], measure: &str) -> String {
        let mut out = String::new();
        for instrument in &self.instruments {
            let mine: Vec<&Row> = here
                .iter()
                .copied()
                .filter(|r| r.measure == measure && r.instrument == *instrument)
                .collect();
            let reasons: Vec<&str> = Unreachable::NAMES
                .into_iter()
                .filter(|reason| mine.iter().any(|r| lost_to(r, reason) > 0))
                .collect();
            if reasons.is_empty() {
                out += &format!("\n{instrument} reaches every pose of {label}\n");
                continue;
            }
            let headings: String = reasons.iter().map(|r| format!("\t>{r}")).collect();
            let mut columns = Columns::new(&format!("\t>all{headings}\t>of nrmse"));
            for choice in &self.choices {
                let rows = || mine.iter().filter(|r| Choice::of(r) == *choice);
                let poses: usize = rows().map(|r| r.poses).sum();
                let share = |n: usize| percent((poses > 0).then(|| n as f64 / poses as f64));
                let lost = |reason: &str| rows().map(|r| lost_to(r, reason)).sum::<usize>();
                let all = Unreachable::NAMES.into_iter().map(lost).sum();
                let each: String = reasons
                    .iter()
                    .map(|reason| format!("\t{}", share(lost(reason))))
                    .collect();
                // Shares, as errors of unlike materials cannot be averaged.
                let cost = |r: &&&Row| Some(r.value("hole_nrmse")? / r.value("nrmse")?);
                let costs: Vec<f64> = rows().filter_map(|r| cost(&r)).collect();
                // `+ 0.0` after rounding: no −0 %.
                let cost =
                    arithmetic_mean(&costs).map(|c| format!("{}%", (100.0 * c).round() + 0.0));
                let (name, cost) = (self.name(choice), cost.unwrap_or("-".into()));
                columns.row(&format!("  {name}\t{}{each}\t{cost}", share(all)));
            }
            out += &format!(
                "\nout of reach of {instrument} at {label}, and the share of nrmse, {measure}, that it makes\n{columns}"
            );
        }
        out
    }

    /// A line per choice, a column per instrument; `best` marks the least of a column.
    fn table(
        &self,
        title: &str,
        rows: &[&Row],
        of: impl Fn(&Row) -> Option<f64>,
        show: impl Fn(Option<f64>) -> String,
        best: bool,
    ) -> String {
        let headings = self.instruments.iter().map(|i| format!("\t>{i} "));
        let mut columns = Columns::new(&headings.collect::<String>());
        let cells: Vec<Vec<Option<f64>>> = self
            .choices
            .iter()
            .map(|choice| {
                let cell = |instrument: &String| {
                    let mine = |r: &&&Row| r.instrument == *instrument && Choice::of(r) == *choice;
                    let values: Vec<f64> = rows.iter().filter(mine).filter_map(|r| of(r)).collect();
                    geometric_mean(&values)
                };
                self.instruments.iter().map(cell).collect()
            })
            .collect();
        for (choice, line) in self.choices.iter().zip(&cells) {
            let mut text = format!("  {}", self.name(choice));
            for (i, cell) in line.iter().enumerate() {
                let mark = match best {
                    true => star(*cell, cells.iter().map(|l| l[i])),
                    false => ' ',
                };
                text += &format!("\t{}{mark}", show(*cell));
            }
            columns.row(&text);
        }
        format!("\n{title}\n{columns}")
    }

    /// Name of a choice: those of its fields that differ between choices.
    fn name(&self, choice: &Choice) -> String {
        let differ = |of: fn(&Choice) -> &String| {
            let mut all = self.choices.iter().map(of);
            let first = all.next();
            all.any(|other| Some(other) != first)
        };
        let mut parts = vec![choice.label.as_str()];
        parts.extend(differ(|c| &c.sample_set).then_some(choice.sample_set.as_str()));
        parts.extend(differ(|c| &c.reconstruction).then_some(choice.reconstruction.as_str()));
        parts.join(" ")
    }
}

/// Number of a row's poses that are unreachable for a reason.
fn lost_to(row: &Row, reason: &str) -> usize {
    let parts = row.unreachable.split(';').filter_map(|p| p.split_once(':'));
    let counts = parts.filter(|(name, _)| *name == reason);
    counts.filter_map(|(_, n)| n.parse::<usize>().ok()).sum()
}

fn percent(share: Option<f64>) -> String {
    match share {
        Some(v) => format!("{:.1}%", 100.0 * v),
        None => "-".into(),
    }
}

fn arithmetic_mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
