//! The regular lattice of a grid in the box of a parametrization.

use crate::parametrization::{Axis, AxisKind, Coords};
use serde::{Deserialize, Serialize};

/// Positions of the nodes of an axis; `n` nodes, unit coordinate u in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Centring {
    /// u = (j + ½)/n: in the middle of n equal cells.
    Cell,
    /// u = j/(n − 1): on both ends. On a periodic axis, whose ends are one place, u = j/n.
    Node,
    /// u = j/(n − ½): on the start, half a cell from the end. For radial axes with a peak at 0.
    Start,
}

/// An axis of a lattice: axis value = origin + index coordinate × step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LatticeAxis {
    /// Number of nodes, at least 1.
    pub n: usize,
    /// Axis value of node 0.
    pub origin: f64,
    /// Distance between nodes in axis units (the whole range if there is one node).
    pub step: f64,
    /// True if node n is node 0 again.
    pub periodic: bool,
}

impl LatticeAxis {
    /// `n` nodes over the range of `axis`.
    pub fn new(axis: &Axis, centring: Centring, n: usize) -> Self {
        let count = n as f64;
        let periodic = axis.kind == AxisKind::Periodic;
        let (first, cells) = match centring {
            Centring::Cell => (0.5, count),
            Centring::Node if periodic => (0.0, count),
            Centring::Node => (0.0, (count - 1.0).max(1.0)),
            Centring::Start => (0.0, count - 0.5),
        };
        let step = axis.length() / cells;
        Self {
            n,
            origin: axis.range[0] + first * step,
            step,
            periodic,
        }
    }

    /// True if all nodes lie in the range of `axis`, as those of a grid do.
    pub(super) fn fits(&self, axis: &Axis) -> bool {
        let slack = 1e-9 * axis.length();
        let [lo, hi] = axis.range;
        let last = self.value(self.n.saturating_sub(1) as f64);
        // Written so that NaN fails.
        let inside = self.origin >= lo - slack && last <= hi + slack;
        self.n > 0
            && self.step > 0.0
            && inside
            && self.periodic == (axis.kind == AxisKind::Periodic)
    }

    /// Axis value at an index coordinate (node numbers are integers; may be negative).
    #[inline]
    pub fn value(&self, index: f64) -> f64 {
        self.origin + index * self.step
    }

    /// Index coordinate of an axis value.
    #[inline]
    pub fn index(&self, value: f64) -> f64 {
        (value - self.origin) / self.step
    }
}

/// A regular lattice over the box of a parametrization.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// One per axis of the parametrization; the last runs fastest.
    pub axes: Vec<LatticeAxis>,
    /// For each node: the pose that measures it, if it is physical. Nodes that name the same
    /// configuration share a pose.
    pub pose: Vec<Option<u32>>,
}

impl Lattice {
    /// Number of nodes along each axis.
    pub fn shape(&self) -> Vec<usize> {
        self.axes.iter().map(|a| a.n).collect()
    }

    /// Node number of integer indices; periodic axes wrap, `None` outside the others.
    pub fn node(&self, index: &[i64]) -> Option<usize> {
        node(&self.axes, index)
    }

    /// Coordinates at integer indices, inside or outside the box.
    pub fn coords(&self, index: &[i64]) -> Coords {
        coords(&self.axes, index)
    }
}

fn node(axes: &[LatticeAxis], index: &[i64]) -> Option<usize> {
    let mut node = 0;
    for (axis, &i) in axes.iter().zip(index) {
        let n = axis.n as i64;
        let i = if axis.periodic { i.rem_euclid(n) } else { i };
        if !(0..n).contains(&i) {
            return None;
        }
        node = node * axis.n + i as usize;
    }
    Some(node)
}

/// Number of the node at coordinates; `None` if they are further from the next one than a share `same` of an axis.
pub(super) fn node_at(axes: &[LatticeAxis], coords: &Coords, same: f64) -> Option<usize> {
    let mut index = [0; 4];
    for ((index, axis), &c) in index.iter_mut().zip(axes).zip(coords) {
        let at = axis.index(c);
        let near = at.round();
        if !((at - near).abs() <= same * axis.n as f64) {
            return None;
        }
        *index = near as i64;
    }
    node(axes, &index[..axes.len()])
}

pub(super) fn coords(axes: &[LatticeAxis], index: &[i64]) -> Coords {
    let mut c = [0.0; 4];
    for ((c, axis), &i) in c.iter_mut().zip(axes).zip(index) {
        *c = axis.value(i as f64);
    }
    c
}

/// Calls `visit` with the indices of every node of a box, last axis fastest.
pub fn for_each_node(shape: &[usize], mut visit: impl FnMut(&[i64])) {
    each_node_while(shape, |index| {
        visit(index);
        true
    });
}

/// [`for_each_node`] until `visit` returns false.
pub(super) fn each_node_while(shape: &[usize], mut visit: impl FnMut(&[i64]) -> bool) {
    let mut index = vec![0i64; shape.len()];
    let total: usize = shape.iter().product();
    for _ in 0..total {
        if !visit(&index) {
            return;
        }
        for (i, &n) in index.iter_mut().zip(shape).rev() {
            *i += 1;
            if *i < n as i64 {
                break;
            }
            *i = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visiting_stops_when_told() {
        let mut seen = Vec::new();
        each_node_while(&[2, 3], |index| {
            seen.push(index.to_vec());
            seen.len() < 4
        });
        assert_eq!(seen, [[0, 0], [0, 1], [0, 2], [1, 0]]);
    }
}
