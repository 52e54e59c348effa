//! Rows: one rung each; the front of Pareto, and the seconds that a choice needs for an error.

use super::{Diagram, Judged, Section, Times};
use crate::report;
use crate::statistics::order;

/// What was measured on a rung.
#[derive(Clone, Debug)]
pub struct Row {
    /// Its names, in the order of the section's.
    pub names: Vec<String>,
    /// Times of its passes.
    pub times: Times,
    /// How good it is.
    pub judged: Judged,
}

impl Row {
    /// What it is compared within.
    pub(crate) fn case(&self) -> &str {
        self.names.first().map_or("", String::as_str)
    }

    /// The choice: its names between the case and the rung.
    pub fn choice(&self) -> &[String] {
        let last = self.names.len().saturating_sub(1);
        &self.names[last.min(1)..last]
    }
}

/// Rows by what they are compared within, in their order.
pub(super) fn cases(rows: &[Row]) -> Vec<Vec<&Row>> {
    grouped(rows.iter(), |row| row.case().to_owned())
}

/// Rows of like keys, in the order of the first of each.
pub(super) fn grouped<'a, K: PartialEq>(
    rows: impl Iterator<Item = &'a Row>,
    key: impl Fn(&Row) -> K,
) -> Vec<Vec<&'a Row>> {
    let groups = report::grouped(rows.map(|row| (key(row), row)));
    groups.into_iter().map(|(_, group)| group).collect()
}

/// True of each point that is not dominated: no other is at most equal in both coordinates and less in one. A point
/// that lacks a coordinate is on no front.
///
/// ```
/// let points = [Some([1.0, 3.0]), Some([2.0, 2.0]), Some([3.0, 2.0]), None];
/// assert_eq!(gonio::bench::front(&points), [true, true, false, false]);
/// ```
pub fn front(points: &[Option<[f64; 2]>]) -> Vec<bool> {
    let numbered = points.iter().enumerate();
    let mut order: Vec<_> = numbered.filter_map(|(i, p)| Some((i, (*p)?))).collect();
    order.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut is_on = vec![false; points.len()];
    let mut last: Option<[f64; 2]> = None;
    for (i, point) in order {
        if last.is_none_or(|last| point[1] < last[1] || point == last) {
            is_on[i] = true;
            last = Some(point);
        }
    }
    is_on
}

/// The rows of a case that are on the front of a diagram, cheapest first, with their coordinates.
pub(super) fn front_of<'a>(
    section: &Section,
    diagram: &Diagram,
    rows: &[&'a Row],
) -> Vec<(&'a Row, [f64; 2])> {
    let point = |row: &&Row| {
        let [x, y] = [diagram.x, diagram.y].map(|column| section.number(row, column));
        Some([x?, y?])
    };
    let points: Vec<_> = rows.iter().map(point).collect();
    let is_on = front(&points).into_iter();
    let points = is_on
        .zip(points)
        .map(|(is_on, point)| point.filter(|_| is_on));
    let on = rows.iter().zip(points);
    let mut on: Vec<_> = on.filter_map(|(row, point)| Some((*row, point?))).collect();
    on.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
    on
}

/// For each row, whether it is on the front of each diagram that has one.
pub(super) fn is_on_fronts(section: &Section, rows: &[Row]) -> Vec<Vec<bool>> {
    let diagrams = section.diagrams.iter().filter(|d| d.has_front);
    let mut all = vec![Vec::new(); rows.len()];
    for diagram in diagrams {
        let cases = cases(rows);
        let on = cases
            .iter()
            .flat_map(|case| front_of(section, diagram, case));
        let on: Vec<&Row> = on.map(|(row, _)| row).collect();
        for (row, all) in rows.iter().zip(&mut all) {
            all.push(on.iter().any(|other| std::ptr::eq(*other, row)));
        }
    }
    all
}

/// Seconds for an error, by the way they were found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Time {
    /// Interpolated between two rungs.
    Between(f64),
    /// Upper bound: the cheapest rung is already better.
    AtMost(f64),
    /// Extrapolated beyond the dearest rung, along N^(−1/2).
    Beyond(f64),
    /// Lower bound: the dearest rung is lawless, or its error more than two decades above.
    MoreThan(f64),
}

impl Time {
    /// The number.
    pub(crate) fn seconds(self) -> f64 {
        let (Time::Between(s) | Time::AtMost(s) | Time::Beyond(s) | Time::MoreThan(s)) = self;
        s
    }

    /// The sign before the number.
    fn mark(self) -> char {
        match self {
            Time::Between(_) => ' ',
            Time::AtMost(_) => '<',
            Time::Beyond(_) => '*',
            Time::MoreThan(_) => '>',
        }
    }

    /// The seconds for an error, from points (seconds, error), cheapest first; `lawful` says that
    /// the last of them may be extrapolated.
    pub fn to_reach(target: f64, points: &[(f64, f64)], lawful: bool) -> Option<Self> {
        let (&first, rest) = points.split_first()?;
        if first.1 <= target {
            return Some(Time::AtMost(first.0));
        }
        let mut last = first;
        for &next in rest {
            if next.1 <= target {
                // An error of 0 is as good as any: rungs are compared, not logarithms.
                let share = match next.1 > 0.0 {
                    true => (last.1 / target).ln() / (last.1 / next.1).ln(),
                    false => 1.0,
                };
                return Some(Time::Between(last.0 * (next.0 / last.0).powf(share)));
            }
            last = next;
        }
        let ratio = last.1 / target;
        Some(if lawful && ratio <= 100.0 {
            Time::Beyond(last.0 * ratio * ratio)
        } else {
            Time::MoreThan(last.0)
        })
    }
}

/// By which power of the number along its horizontal axis the costs of each choice grow, over the last two decades of it; empty of a
/// section without diagrams of costs.
pub(crate) fn grown(section: &Section, rows: &[Row]) -> String {
    let choices = grouped(rows.iter(), |row| row.names[..row.names.len() - 1].to_vec());
    let mut out = String::new();
    for choice in &choices {
        let mut of = Vec::new();
        for diagram in section.diagrams.iter().filter(|d| !d.has_front) {
            let point = |row: &&Row| {
                let [x, y] = [diagram.x, diagram.y].map(|c| section.number(row, c));
                Some((x?, y?))
            };
            let mut points: Vec<(f64, f64)> = choice.iter().filter_map(point).collect();
            let last = points.iter().map(|p| p.0).fold(0.0, f64::max);
            points.retain(|p| p.0 >= 0.009 * last);
            let order = order(&points).map(|order| order.slope);
            of.extend(order.map(|slope| format!("{} {slope:.2}", diagram.y)));
        }
        if !of.is_empty() {
            let names = choice[0].names[..choice[0].names.len() - 1].join(" ");
            out += &format!("  {names}: {}\n", of.join(", "));
        }
    }
    match out.is_empty() {
        true => out,
        false => format!("\nexponent of growth, over the last two decades\n{out}"),
    }
}

/// Choices that are printed for each error, at most.
const MOST_PRINTED: usize = 4;

/// The choices of each case that reach an error soonest, and how many times the seconds of the first the others take;
/// empty of a section without targets.
pub fn reached(section: &Section, rows: &[Row]) -> String {
    let (columns, targets) = section.targets;
    if rows.is_empty() || columns.is_empty() {
        return String::new();
    }
    let mut out = String::from(
        "\nseconds to reach an error, soonest first, and how many times those of the first\n\
         (< the cheapest rung is better; * extrapolated: error falls with the root of the time;\n\
         > not reached, and lawless or too far off to extrapolate)\n",
    );
    let cases = cases(rows);
    let widths = rows.iter().map(|row| row.case().chars().count());
    let wide = widths.max().unwrap_or(0);
    let name = columns.iter().map(|c| c.len()).max().unwrap_or(0);
    for case in &cases {
        let of = case[0].case();
        for column in columns {
            for &target in targets {
                out += &format!("{of:<wide$}  {column:<name$}  {target:>5.0e} ");
                out += &(line(section, case, column, target) + "\n");
            }
        }
    }
    out
}

fn line(section: &Section, case: &[&Row], column: &str, target: f64) -> String {
    let place = section.place(column);
    let error = |r: &&Row| r.judged.values.get(place?)?.standard_error;
    let known = case.iter().filter_map(error).reduce(f64::min);
    if known.is_some_and(|known| known > target) {
        return " not known to that".into();
    }
    let reached = |rungs: Vec<&Row>| {
        let point = |r: &&Row| Some((r.times.median, section.number(r, column)?));
        let points: Vec<_> = rungs.iter().filter_map(point).collect();
        let lawful = rungs.last().is_some_and(|r| r.judged.is_lawful);
        let time = Time::to_reach(target, &points, lawful)?;
        Some((rungs[0].choice().join(" "), time))
    };
    let choices = grouped(case.iter().copied(), |r| r.choice().to_vec());
    let mut times: Vec<_> = choices.into_iter().filter_map(reached).collect();
    times.sort_by(|(_, a), (_, b)| a.seconds().total_cmp(&b.seconds()));
    // What is only known not to be enough comes last.
    times.sort_by_key(|(_, time)| matches!(time, Time::MoreThan(_)));
    let least = times.first().map_or(1.0, |(_, t)| t.seconds());
    let print = |(i, (choice, time)): (usize, &(String, Time))| {
        let seconds = time.seconds();
        let ratio = match i {
            0 => String::new(),
            _ => format!(" ({:.1e}×)", seconds / least),
        };
        format!("  {choice} {}{seconds:.1e} s{ratio}", time.mark())
    };
    let first = times.iter().take(MOST_PRINTED);
    first.enumerate().map(print).collect()
}
