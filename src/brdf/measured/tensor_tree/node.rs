//! Octrees whose leaves are as large as they can be.

use std::io::{self, Write};

/// Part of a tree: one value for all of its cube, or its eight halves along each axis. Bit k of the number of a part is set in
/// the upper half of axis k.
#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    /// The value; NaN without data.
    Leaf(f64),
    /// The parts.
    Parts(Box<[Node; 8]>),
}

/// A node, and what it was made of.
pub(super) struct Built {
    pub node: Node,
    /// Mean of its values that are there.
    mean: f64,
    /// Mean of their squares.
    square: f64,
    /// Their share.
    share: f64,
}

impl Built {
    /// A finest cell; NaN is none.
    pub(crate) fn cell(value: f64) -> Self {
        let is_there = !value.is_nan();
        let held = if is_there { value } else { 0.0 };
        Self {
            node: Node::Leaf(value),
            mean: held,
            square: held * held,
            share: f64::from(u8::from(is_there)),
        }
    }

    /// Eight parts, or one leaf if all are leaves and `is_one` of mean and standard deviation. A leaf without a value gets the
    /// mean of those around it.
    pub(crate) fn from_parts(mut parts: [Built; 8], is_one: impl Fn(f64, f64) -> bool) -> Self {
        let share: f64 = parts.iter().map(|p| p.share).sum();
        let over = |of: fn(&Built) -> f64| {
            let sum: f64 = parts.iter().map(|p| p.share * of(p)).sum();
            if share > 0.0 { sum / share } else { 0.0 }
        };
        let (mean, square) = (over(|p| p.mean), over(|p| p.square));
        let deviation = (square - mean * mean).max(0.0).sqrt();
        let are_leaves = parts.iter().all(|p| matches!(p.node, Node::Leaf(_)));
        let node = if share == 0.0 {
            Node::Leaf(f64::NAN)
        } else if are_leaves && is_one(mean, deviation) {
            Node::Leaf(mean)
        } else {
            for part in &mut parts {
                if matches!(part.node, Node::Leaf(value) if value.is_nan()) {
                    part.node = Node::Leaf(mean);
                }
            }
            Node::Parts(Box::new(parts.map(|p| p.node)))
        };
        Self {
            node,
            mean,
            square,
            share: share / 8.0,
        }
    }
}

/// The number of the part that a point of [0, 1)³ is in, and its place there.
fn descend(place: [f64; 3]) -> (usize, [f64; 3]) {
    let upper = place.map(|x| x >= 0.5);
    let part = (0..3).fold(0, |part, k| part | usize::from(upper[k]) << k);
    let inner = |k: usize| 2.0 * place[k] - f64::from(u8::from(upper[k]));
    (part, std::array::from_fn(inner))
}

impl Node {
    /// The value at a point of [0, 1)³, by going down the tree; NaN without data.
    pub fn value_at(&self, mut place: [f64; 3]) -> f64 {
        let mut node = self;
        loop {
            match node {
                Node::Leaf(value) => return *value,
                Node::Parts(parts) => {
                    let part;
                    (part, place) = descend(place);
                    node = &parts[part];
                }
            }
        }
    }

    /// The leaf that holds a point of [0, 1)³.
    pub(super) fn leaf(&mut self, place: [f64; 3]) -> &mut f64 {
        match self {
            Node::Leaf(value) => value,
            Node::Parts(parts) => {
                let (part, place) = descend(place);
                parts[part].leaf(place)
            }
        }
    }

    /// Visits the value of each leaf, parts in the order of their numbers.
    pub(super) fn for_each_leaf(&mut self, visit: &mut dyn FnMut(&mut f64)) {
        match self {
            Node::Leaf(value) => visit(value),
            Node::Parts(parts) => {
                for part in parts.iter_mut() {
                    part.for_each_leaf(visit);
                }
            }
        }
    }

    /// The values of the leaves, in that order.
    pub(super) fn values(&self) -> Vec<f64> {
        match self {
            Node::Leaf(value) => vec![*value],
            Node::Parts(parts) => parts.iter().flat_map(Node::values).collect(),
        }
    }

    /// Number of leaves.
    pub fn leaves(&self) -> usize {
        self.values().len()
    }

    /// The smallest value.
    pub(crate) fn least(&self) -> f64 {
        match self {
            Node::Leaf(value) => *value,
            Node::Parts(parts) => parts.iter().map(Node::least).fold(f64::INFINITY, f64::min),
        }
    }

    /// Makes 0 of the cell, `halvings` below this node, that holds a point of [0, 1)³.
    pub(crate) fn clear(&mut self, place: [f64; 3], halvings: usize) {
        if halvings == 0 {
            *self = Node::Leaf(0.0);
            return;
        }
        if let Node::Leaf(value) = *self {
            *self = Node::Parts(Box::new(std::array::from_fn(|_| Node::Leaf(value))));
        }
        if let Node::Parts(parts) = self {
            let (part, place) = descend(place);
            parts[part].clear(place, halvings - 1);
        }
    }

    /// Writes braces and numbers as Radiance reads them: parts in the order of their numbers; eight leaves as one grid, whose
    /// last axis runs fastest.
    pub(super) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        match self {
            Node::Leaf(value) => write!(out, "{{{}}}", number(*value)),
            Node::Parts(parts) => {
                let leaf = |part: usize| match parts[part] {
                    Node::Leaf(value) => Some(value),
                    Node::Parts(_) => None,
                };
                let grid = [0, 4, 2, 6, 1, 5, 3, 7].map(leaf);
                if grid.iter().all(Option::is_some) {
                    let numbers = grid.into_iter().flatten().map(number);
                    return write!(out, "{{{}}}", numbers.collect::<Vec<_>>().join(" "));
                }
                out.write_all(b"{\n")?;
                for part in parts.iter() {
                    part.write(out)?;
                }
                out.write_all(b"}\n")
            }
        }
    }
}

/// Four digits, in as few letters as they need.
fn number(value: f64) -> String {
    let exponential = format!("{value:.3e}");
    // What was just written is a number.
    let rounded: f64 = exponential.parse().unwrap_or(value);
    let plain = rounded.to_string();
    let plain = match plain.strip_prefix("0.") {
        Some(rest) => format!(".{rest}"),
        None => plain,
    };
    let short = format!("{rounded:e}");
    if plain.len() <= short.len() {
        plain
    } else {
        short
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_good_to_four_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.012_345, ".01235"),
            (123.449, "123.4"),
            (1.5e-7, "1.5e-7"),
            (54_321.0, "54320"),
            (2e9, "2e9"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn equal_parts_are_one_and_gaps_are_filled() {
        let of = |values: [f64; 8], most: f64| {
            Built::from_parts(values.map(Built::cell), |_, deviation| deviation <= most).node
        };
        assert_eq!(of([2.0; 8], 0.0), Node::Leaf(2.0));
        let mut values = [1.0; 8];
        values[3] = 5.0;
        values[0] = f64::NAN;
        // The mean of seven values fills the gap.
        let tree = of(values, 0.1);
        assert_eq!(tree.value_at([0.1, 0.2, 0.3]), 11.0 / 7.0);
        assert_eq!(tree.value_at([0.6, 0.7, 0.3]), 5.0);
        assert_eq!(tree.value_at([0.6, 0.7, 0.6]), 1.0);
        assert_eq!((tree.leaves(), tree.least()), (8, 1.0));
        assert!(of([f64::NAN; 8], 0.1).value_at([0.5; 3]).is_nan());
        let mut text = Vec::new();
        tree.write(&mut text).unwrap();
        // x upper, s upper, t lower is the seventh number.
        assert_eq!(text, b"{1.571 1 1 1 1 1 5 1}");
        let mut leaf = Node::Leaf(2.0);
        leaf.clear([0.1, 0.3, 0.6], 2);
        let values = [0.1, 0.3].map(|x| leaf.value_at([x, 0.3, 0.6]));
        assert_eq!((leaf.leaves(), values), (15, [0.0, 2.0]));
    }
}
