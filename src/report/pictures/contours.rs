//! Isolines of values on a lattice, by marching squares.

use std::collections::BTreeMap;

/// Lines along which the values, linear between neighbours, are `level`: points (column, row) in
/// steps of the lattice, closed lines with their first point again at the end. Squares with a
/// corner that has no value hold no line.
pub(super) fn isolines(values: &[Option<f64>], columns: usize, level: f64) -> Vec<Vec<[f64; 2]>> {
    let rows = values.len() / columns.max(1);
    // An edge is twice its first corner, plus one if it goes down; it has one crossing at most,
    // shared by the squares on both of its sides.
    let mut crossings: BTreeMap<usize, Crossing> = BTreeMap::new();
    for row in 1..rows {
        for column in 1..columns {
            let a = (row - 1) * columns + column - 1;
            let corners = [a, a + 1, a + columns + 1, a + columns];
            let [p, q, r, s] = corners;
            let (Some(p), Some(q), Some(r), Some(s)) = (values[p], values[q], values[r], values[s])
            else {
                continue;
            };
            let value = [p, q, r, s];
            let above = [p >= level, q >= level, r >= level, s >= level];
            // Most squares hold no line.
            if above == [above[0]; 4] {
                continue;
            }
            let edges = [2 * a, 2 * (a + 1) + 1, 2 * (a + columns), 2 * a + 1];
            let crossed = |i: usize| above[i] != above[(i + 1) % 4];
            let cut: Vec<usize> = (0..4).filter(|&i| crossed(i)).collect();
            let joined: &[[usize; 2]] = match cut[..] {
                [i, k] => &[[i, k]],
                // A saddle: the value in the middle decides which corners are connected.
                [_, _, _, _] if (value.iter().sum::<f64>() >= 4.0 * level) == above[0] => {
                    &[[0, 1], [2, 3]]
                }
                [_, _, _, _] => &[[3, 0], [1, 2]],
                _ => &[],
            };
            for [i, k] in joined {
                for (i, other) in [(*i, edges[*k]), (*k, edges[*i])] {
                    let (from, to) = (corners[i], corners[(i + 1) % 4]);
                    let (from, to) = (from.min(to), from.max(to));
                    let crossing = crossings.entry(edges[i]).or_insert_with(|| {
                        let place = |i: usize| [(i % columns) as f64, (i / columns) as f64];
                        let [u, v] = [from, to].map(|i| values[i].unwrap_or(level));
                        let t = ((level - u) / (v - u)).clamp(0.0, 1.0);
                        let (a, b) = (place(from), place(to));
                        Crossing {
                            at: [0, 1].map(|d| a[d] + t * (b[d] - a[d])),
                            next: Vec::new(),
                        }
                    });
                    crossing.next.push(other);
                }
            }
        }
    }
    let ends = crossings.iter().filter(|(_, c)| c.next.len() == 1);
    let ends: Vec<usize> = ends.map(|(edge, _)| *edge).collect();
    let all: Vec<usize> = crossings.keys().copied().collect();
    let mut lines = Vec::new();
    // Open lines from their ends, then what is left: closed ones.
    for start in ends.into_iter().chain(all) {
        let line = walk(&mut crossings, start);
        if line.len() > 1 {
            lines.push(line);
        }
    }
    lines
}

/// The crossing of a line and an edge of the lattice.
struct Crossing {
    at: [f64; 2],
    /// The edges on which it goes on, one or two; taken out as the line is walked.
    next: Vec<usize>,
}

fn walk(crossings: &mut BTreeMap<usize, Crossing>, start: usize) -> Vec<[f64; 2]> {
    let mut line = Vec::new();
    let mut here = start;
    while let Some(crossing) = crossings.get_mut(&here) {
        line.push(crossing.at);
        let Some(next) = crossing.next.pop() else {
            break;
        };
        if let Some(other) = crossings.get_mut(&next) {
            other.next.retain(|edge| *edge != here);
        }
        here = next;
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(columns: usize, rows: usize, f: impl Fn(f64, f64) -> f64) -> Vec<Option<f64>> {
        let nodes = (0..columns * rows).map(|i| ((i % columns) as f64, (i / columns) as f64));
        nodes.map(|(x, y)| Some(f(x, y))).collect()
    }

    #[test]
    fn planes_have_straight_lines() {
        let values = field(7, 5, |x, y| 2.0 * x - y + 0.25);
        let [line] = &isolines(&values, 7, 3.5)[..] else {
            panic!("one line");
        };
        for [x, y] in line {
            assert!((2.0 * x - y + 0.25 - 3.5).abs() < 1e-12);
        }
        // From edge to edge of the lattice.
        let ends = [line[0], line[line.len() - 1]].map(|p| p[1]);
        assert!(ends.contains(&0.0) && ends.contains(&4.0), "{ends:?}");
        assert!(isolines(&values, 7, 100.0).is_empty());
    }

    #[test]
    fn circles_close() {
        let values = field(81, 81, |x, y| (x - 40.0).hypot(y - 40.0));
        let [line] = &isolines(&values, 81, 30.2)[..] else {
            panic!("one line");
        };
        assert_eq!(line[0], line[line.len() - 1]);
        for [x, y] in line {
            // Linear between neighbours: the error is the curvature, (1/8)/30.
            assert!(((x - 40.0).hypot(y - 40.0) - 30.2).abs() < 0.006);
        }
        let length: f64 = line
            .windows(2)
            .map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]))
            .sum();
        assert!((length / (std::f64::consts::TAU * 30.2) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn every_segment_is_drawn_once_around_saddles_and_holes() {
        let mut values = field(30, 30, |x, y| (0.7 * x).sin() * (0.7 * y).cos());
        values[7 * 30 + 11] = None;
        let lines = isolines(&values, 30, 0.01);
        let mut segments = Vec::new();
        for line in &lines {
            for w in line.windows(2) {
                let mut ends = [w[0], w[1]].map(|p| p.map(f64::to_bits));
                ends.sort_unstable();
                segments.push(ends);
                // None enters a square of the missing corner.
                let [x, y] = [0, 1].map(|d| 0.5 * (w[0][d] + w[1][d]));
                assert!((x - 11.0).abs() > 1.0 || (y - 7.0).abs() > 1.0);
            }
        }
        let count = segments.len();
        segments.sort_unstable();
        segments.dedup();
        assert_eq!(segments.len(), count);
        assert!(count > 200);
    }
}
