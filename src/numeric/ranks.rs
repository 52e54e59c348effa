//! Ranks of values; ties share the mean of theirs.

/// Twice the rank of every value, the least being 1; equal values share the mean of their ranks, so
/// that twice of it is a whole number.
pub(crate) fn doubled_ranks(values: &[f64]) -> Vec<usize> {
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
