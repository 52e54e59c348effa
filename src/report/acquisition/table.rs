//! The table a run prints: a line per schedule and material, an error per measure and reconstruction.

use crate::experiment::{Plan, Row};
use std::collections::HashMap;
use std::fmt::Write;

/// The widest a reconstruction's name may be as a heading; longer ones are numbered and explained.
const HEADING: usize = 13;

/// Formats rows as they come.
pub struct Table {
    measures: Vec<String>,
    /// Names and coordinates of the reconstructions.
    methods: Vec<[String; 2]>,
    labels: Vec<String>,
    headings: Vec<String>,
    /// Positions of a schedule's reconstructions, by parametrization, warp, sample set, allowance.
    made_on: HashMap<[String; 4], Vec<usize>>,
    /// Width of the material's column.
    materials: usize,
    /// Width of the parametrization's column.
    parametrizations: usize,
    /// Width of the sample set's column, if there is more than one.
    sets: Option<usize>,
    seeds: bool,
    /// Width of the instrument's column, if there are any.
    instruments: Option<usize>,
}

impl Table {
    /// The table of a plan.
    pub fn new(plan: &Plan) -> Self {
        let labels: Vec<String> = plan.methods.iter().map(|m| m.label()).collect();
        let long = labels.iter().any(|label| count(label) > HEADING);
        let headings = labels.iter().enumerate().map(|(i, label)| {
            if long {
                format!("[{}]", i + 1)
            } else {
                label.clone()
            }
        });
        let width = |names: &mut dyn Iterator<Item = usize>, least: usize| {
            names.max().unwrap_or(0).max(least)
        };
        let instruments = width(&mut plan.instruments.iter().map(|i| count(&i.name)), 10);
        let sets = width(&mut plan.sample_sets.iter().map(|s| count(&s.name)), 10);
        let made_on = plan.units().into_iter().map(|unit| {
            let coordinates = &plan.parametrizations[unit.coordinates];
            let schedule = [
                coordinates.name().to_owned(),
                coordinates.warp.clone(),
                plan.sample_sets[unit.sample_set].name.clone(),
                unit.allowance.to_string(),
            ];
            (schedule, plan.methods_on(&unit))
        });
        Self {
            measures: plan.measures.iter().map(|m| m.name().into()).collect(),
            methods: plan
                .methods
                .iter()
                .map(|m| [m.name.clone(), m.coordinates.clone()])
                .collect(),
            headings: headings.collect(),
            labels,
            made_on: made_on.collect(),
            materials: width(&mut plan.materials.iter().map(|m| count(&m.name)), 8),
            parametrizations: width(
                &mut plan.parametrizations.iter().map(|c| count(&c.label())),
                15,
            ),
            sets: (plan.sample_sets.len() > 1).then_some(sets),
            seeds: plan.seeds.len() > 1,
            instruments: (!plan.instruments.is_empty()).then_some(instruments),
        }
    }

    /// The lines above the first row.
    pub fn head(&self) -> String {
        let mut out = String::new();
        if self.headings != self.labels {
            for (heading, label) in self.headings.iter().zip(&self.labels) {
                out += &format!("{heading} {label}\n");
            }
        }
        let lead = self.lead(&Lead {
            material: "material",
            parametrization: "parametrization",
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

    /// The lines of the rows of one schedule, one per material. Times of a line add up its
    /// reconstructions; `evaluate` is the mean of the measures.
    pub fn lines(&self, rows: &[&Row]) -> String {
        let mut out = String::new();
        for rows in rows.chunk_by(|a, b| a.material == b.material) {
            let first = rows[0];
            let parametrization = match first.warp.as_str() {
                "none" => first.parametrization.clone(),
                warp => format!("{} {warp}", first.parametrization),
            };
            out += &self.lead(&Lead {
                material: &first.material,
                parametrization: &parametrization,
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
            let schedule = [
                &first.parametrization,
                &first.warp,
                &first.sample_set,
                &first.allowed,
            ];
            let made = self.made_on.get(&schedule.map(String::clone));
            for measure in &self.measures {
                for (m, ([name, coordinates], heading)) in
                    self.methods.iter().zip(&self.headings).enumerate()
                {
                    let mut cell = rows.iter().filter(|r| r.measure == *measure);
                    let cell =
                        cell.find(|r| r.reconstruction == *name && r.coordinates == *coordinates);
                    let text = match cell {
                        Some(row) => error(row.value("nrmse")),
                        None if made.is_some_and(|made| made.contains(&m)) => "failed".into(),
                        None => String::new(),
                    };
                    out += &format!("  {text:>w$}", w = self.width(heading));
                }
            }
            let ms = |seconds: Option<f64>| match seconds.map(|s| 1e3 * s) {
                Some(ms) if ms < 99.95 => format!("{ms:.1}"),
                Some(ms) => format!("{ms:.0}"),
                None => String::new(),
            };
            let per_measure = 1.0 / self.measures.len() as f64;
            let sum = |of: fn(&Row) -> Option<f64>| {
                let all: Option<f64> = rows.iter().map(|r| of(r)).sum();
                all.map(|all| all * per_measure)
            };
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
            material,
            parametrization,
            set,
            instrument,
            allowed,
            budget,
            seed,
            readings,
            reachable,
            minutes,
        } = lead;
        let mut out = format!(
            "{material:<w$}  {parametrization:<v$}",
            w = self.materials,
            v = self.parametrizations
        );
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

/// The fields of a line before its errors.
struct Lead<'a> {
    material: &'a str,
    parametrization: &'a str,
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
pub fn error(value: Option<f64>) -> String {
    match value {
        None => "-".into(),
        Some(0.0) => "0".into(),
        Some(v) if (0.001..100.0).contains(&v) => format!("{v:.4}"),
        Some(v) => format!("{v:.1e}"),
    }
}
