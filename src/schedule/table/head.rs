//! Where the rows of a table begin, and what stands between its cells.
//!
//! Programs write their own lines above a table (a title, `sep=;`, the date), a line of units below its names, or no names at all.
//! The line of names is the first that has names of ours or of `--columns`; else, of a table by others, the line above the first
//! numbers, or the last comment above them; else columns are called by their numbers, from 1.

use super::cells::Cells;
use crate::brdf::marks::is_mark;
use crate::schedule::convention::Conventions;
use crate::schedule::names;
use std::borrow::Cow;

/// Lines among which names and first numbers are looked for.
const LOOKED_AT: usize = 200;

/// What may stand between cells; a blank stands for any number of blanks and tabs.
const SEPARATORS: [u8; 4] = [b';', b'\t', b',', b' '];

/// The first line of a table of a spreadsheet may name what stands between its cells.
const SEPARATOR: &str = "sep=";

/// The head of a table.
#[derive(Debug)]
pub(super) struct Head {
    /// The line of the names, from 1; that of the first numbers, if there are no names.
    pub line: usize,
    /// The names, with the units that stand below them.
    pub labels: Vec<String>,
    /// What stands between the cells of rows.
    pub separator: u8,
    /// The last line of the head.
    pub last: usize,
    /// Other lines above the rows.
    pub prose: usize,
}

/// Comments begin so; those that begin with the first may hold facts.
const COMMENTS: [&str; 4] = ["#", "\"#", "%", "//"];

/// The text of a comment; `None` of another line.
pub(super) fn comment(line: &str) -> Option<&str> {
    COMMENTS.iter().find_map(|mark| line.strip_prefix(mark))
}

/// What stands between cells, if a line says it.
pub(super) fn hint(line: &str) -> Option<u8> {
    let (key, rest) = line.as_bytes().split_at_checked(SEPARATOR.len())?;
    let is_hint = key.eq_ignore_ascii_case(SEPARATOR.as_bytes());
    rest.first().copied().filter(|_| is_hint)
}

/// True of a line without a cell, as spreadsheets write them below a table.
pub(super) fn is_empty(line: &str) -> bool {
    line.chars().all(|c| matches!(c, ',' | ';' | '\t' | ' '))
}

/// The number in a cell: with a decimal comma, if that may be, and exponents of Fortran; `None` of another text.
pub(crate) fn number(cell: &str, comma: bool) -> Option<f64> {
    let is_exponent = |c| matches!(c, 'D' | 'd');
    // Most cells are as they are: nothing is copied.
    let mut cell = Cow::Borrowed(cell);
    if comma && cell.contains(',') && !cell.contains('.') {
        cell = cell.replacen(',', ".", 1).into();
    }
    let number = cell.parse().ok();
    number.or_else(|| cell.replacen(is_exponent, "e", 1).parse().ok())
}

/// The cells of a line; `None` if a quote is not closed.
fn cells(line: &str, separator: u8) -> Option<Vec<String>> {
    let mut cells = Cells::new(separator);
    Some(cells.split(line)?.map(String::from).collect())
}

/// True of cells that are numbers, or stand for none; of columns that are `numbered` by the user others may be text.
fn are_numbers(cells: &[String], separator: u8, numbered: bool) -> bool {
    let number = |cell: &String| number(cell, separator != b',').is_some();
    let known = cells.iter().filter(|c| number(c)).count();
    let others = |cell: &String| numbered || cell.is_empty() || is_mark(cell) || number(cell);
    known >= 3 && cells.iter().all(others)
}

impl Head {
    /// Finds the head of a text under conventions. `None` of a text without a line.
    pub(super) fn find(text: &str, conventions: &Conventions) -> Option<Self> {
        let (mut hint, mut comments) = (None, Vec::new());
        let mut content: Vec<(usize, &str)> = Vec::new();
        for (line, text) in (1..).zip(text.lines()) {
            let text = text.trim_matches(' ');
            if let Some(comment) = comment(text) {
                comments.push((line, comment));
                continue;
            }
            if is_empty(text) {
                continue;
            }
            if let (true, Some(separator)) = (content.is_empty(), self::hint(text)) {
                hint = Some(separator);
                continue;
            }
            if content.len() >= LOOKED_AT {
                break;
            }
            content.push((line, text));
        }
        let usual = |text: &str| hint.unwrap_or_else(|| usual_separator(text));
        // Names of ours, or of the user; prose has no name of an angle.
        for (i, &(line, text)) in content.iter().enumerate() {
            let separator = usual(text);
            let labels = cells(text, separator).unwrap_or_default();
            let ours = labels.iter().filter_map(|label| names::ours(label));
            let is_angle = |name: &str| ["theta", "omega"].iter().any(|a| name.starts_with(a));
            let has_angle = ours.clone().any(|(named, _)| is_angle(&named));
            let by_user = labels
                .iter()
                .filter(|label| conventions.names(label))
                .count();
            if (has_angle || by_user > 0) && ours.count() + by_user >= 2 {
                let units = content.get(i + 1).copied();
                let units = units.and_then(|(line, text)| {
                    let of = |s| cells(text, s).filter(|cells| cells.len() == labels.len());
                    Some((line, of(separator).or_else(|| of(b' '))?))
                });
                let head = Self::new(line, labels, units, separator, i);
                return Some(match hint {
                    Some(_) => head,
                    None => head.with_rows(&content),
                });
            }
        }
        let numbered = conventions.are_numbers();
        for (i, &(_, text)) in content.iter().enumerate() {
            let separators = SEPARATORS.iter().filter(|s| hint.is_none_or(|h| h == **s));
            let numbers = separators.copied().find_map(|separator| {
                let cells = cells(text, separator)?;
                are_numbers(&cells, separator, numbered).then_some((separator, cells.len()))
            });
            if let Some((separator, width)) = numbers {
                let above = |(line, _): &(usize, &str)| *line < content[i].0;
                let comment = comments.into_iter().rfind(above);
                return Some(Self::above(&content[..=i], comment, separator, width));
            }
        }
        // Without numbers, or names that are known: the first line is that of the names.
        let &(line, text) = content.first()?;
        let separator = usual(text);
        let labels = cells(text, separator)?;
        Some(Self::new(line, labels, None, separator, 0))
    }

    /// This head with what stands between the cells of the first row, where that is not what stands between names.
    fn with_rows(mut self, content: &[(usize, &str)]) -> Self {
        let first = content.iter().find(|(line, _)| *line > self.last);
        let of = |separator: u8| {
            let found = first.and_then(|(_, text)| cells(text, separator))?;
            (found.len() == self.labels.len()).then_some(found)
        };
        let fits = |separator: &u8| {
            let whole = |cells: Vec<String>| {
                let ends = |cell: &String| cell.ends_with([',', ';']);
                are_numbers(&cells, *separator, false) && !cells.iter().any(ends)
            };
            of(*separator).is_some_and(whole)
        };
        if of(self.separator).is_none() {
            let other = SEPARATORS.into_iter().find(fits);
            self.separator = other.unwrap_or(self.separator);
        }
        self
    }

    /// The head above the first numbers, the last of the lines `before`.
    fn above(
        before: &[(usize, &str)],
        comment: Option<(usize, &str)>,
        separator: u8,
        width: usize,
    ) -> Self {
        let of = |(line, text): (usize, &str)| {
            let labels = cells(text, separator).filter(|cells| cells.len() == width)?;
            Some((line, labels))
        };
        let (first, above) = match before {
            [above @ .., first] => (first.0, above),
            [] => (1, before),
        };
        let mut above = above.iter().rev().copied();
        let mut next = above.next().and_then(of);
        let mut units = None;
        if next.as_ref().is_some_and(|(_, cells)| are_units(cells)) {
            units = next;
            next = above.next().and_then(of);
        }
        if let Some((line, labels)) = next {
            return Self::new(line, labels, units, separator, above.count());
        }
        // The names of numpy.savetxt are a comment.
        let comment = comment.filter(|(line, _)| *line < first).and_then(of);
        let are_ours =
            |labels: &[String]| labels.iter().filter_map(|l| names::ours(l)).count() >= 2;
        let numbered = || (first, (1..=width).map(|i| i.to_string()).collect());
        let names = comment.filter(|(_, labels)| are_ours(labels));
        let (line, labels) = names.unwrap_or_else(numbered);
        let head = Self::new(line, labels, None, separator, before.len() - 1);
        let last = first - 1;
        Self { last, ..head }
    }

    fn new(
        line: usize,
        labels: Vec<String>,
        units: Option<(usize, Vec<String>)>,
        separator: u8,
        prose: usize,
    ) -> Self {
        let units = units.filter(|(_, units)| units.len() == labels.len() && are_units(units));
        let (last, labels) = match units {
            None => (line, labels),
            Some((last, units)) => {
                let with = |(label, unit): (String, String)| match names::bare(&unit) {
                    "" => label,
                    unit => format!("{label} [{unit}]"),
                };
                (last, labels.into_iter().zip(units).map(with).collect())
            }
        };
        Self {
            line,
            labels,
            separator,
            last,
            prose,
        }
    }
}

/// True of cells of which each is a unit or empty.
fn are_units(cells: &[String]) -> bool {
    let is_unit = |cell: &String| cell.is_empty() || names::is_unit(names::bare(cell));
    cells.iter().any(|cell| !cell.is_empty()) && cells.iter().all(is_unit)
}

/// What stands between the names of a line: the first of these that is in it.
fn usual_separator(line: &str) -> u8 {
    let there = |s: &&u8| line.as_bytes().contains(s);
    SEPARATORS.iter().find(there).copied().unwrap_or(b',')
}
