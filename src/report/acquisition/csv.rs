//! The tables of an acquisition: `results.csv`, its rows, and `ranking.csv`, every choice of every ranking with all its statistics.

use crate::experiment::{Cell, Findings, Line, Record, Row, Scope};
use crate::report::in_memory;
use crate::report::schema::{Csv, Schema, columns, text};
use serde_json::{Map, Value};

/// Rows as CSV: a column per key of `results.jsonl`, in the same order; undefined values are empty fields.
pub fn results_csv(rows: &[&Row]) -> String {
    let mut csv = Csv::new();
    csv.row(Row::columns().map(|(name, _)| name));
    for row in rows {
        csv.values(&cells(row));
    }
    csv.text()
}

/// The columns of a row, in order, with their values.
pub(super) fn cells(row: &Row) -> Map<String, Value> {
    let [cells, _] = in_memory(row.parts());
    cells
}

/// A choice at an allowance: its ranking, its line, the allowance and its cell.
type Place<'a> = (&'a Scope, &'a Line, &'a str, &'a Cell);

fn schema<'a>() -> Schema<Place<'a>> {
    columns! { (scope, line, allowed, cell) in Place<'a>;
        "metric" => scope.metric.name(),
        "measure" => scope.measure.as_str(),
        // Empty: all of them.
        "truth" => scope.truth.as_deref(),
        "materials" => scope.materials,
        "parametrization" => line.choice.parametrization.as_str(),
        "warp" => line.choice.warp.as_str(),
        "sample_set" => line.choice.sample_set.as_str(),
        "instrument" => line.choice.instrument.as_str(),
        "reconstruction" => line.choice.reconstruction.as_str(),
        "coordinates" => line.choice.coordinates.as_str(),
        "allowed" => *allowed,
        "place" => cell.place,
        "mean" => cell.mean,
        "median" => cell.median,
        "ratio_to_best" => cell.against_best.map(|p| p.ratio),
        "ratio_low" => cell.against_best.and_then(|p| Some(p.interval?[0])),
        "ratio_high" => cell.against_best.and_then(|p| Some(p.interval?[1])),
        "p" => cell.against_best.and_then(|p| p.p),
        "wins" => cell.against_best.map(|p| p.wins),
        "losses" => cell.against_best.map(|p| p.losses),
        "ties" => cell.against_best.map(|p| p.ties),
        // Empty for the best itself.
        "verdict" => cell.against_best.map(|p| p.verdict().to_string()),
        "readings" => cell.readings,
        "instrument_seconds" => cell.instrument_seconds,
        "order" => line.order.as_ref().map(|o| o.slope),
        "order_low" => line.order.as_ref().and_then(|o| Some(o.interval?[0])),
        "order_high" => line.order.as_ref().and_then(|o| Some(o.interval?[1])),
    }
}

/// A line per scope, choice and allowance.
pub fn ranking_csv(findings: &Findings) -> String {
    let schema = schema();
    let mut csv = csv::Writer::from_writer(Vec::new());
    let lines = findings
        .rankings
        .iter()
        .flat_map(|r| r.lines.iter().map(move |line| (&r.scope, line)));
    let mut is_first = true;
    for (scope, line) in lines {
        for (cell, allowed) in line.cells.iter().zip(&findings.allowances) {
            if let Some(cell) = cell {
                if std::mem::take(&mut is_first) {
                    in_memory(csv.write_record(schema.names()));
                }
                let place: Place<'_> = (scope, line, allowed, cell);
                in_memory(csv.serialize(schema.cells(&place).collect::<Vec<_>>()));
            }
        }
    }
    text(csv)
}
