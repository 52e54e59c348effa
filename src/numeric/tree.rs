//! A k-d tree, under any metric whose distances grow with the way along every axis.
//!
//! The distance to the nearest place of a box bounds those to all points in it: the search is exact in the metric itself,
//! rounding included, on axes that wrap as well. Points are found in the order of their distances, and of their numbers where
//! these are equal, so that nothing depends on where the tree divides them.

use smallvec::SmallVec;
use std::cmp::Ordering;

/// Points per leaf.
const LEAF: usize = 16;

/// Neighbours up to which the list is kept sorted, as reconstructions ask for by default.
const FEW: usize = 32;

/// A way to measure distances of points with `K` coordinates.
pub(crate) trait Metric<const K: usize> {
    /// What tells the nearer of two points: less is nearer.
    type Distance: Copy + PartialOrd;

    /// The distance of two points.
    fn distance(&self, from: &[f64; K], to: &[f64; K]) -> Self::Distance;

    /// What of a distance [`to_box`](Self::to_box) bounds.
    fn bounded(distance: Self::Distance) -> f64;

    /// No more than what is [bounded](Self::bounded) of the distance to any point of a box.
    fn to_box(&self, from: &[f64; K], low: &[f64; K], high: &[f64; K]) -> f64;

    /// Length of an axis: boxes are halved across the longest.
    fn length(&self, axis: usize, low: f64, high: f64) -> f64;
}

/// The larger of two numbers: one instruction, as `f64::max` with its care for NaN is not.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The squares of Euclid's distances.
pub(crate) struct Squared;

impl<const K: usize> Metric<K> for Squared {
    type Distance = f64;

    #[inline(always)]
    fn distance(&self, from: &[f64; K], to: &[f64; K]) -> f64 {
        (0..K).fold(0.0, |sum, d| sum + (from[d] - to[d]) * (from[d] - to[d]))
    }

    #[inline(always)]
    fn bounded(distance: f64) -> f64 {
        distance
    }

    #[inline(always)]
    fn to_box(&self, from: &[f64; K], low: &[f64; K], high: &[f64; K]) -> f64 {
        (0..K).fold(0.0, |sum, d| {
            let way = larger(larger(low[d] - from[d], from[d] - high[d]), 0.0);
            sum + way * way
        })
    }

    #[inline]
    fn length(&self, _axis: usize, low: f64, high: f64) -> f64 {
        high - low
    }
}

/// A point that was found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near<D> {
    pub distance: D,
    pub number: u32,
}

impl<D: PartialOrd> Near<D> {
    #[inline(always)]
    fn is_before(&self, other: &Self) -> bool {
        self.distance < other.distance
            || (self.distance == other.distance && self.number < other.number)
    }

    #[inline(always)]
    fn order(&self, other: &Self) -> Ordering {
        if self.is_before(other) {
            Ordering::Less
        } else {
            Ordering::Greater
        }
    }
}

#[derive(Clone, Copy)]
struct Point<const K: usize> {
    at: [f64; K],
    number: u32,
}

struct Node<const K: usize> {
    low: [f64; K],
    high: [f64; K],
    parent: u32,
    /// Number of the first child, the second follows; 0 in a leaf.
    children: u32,
    /// The points of a leaf: those that are left come first.
    start: u32,
    /// Points that are left below.
    left: u32,
}

impl<const K: usize> Node<K> {
    fn new(points: &[Point<K>], start: usize, parent: u32) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; K], [f64::NEG_INFINITY; K]);
        for point in points {
            for (d, &x) in point.at.iter().enumerate() {
                low[d] = low[d].min(x);
                high[d] = high[d].max(x);
            }
        }
        Self {
            low,
            high,
            parent,
            children: 0,
            start: start as u32,
            left: points.len() as u32,
        }
    }

    fn points(&self) -> std::ops::Range<usize> {
        self.start as usize..(self.start + self.left) as usize
    }
}

/// The tree.
pub(crate) struct Tree<const K: usize, M> {
    metric: M,
    /// Leaf by leaf.
    points: Vec<Point<K>>,
    nodes: Vec<Node<K>>,
}

impl<const K: usize, M: Metric<K>> Tree<K, M> {
    /// Of finite points, which are numbered in their order.
    pub fn new(metric: M, points: &[[f64; K]]) -> Self {
        let numbered = points.iter().zip(0..);
        let mut points: Vec<_> = numbered.map(|(&at, number)| Point { at, number }).collect();
        let mut nodes = Vec::with_capacity(points.len() / 2 + 1);
        nodes.push(Node::new(&points, 0, 0));
        // Children are appended behind their parents: one pass over a growing list.
        let mut at = 0;
        while at < nodes.len() {
            let node = &nodes[at];
            let range = node.points();
            if range.len() > LEAF {
                let length = |d: usize| metric.length(d, node.low[d], node.high[d]);
                let longer = |best, d| if length(d) > length(best) { d } else { best };
                let axis = (1..K).fold(0, longer);
                let half = range.len() / 2;
                let below = &mut points[range.clone()];
                below.select_nth_unstable_by(half, |a, b| {
                    a.at[axis]
                        .total_cmp(&b.at[axis])
                        .then(a.number.cmp(&b.number))
                });
                let (first, second) = below.split_at(half);
                nodes[at].children = nodes.len() as u32;
                nodes.push(Node::new(first, range.start, at as u32));
                nodes.push(Node::new(second, range.start + half, at as u32));
            }
            at += 1;
        }
        Self {
            metric,
            points,
            nodes,
        }
    }

    /// The leaf of each point, by its number.
    pub fn leaves(&self) -> Vec<u32> {
        let mut leaves = vec![0; self.points.len()];
        for (node, leaf) in self.nodes.iter().zip(0..) {
            if node.children == 0 {
                for point in &self.points[node.points()] {
                    leaves[point.number as usize] = leaf;
                }
            }
        }
        leaves
    }

    /// Takes a point out of its leaf.
    pub fn remove(&mut self, number: u32, leaf: u32) {
        let node = &self.nodes[leaf as usize];
        let left = &mut self.points[node.points()];
        let Some(place) = left.iter().position(|point| point.number == number) else {
            return;
        };
        left.swap(place, left.len() - 1);
        let mut at = leaf as usize;
        loop {
            self.nodes[at].left -= 1;
            if at == 0 {
                break;
            }
            at = self.nodes[at].parent as usize;
        }
    }

    /// The number of the nearest point that is left and no farther than a distance, if there is one.
    #[inline]
    pub fn nearest_one(&self, from: &[f64; K], most: M::Distance) -> Option<u32> {
        let mut found = None;
        self.search(from, most, |near| {
            found = Some(near.number);
            Some(near)
        });
        found
    }

    /// Fills `found` with the nearest points that are left, nearest first: `count` (≥ 1) of them, or as many as lie up to a
    /// distance.
    #[inline]
    pub fn nearest(
        &self,
        from: &[f64; K],
        count: usize,
        most: M::Distance,
        found: &mut Vec<Near<M::Distance>>,
    ) {
        found.clear();
        if count <= FEW {
            self.search(from, most, |near| {
                if found.len() < count {
                    found.push(near);
                }
                let mut place = found.len() - 1;
                while place > 0 && near.is_before(&found[place - 1]) {
                    found[place] = found[place - 1];
                    place -= 1;
                }
                found[place] = near;
                (found.len() == count).then(|| found[count - 1])
            });
            return;
        }
        // To sort once is faster than to keep a long list sorted.
        self.search(from, most, |near| {
            found.push(near);
            (found.len() == 2 * count).then(|| {
                found.select_nth_unstable_by(count - 1, Near::order);
                found.truncate(count);
                found[count - 1]
            })
        });
        found.sort_unstable_by(Near::order);
        found.truncate(count);
    }

    /// Visits points that are left up to a distance, those of near boxes first. `visit` returns the farthest that is still
    /// wanted, if it is another than before; points behind it are passed over.
    #[inline(always)]
    fn search(
        &self,
        from: &[f64; K],
        most: M::Distance,
        mut visit: impl FnMut(Near<M::Distance>) -> Option<Near<M::Distance>>,
    ) {
        let mut within = Near {
            distance: most,
            number: u32::MAX,
        };
        let mut stack: SmallVec<[(u32, f64); 64]> = SmallVec::new();
        stack.push((0, 0.0));
        while let Some((at, bound)) = stack.pop() {
            // A point at the same distance may have a lesser number.
            if bound > M::bounded(within.distance) {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.children == 0 {
                for point in &self.points[node.points()] {
                    let near = Near {
                        distance: self.metric.distance(from, &point.at),
                        number: point.number,
                    };
                    // One comparison for most.
                    if near.distance > within.distance || !near.is_before(&within) {
                        continue;
                    }
                    if let Some(farthest) = visit(near) {
                        within = farthest;
                    }
                }
                continue;
            }
            let [first, second] = [node.children, node.children + 1];
            let [a, b] = [&self.nodes[first as usize], &self.nodes[second as usize]];
            let to_a = self.metric.to_box(from, &a.low, &a.high);
            let to_b = self.metric.to_box(from, &b.low, &b.high);
            let mut push = |child: u32, left: u32, bound: f64| {
                if left > 0 && bound <= M::bounded(within.distance) {
                    stack.push((child, bound));
                }
            };
            // The nearer is taken next.
            if to_b < to_a {
                push(first, a.left, to_a);
                push(second, b.left, to_b);
            } else {
                push(second, b.left, to_b);
                push(first, a.left, to_a);
            }
        }
    }
}
