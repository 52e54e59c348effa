//! Back and forth in rows: the slowest axis changes least often.

use super::super::motion::Travel;
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
    let extent = |j: usize| {
        let axis = positions.iter().map(|p| p[j]);
        axis.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        })
    };
    // An axis that stands still needs no level.
    let mut axes: Vec<usize> = (0..MAX_AXES)
        .filter(|&j| extent(j).1 - extent(j).0 > SAME)
        .collect();
    axes.sort_by(|&a, &b| travel.speed(a).total_cmp(&travel.speed(b)));
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (level, &j) in axes.iter().enumerate() {
        let innermost = level + 1 == axes.len();
        let (low, high) = extent(j);
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
    let places = ascending.chunk_by(|a, b| b - a <= SAME).count();
    if innermost || SHARED * places <= x.len() {
        // Rounding must not tear a row apart.
        let starts: Vec<f64> = ascending
            .chunk_by(|a, b| b - a <= SAME)
            .map(|c| c[0])
            .collect();
        for x in &mut x {
            *x = starts.partition_point(|s| s <= x) as f64;
        }
    } else {
        for x in &mut x {
            *x = ((*x - low) / ROW).floor();
        }
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
        let ascending = at(a).total_cmp(&at(b));
        let along = if *back {
            ascending.reverse()
        } else {
            ascending
        };
        along.then(a.cmp(b))
    });
    *back = !*back;
    for group in numbers.chunk_by_mut(|a, b| at(a) == at(b)) {
        arrange(inner, inner_backwards, group);
    }
}
