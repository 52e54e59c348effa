//! A k-d tree under the metric of travel times, from which points can be taken.
//!
//! Times grow with the way of every axis, so the time to the nearest point of a box bounds the
//! times to all points in it: the search is exact in the true metric, on axes that wrap as well,
//! without images of points or a metric in their place.

use super::super::motion::Travel;
use crate::schedule::{MAX_AXES, Positions};

/// Points per leaf.
const LEAF: usize = 8;

/// Order of points by distance: less is nearer.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Nearness {
    /// Square of the travel time, s².
    time: f64,
    /// Sum of the squares of all axes: among equal times the way that moves least. On a lattice
    /// most times are equal, and neighbours along its axes are better than any others.
    all: f64,
    number: u32,
}

impl Nearness {
    fn of(squares: &Positions, number: u32) -> Self {
        Self {
            time: squares.iter().copied().fold(0.0, f64::max),
            all: squares.iter().sum(),
            number,
        }
    }

    const FAR: Self = Self {
        time: f64::INFINITY,
        all: f64::INFINITY,
        number: u32::MAX,
    };
}

struct Node {
    low: Positions,
    high: Positions,
    parent: u32,
    /// Number of the first child, the second follows; 0 in a leaf.
    children: u32,
    /// The points of a leaf in `numbers`: those that are left come first.
    start: u32,
    /// Points that are left below.
    left: u32,
}

/// The tree.
pub(super) struct Tree<'a> {
    travel: &'a Travel,
    points: &'a [Positions],
    /// Numbers of the points, leaf by leaf.
    numbers: Vec<u32>,
    /// The leaf of each point.
    leaf: Vec<u32>,
    nodes: Vec<Node>,
    stack: Vec<(u32, f64)>,
}

impl<'a> Tree<'a> {
    pub fn new(travel: &'a Travel, points: &'a [Positions]) -> Self {
        let mut tree = Self {
            travel,
            points,
            numbers: (0..points.len() as u32).collect(),
            leaf: vec![0; points.len()],
            nodes: Vec::with_capacity(points.len() / 2 + 1),
            stack: Vec::new(),
        };
        let root = tree.node(0, points.len(), 0);
        tree.nodes.push(root);
        // Children are appended behind their parents: one pass over a growing list.
        let mut at = 0;
        while at < tree.nodes.len() {
            tree.split(at);
            at += 1;
        }
        tree
    }

    fn node(&self, start: usize, count: usize, parent: u32) -> Node {
        let (mut low, mut high) = ([f64::INFINITY; MAX_AXES], [f64::NEG_INFINITY; MAX_AXES]);
        for &i in &self.numbers[start..start + count] {
            for (j, &x) in self.points[i as usize].iter().enumerate() {
                low[j] = low[j].min(x);
                high[j] = high[j].max(x);
            }
        }
        Node {
            low,
            high,
            parent,
            children: 0,
            start: start as u32,
            left: count as u32,
        }
    }

    /// Halves a node across the axis that takes longest from end to end.
    fn split(&mut self, at: usize) {
        let Node { start, left, .. } = self.nodes[at];
        let (start, count) = (start as usize, left as usize);
        let range = start..start + count;
        if count <= LEAF {
            for &i in &self.numbers[range] {
                self.leaf[i as usize] = at as u32;
            }
            return;
        }
        let (low, high) = (self.nodes[at].low, self.nodes[at].high);
        let width = |j: usize| (high[j] - low[j]) / self.travel.speed(j);
        let axis = (1..MAX_AXES).fold(0, |best, j| if width(j) > width(best) { j } else { best });
        let points = self.points;
        self.numbers[range].select_nth_unstable_by(count / 2, |&a, &b| {
            let [x, y] = [a, b].map(|i| points[i as usize][axis]);
            x.total_cmp(&y).then(a.cmp(&b))
        });
        self.nodes[at].children = self.nodes.len() as u32;
        let half = count / 2;
        for (start, count) in [(start, half), (start + half, count - half)] {
            let child = self.node(start, count, at as u32);
            self.nodes.push(child);
        }
    }

    /// Takes a point out.
    pub fn remove(&mut self, number: u32) {
        let mut at = self.leaf[number as usize] as usize;
        let node = &self.nodes[at];
        let start = node.start as usize;
        let left = &mut self.numbers[start..start + node.left as usize];
        if let Some(i) = left.iter().position(|&n| n == number) {
            left.swap(i, node.left as usize - 1);
        }
        loop {
            self.nodes[at].left -= 1;
            if at == 0 {
                break;
            }
            at = self.nodes[at].parent as usize;
        }
    }

    /// Number of the nearest point that is left.
    pub fn nearest(&mut self, from: &Positions) -> Option<u32> {
        let mut best = [Nearness::FAR];
        self.search(from, &mut best);
        (best[0].number != u32::MAX).then_some(best[0].number)
    }

    /// Numbers of the nearest points to point `of`, without itself, nearest first.
    pub fn neighbours<const K: usize>(&mut self, of: u32) -> impl Iterator<Item = u32> {
        // `K` others and the point itself, which may have company at travel time 0.
        let mut best = vec![Nearness::FAR; K + 1];
        let from = self.points[of as usize];
        self.search(&from, &mut best);
        best.into_iter()
            .map(|b| b.number)
            .filter(move |&n| n != of && n != u32::MAX)
            .take(K)
    }

    /// Fills `best`, which is sorted, nearest first.
    fn search(&mut self, from: &Positions, best: &mut [Nearness]) {
        let last = best.len() - 1;
        let mut stack = std::mem::take(&mut self.stack);
        stack.push((0, 0.0));
        while let Some((at, bound)) = stack.pop() {
            // An equal bound may hold an equal time with a lesser sum or number.
            if bound > best[last].time {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.children == 0 {
                let start = node.start as usize;
                for &number in &self.numbers[start..start + node.left as usize] {
                    let squares = self.travel.squares(from, &self.points[number as usize]);
                    let found = Nearness::of(&squares, number);
                    if found < best[last] {
                        let place = best.partition_point(|b| *b < found);
                        best[place..].rotate_right(1);
                        best[place] = found;
                    }
                }
                continue;
            }
            let [mut near, mut far] = [node.children, node.children + 1].map(|c| {
                let child = &self.nodes[c as usize];
                let squares = self.travel.squares_to_box(from, &child.low, &child.high);
                (c, squares.into_iter().fold(0.0, f64::max))
            });
            if far.1 < near.1 {
                std::mem::swap(&mut near, &mut far);
            }
            for child in [far, near] {
                if self.nodes[child.0 as usize].left > 0 && child.1 <= best[last].time {
                    stack.push(child);
                }
            }
        }
        self.stack = stack;
    }
}
