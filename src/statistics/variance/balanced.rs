//! Analysis of variance of balanced data, where all combinations of levels are equally frequent.

use super::{Levels, Squares};

/// Sums of squares from the means of levels and of cells, or `None` of data that is not balanced.
///
/// With equal counts the terms are orthogonal: what least squares fits for a level is the mean of its
/// rows less the mean of all, and for a cell of two factors the mean of its rows less those.
pub(super) fn squares(rows: &[(&[usize], f64)], levels: &Levels, mean: f64) -> Option<Squares> {
    if !is_balanced(levels, rows.len()) {
        return None;
    }
    let factors = levels.counts.len();
    let n = rows.len() as f64;
    let centred = || levels.rows(factors).zip(rows.iter().map(|(_, v)| v - mean));
    let effects: Vec<Vec<f64>> = (0..factors)
        .map(|f| {
            let mut sums = vec![0.0; levels.counts[f]];
            for (at, value) in centred() {
                sums[at[f]] += value;
            }
            let share = levels.counts[f] as f64 / n;
            sums.into_iter().map(|s| s * share).collect()
        })
        .collect();
    let square = |effects: &[f64]| {
        let sum: f64 = effects.iter().map(|e| e * e).sum();
        sum * n / effects.len() as f64
    };
    let mains = effects.iter().map(|e| square(e)).collect();
    // What the terms leave of each row.
    let mut left: Vec<f64> = centred()
        .map(|(at, value)| value - (0..factors).map(|f| effects[f][at[f]]).sum::<f64>())
        .collect();
    let mut pairs = Vec::new();
    for b in 0..factors {
        for a in 0..b {
            let [rows_of, columns] = [a, b].map(|f| levels.counts[f]);
            let mut cells = vec![0.0; rows_of * columns];
            let cell = |at: &[usize]| at[a] * columns + at[b];
            for (at, value) in centred() {
                cells[cell(at)] += value;
            }
            let share = cells.len() as f64 / n;
            for (i, sum) in cells.iter_mut().enumerate() {
                *sum = *sum * share - effects[a][i / columns] - effects[b][i % columns];
            }
            for (at, left) in levels.rows(factors).zip(&mut left) {
                *left -= cells[cell(at)];
            }
            pairs.push((a, b, square(&cells)));
        }
    }
    let rest = left.iter().map(|l| l * l).sum();
    Some(Squares { mains, pairs, rest })
}

/// True if every combination of levels is there, each as often as any other.
fn is_balanced(levels: &Levels, rows: usize) -> bool {
    let factors = levels.counts.len();
    let all = levels.counts.iter().try_fold(1usize, |all, count| {
        all.checked_mul(*count).filter(|all| *all <= rows)
    });
    // Without factors all rows are of one combination.
    let Some(all) = all.filter(|all| factors > 0 && rows.is_multiple_of(*all)) else {
        return false;
    };
    let mut times = vec![0; all];
    for at in levels.rows(factors) {
        let place = at.iter().zip(&levels.counts);
        times[place.fold(0, |place, (level, count)| place * count + level)] += 1;
    }
    times.iter().all(|t| *t == rows / all)
}
