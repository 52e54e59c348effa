//! Local search on a path: 2-opt and Or-opt over lists of neighbours, with a queue of the places
//! that are worth another look (Bentley 1992, *Fast algorithms for geometric traveling salesman
//! problems*), then an iterated local search: exchange two neighbouring pieces of the path, repair
//! what that broke, keep the result if it is no longer than before (Johnson & McGeoch 1997, *The
//! traveling salesman problem: a case study in local optimization*).
//!
//! The open path is a closed tour through two more places: rest, which comes first, and an end
//! that is 0 s from everywhere. The step from the end to rest is worth keeping at any price. On a
//! closed tour a piece can be turned round by turning round all the others, whichever is less.

use super::super::motion::Travel;
use super::FAR;
use crate::numeric::tree::Tree;
use crate::sampling::{Random, RandomStream};
use crate::schedule::Positions;
use std::collections::VecDeque;

/// Neighbours that a place looks at.
const NEIGHBOURS: usize = 10;

/// Longest piece that Or-opt moves.
const LONGEST: usize = 3;

/// Gains below this are rounding, s.
const LEAST: f64 = 1e-9;

/// Longest piece that a kick exchanges.
const PIECE: usize = 50;

/// Kicks per place.
const KICKS: usize = 3;

/// Kicks at most: what they gain per second falls when they no longer meet again.
const MOST_KICKS: usize = 200_000;

/// Places on the longest piece that is turned round to repair a kick.
const REPAIR: usize = 1000;

/// Shortens a path over `points`, each of which it visits once.
pub(super) fn improve(
    travel: &Travel,
    rest: &Positions,
    points: &[Positions],
    path: Vec<u32>,
) -> Vec<u32> {
    if path.is_empty() {
        return path;
    }
    // Places are numbered along the path: what is near in space is then near in memory.
    let mut places = vec![*rest];
    places.extend(path.iter().map(|&i| points[i as usize]));
    let mut search = Search::new(travel, &places);
    (0..search.end()).for_each(|place| search.queue(place));
    search.repair();
    search.kick();
    let shorter = search.path();
    shorter.map(|place| path[place as usize - 1]).collect()
}

struct Search<'a> {
    travel: &'a Travel,
    places: &'a [Positions],
    /// Neighbours of each place, nearest first; `u32::MAX` where there are not so many.
    neighbours: Vec<[u32; NEIGHBOURS]>,
    tour: Tour,
    queue: VecDeque<u32>,
    queued: Vec<bool>,
}

impl<'a> Search<'a> {
    fn new(travel: &'a Travel, places: &'a [Positions]) -> Self {
        let tree = Tree::new(travel, places);
        let mut found = Vec::new();
        let neighbours = (0..places.len() as u32).map(|i| {
            let mut list = [u32::MAX; NEIGHBOURS];
            // The place itself is one of them, or others that are no way off.
            tree.nearest(&places[i as usize], NEIGHBOURS + 1, FAR, &mut found);
            let others = found.iter().map(|near| near.number).filter(|&n| n != i);
            for (slot, n) in list.iter_mut().zip(others) {
                *slot = n;
            }
            list
        });
        Self {
            travel,
            places,
            neighbours: neighbours.collect(),
            tour: Tour::new(places.len() + 1),
            queue: VecDeque::with_capacity(places.len() + 1),
            queued: vec![false; places.len() + 1],
        }
    }

    #[inline]
    fn end(&self) -> u32 {
        self.places.len() as u32
    }

    #[inline]
    fn cost(&self, a: u32, b: u32) -> f64 {
        let place = |i: u32| &self.places[i as usize];
        match (a.max(b) == self.end(), a.min(b)) {
            (true, 0) => f64::NEG_INFINITY,
            (true, _) => 0.0,
            (false, _) => self.travel.seconds(place(a), place(b)),
        }
    }

    /// Neighbours of a place, nearest first.
    #[inline]
    fn neighbours(&self, place: u32) -> impl Iterator<Item = u32> + use<> {
        let list = self.neighbours[place as usize].into_iter();
        list.take_while(|&n| n != u32::MAX)
    }

    fn queue(&mut self, place: u32) {
        if !std::mem::replace(&mut self.queued[place as usize], true) {
            self.queue.push_back(place);
        }
    }

    /// Improves until no place in the queue is left; returns the seconds saved.
    fn repair(&mut self) -> f64 {
        let mut saved = 0.0;
        while let Some(place) = self.queue.pop_front() {
            self.queued[place as usize] = false;
            if place == self.end() {
                continue;
            }
            while let Some(gain) = self.two_opt(place).or_else(|| self.or_opt(place)) {
                saved += gain;
            }
        }
        saved
    }

    /// Two steps, one of them at `a`, become two others, one from `a` to a neighbour.
    fn two_opt(&mut self, a: u32) -> Option<f64> {
        for forwards in [true, false] {
            let b = self.tour.beside(a, forwards);
            let ab = self.cost(a, b);
            for c in self.neighbours(a) {
                let ac = self.cost(a, c);
                if ac >= ab {
                    break;
                }
                let d = self.tour.beside(c, forwards);
                let gain = ab + self.cost(c, d) - ac - self.cost(b, d);
                if gain > LEAST && self.tour.near(a, c) {
                    self.tour.exchange([a, b, c]);
                    [a, b, c, d].into_iter().for_each(|i| self.queue(i));
                    return Some(gain);
                }
            }
        }
        None
    }

    /// A piece of up to [`LONGEST`] places that begins with `first` moves to where `first` has a
    /// neighbour beside it.
    fn or_opt(&mut self, first: u32) -> Option<f64> {
        for forwards in [true, false] {
            let before = self.tour.beside(first, !forwards);
            let mut piece = [first; LONGEST];
            for length in 1..=LONGEST {
                if length > 1 {
                    piece[length - 1] = self.tour.beside(piece[length - 2], forwards);
                }
                let last = piece[length - 1];
                let after = self.tour.beside(last, forwards);
                if after == before || last == before {
                    break;
                }
                let cut = self.cost(before, first) + self.cost(last, after);
                let free = cut - self.cost(before, after);
                if !(free > LEAST) {
                    continue;
                }
                for c in self.neighbours(first) {
                    let to = self.cost(first, c);
                    if to >= free {
                        break;
                    }
                    if piece[..length].contains(&c) {
                        continue;
                    }
                    for beyond in [true, false] {
                        // The step from c to d takes the piece in.
                        let d = self.tour.beside(c, beyond);
                        if piece[..length].contains(&d) {
                            continue;
                        }
                        let gain = free + self.cost(c, d) - to - self.cost(last, d);
                        if gain > LEAST && self.tour.near(first, c) {
                            let ends = [before, first, last, after, c, d];
                            self.tour.insert(ends, forwards, beyond);
                            ends.into_iter().for_each(|i| self.queue(i));
                            return Some(gain);
                        }
                    }
                }
            }
        }
        None
    }

    /// Exchanges two neighbouring pieces, over and over, and keeps what does not lengthen the path.
    fn kick(&mut self) {
        let n = self.tour.order.len();
        if n < 5 {
            return;
        }
        let mut random = Random::new(0).stream(0);
        self.tour.longest = REPAIR;
        for _ in 0..(KICKS * n).min(MOST_KICKS) {
            let longest = PIECE.min((n - 2) / 2);
            let start = below(&mut random, n);
            let [one, two] = [0; 2].map(|_| 1 + below(&mut random, longest));
            let at = |i: usize| self.tour.order[(start + i) % n];
            let [a, b] = [at(0), at(1)];
            let [c, d] = [at(one), at(one + 1)];
            let [e, f] = [at(one + two), at(one + two + 1)];
            let cut = self.cost(a, b) + self.cost(c, d) + self.cost(e, f);
            let lost = self.cost(a, d) + self.cost(e, b) + self.cost(c, f) - cut;
            // Never between the end and rest.
            if !lost.is_finite() {
                continue;
            }
            self.tour.log.clear();
            // a [b…c] [d…e] f: both together, then each by itself.
            self.tour.turn(start + 1, one + two);
            self.tour.turn(start + 1, two);
            self.tour.turn(start + 1 + two, one);
            [a, b, c, d, e, f].into_iter().for_each(|i| self.queue(i));
            if self.repair() < lost {
                self.tour.undo();
            }
        }
    }

    /// The places from rest to the end, without both.
    fn path(&self) -> impl Iterator<Item = u32> {
        let forwards = self.tour.beside(0, false) == self.end();
        let mut place = 0;
        (1..self.end()).map(move |_| {
            place = self.tour.beside(place, forwards);
            place
        })
    }
}

/// A number in `0..n`.
fn below(random: &mut RandomStream, n: usize) -> usize {
    (random.next() * n as f64) as usize
}

struct Tour {
    order: Vec<u32>,
    /// Position in `order` of each place.
    at: Vec<u32>,
    /// Pieces longer than this are not turned round.
    longest: usize,
    /// Pieces turned since the last kick: start and length.
    log: Vec<(u32, u32)>,
}

impl Tour {
    fn new(n: usize) -> Self {
        Self {
            order: (0..n as u32).collect(),
            at: (0..n as u32).collect(),
            longest: n,
            log: Vec::new(),
        }
    }

    /// The next place, or the one before.
    #[inline]
    fn beside(&self, place: u32, forwards: bool) -> u32 {
        let (at, n) = (self.at[place as usize] as usize, self.order.len());
        let next = match forwards {
            true if at + 1 == n => 0,
            true => at + 1,
            false if at == 0 => n - 1,
            false => at - 1,
        };
        self.order[next]
    }

    /// True if the pieces between two places may be turned round.
    #[inline]
    fn near(&self, a: u32, b: u32) -> bool {
        let apart = self.at[a as usize].abs_diff(self.at[b as usize]) as usize;
        apart.min(self.order.len() - apart) <= self.longest
    }

    /// The steps a–b and c–d become a–c and b–d. `b` follows `a` in the direction in which `d`
    /// follows `c`.
    fn exchange(&mut self, [a, b, c]: [u32; 3]) {
        let ends = match self.beside(a, true) == b {
            true => [b, c],
            false => [c, b],
        };
        let [from, to] = ends.map(|i| self.at[i as usize] as usize);
        let n = self.order.len();
        let inside = (to + n - from) % n + 1;
        // Inside out or outside in: the tour is the same.
        if 2 * inside <= n {
            self.turn(from, inside);
        } else {
            self.turn(to + 1, n - inside);
        }
    }

    /// The piece `first…last` leaves its place between `before` and `after` for the step between
    /// `c` and `d`, and `first` comes beside `c`. `forwards` is the direction from `first` to
    /// `last`, `beyond` that from `c` to `d`.
    fn insert(&mut self, ends: [u32; 6], forwards: bool, beyond: bool) {
        let [before, first, last, after, c, d] = ends;
        let same = forwards == beyond;
        let x = if same { c } else { d };
        // before [first…last] after … x y
        self.exchange([before, first, x]);
        // before x … after [last…first] y
        self.exchange([before, x, after]);
        // before after … x [last…first] y
        if same {
            self.exchange([x, last, first]);
        }
    }

    /// Turns `length` places from `start` on round.
    fn turn(&mut self, start: usize, length: usize) {
        let n = self.order.len();
        let (mut i, mut j) = (start % n, (start + length + n - 1) % n);
        for _ in 0..length / 2 {
            self.order.swap(i, j);
            self.at[self.order[i] as usize] = i as u32;
            self.at[self.order[j] as usize] = j as u32;
            i = if i + 1 == n { 0 } else { i + 1 };
            j = if j == 0 { n - 1 } else { j - 1 };
        }
        self.log.push(((start % n) as u32, length as u32));
    }

    /// Takes back everything since the last kick.
    fn undo(&mut self) {
        while let Some((start, length)) = self.log.pop() {
            self.turn(start as usize, length as usize);
            self.log.pop();
        }
    }
}
