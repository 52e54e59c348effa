//! The table a run prints: a line per schedule and material, an error per measure and reconstruction.

use super::order::sampling;
use crate::experiment::{Method, Plan, Row};
use crate::report::{Columns, first_of_each};
use crate::statistics::is_exact;
use std::collections::HashMap;
use std::fmt::Display;

/// The widest a reconstruction's name may be as a heading; longer ones are numbered and explained.
const HEADING: usize = 13;

/// A column before the errors.
struct Lead {
    heading: &'static str,
    width: usize,
    /// True if cells are aligned at the right.
    is_right: bool,
    cell: fn(&Row) -> String,
}

impl Lead {
    fn number(heading: &'static str, width: usize, cell: fn(&Row) -> String) -> Self {
        Self {
            heading,
            width,
            is_right: true,
            cell,
        }
    }

    fn name<'n>(
        heading: &'static str,
        names: impl Iterator<Item = &'n str>,
        cell: fn(&Row) -> String,
    ) -> Self {
        let widest = names.map(count).fold(count(heading), usize::max);
        Self {
            is_right: false,
            ..Self::number(heading, widest, cell)
        }
    }
}

/// Formats rows as they come.
pub struct Table<'a> {
    plan: &'a Plan,
    lead: Vec<Lead>,
    /// One method each of the reconstructions, of which one in the coordinates of schedules is a method for each of these.
    methods: Vec<&'a Method>,
    /// Names or numbers of the reconstructions.
    headings: Vec<String>,
    /// The methods of a schedule, by parametrization, warp, sample set, allowance.
    made_on: HashMap<[String; 4], Vec<&'a Method>>,
}

impl<'a> Table<'a> {
    /// The table of a plan.
    pub(crate) fn new(plan: &'a Plan) -> Self {
        let methods = first_of_each(&plan.methods, |a, b| are_one(a, b));
        let labels: Vec<String> = methods.iter().map(|m| m.label()).collect();
        let long = labels.iter().any(|label| count(label) > HEADING);
        let headings = labels.iter().enumerate().map(|(i, label)| match long {
            true => format!("[{}]", i + 1),
            false => label.clone(),
        });
        let made_on = plan.units().into_iter().map(|unit| {
            let coordinates = plan.coordinates_of(&unit);
            let schedule = [
                coordinates.name().to_owned(),
                coordinates.warp.clone(),
                plan.sample_sets[unit.sample_set].name.clone(),
                unit.allowance.to_string(),
            ];
            let used = plan.methods_on(&unit).into_iter();
            (schedule, used.map(|m| &plan.methods[m]).collect())
        });
        Self {
            plan,
            lead: lead(plan),
            headings: headings.collect(),
            methods,
            made_on: made_on.collect(),
        }
    }

    /// The lines above the first row.
    pub(crate) fn head(&self) -> String {
        let mut out = String::new();
        let labels: Vec<String> = self.methods.iter().map(|m| m.label()).collect();
        if self.headings != labels {
            for (heading, label) in self.headings.iter().zip(labels) {
                out += &format!("{heading} {label}\n");
            }
        }
        let mut bottom = self.padded(|lead| lead.heading.into());
        let mut top = " ".repeat(count(&bottom));
        for measure in &self.plan.measures {
            let mut block = String::new();
            for heading in &self.headings {
                block += &format!("  {heading:>w$}", w = width(heading));
            }
            let title = format!("nrmse, {}", measure.name());
            top += &format!("  {title:<w$}", w = count(&block) - 2);
            bottom += &block;
        }
        top += "    time in ms, all of the line";
        bottom += &times(["plan", "measure", "reconst.", "evaluate", "± %"].map(String::from));
        out + top.trim_end() + "\n" + &bottom
    }

    /// The lines of the rows of one schedule, one per material. Times of a line add up its
    /// reconstructions; `evaluate` is the mean of the measures; `± %` is half the range of all within the run, where it is known.
    pub(crate) fn lines(&self, rows: &[&Row]) -> String {
        let materials = rows.chunk_by(|a, b| a.material == b.material);
        materials.map(|rows| self.line(rows)).collect()
    }

    fn line(&self, rows: &[&Row]) -> String {
        let first = rows[0];
        let mut out = self.padded(|lead| (lead.cell)(first));
        let schedule = [
            &first.parametrization,
            &first.warp,
            &first.sample_set,
            &first.allowed,
        ];
        let made = self.made_on.get(&schedule.map(String::clone));
        for measure in &self.plan.measures {
            for (method, heading) in self.methods.iter().zip(&self.headings) {
                let is_of = |r: &&&Row| {
                    r.reconstruction == method.name && r.coordinates == method.coordinates
                };
                let mut cells = rows.iter().filter(|r| r.measure == measure.name());
                let text = match cells.find(is_of) {
                    Some(row) => error(row.value("nrmse")),
                    None if made.is_some_and(|made| made.iter().any(|m| are_one(m, method))) => {
                        "failed".into()
                    }
                    None => String::new(),
                };
                out += &format!("  {text:>w$}", w = width(heading));
            }
        }
        let ms = |seconds: Option<f64>| match seconds.map(|s| 1e3 * s) {
            Some(ms) if ms < 99.95 => format!("{ms:.1}"),
            Some(ms) => format!("{ms:.0}"),
            None => String::new(),
        };
        let per_measure = 1.0 / self.plan.measures.len() as f64;
        let sum = |of: fn(&Row) -> Option<f64>| {
            let all: Option<f64> = rows.iter().map(|r| of(r)).sum();
            all.map(|all| all * per_measure)
        };
        let half = sum(|r| r.seconds_range().map(|[low, high]| (high - low) / 2.0));
        let spread = half.zip(sum(Row::seconds));
        let spread = spread.map(|(half, whole)| 100.0 * half / whole);
        let spread = spread.map_or(String::new(), |percent| format!("{percent:.0}"));
        let [plan, measure] = [first.plan_seconds, first.measure_seconds].map(ms);
        let sums = [sum(|r| r.reconstruct_seconds), sum(|r| r.evaluate_seconds)];
        let [reconstruct, evaluate] = sums.map(ms);
        out + &times([plan, measure, reconstruct, evaluate, spread])
    }

    fn padded(&self, text: impl Fn(&Lead) -> String) -> String {
        let cells = self.lead.iter().map(|lead| {
            let (text, w) = (text(lead), lead.width);
            match lead.is_right {
                true => format!("{text:>w$}"),
                false => format!("{text:<w$}"),
            }
        });
        cells.collect::<Vec<_>>().join("  ")
    }
}

/// True if two methods are one reconstruction in the same coordinates, or both in those of schedules.
fn are_one(a: &Method, b: &Method) -> bool {
    a.name == b.name && a.coordinates == b.coordinates
}

/// The columns before the errors: those that differ between the rows of a plan.
fn lead(plan: &Plan) -> Vec<Lead> {
    let has_instruments = !plan.instruments.is_empty();
    let labels = plan.units().into_iter();
    let labels: Vec<String> = labels.map(|u| plan.coordinates_of(&u).label()).collect();
    let mut lead = vec![
        Lead::name("material", plan.materials.iter().map(|m| &*m.name), |r| {
            r.material.clone()
        }),
        Lead::name("parametrization", labels.iter().map(|l| &**l), |r| {
            sampling(&r.choice())
        }),
    ];
    if plan.sample_sets.len() > 1 {
        let names = plan.sample_sets.iter().map(|s| &*s.name);
        lead.push(Lead::name("sample set", names, |r| r.sample_set.clone()));
    }
    if has_instruments {
        let names = plan.instruments.iter().map(|i| &*i.name);
        lead.push(Lead::name("instrument", names, |r| r.instrument.clone()));
        lead.push(Lead::number("allowed", 13, |r| r.allowed.clone()));
        // With an instrument what counts is how many poses there are, not how many may be.
        lead.push(Lead::number("poses", 8, |r| r.poses.to_string()));
    } else {
        lead.push(Lead::number("budget", 8, |r| r.budget.to_string()));
    }
    if plan.seeds.len() > 1 {
        lead.push(Lead::number("seed", 6, |r| r.seed.to_string()));
    }
    lead.push(Lead::number("readings", 8, |r| r.readings.to_string()));
    if has_instruments {
        lead.push(Lead::number("reach", 6, |r| {
            format!("{:.1}%", 100.0 * r.reachable)
        }));
        lead.push(Lead::number("minutes", 8, |r| {
            let minutes = r.instrument_seconds.map(|s| format!("{:.1}", s / 60.0));
            minutes.unwrap_or_default()
        }));
    }
    lead
}

/// The columns behind the errors.
fn times([plan, measure, reconstruct, evaluate, spread]: [String; 5]) -> String {
    let text = format!("  {plan:>7} {measure:>7} {reconstruct:>8} {evaluate:>8} {spread:>4}");
    text.trim_end().to_owned() + "\n"
}

fn width(heading: &str) -> usize {
    count(heading).max(8)
}

fn count(text: &str) -> usize {
    text.chars().count()
}

/// A table for people: a title above names, and headings above cells.
pub(super) fn headed<T: Display>(title: &str, headings: &[T]) -> Columns {
    let headings: String = headings.iter().map(|h| format!("\t>{h} ")).collect();
    Columns::new(&format!("{title}{headings}"))
}

/// A table of names with their values, one per heading; `cell` writes that of a line and a column, with a star at the
/// least value of the column and else a blank.
pub(super) fn starred<T: Display>(
    title: &str,
    headings: &[T],
    lines: &[(String, Vec<Option<f64>>)],
    cell: impl Fn(usize, usize, char) -> String,
) -> Columns {
    let mut columns = headed(title, headings);
    for (i, (name, values)) in lines.iter().enumerate() {
        let mut row = format!("  {name}");
        for (k, own) in values.iter().enumerate() {
            let least = lines.iter().filter_map(|l| l.1[k]).reduce(f64::min);
            let star = if own.is_some() && *own == least {
                '*'
            } else {
                ' '
            };
            row += &format!("\t{}", cell(i, k, star));
        }
        columns.row(&row);
    }
    columns
}

/// An error with three to four digits; `exact` if it is one of rounding, `-` if there is none.
pub fn error(value: Option<f64>) -> String {
    match value {
        None => "-".into(),
        Some(v) if is_exact(v) => "exact".into(),
        Some(v) if (0.001..100.0).contains(&v) => format!("{v:.4}"),
        Some(v) => format!("{v:.1e}"),
    }
}

/// A table of texts: its title stands above the names of its lines.
pub(super) struct TextTable {
    pub title: String,
    /// Headings of the cells.
    pub head: Vec<String>,
    /// Lines of a name and its cells.
    pub lines: Vec<(String, Vec<String>)>,
}

impl TextTable {
    /// The table for a terminal, below an empty line.
    pub(super) fn text(&self) -> String {
        let head = self.head.iter().map(|a| format!("\t>{a}"));
        let lines = self.lines.iter();
        let lines = lines.map(|(name, cells)| format!("  {name}\t{}", cells.join("\t")));
        let columns = Columns::with_rows(
            &format!("{}{}", self.title, head.collect::<String>()),
            lines,
        );
        format!("\n{columns}")
    }
}
