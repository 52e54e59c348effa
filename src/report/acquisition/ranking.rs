//! Table of the mean errors of all choices, over all materials.

use super::order::sampling;
use super::table::{error, star};
use crate::error::count;
use crate::experiment::{Choice, OWN, Row};
use crate::report::{Columns, each_once};
use crate::statistics::{compares, geometric_mean};

/// The geometric mean of `nrmse` over materials and seeds, by measure and budget; the best of each
/// column is marked. A mean that lacks rows others have is in brackets and not marked. Materials
/// that some choice reconstructs exactly (Lambert on a grid) are left out: they say nothing about
/// which is better.
pub fn ranking(rows: &[&Row]) -> String {
    let mut out = String::new();
    let mut exact = each_once(rows.iter().map(|r| r.material.as_str()));
    exact.retain(|m| {
        let mine = rows.iter().filter(|r| r.material == *m);
        !compares(mine.filter_map(|r| r.value("nrmse")))
    });
    let rows: Vec<&Row> = rows
        .iter()
        .copied()
        .filter(|r| !exact.contains(&r.material.as_str()))
        .collect();
    if rows.is_empty() {
        return out;
    }
    let materials = each_once(rows.iter().map(|r| r.material.as_str()));
    let measures = each_once(rows.iter().map(|r| r.measure.as_str()));
    let budgets = each_once(rows.iter().map(|r| r.budget));
    let choices = each_once(rows.iter().map(|r| r.choice()));
    let sets = choices
        .iter()
        .any(|c| c.sample_set != choices[0].sample_set);
    let name = |c: &Choice| {
        let sampling = sampling(c);
        let mut parts = vec![sampling.as_str()];
        parts.extend(sets.then_some(c.sample_set.as_str()));
        parts.push(&c.reconstruction);
        if c.coordinates != OWN {
            parts.extend(["in", &c.coordinates]);
        }
        parts.join(" ")
    };
    for measure in measures {
        let headings: String = budgets.iter().map(|b| format!("\t>{b} ")).collect();
        let mut columns = Columns::new(&format!("ranking, {measure}{headings}"));
        let cells: Vec<Vec<Cell>> = choices
            .iter()
            .map(|c| {
                let cell = |budget| {
                    let mine =
                        |r: &&Row| r.measure == measure && r.budget == budget && r.choice() == *c;
                    Cell::of(rows.iter().copied().filter(mine))
                };
                budgets.iter().map(|&b| cell(b)).collect()
            })
            .collect();
        for (c, line) in choices.iter().zip(&cells) {
            let mut row = format!("  {}", name(c));
            for (column, cell) in line.iter().enumerate() {
                let all = || cells.iter().map(|line| &line[column]);
                let rows = all().map(|c| c.rows).max().unwrap_or(0);
                let whole = cell.rows == rows;
                let means = all().filter(|c| c.rows == rows).map(|c| c.mean);
                let text = error(cell.mean);
                row += &match whole {
                    true => format!("\t{text}{}", star(cell.mean, means)),
                    false => format!("\t({text}) "),
                };
            }
            columns.row(&row);
        }
        out += &format!("\n{columns}");
    }
    let materials = count(materials.len(), "material");
    let exact = match exact.join(", ") {
        names if names.is_empty() => names,
        names => format!(" (exact by a choice and left out: {names})"),
    };
    format!("\nGeometric mean of nrmse over {materials}{exact}; * best of its budget.\n") + &out
}

/// A mean and its number of rows.
struct Cell {
    mean: Option<f64>,
    rows: usize,
}

impl Cell {
    fn of<'a>(rows: impl Iterator<Item = &'a Row>) -> Self {
        let errors: Vec<f64> = rows.filter_map(|r| r.value("nrmse")).collect();
        Self {
            mean: geometric_mean(&errors),
            rows: errors.len(),
        }
    }
}
