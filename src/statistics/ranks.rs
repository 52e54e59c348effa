//! Ranks, ties shared.

/// Twice the rank of every value, the least being 1; equal values share the mean of their ranks, so
/// that twice of it is a whole number.
pub(super) fn doubled_ranks(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0; values.len()];
    let mut first = 0;
    for group in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let next = first + group.len();
        for place in group {
            // The first of them has rank first + 1, the last rank next.
            ranks[*place] = first + 1 + next;
        }
        first = next;
    }
    ranks
}

/// The mean rank of every choice over materials (1 is the least error, as Friedman ranks them).
///
/// One slice per material holds an error per choice, in the same order. `None` without materials or
/// choices, where a material lacks a choice, and where an error is NaN.
pub fn mean_ranks(materials: &[&[f64]]) -> Option<Vec<f64>> {
    let choices = materials.first()?.len();
    let whole = |m: &&[f64]| m.len() == choices && !m.iter().any(|e| e.is_nan());
    if choices == 0 || !materials.iter().all(whole) {
        return None;
    }
    let mut sums = vec![0; choices];
    for errors in materials {
        for (sum, rank) in sums.iter_mut().zip(doubled_ranks(errors)) {
            *sum += rank;
        }
    }
    let n = materials.len() as f64;
    Some(sums.iter().map(|s| *s as f64 / 2.0 / n).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_share_their_ranks() {
        // scipy.stats.rankdata([3, 1, 3, 0, 3, 1]) = [5, 2.5, 5, 1, 5, 2.5]
        let ranks = doubled_ranks(&[3.0, 1.0, 3.0, 0.0, 3.0, 1.0]);
        assert_eq!(ranks, [10, 5, 10, 2, 10, 5]);
        // Zeros of both signs are equal.
        assert_eq!(doubled_ranks(&[0.0, -0.0]), [3, 3]);
    }

    #[test]
    fn mean_ranks_of_a_small_table() {
        // Ranks 1 2 3, 2 1 3, 1 2.5 2.5.
        let table: [&[f64]; 3] = [&[0.1, 0.2, 0.3], &[5.0, 4.0, 6.0], &[1.0, 2.0, 2.0]];
        let ranks = mean_ranks(&table).unwrap();
        let expected = [4.0 / 3.0, 5.5 / 3.0, 8.5 / 3.0];
        for (r, e) in ranks.iter().zip(expected) {
            assert!((r - e).abs() < 1e-15, "{r} {e}");
        }
        assert_eq!(mean_ranks(&[]), None);
        assert_eq!(mean_ranks(&[&[1.0, 2.0], &[1.0]]), None);
        assert_eq!(mean_ranks(&[&[1.0, f64::NAN]]), None);
    }
}
