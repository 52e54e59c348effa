//! The front of Pareto.

use super::row::cases;
use super::{Diagram, Row, Section};

/// True of each point that is not dominated: no other is at most equal in both coordinates and less in one. A point
/// that lacks a coordinate is on no front.
///
/// ```
/// let points = [Some([1.0, 3.0]), Some([2.0, 2.0]), Some([3.0, 2.0]), None];
/// assert_eq!(gonio::bench::front(&points), [true, true, false, false]);
/// ```
pub fn front(points: &[Option<[f64; 2]>]) -> Vec<bool> {
    let mut order: Vec<(usize, [f64; 2])> = points
        .iter()
        .enumerate()
        .filter_map(|(i, p)| Some((i, (*p)?)))
        .collect();
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
        Some([
            section.number(row, diagram.x)?,
            section.number(row, diagram.y)?,
        ])
    };
    let points: Vec<_> = rows.iter().map(point).collect();
    let is_on = front(&points);
    let mut on: Vec<(&Row, [f64; 2])> = rows
        .iter()
        .zip(points)
        .zip(is_on)
        .filter_map(|((row, point), is_on)| point.filter(|_| is_on).map(|p| (*row, p)))
        .collect();
    on.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
    on
}

/// For each row, whether it is on the front of each diagram that has one.
pub(super) fn is_on_fronts(section: &Section, rows: &[Row]) -> Vec<Vec<bool>> {
    let diagrams = || section.diagrams.iter().filter(|d| d.has_front);
    let mut all = vec![Vec::new(); rows.len()];
    for diagram in diagrams() {
        let on: Vec<&Row> = cases(rows)
            .iter()
            .flat_map(|case| front_of(section, diagram, case))
            .map(|(row, _)| row)
            .collect();
        for (row, all) in rows.iter().zip(&mut all) {
            all.push(on.iter().any(|other| std::ptr::eq(*other, row)));
        }
    }
    all
}
