//! Shapes of arrays, which broadcast as NumPy's do.

use crate::errors::refused;
use gonio::error::listed;
use pyo3::prelude::*;

/// A shape as Python writes it.
pub fn tuple(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        several => format!("({})", listed(several)),
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
        let [(a, m), (b, n)] = [a, b].map(|(name, shape, _)| (name, tuple(shape)));
        refused(format!(
            "{a} has the shape {m} and {b} has {n}; allowed: shapes that broadcast"
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
            i
        });
        let index: Vec<usize> = index.collect();
        format!("[{}]", listed(index.iter().rev()))
    }
}
