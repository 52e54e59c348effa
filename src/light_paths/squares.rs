//! Things in squares of a plane, found by where they are.

/// Equal parts of [−1, 1] along each axis.
#[derive(Clone, Copy)]
pub(super) struct Squares {
    /// Parts along an axis.
    pub across: usize,
    /// Parts for each unit.
    pub per_unit: f64,
}

impl Squares {
    /// Parts of a width, at most so many along an axis.
    pub(super) fn new(width: f64, most: f64) -> Self {
        let across = (2.0 / width).clamp(1.0, most) as usize;
        Self {
            across,
            per_unit: across as f64 / 2.0,
        }
    }

    /// The part of a component.
    pub(super) fn part(&self, x: f64) -> usize {
        (((x + 1.0) * self.per_unit) as usize).min(self.across - 1)
    }

    /// The number of the square of a place, the last axis fastest.
    pub(super) fn index<const N: usize>(&self, at: [f64; N]) -> usize {
        let parts = at.into_iter().map(|x| self.part(x));
        parts.fold(0, |index, part| index * self.across + part)
    }
}

/// The number of the first thing of each square, from the square of each, as they lie in the order of their squares; one more
/// at the end.
pub(super) fn firsts(squares: usize, of_each: impl Iterator<Item = usize>) -> Vec<u32> {
    let mut first = vec![0; squares + 1];
    of_each.for_each(|square| first[square + 1] += 1);
    for i in 1..first.len() {
        first[i] += first[i - 1];
    }
    first
}
