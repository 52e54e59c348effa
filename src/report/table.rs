//! The table a run prints: a line per schedule, an error per measure and reconstruction.

use crate::experiment::{Plan, Row};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The widest a reconstruction's name may be as a heading; longer ones are numbered and explained.
const HEADING: usize = 13;

/// Formats rows as they come.
pub struct Table {
    measures: Vec<String>,
    reconstructions: Vec<String>,
    headings: Vec<String>,
    /// Width of the parametrization's column.
    labels: usize,
    /// Width of the sample set's column, if there is more than one.
    sets: Option<usize>,
    seeds: bool,
    /// Width of the instrument's column, if there are any.
    instruments: Option<usize>,
    material: Option<String>,
}

impl Table {
    /// The table of a plan.
    pub fn new(plan: &Plan) -> Self {
        let names = plan.reconstructions.iter().map(|r| r.name.clone());
        let reconstructions: Vec<String> = names.collect();
        let long = reconstructions.iter().any(|name| name.len() > HEADING);
        let headings = reconstructions.iter().enumerate().map(|(i, name)| {
            if long {
                format!("[{}]", i + 1)
            } else {
                name.clone()
            }
        });
        let width = |names: &mut dyn Iterator<Item = usize>, least: usize| {
            names.max().unwrap_or(0).max(least)
        };
        let instruments = width(&mut plan.instruments.iter().map(|i| count(&i.name)), 10);
        let sets = width(&mut plan.sample_sets.iter().map(|s| count(&s.name)), 10);
        Self {
            measures: plan.measures.iter().map(|m| m.name().into()).collect(),
            headings: headings.collect(),
            reconstructions,
            labels: width(
                &mut plan.parametrizations.iter().map(|c| count(&c.label())),
                15,
            ),
            sets: (plan.sample_sets.len() > 1).then_some(sets),
            seeds: plan.seeds.len() > 1,
            instruments: (!plan.instruments.is_empty()).then_some(instruments),
            material: None,
        }
    }

    /// The lines above the first row.
    pub fn head(&self) -> String {
        let mut out = String::new();
        if self.headings != self.reconstructions {
            for (heading, name) in self.headings.iter().zip(&self.reconstructions) {
                out += &format!("{heading} {name}\n");
            }
        }
        let lead = self.lead(&Lead {
            label: "parametrization",
            set: "sample set",
            instrument: "instrument",
            allowed: "allowed",
            budget: if self.instruments.is_some() {
                "poses"
            } else {
                "budget"
            },
            seed: "seed",
            readings: "readings",
            reachable: "reach",
            minutes: "minutes",
        });
        let blank = " ".repeat(count(&lead));
        let (mut top, mut bottom) = (blank, lead);
        for measure in &self.measures {
            let mut block = String::new();
            for heading in &self.headings {
                block += &format!("  {heading:>w$}", w = self.width(heading));
            }
            let title = format!("nrmse, {measure}");
            top += &format!("  {title:<w$}", w = count(&block) - 2);
            bottom += &block;
        }
        top += "    time in ms, all of the line";
        bottom += &format!(
            "  {:>7} {:>7} {:>8} {:>8}",
            "plan", "measure", "reconst.", "evaluate"
        );
        out + top.trim_end() + "\n" + &bottom + "\n"
    }

    /// The lines of the rows of one material, parametrization, sample set, instrument and allowance. Times of a
    /// line add up its reconstructions; `evaluate` is the mean of the measures.
    pub fn lines(&mut self, rows: &[Row]) -> String {
        let mut out = String::new();
        let mut seeds: BTreeMap<usize, (u64, Vec<&Row>)> = BTreeMap::new();
        for row in rows {
            let known = seeds.values().position(|(seed, _)| *seed == row.seed);
            let place = known.unwrap_or(seeds.len());
            seeds.entry(place).or_insert((row.seed, vec![])).1.push(row);
        }
        for (_, rows) in seeds.into_values() {
            let first = rows[0];
            if self.material.as_ref() != Some(&first.material) {
                self.material = Some(first.material.clone());
                out += &format!("{}\n", first.material);
            }
            let label = match first.warp.as_str() {
                "none" => first.parametrization.clone(),
                warp => format!("{} {warp}", first.parametrization),
            };
            out += &self.lead(&Lead {
                label: &label,
                set: &first.sample_set,
                instrument: &first.instrument,
                allowed: &first.allowed,
                // With an instrument what counts is how many poses there are, not how many may be.
                budget: &match self.instruments {
                    Some(_) => first.poses.to_string(),
                    None => first.budget.to_string(),
                },
                seed: &first.seed.to_string(),
                readings: &first.readings.to_string(),
                reachable: &format!("{:.1}%", 100.0 * first.reachable),
                minutes: &first
                    .instrument_seconds
                    .map_or(String::new(), |s| format!("{:.1}", s / 60.0)),
            });
            for measure in &self.measures {
                for (name, heading) in self.reconstructions.iter().zip(&self.headings) {
                    let mut cell = rows.iter();
                    let cell = cell.find(|r| r.measure == *measure && r.reconstruction == *name);
                    let text = cell.map_or("failed".into(), |r| error(r.nrmse));
                    out += &format!("  {text:>w$}", w = self.width(heading));
                }
            }
            let ms = |seconds: f64| match 1e3 * seconds {
                ms if ms < 99.95 => format!("{ms:.1}"),
                ms => format!("{ms:.0}"),
            };
            let per_measure = 1.0 / self.measures.len() as f64;
            let sum = |of: fn(&Row) -> f64| rows.iter().map(|r| of(r)).sum::<f64>() * per_measure;
            // Writing to a string does not fail.
            let _ = writeln!(
                out,
                "  {:>7} {:>7} {:>8} {:>8}",
                ms(first.plan_seconds),
                ms(first.measure_seconds),
                ms(sum(|r| r.reconstruct_seconds)),
                ms(sum(|r| r.evaluate_seconds)),
            );
        }
        out
    }

    fn width(&self, heading: &str) -> usize {
        count(heading).max(8)
    }

    fn lead(&self, lead: &Lead<'_>) -> String {
        let Lead {
            label,
            set,
            instrument,
            allowed,
            budget,
            seed,
            readings,
            reachable,
            minutes,
        } = lead;
        let mut out = format!("  {label:<w$}", w = self.labels);
        if let Some(w) = self.sets {
            out += &format!("  {set:<w$}");
        }
        if let Some(w) = self.instruments {
            out += &format!("  {instrument:<w$}  {allowed:>13}");
        }
        out += &format!("  {budget:>8}");
        if self.seeds {
            out += &format!("  {seed:>6}");
        }
        out += &format!("  {readings:>8}");
        if self.instruments.is_some() {
            out += &format!("  {reachable:>6}  {minutes:>8}");
        }
        out
    }
}

/// What stands before the errors of a line.
struct Lead<'a> {
    label: &'a str,
    set: &'a str,
    instrument: &'a str,
    allowed: &'a str,
    budget: &'a str,
    seed: &'a str,
    readings: &'a str,
    reachable: &'a str,
    minutes: &'a str,
}

/// Columns a text takes.
fn count(text: &str) -> usize {
    text.chars().count()
}

/// An error with three to four digits; `-` if there is none.
pub(super) fn error(value: Option<f64>) -> String {
    match value {
        None => "-".into(),
        Some(0.0) => "0".into(),
        Some(v) if (0.001..100.0).contains(&v) => format!("{v:.4}"),
        Some(v) => format!("{v:.1e}"),
    }
}
