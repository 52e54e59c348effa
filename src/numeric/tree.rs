//! A k-d tree, under any metric whose distances grow with the way along every axis.
//!
//! The distance to the nearest place of a box bounds those to all points in it: the search is exact in the metric itself,
//! rounding included, on axes that wrap as well. Points are found in the order of their distances, and of their numbers where
//! these are equal, so that nothing depends on where the tree divides them.

use rayon::iter::{IndexedParallelIterator, IntoParallelRefMutIterator, ParallelIterator};
use smallvec::SmallVec;
use std::array::from_fn;
use std::cmp::Ordering;

/// Points per leaf.
const LEAF: usize = 16;

/// Neighbours up to which the list is kept sorted, as reconstructions ask for by default.
const FEW: usize = 32;

/// A way to measure distances of points with `K` coordinates.
pub(crate) trait Metric<const K: usize> {
    /// Order of points by nearness: less is nearer.
    type Distance: Copy + PartialOrd;

    /// The distance of two points.
    fn distance(&self, from: &[f64; K], to: &[f64; K]) -> Self::Distance;

    /// The distances of the points of a leaf, whose coordinates are given axis by axis.
    #[inline(always)]
    fn distances(&self, from: &[f64; K], to: &[[f64; LEAF]; K]) -> [Self::Distance; LEAF] {
        from_fn(|i| self.distance(from, &from_fn(|d| to[d][i])))
    }

    /// What of a distance [`to_box`](Self::to_box) bounds.
    fn bounded(distance: Self::Distance) -> f64;

    /// No more than what is [bounded](Self::bounded) of the distance to any point of a box.
    fn to_box(&self, from: &[f64; K], low: &[f64; K], high: &[f64; K]) -> f64;

    /// Lower bounds of two boxes, as [`to_box`](Self::to_box).
    #[inline(always)]
    fn to_boxes(&self, from: &[f64; K], low: &[[f64; 2]; K], high: &[[f64; 2]; K]) -> [f64; 2] {
        from_fn(|i| self.to_box(from, &from_fn(|d| low[d][i]), &from_fn(|d| high[d][i])))
    }

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

    // No `from_fn`: it is a call that vector instructions end at.
    #[inline(always)]
    fn distances(&self, from: &[f64; K], to: &[[f64; LEAF]; K]) -> [f64; LEAF] {
        let mut sums = [0.0; LEAF];
        for (from, to) in from.iter().zip(to) {
            for i in 0..LEAF {
                sums[i] += (from - to[i]) * (from - to[i]);
            }
        }
        sums
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

    /// Puts it into a list of the `count` nearest, nearest first; the last of a full list.
    #[inline(always)]
    pub(crate) fn among(self, count: usize, found: &mut Vec<Self>) -> Option<Self>
    where
        D: Copy,
    {
        if found.len() < count {
            found.push(self);
        } else if !self.is_before(&found[count - 1]) {
            return Some(found[count - 1]);
        }
        let mut place = found.len() - 1;
        while place > 0 && self.is_before(&found[place - 1]) {
            found[place] = found[place - 1];
            place -= 1;
        }
        found[place] = self;
        (found.len() == count).then(|| found[count - 1])
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

/// Stands for no number of a node.
const NONE: u32 = u32::MAX;

/// Two parts of the points, with what lies in each.
struct Node<const K: usize> {
    /// The boxes of both, axis by axis.
    low: [[f64; 2]; K],
    high: [[f64; 2]; K],
    /// Numbers of the nodes that divide them further, or `!number` of a leaf.
    children: [i32; 2],
    /// Points that are left in them.
    left: [u32; 2],
    parent: u32,
}

/// Points, axis by axis: several distances are computed at once.
struct Leaf<const K: usize> {
    at: [[f64; LEAF]; K],
    number: [u32; LEAF],
    /// Points that are left: they come first.
    left: u32,
    parent: u32,
}

impl<const K: usize> Leaf<K> {
    fn new(points: &[Point<K>], parent: u32) -> Self {
        let mut leaf = Self {
            at: [[0.0; LEAF]; K],
            number: [0; LEAF],
            left: points.len() as u32,
            parent,
        };
        for (i, point) in points.iter().enumerate() {
            leaf.number[i] = point.number;
            for (axis, &x) in leaf.at.iter_mut().zip(&point.at) {
                axis[i] = x;
            }
        }
        leaf
    }
}

pub(crate) struct Tree<const K: usize, M> {
    metric: M,
    /// From the root on, level by level; none if all points are in one leaf.
    nodes: Vec<Node<K>>,
    leaves: Vec<Leaf<K>>,
}

/// Points of one task, about.
const TASK: usize = 1 << 14;

/// Points of the first half: whole leaves, so that all but the last leaf are full.
fn half(points: usize) -> usize {
    (points / 2).next_multiple_of(LEAF)
}

/// Points that are to be a leaf, or a node with what is below it.
struct Part<'a, const K: usize> {
    points: &'a mut [Point<K>],
    parent: u32,
    /// Which child of the parent it is.
    side: usize,
}

impl<const K: usize> Part<'_, K> {
    /// The box of the points. Of more than a leaf holds, half are put before the others along the axis on which it is longest.
    fn divide(&mut self, metric: &impl Metric<K>) -> ([f64; K], [f64; K]) {
        let (mut low, mut high) = ([f64::INFINITY; K], [f64::NEG_INFINITY; K]);
        for point in &*self.points {
            for (d, &x) in point.at.iter().enumerate() {
                low[d] = low[d].min(x);
                high[d] = high[d].max(x);
            }
        }
        if self.points.len() > LEAF {
            let length = |d: usize| metric.length(d, low[d], high[d]);
            let longer = |best, d| if length(d) > length(best) { d } else { best };
            let axis = (1..K).fold(0, longer);
            let half = half(self.points.len());
            self.points.select_nth_unstable_by(half, |a, b| {
                a.at[axis]
                    .total_cmp(&b.at[axis])
                    .then(a.number.cmp(&b.number))
            });
        }
        (low, high)
    }
}

impl<const K: usize, M: Metric<K>> Tree<K, M> {
    /// Of finite points, which are numbered in their order. Level by level, the parts of a level on all cores.
    pub(crate) fn new(metric: M, points: &[[f64; K]]) -> Self
    where
        M: Sync,
    {
        let numbered = points.iter().zip(0..);
        let mut points: Vec<_> = numbered.map(|(&at, number)| Point { at, number }).collect();
        let mut nodes: Vec<Node<K>> = Vec::with_capacity(points.len().div_ceil(LEAF));
        let mut leaves = Vec::with_capacity(nodes.capacity() + 1);
        let mut level = vec![Part {
            points: &mut points,
            parent: NONE,
            side: 0,
        }];
        while !level.is_empty() {
            let of_task = (TASK / level[0].points.len().max(1)).max(1);
            let parts = level.par_iter_mut().with_min_len(of_task);
            let divided: Vec<_> = parts.map(|part| part.divide(&metric)).collect();
            let mut next = Vec::new();
            for (part, (low, high)) in level.into_iter().zip(divided) {
                let Part {
                    points,
                    parent,
                    side,
                } = part;
                let number =
                    if points.len() > LEAF {
                        let number = nodes.len() as u32;
                        let (left, right) = points.split_at_mut(half(points.len()));
                        nodes.push(Node {
                            low: [[0.0; 2]; K],
                            high: [[0.0; 2]; K],
                            children: [0; 2],
                            left: [left.len() as u32, right.len() as u32],
                            parent,
                        });
                        next.extend([left, right].into_iter().zip(0..).map(|(points, side)| {
                            Part {
                                points,
                                parent: number,
                                side,
                            }
                        }));
                        number as i32
                    } else {
                        leaves.push(Leaf::new(points, parent));
                        !(leaves.len() as i32 - 1)
                    };
                if let Some(node) = nodes.get_mut(parent as usize) {
                    node.children[side] = number;
                    for d in 0..K {
                        node.low[d][side] = low[d];
                        node.high[d][side] = high[d];
                    }
                }
            }
            level = next;
        }
        Self {
            metric,
            nodes,
            leaves,
        }
    }

    /// The leaf of each point, by its number.
    pub(crate) fn leaves(&self) -> Vec<u32> {
        let count: u32 = self.leaves.iter().map(|leaf| leaf.left).sum();
        let mut leaves = vec![0; count as usize];
        for (leaf, number) in self.leaves.iter().zip(0..) {
            for &point in &leaf.number[..leaf.left as usize] {
                leaves[point as usize] = number;
            }
        }
        leaves
    }

    /// Takes a point out of its leaf.
    pub(crate) fn remove(&mut self, number: u32, leaf: u32) {
        let mut child = !(leaf as i32);
        let leaf = &mut self.leaves[leaf as usize];
        let left = &leaf.number[..leaf.left as usize];
        let Some(place) = left.iter().position(|&point| point == number) else {
            return;
        };
        let last = left.len() - 1;
        leaf.number.swap(place, last);
        for axis in &mut leaf.at {
            axis.swap(place, last);
        }
        leaf.left -= 1;
        let mut parent = leaf.parent;
        while let Some(node) = self.nodes.get_mut(parent as usize) {
            node.left[usize::from(node.children[1] == child)] -= 1;
            (child, parent) = (parent as i32, node.parent);
        }
    }

    /// The number of the nearest point that is left and no farther than a distance, if there is one.
    #[inline]
    pub(crate) fn nearest_one(&self, from: &[f64; K], most: M::Distance) -> Option<u32> {
        let mut found = None;
        self.search(from, most, |near| {
            found = Some(near.number);
            Some(near)
        });
        found
    }

    /// Fills `found` with the nearest points that are left, nearest first: `count` (≥ 1) of them, or as many as lie up to a
    /// distance.
    #[inline(always)]
    pub(crate) fn nearest(
        &self,
        from: &[f64; K],
        count: usize,
        most: M::Distance,
        found: &mut Vec<Near<M::Distance>>,
    ) {
        found.clear();
        if count <= FEW {
            self.search(from, most, |near| near.among(count, found));
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

    /// Fills `found` with the points that are left up to a distance, in no order; with more than `count` of them it ends early.
    #[inline(always)]
    pub(crate) fn within(
        &self,
        from: &[f64; K],
        most: M::Distance,
        count: usize,
        found: &mut Vec<Near<M::Distance>>,
    ) {
        found.clear();
        self.search(from, most, |near| {
            found.push(near);
            // Nothing farther than the first is looked at any more.
            (found.len() > count).then(|| found[0])
        });
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
        let mut stack: SmallVec<[(i32, f64); 64]> = SmallVec::new();
        stack.push((if self.nodes.is_empty() { !0 } else { 0 }, 0.0));
        while let Some((mut at, bound)) = stack.pop() {
            let limit = M::bounded(within.distance);
            // A point at the same distance may have a lesser number.
            if bound > limit {
                continue;
            }
            // Down to a leaf, the nearer part first. The code stands twice: if the numbers of the parts are chosen instead of
            // the way, loads wait for the choice, and queries that follow each other, whose ways are alike, take 1.5 times
            // as long.
            while let Ok(number) = usize::try_from(at) {
                let Node {
                    low,
                    high,
                    children: [first, second],
                    left: [in_first, in_second],
                    ..
                } = &self.nodes[number];
                let [a, b] = self.metric.to_boxes(from, low, high);
                if b < a {
                    if a <= limit && *in_first > 0 {
                        stack.push((*first, a));
                    }
                    if b > limit || *in_second == 0 {
                        break;
                    }
                    at = *second;
                } else {
                    if b <= limit && *in_second > 0 {
                        stack.push((*second, b));
                    }
                    if a > limit || *in_first == 0 {
                        break;
                    }
                    at = *first;
                }
            }
            if at >= 0 {
                continue;
            }
            let leaf = &self.leaves[!at as usize];
            let distances = self.metric.distances(from, &leaf.at);
            // One bit for each that is near enough, so that the others cost no branch.
            let mut near_enough = 0_u32;
            for (i, distance) in distances.iter().enumerate() {
                near_enough |= u32::from(*distance <= within.distance) << i;
            }
            near_enough &= (1 << leaf.left) - 1;
            while near_enough > 0 {
                let i = near_enough.trailing_zeros() as usize;
                near_enough &= near_enough - 1;
                let near = Near {
                    distance: distances[i],
                    number: leaf.number[i],
                };
                if !near.is_before(&within) {
                    continue;
                }
                if let Some(farthest) = visit(near) {
                    within = farthest;
                }
            }
        }
    }
}
