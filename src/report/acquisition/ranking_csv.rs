//! `ranking.csv`: every choice of every ranking with all its statistics.

use crate::experiment::Findings;
use serde::Serialize;
use std::io::{self, Write};

/// A line of the file.
#[derive(Serialize)]
struct Record<'a> {
    metric: &'a str,
    measure: &'a str,
    /// Truth class; empty: all of them.
    truth: Option<&'a str>,
    materials: usize,
    parametrization: &'a str,
    warp: &'a str,
    sample_set: &'a str,
    instrument: &'a str,
    reconstruction: &'a str,
    coordinates: &'a str,
    allowed: &'a str,
    place: Option<usize>,
    mean: f64,
    median: f64,
    ratio_to_best: Option<f64>,
    ratio_low: Option<f64>,
    ratio_high: Option<f64>,
    p: Option<f64>,
    wins: Option<usize>,
    losses: Option<usize>,
    ties: Option<usize>,
    /// Verdict of the comparison with the best; empty for the best itself.
    verdict: Option<String>,
    readings: f64,
    instrument_seconds: Option<f64>,
    order: Option<f64>,
    order_low: Option<f64>,
    order_high: Option<f64>,
}

/// Writes a line per scope, choice and allowance.
///
/// # Errors
/// Errors of `out`.
pub fn ranking_csv(out: &mut impl Write, findings: &Findings) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    for ranking in &findings.rankings {
        let scope = &ranking.scope;
        for line in &ranking.lines {
            let choice = &line.choice;
            let order = line.order.as_ref();
            let slopes = order.and_then(|o| o.interval);
            for (cell, allowed) in line.cells.iter().zip(&findings.allowances) {
                let Some(cell) = cell else {
                    continue;
                };
                let paired = cell.against_best.as_ref();
                let interval = paired.and_then(|p| p.interval);
                csv.serialize(Record {
                    metric: scope.metric.name(),
                    measure: &scope.measure,
                    truth: scope.truth.as_deref(),
                    materials: scope.materials,
                    parametrization: &choice.parametrization,
                    warp: &choice.warp,
                    sample_set: &choice.sample_set,
                    instrument: &choice.instrument,
                    reconstruction: &choice.reconstruction,
                    coordinates: &choice.coordinates,
                    allowed,
                    place: cell.place,
                    mean: cell.mean,
                    median: cell.median,
                    ratio_to_best: paired.map(|p| p.ratio),
                    ratio_low: interval.map(|i| i[0]),
                    ratio_high: interval.map(|i| i[1]),
                    p: paired.and_then(|p| p.p),
                    wins: paired.map(|p| p.wins),
                    losses: paired.map(|p| p.losses),
                    ties: paired.map(|p| p.ties),
                    verdict: paired.map(|p| p.verdict().to_string()),
                    readings: cell.readings,
                    instrument_seconds: cell.instrument_seconds,
                    order: order.map(|o| o.slope),
                    order_low: slopes.map(|i| i[0]),
                    order_high: slopes.map(|i| i[1]),
                })?;
            }
        }
    }
    csv.flush()
}
