//! Tables as sheets of a matrix: above each the light, along it the angles of the sensor.
//!
//! ```text
//! theta_i;15
//! ;0;30;60
//! 0;0.257;0.257;0.257
//! 10;0.188;0.193;0.208
//! ```
//!
//! Rows are polar angles of the sensor, columns its azimuths; further sheets follow. A line `phi_i;…` may be beside that of theta_i.
//! Titles are read past: any line above the first sheet, a text in the first cell alone above others, which then have lights of their own.

use super::FileError;
use super::cells::Cells;
use super::head::{self, number};
use super::read::Table;
use crate::brdf::marks::is_mark;
use crate::schedule::names;

/// Angles above a sheet.
const KEYS: [&str; 2] = ["theta_i", "phi_i"];

/// Lines with content among which the first sheet begins, below titles.
const TITLES: usize = 20;

/// A line of a sheet.
enum Line {
    /// One of [`KEYS`], its label, and the number.
    Key(usize, String, f64),
    /// The azimuths.
    Head(Vec<f64>),
    /// A polar angle and the cells.
    Row(f64, Vec<String>),
    /// A text in the first cell alone, which is neither a name of ours nor a mark.
    Title,
    Other,
}

fn line_of(cells: &[String], comma: bool) -> Line {
    let number = |cell: &String| number(cell, comma).filter(|x| x.is_finite());
    let last = cells.iter().rposition(|cell| !cell.is_empty());
    let [first, rest @ ..] = &cells[..last.map_or(0, |i| i + 1)] else {
        return Line::Other;
    };
    let key =
        names::ours(first).and_then(|(named, _)| KEYS.iter().position(|k| named.starts_with(k)));
    if let (Some(key), [value]) = (key, rest) {
        let line = number(value).map(|value| Line::Key(key, first.clone(), value));
        return line.unwrap_or(Line::Other);
    }
    let all: Option<Vec<f64>> = rest.iter().map(number).collect();
    match (number(first), all) {
        // A word may stand in the corner.
        (None, Some(all)) if rest.len() > usize::from(!first.is_empty()) => Line::Head(all),
        (Some(theta), _) => Line::Row(theta, cells[1..].to_vec()),
        _ if rest.is_empty() && names::ours(first).is_none() && !is_mark(first) => Line::Title,
        _ => Line::Other,
    }
}

/// Lines with content: number, cells.
fn lines(text: &str, separator: u8) -> impl Iterator<Item = (usize, Vec<String>)> {
    let content = (1..).zip(text.lines()).filter(|(_, line)| {
        let is_other = head::hint(line).is_some() || head::is_empty(line);
        !is_other && head::comment(line.trim_matches(' ')).is_none()
    });
    let mut cells = Cells::new(separator);
    content.map(move |(number, line)| {
        let found = cells.split(line).map(|all| all.map(String::from).collect());
        // After a quote that is not closed nothing else can be split.
        let found = found.unwrap_or_else(|| {
            cells = Cells::new(separator);
            Vec::new()
        });
        (number, found)
    })
}

/// What stands between the cells of a text that is such a table.
pub(super) fn separator(text: &str) -> Option<u8> {
    [b';', b'\t', b','].into_iter().find(|&separator| {
        let kind = |(_, cells): (usize, Vec<String>)| line_of(&cells, separator != b',');
        let mut all = lines(text, separator).take(TITLES).map(kind);
        all.any(|line| matches!(line, Line::Key(..)))
            && (all.take(1 + KEYS.len())).any(|line| matches!(line, Line::Head(_)))
    })
}

impl Table {
    /// Reads sheets whose cells `separator` separates; a row of the table is a cell.
    pub(super) fn read_matrix(
        &mut self,
        text: &str,
        separator: u8,
        name_columns: impl Fn(&mut Self, Vec<String>, usize) -> Result<(), FileError>,
    ) -> Result<(), FileError> {
        let comma = separator != b',';
        let mut keys: [Option<f64>; 2] = [None; 2];
        let mut azimuths: Vec<f64> = Vec::new();
        let (mut lights, mut title) = (Vec::new(), None);
        let mut first_unit: Option<Option<&str>> = None;
        for (line, cells) in lines(text, separator) {
            match line_of(&cells, comma) {
                Line::Key(key, label, value) => {
                    let unit = names::unit(&label);
                    if *first_unit.get_or_insert(unit) != unit {
                        let message =
                            "its unit is not that of the angle before; allowed: one for all angles";
                        return Err(self.error(line, message));
                    }
                    if self.columns.is_empty() {
                        let end = unit.map_or(String::new(), |unit| format!("_{unit}"));
                        let angles = [KEYS[0], KEYS[1], "theta_o", "phi_o"];
                        let mut labels = angles.map(|angle| format!("{angle}{end}")).to_vec();
                        labels.push("value".into());
                        name_columns(self, labels, line)?;
                    }
                    // A new sheet begins.
                    if !azimuths.is_empty() {
                        keys[0] = None;
                        azimuths.clear();
                    }
                    keys[key] = Some(value);
                }
                // Not below the light of a sheet; the next has its own.
                Line::Title if keys[0].is_some() != azimuths.is_empty() => {
                    self.prose += 1;
                    keys[0] = None;
                    azimuths.clear();
                    title = Some(line);
                }
                _ if self.columns.is_empty() => self.prose += 1,
                Line::Head(all) if keys[0].is_some() && azimuths.is_empty() => {
                    // What a title calls by another name is no repeat.
                    if let (Some(title), true) = (title, lights.contains(&keys)) {
                        let message = format!(
                            "this sheet has the light of one above the title in line {title}; allowed: one sheet for each light, \
                             or a file for each title"
                        );
                        return Err(self.error(line, message));
                    }
                    lights.push(keys);
                    azimuths = all;
                }
                Line::Row(theta, cells) if !azimuths.is_empty() => {
                    let (found, expected) = (cells.len(), azimuths.len());
                    let beyond = cells.iter().skip(expected).any(|cell| !cell.is_empty());
                    if found < expected || beyond {
                        let message = format!("{found} values where there are {expected} azimuths");
                        return Err(self.error(line, message).cut_if(found < expected));
                    }
                    for (cell, &phi) in cells.iter().zip(&azimuths) {
                        let value = self.cell(cell, comma, 4, line)?;
                        let [theta_i, phi_i] = keys.map(|key| key.unwrap_or(0.0));
                        self.lines.push(line);
                        self.numbers.extend([theta_i, phi_i, theta, phi, value]);
                    }
                }
                _ => {
                    let message = "this is no line of a sheet; allowed: theta_i and its angle, a row of azimuths below an \
                                   empty cell, rows of a polar angle and values";
                    return Err(self.error(line, message));
                }
            }
        }
        Ok(())
    }
}
