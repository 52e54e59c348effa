//! Rows as diagrams.

use super::row::{cases, front_of, grouped};
use super::{Diagram, Machine, Row, Section};
use crate::report::{self, Axis, Mark, Panel, Series, each_once};

/// A panel for each case and diagram: a line for each choice, or dots where there are many of a colour, and a dashed
/// line through the front.
pub fn svg(section: &Section, rows: &[Row], machine: &Machine) -> String {
    let colors = each_once(rows.iter().map(|row| row.names[section.color].as_str()));
    let panels: Vec<Panel> = cases(rows)
        .iter()
        .flat_map(|case| {
            let panel = |diagram: &Diagram| panel(section, diagram, case, &colors);
            section.diagrams.iter().map(panel).collect::<Vec<_>>()
        })
        .collect();
    let title = format!("{}: {} ({machine})", section.name, section.summary);
    report::svg(&title, &panels, section.diagrams.len().clamp(2, 3))
}

fn axis(section: &Section, column: &str) -> Axis {
    let summary = section.place(column).map(|at| section.columns[at].summary);
    Axis::log(summary.map_or(column.into(), |s| format!("{column}: {s}")))
}

fn panel(section: &Section, diagram: &Diagram, case: &[&Row], colors: &[&str]) -> Panel {
    let color_of = |row: &Row| row.names[section.color].clone();
    let mut series = Vec::new();
    for (color, name) in colors.iter().enumerate() {
        let of_color = case.iter().copied().filter(|row| color_of(row) == *name);
        let ladders = grouped(of_color, |row| row.choice().to_vec());
        let mark = match ladders.len() {
            0 | 1 => Mark::Line,
            _ => Mark::Points,
        };
        let point = |row: &&Row| {
            let x = section.number(row, diagram.x)?;
            Some((x, section.number(row, diagram.y)))
        };
        let points = ladders.iter().flatten().filter_map(point);
        series.push(Series::new(*name, color, mark, points));
    }
    if diagram.has_front {
        let front = front_of(section, diagram, case).into_iter();
        let points = front.map(|(_, [x, y])| (x, Some(y)));
        let name = "no other is as good for less";
        series.push(Series::new(name, colors.len(), Mark::Dashed, points));
    }
    let axes = [diagram.x, diagram.y].map(|column| axis(section, column));
    Panel::new(case[0].case(), axes, series)
}
