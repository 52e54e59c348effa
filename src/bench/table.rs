//! Rows as text, CSV and JSON.

use super::row::{cases, front_of, is_on_fronts};
use super::{Diagram, Machine, Row, Section, Task};
use crate::report::in_memory;
use crate::report::schema::text as csv_text;
use crate::report::schema::{Cell, Schema, columns};
use crate::validation::Estimate;
use serde_json::Value as Json;

/// Widths of the columns of a table for people.
pub(crate) struct Layout {
    section: &'static Section,
    names: Vec<usize>,
}

/// A number for people.
fn shown(x: f64) -> String {
    match x {
        x if x.fract() == 0.0 && x.abs() < 1e9 => x.to_string(),
        x => format!("{x:.2e}"),
    }
}

impl Layout {
    /// That of the rows that a task makes.
    pub(crate) fn new(task: &Task) -> Self {
        let section = task.section;
        let mut names: Vec<usize> = section.names.iter().map(|n| n.len()).collect();
        for row in task.names() {
            for (width, name) in names.iter_mut().zip(row) {
                *width = (*width).max(name.chars().count());
            }
        }
        Self { section, names }
    }

    fn line(&self, names: &[&str], seconds: [&str; 2], numbers: &[String]) -> String {
        let last = self.names.len().saturating_sub(1);
        let names = names.iter().zip(&self.names).enumerate();
        let mut out: String = names
            .map(|(i, (name, &width))| match i == last {
                true => format!("{name:>width$}  "),
                false => format!("{name:<width$}  "),
            })
            .collect();
        let [seconds, spread] = seconds;
        out += &format!("{seconds:>9}  {spread:<22}");
        for (number, column) in numbers.iter().zip(self.section.columns) {
            let wide = if column.uncertainty.is_some() { 19 } else { 8 };
            let wide = wide.max(column.name.len());
            out += &format!("  {number:>wide$}");
        }
        out.trim_end().to_owned() + "\n"
    }

    /// Title and head of the table.
    pub(crate) fn head(&self, machine: &Machine) -> String {
        let section = self.section;
        let names: Vec<String> = section.columns.iter().map(|c| c.name.into()).collect();
        format!("{}: {}\n{machine}\n\n", section.name, section.summary)
            + &self.line(section.names, ["seconds", "least to most, passes"], &names)
    }

    pub(crate) fn row(&self, row: &Row) -> String {
        let names: Vec<&str> = row.names.iter().map(String::as_str).collect();
        let times = row.times;
        let spread = format!("{:.2e} to {:.2e}, {}", times.min, times.max, times.repeats);
        let number = |v: &Estimate| match (v.value, v.standard_error) {
            (None, _) => "–".into(),
            (Some(x), None) => shown(x),
            (Some(x), Some(u)) => format!("{x:.2e} ± {u:.1e}"),
        };
        let numbers: Vec<String> = row.judged.values.iter().map(number).collect();
        let median = format!("{:.3e}", times.median);
        self.line(&names, [&median, &spread], &numbers)
    }
}

/// The choices on each front, cheapest first; empty of a section without fronts.
pub(crate) fn fronts(section: &Section, rows: &[Row]) -> String {
    let mut out = String::new();
    for diagram in section.diagrams.iter().filter(|d| d.has_front) {
        for case in cases(rows) {
            let (Diagram { x, y, .. }, case_name) = (diagram, case[0].case());
            out += &format!("\nbest {y} for its {x}, {case_name}: no other is as good for less\n");
            for (row, [x, y]) in front_of(section, diagram, &case) {
                let names = row.names[1..].join(" ");
                out += &format!("  {x:>9.2e}  {y:>9.2e}  {names}\n");
            }
        }
    }
    out
}

/// A row, and whether it is on each front.
type Placed<'a> = (&'a Row, Vec<bool>);

fn placed<'a>(section: &Section, rows: &'a [Row]) -> impl Iterator<Item = Placed<'a>> {
    rows.iter().zip(is_on_fronts(section, rows))
}

/// Columns of files: names and numbers of a row in full, each with its uncertainty, and whether it is on each front.
fn schema<'a>(section: &Section) -> Schema<Placed<'a>> {
    let mut schema = Schema::new();
    for (i, name) in section.names.iter().enumerate() {
        schema = schema.and(columns! { (row, _) in Placed<'a>; *name => row.names[i].as_str(), });
    }
    schema = schema.and(columns! { (row, _) in Placed<'a>;
        "seconds" => Json::from(row.times.median),
        "seconds_min" => Json::from(row.times.min),
        "seconds_max" => Json::from(row.times.max),
        "repeats" => row.times.repeats,
    });
    for (i, column) in section.columns.iter().enumerate() {
        schema = schema.and(columns! { (row, _) in Placed<'a>;
            column.name => Json::from(row.judged.values[i].value),
        });
        if let Some(name) = column.uncertainty {
            schema = schema.and(columns! { (row, _) in Placed<'a>;
                name => Json::from(row.judged.values[i].standard_error),
            });
        }
    }
    let diagrams = section.diagrams.iter().filter(|d| d.has_front);
    for (i, diagram) in diagrams.enumerate() {
        schema = schema.and(columns! { (_, is_on) in Placed<'a>; diagram.column() => is_on[i], });
    }
    schema
}

/// Rows as CSV with a head; the machine is in each of them.
pub(crate) fn csv(section: &Section, rows: &[Row], machine: &Machine) -> String {
    let schema = schema(section);
    let mut csv = csv::Writer::from_writer(Vec::new());
    in_memory(csv.write_record(schema.names().chain(["cpu", "threads"])));
    let of_machine = [machine.cpu.clone(), machine.threads.to_string()];
    for row in placed(section, rows) {
        let cells = schema.cells(&row).map(Cell::text);
        in_memory(csv.write_record(cells.chain(of_machine.clone())));
    }
    csv_text(csv)
}

/// Rows as JSON objects.
pub(crate) fn json(section: &Section, rows: &[Row]) -> Json {
    let schema = schema(section);
    placed(section, rows)
        .map(|row| schema.object(&row))
        .collect()
}
