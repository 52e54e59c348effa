//! Table of the mean errors of all choices, over all materials.

use super::order::{by, sampling};
use super::table::{error, starred};
use crate::error::count;
use crate::experiment::{Choice, Row};
use crate::report::each_once;
use crate::statistics::{compares, geometric_mean};

/// The geometric mean of `nrmse` over materials and seeds, by measure and budget; the best of each
/// column is marked. A mean that lacks rows others have is in brackets and not marked. Materials
/// that some choice reconstructs exactly (Lambert on a grid) are left out: they say nothing about
/// which is better.
pub fn ranking(rows: &[&Row]) -> String {
    let materials = each_once(rows.iter().map(|r| r.material.as_str()));
    let (materials, exact): (Vec<&str>, Vec<&str>) = materials.into_iter().partition(|m| {
        let mine = rows.iter().filter(|r| r.material == *m);
        compares(mine.filter_map(|r| r.value("nrmse")))
    });
    let rows: Vec<&Row> = rows
        .iter()
        .copied()
        .filter(|r| materials.contains(&r.material.as_str()))
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let exact = match exact.join(", ") {
        names if names.is_empty() => names,
        names => format!(" (exact by a choice and left out: {names})"),
    };
    let mut out = format!(
        "\nGeometric mean of nrmse over {}{exact}; * best of its budget.\n",
        count(materials.len(), "material")
    );
    let budgets = each_once(rows.iter().map(|r| r.budget));
    let choices = each_once(rows.iter().map(|r| r.choice()));
    let sets = choices
        .iter()
        .any(|c| c.sample_set != choices[0].sample_set);
    let name = |c: &Choice| match sets {
        true => format!("{} {} {}", sampling(c), c.sample_set, by(c)),
        false => format!("{} {}", sampling(c), by(c)),
    };
    for measure in each_once(rows.iter().map(|r| r.measure.as_str())) {
        // Errors of each choice and budget.
        let errors = |c: &Choice, budget: usize| -> Vec<f64> {
            let mine = rows
                .iter()
                .filter(|r| r.measure == measure && r.budget == budget && r.choice() == *c);
            mine.filter_map(|r| r.value("nrmse")).collect()
        };
        let cells = choices
            .iter()
            .map(|c| budgets.iter().map(|&b| errors(c, b)).collect());
        let cells: Vec<Vec<Vec<f64>>> = cells.collect();
        let is_whole =
            |cell: &[f64], k: usize| cells.iter().all(|line| line[k].len() <= cell.len());
        let lines = choices.iter().zip(&cells).map(|(c, line)| {
            let whole = line.iter().enumerate().map(|(k, cell)| {
                let mean = geometric_mean(cell);
                mean.filter(|_| is_whole(cell, k))
            });
            (name(c), whole.collect())
        });
        let lines: Vec<(String, Vec<Option<f64>>)> = lines.collect();
        let columns = starred(
            &format!("ranking, {measure}"),
            &budgets,
            &lines,
            |i, k, star| {
                let cell = &cells[i][k];
                let text = error(geometric_mean(cell));
                match is_whole(cell, k) {
                    true => format!("{text}{star}"),
                    false => format!("({text}) "),
                }
            },
        );
        out += &format!("\n{columns}");
    }
    out
}
