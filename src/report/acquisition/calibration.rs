//! Errors beside those that reconstructions expected of themselves, as a text and for the page.

use super::findings::{headings, method};
use super::order::sampling;
use crate::experiment::{Calibrated, Calibration, Findings};
use crate::report::Columns;

/// Content of a cell.
pub(super) const LEGEND: &str = "Error over the error that the reconstruction expected of itself: the median over \
                                 materials, what nine of ten are below, and under the cosine measure the share of \
                                 materials below the bound that is stated for nine of ten.";

/// A table: its title, and lines of a name and its cells.
pub(super) struct Table {
    pub title: String,
    pub lines: Vec<(String, Vec<String>)>,
}

/// A table for each metric and measure.
pub(super) fn tables(findings: &Findings) -> Vec<Table> {
    let all = findings
        .calibrations
        .chunk_by(Calibration::is_of_same_error);
    all.map(|of| Table {
        title: format!("{} over expected, {}", of[0].metric.name(), of[0].measure),
        lines: of.iter().map(|line| named(line, findings)).collect(),
    })
    .collect()
}

fn named(line: &Calibration, findings: &Findings) -> (String, Vec<String>) {
    let name = format!(
        "{}, {}",
        sampling(&line.choice),
        method(&line.choice, findings)
    );
    (name, line.cells.iter().map(cell).collect())
}

fn cell(cell: &Option<Calibrated>) -> String {
    let Some(cell) = cell else {
        return "–".into();
    };
    let ninth = cell.ninth.map_or("–".into(), |r| format!("{r:.2}"));
    let below = cell
        .below
        .map_or(String::new(), |b| format!(" {:.0} %", 100.0 * b));
    format!("{:.2} {ninth}{below}", cell.median)
}

/// All tables as a text; empty if nothing was expected.
pub fn calibration(findings: &Findings) -> String {
    let mut out = String::new();
    for table in tables(findings) {
        let headings: String = headings(findings)
            .iter()
            .map(|a| format!("\t>{a}"))
            .collect();
        let lines = table.lines.iter();
        let lines = lines.map(|(name, cells)| format!("  {name}\t{}", cells.join("\t")));
        let columns = Columns::with_rows(&format!("{}{headings}", table.title), lines);
        out += &format!("\n{columns}");
    }
    match out.is_empty() {
        true => out,
        false => format!("{out}\n{LEGEND}\n"),
    }
}
