//! Back and forth in rows: the slowest axis changes least often.

use super::super::motion::Travel;
use crate::numeric::extent;
use crate::schedule::{MAX_AXES, Positions};

/// Width of a row, rad: 5°.
const ROW: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Positions closer than this are one, rad.
const SAME: f64 = 1e-9;

/// Visits an axis must make at each of its positions, on average, to be left as it is; others are
/// cut into rows. A scan over a lattice finer than [`ROW`] keeps its sweeps this way.
const SHARED: usize = 4;

/// Boustrophedon: the slowest axis outermost (equal ones by number), each axis runs in the other
/// direction every time, and begins at the end that is nearer to rest. All but the innermost are
/// cut into rows of 5°, unless most of their positions are shared.
pub(super) fn sorted(travel: &Travel, rest: &Positions, positions: &[Positions]) -> Vec<u32> {
    let mut numbers: Vec<u32> = (0..positions.len() as u32).collect();
    // An axis that stands still needs no level.
    let axis = |j: usize| Some((j, extent(positions.iter().map(|p| p[j]))?));
    let axes = (0..MAX_AXES).filter_map(axis);
    let mut axes: Vec<_> = axes.filter(|(_, [low, high])| high - low > SAME).collect();
    axes.sort_by(|(a, _), (b, _)| travel.speed(*a).total_cmp(&travel.speed(*b)));
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (level, &(j, [low, high])) in axes.iter().enumerate() {
        let innermost = level + 1 == axes.len();
        let descends = (high - rest[j]).abs() < (low - rest[j]).abs();
        let mut row = lined_up(positions.iter().map(|p| p[j]).collect(), innermost, low);
        if descends {
            row.iter_mut().for_each(|r| *r = -*r);
        }
        rows.push(row);
    }
    let mut backwards = vec![false; axes.len()];
    arrange(&rows, &mut backwards, &mut numbers);
    numbers
}

/// The row of each position, from 0; equal coordinates are one row.
fn lined_up(mut x: Vec<f64>, innermost: bool, low: f64) -> Vec<f64> {
    let mut ascending = x.clone();
    ascending.sort_unstable_by(f64::total_cmp);
    // Rounding must not tear a row apart.
    let places = ascending.chunk_by(|a, b| b - a <= SAME);
    let starts: Vec<f64> = places.map(|place| place[0]).collect();
    let is_kept = innermost || SHARED * starts.len() <= x.len();
    for x in &mut x {
        *x = match is_kept {
            true => starts.partition_point(|start| start <= x) as f64,
            false => ((*x - low) / ROW).floor(),
        };
    }
    x
}

/// Sorts by the first of `rows`, and within each row by the others, every second time backwards.
fn arrange(rows: &[Vec<f64>], backwards: &mut [bool], numbers: &mut [u32]) {
    let (Some((row, inner)), Some((back, inner_backwards))) =
        (rows.split_first(), backwards.split_first_mut())
    else {
        return;
    };
    let at = |i: &u32| row[*i as usize];
    numbers.sort_unstable_by(|a, b| {
        let [first, second] = if *back { [b, a] } else { [a, b] };
        at(first).total_cmp(&at(second)).then(a.cmp(b))
    });
    *back = !*back;
    for group in numbers.chunk_by_mut(|a, b| at(a) == at(b)) {
        arrange(inner, inner_backwards, group);
    }
}
