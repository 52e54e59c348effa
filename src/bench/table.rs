//! Rows as text, CSV and JSON.

use super::front::{front_of, is_on_fronts};
use super::row::{cases, head};
use super::{Machine, Row, Section, Task};
use serde_json::{Map, Value as Json};
use std::io::{self, Write};

/// Widths of the columns of a table for people.
pub struct Layout {
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
    pub fn new(task: &Task) -> Self {
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
    pub fn head(&self, machine: &Machine) -> String {
        let section = self.section;
        let names: Vec<String> = section.columns.iter().map(|c| c.name.into()).collect();
        format!("{}: {}\n{machine}\n\n", section.name, section.summary)
            + &self.line(section.names, ["seconds", "least to most, passes"], &names)
    }

    /// A row of it.
    pub fn row(&self, row: &Row) -> String {
        let names: Vec<&str> = row.names.iter().map(String::as_str).collect();
        let times = row.times;
        let spread = format!("{:.2e} to {:.2e}, {}", times.min, times.max, times.repeats);
        let numbers: Vec<String> = row
            .values
            .iter()
            .map(|v| match (v.value, v.uncertainty) {
                (None, _) => "–".into(),
                (Some(x), None) => shown(x),
                (Some(x), Some(u)) => format!("{x:.2e} ± {u:.1e}"),
            })
            .collect();
        self.line(
            &names,
            [&format!("{:.3e}", times.median), &spread],
            &numbers,
        )
    }
}

/// The choices on each front, cheapest first; empty of a section without fronts.
pub fn fronts(section: &Section, rows: &[Row]) -> String {
    let mut out = String::new();
    for diagram in section.diagrams.iter().filter(|d| d.has_front) {
        for case in cases(rows) {
            out += &format!(
                "\nbest {} for its {}, {}: no other is as good for less\n",
                diagram.y,
                diagram.x,
                case[0].case()
            );
            for (row, [x, y]) in front_of(section, diagram, &case) {
                let names = row.names[1..].join(" ");
                out += &format!("  {x:>9.2e}  {y:>9.2e}  {names}\n");
            }
        }
    }
    out
}

/// A row by the names of its columns, numbers in full.
fn record(section: &Section, row: &Row, is_on: &[bool]) -> Vec<Json> {
    let mut cells: Vec<Json> = row.names.iter().map(|n| n.as_str().into()).collect();
    let times = row.times;
    cells.extend([times.median, times.min, times.max].map(Json::from));
    cells.push(times.repeats.into());
    for (value, column) in row.values.iter().zip(section.columns) {
        cells.push(value.value.map_or(Json::Null, Json::from));
        if column.uncertainty.is_some() {
            cells.push(value.uncertainty.map_or(Json::Null, Json::from));
        }
    }
    cells.extend(is_on.iter().map(|&on| Json::from(on)));
    cells
}

/// Names of all columns.
fn columns(section: &Section) -> Vec<String> {
    let mut columns = head(section);
    let diagrams = section.diagrams.iter().filter(|d| d.has_front);
    columns.extend(diagrams.map(super::Diagram::column));
    columns
}

/// Writes rows with a head; the machine is in each of them.
///
/// # Errors
/// Those of writing.
pub fn csv(
    section: &Section,
    rows: &[Row],
    machine: &Machine,
    out: &mut dyn Write,
) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    let mut head = columns(section);
    head.extend(["cpu", "threads"].map(Into::into));
    csv.write_record(head)?;
    for (row, is_on) in rows.iter().zip(is_on_fronts(section, rows)) {
        let cell = |json: Json| match json {
            Json::Null => String::new(),
            Json::String(text) => text,
            json => json.to_string(),
        };
        let mut cells: Vec<String> = record(section, row, &is_on).into_iter().map(cell).collect();
        cells.extend([machine.cpu.clone(), machine.threads.to_string()]);
        csv.write_record(cells)?;
    }
    csv.flush()
}

/// Rows as JSON objects.
pub fn json(section: &Section, rows: &[Row]) -> Json {
    let columns = columns(section);
    let object = |(row, is_on): (&Row, Vec<bool>)| {
        let cells = record(section, row, &is_on);
        Json::Object(columns.iter().cloned().zip(cells).collect::<Map<_, _>>())
    };
    let rows = rows.iter().zip(is_on_fronts(section, rows));
    Json::Array(rows.map(object).collect())
}
