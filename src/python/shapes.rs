//! Shapes of arrays, which broadcast as NumPy's do.

use crate::errors::refused;
use pyo3::prelude::*;

/// A shape as Python writes it.
pub fn tuple(shape: &[usize]) -> String {
    let lengths: Vec<String> = shape.iter().map(usize::to_string).collect();
    match lengths.as_slice() {
        [one] => format!("({one},)"),
        several => format!("({})", several.join(", ")),
    }
}

/// The lengths of an array before its last `tail` axes; one row where there are none.
pub fn batch(shape: &[usize], tail: usize) -> &[usize] {
    match &shape[..shape.len() - tail] {
        [] => &[1],
        lengths => lengths,
    }
}

/// The shape that two arguments have together, as NumPy broadcasts: each with its name, its shape, and how many of its last
/// axes a row has.
pub fn broadcast(a: (&str, &[usize], usize), b: (&str, &[usize], usize)) -> PyResult<Vec<usize>> {
    let (m, n) = (batch(a.1, a.2), batch(b.1, b.2));
    let axes = m.len().max(n.len());
    let length = |of: &[usize], i: usize| (i + of.len()).checked_sub(axes).map_or(1, |i| of[i]);
    let both = (0..axes).map(|i| match (length(m, i), length(n, i)) {
        (1, n) | (n, 1) => Some(n),
        (m, n) => (m == n).then_some(n),
    });
    both.collect::<Option<_>>().ok_or_else(|| {
        refused(format!(
            "{} has the shape {} and {} has {}; allowed: shapes that broadcast",
            a.0,
            tuple(a.1),
            b.0,
            tuple(b.1)
        ))
    })
}

/// Where the rows of a broadcast shape are in an array.
#[derive(Clone, Copy)]
pub struct Along<'a> {
    /// Lengths of the array, without those of a row.
    pub own: &'a [usize],
    /// The shape that it is broadcast to.
    pub to: &'a [usize],
}

impl<'a> Along<'a> {
    /// An array of a shape, the last axes of which are of a row.
    pub fn new(shape: &'a [usize], tail: usize, to: &'a [usize]) -> Self {
        let own = batch(shape, tail);
        Self { own, to }
    }

    /// The number in the array of a row.
    pub fn at(&self, row: usize) -> usize {
        let (mut rest, mut at, mut step) = (row, 0, 1);
        let own = self.own.iter().rev().chain(std::iter::repeat(&1));
        for (&length, &own) in self.to.iter().rev().zip(own) {
            if own > 1 {
                at += rest % length * step;
                step *= own;
            }
            rest /= length;
        }
        at
    }

    /// The index in the array of a row, as Python writes it.
    pub fn index(&self, row: usize) -> String {
        let mut rest = self.at(row);
        let index = self.own.iter().rev().map(|&length| {
            let i = rest % length;
            rest /= length;
            i.to_string()
        });
        let mut index: Vec<String> = index.collect();
        index.reverse();
        format!("[{}]", index.join(", "))
    }
}
