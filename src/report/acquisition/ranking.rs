//! Table of the mean errors of all choices, over all materials.

use super::table::error;
use crate::experiment::{Choice, OWN, Row};
use crate::report::Columns;
use crate::statistics::{compares, geometric_mean};

/// The geometric mean of `nrmse` over materials and seeds, by measure and budget; the best of each
/// column is marked. A mean that lacks rows others have is in brackets and not marked. Materials
/// that some choice reconstructs exactly (Lambert on a grid) are left out: they say nothing about
/// which is better.
pub fn ranking(rows: &[&Row]) -> String {
    let mut out = String::new();
    let (mut materials, mut exact) = (vec![], vec![]);
    for row in rows {
        add(&mut exact, row.material.as_str());
    }
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
    let (mut measures, mut budgets, mut choices) = (vec![], vec![], vec![]);
    for row in &rows {
        add(&mut materials, row.material.as_str());
        add(&mut measures, row.measure.as_str());
        add(&mut budgets, row.budget);
        add(&mut choices, row.choice());
    }
    let sets = choices
        .iter()
        .any(|c| c.sample_set != choices[0].sample_set);
    let name = |c: &Choice| {
        let mut parts = vec![c.parametrization.as_str()];
        parts.extend((c.warp != "none").then_some(c.warp.as_str()));
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
                let least = all().filter(|c| c.rows == rows).filter_map(|c| c.mean);
                let best = whole && cell.mean.is_some() && cell.mean == least.reduce(f64::min);
                let text = error(cell.mean);
                let text = if whole { text } else { format!("({text})") };
                row += &format!("\t{text}{}", if best { '*' } else { ' ' });
            }
            columns.row(&row);
        }
        out += &format!("\n{columns}");
    }
    let count = materials.len();
    let s = if count == 1 { "" } else { "s" };
    let exact = match exact.join(", ") {
        names if names.is_empty() => names,
        names => format!(" (exact by a choice and left out: {names})"),
    };
    format!("\nGeometric mean of nrmse over {count} material{s}{exact}; * best of its budget.\n")
        + &out
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

fn add<T: PartialEq>(list: &mut Vec<T>, item: T) {
    if !list.contains(&item) {
        list.push(item);
    }
}
