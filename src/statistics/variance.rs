//! Analysis of variance: the share of the variance that each factor explains.

use nalgebra::DMatrix;
use std::ops::Range;

/// A column is a sum of earlier ones where less than this share of its square is left by them.
/// Rounding leaves 1e-13; a column of a design with a cell in a million filled differently 1e-6.
const ALIASED: f64 = 1e-9;

/// Shares of the total variance, each at least 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Shares {
    /// Number of levels of each factor; a factor of a single level explains nothing.
    pub levels: Vec<usize>,
    /// Share that each factor explains by itself, in the order of `levels`.
    pub mains: Vec<f64>,
    /// Share that two factors explain together beyond each by itself: (first, second, share), first < second.
    pub pairs: Vec<(usize, usize, f64)>,
    /// Residual share: interactions of three and more, and scatter between rows of equal levels.
    pub rest: f64,
    /// 1 − all the others, as combinations are missing or filled unevenly; negative where factors mask one another.
    pub entangled: f64,
    /// The total variance: the mean square of the values about their mean.
    pub variance: f64,
}

/// Splits the variance of values among factors and pairs of factors, from rows of (a level of every
/// factor, value); levels are any numbers, values usually ln error.
///
/// Sums of squares of type II: a factor gets what it takes off the residual of a least-squares fit by all other factors and
/// pairs without it; a pair what it takes off that by everything else. On balanced data (all combinations of levels, equally
/// often) this is the classical decomposition, and the shares add up to 1. On data with gaps it asks nothing of missing
/// combinations, unlike type III, and does not depend on an order, unlike type I.
///
/// `None` with fewer than two rows, rows of different lengths, a value that is not finite, or values all equal.
///
/// A factor is *crossed* where each of its levels has the same rows of the others. What is constant along it and what
/// differs are orthogonal: terms without it see the means over its levels; it and its pairs see the deviations from
/// these, a fit by single factors for each level. Cost: rows · factors² and for each level of a crossed factor
/// factors · columns³ / 3 of the single factors; of those that are not crossed, rows · factors⁴ / 4 +
/// factors² · columns³ / 12, where columns is about the number of cells of all two-way tables.
pub fn variance_shares(rows: &[(&[usize], f64)]) -> Option<Shares> {
    let factors = rows.first()?.0.len();
    let whole = |(levels, value): &(&[usize], f64)| levels.len() == factors && value.is_finite();
    if !rows.iter().all(whole) {
        return None;
    }
    let n = rows.len() as f64;
    let mean = rows.iter().map(|(_, v)| v).sum::<f64>() / n;
    let total: f64 = rows.iter().map(|(_, v)| (v - mean).powi(2)).sum();
    // Equal values may be off their mean by rounding.
    if total <= n * (1e-14 * mean).powi(2) {
        return None;
    }
    let levels = Levels::new(rows);
    let values: Vec<f64> = rows.iter().map(|(_, v)| v - mean).collect();
    let Squares { mains, pairs, rest } = Squares::new(&levels, values);
    let share = |taken: f64| taken.max(0.0) / total;
    let mains: Vec<f64> = mains.into_iter().map(share).collect();
    let pairs = pairs.into_iter().map(|(a, b, taken)| (a, b, share(taken)));
    let pairs: Vec<_> = pairs.collect();
    let rest = share(rest);
    let attributed = mains.iter().sum::<f64>() + pairs.iter().map(|p| p.2).sum::<f64>() + rest;
    Some(Shares {
        levels: levels.counts,
        mains,
        pairs,
        rest,
        entangled: 1.0 - attributed,
        variance: total / n,
    })
}

/// Sums of squares: that of each term, and the residual.
struct Squares {
    mains: Vec<f64>,
    pairs: Vec<(usize, usize, f64)>,
    rest: f64,
}

impl Squares {
    /// Of values whose mean is 0.
    fn new(levels: &Levels, values: Vec<f64>) -> Self {
        let Some((factor, order)) = levels.crossed() else {
            return Design::new(levels, &values, true).squares();
        };
        let count = levels.counts[factor];
        let each = order.len() / count;
        let mut means = vec![0.0; each];
        for of_level in order.chunks_exact(each) {
            for (mean, &row) in means.iter_mut().zip(of_level) {
                *mean += values[row] / count as f64;
            }
        }
        let deviations = order.chunks_exact(each).map(|of_level| {
            let deviation = |(row, mean): (&usize, &f64)| values[*row] - mean;
            of_level.iter().zip(&means).map(deviation).collect()
        });
        let deviations: Vec<Vec<f64>> = deviations.collect();
        let others = levels.without(factor, &order[..each]);
        let own = deviations.iter().map(|d| d.iter().sum::<f64>().powi(2));
        let own = own.sum::<f64>() / each as f64;
        // Fits of different levels have nothing to do with each other.
        let mut with_others = vec![0.0; levels.counts.len()];
        let mut rest = 0.0;
        for deviation in &deviations {
            let of_level = Design::new(&others, deviation, false).squares();
            rest += of_level.rest;
            for (sum, taken) in with_others.iter_mut().zip(of_level.mains) {
                *sum += taken;
            }
        }
        let mut squares = Self::new(&others, means);
        let rows = count as f64;
        squares.mains.iter_mut().for_each(|main| *main *= rows);
        squares.mains[factor] = own;
        for (a, b, taken) in &mut squares.pairs {
            *taken = match (*a == factor, *b == factor) {
                (true, _) => with_others[*b],
                (_, true) => with_others[*a],
                _ => *taken * rows,
            };
        }
        squares.rest = squares.rest * rows + rest;
        squares
    }
}

/// The levels of every row, counted from 0 without gaps.
struct Levels {
    counts: Vec<usize>,
    /// Levels, row after row.
    places: Vec<usize>,
}

impl Levels {
    fn new(rows: &[(&[usize], f64)]) -> Self {
        let factors = rows[0].0.len();
        let named: Vec<Vec<usize>> = (0..factors)
            .map(|f| {
                let mut named: Vec<usize> = rows.iter().map(|(row, _)| row[f]).collect();
                named.sort_unstable();
                named.dedup();
                named
            })
            .collect();
        let place = |(f, level): (usize, &usize)| named[f].partition_point(|l| l < level);
        let places = |(row, _): &(&[usize], f64)| -> Vec<usize> {
            row.iter().enumerate().map(place).collect()
        };
        Self {
            places: rows.iter().flat_map(places).collect(),
            counts: named.iter().map(Vec::len).collect(),
        }
    }

    fn row(&self, row: usize) -> &[usize] {
        let factors = self.counts.len();
        &self.places[row * factors..(row + 1) * factors]
    }

    /// The factor of most levels that have the same rows of the others; its rows, level after level, those of each in one order.
    fn crossed(&self) -> Option<(usize, Vec<usize>)> {
        let rows = self.places.len() / self.counts.len().max(1);
        let mut factors: Vec<usize> = (0..self.counts.len()).collect();
        factors.retain(|f| self.counts[*f] > 1 && rows.is_multiple_of(self.counts[*f]));
        factors.sort_by_key(|f| std::cmp::Reverse(self.counts[*f]));
        factors.into_iter().find_map(|factor| {
            let each = rows / self.counts[factor];
            let others = |row: usize| {
                let (before, rest) = self.row(row).split_at(factor);
                (before, &rest[1..])
            };
            let mut order: Vec<usize> = (0..rows).collect();
            order.sort_by_key(|&row| (self.row(row)[factor], others(row), row));
            let is_crossed = (0..rows).all(|i| {
                let at = self.row(order[i])[factor];
                at == i / each && others(order[i]) == others(order[i % each])
            });
            is_crossed.then_some((factor, order))
        })
    }

    /// Some of the rows, and one level of a factor for all.
    fn without(&self, factor: usize, rows: &[usize]) -> Self {
        let mut counts = self.counts.clone();
        counts[factor] = 1;
        let mut places: Vec<usize> = rows.iter().flat_map(|&r| self.row(r)).copied().collect();
        for row in places.chunks_exact_mut(counts.len()) {
            row[factor] = 0;
        }
        Self { counts, places }
    }
}

/// A factor (both the same) or a pair of factors, and its columns.
#[derive(PartialEq)]
struct Term {
    first: usize,
    second: usize,
    columns: Range<usize>,
}

/// The normal equations of all terms at once.
struct Design {
    terms: Vec<Term>,
    /// Products of all columns: the constant, those of the terms, and last the values.
    gram: DMatrix<f64>,
}

impl Design {
    /// A factor of L levels has L − 1 columns, 1 on their level and 0 elsewhere; a pair has the products of theirs.
    fn new(levels: &Levels, values: &[f64], with_pairs: bool) -> Self {
        let factors = levels.counts.len();
        let mut terms = vec![];
        let mut next = 1;
        let mains = (0..factors).map(|f| (f, f));
        let paired = if with_pairs { factors } else { 0 };
        let pairs = (0..paired).flat_map(|b| (0..b).map(move |a| (a, b)));
        for (first, second) in mains.chain(pairs) {
            let mut count = levels.counts[first] - 1;
            if first != second {
                count *= levels.counts[second] - 1;
            }
            let columns = next..next + count;
            next = columns.end;
            terms.push(Term {
                first,
                second,
                columns,
            });
        }
        let mut gram = DMatrix::zeros(next + 1, next + 1);
        let mut entries = vec![];
        for (row, value) in values.iter().enumerate() {
            let places = levels.row(row);
            entries.clear();
            entries.push((0, 1.0));
            for term in &terms {
                // The first level has no column.
                let (a, b) = (places[term.first], places[term.second]);
                if a == 0 || b == 0 {
                    continue;
                }
                let column = if term.first == term.second {
                    a - 1
                } else {
                    (a - 1) * (levels.counts[term.second] - 1) + b - 1
                };
                entries.push((term.columns.start + column, 1.0));
            }
            entries.push((next, *value));
            for &(i, x) in &entries {
                for &(j, y) in &entries {
                    gram[(i, j)] += x * y;
                }
            }
        }
        Self { terms, gram }
    }

    /// Sums of squares by which each term lowers the residual of the others.
    fn squares(&self) -> Squares {
        let all = || self.terms.iter();
        let taken = |term: &Term, others: &dyn Fn(&&Term) -> bool| {
            // A factor of one level takes nothing.
            if term.columns.is_empty() {
                return 0.0;
            }
            let (without, with) = self.residuals(all().filter(others), [term]);
            without - with
        };
        let mains = all().filter(|t| t.first == t.second);
        let mains = mains.map(|main| taken(main, &|t| ![t.first, t.second].contains(&main.first)));
        let pairs = all().filter(|t| t.first != t.second);
        let pairs = pairs.map(|pair| (pair.first, pair.second, taken(pair, &|t| *t != pair)));
        Squares {
            mains: mains.collect(),
            pairs: pairs.collect(),
            rest: self.residuals(all(), []).1,
        }
    }

    /// The residual sums of squares of fits by some terms, and by these and some more.
    fn residuals<'a>(
        &self,
        some: impl Iterator<Item = &'a Term>,
        more: impl IntoIterator<Item = &'a Term>,
    ) -> (f64, f64) {
        let mut columns = vec![0];
        columns.extend(some.flat_map(|t| t.columns.clone()));
        let some = columns.len();
        columns.extend(more.into_iter().flat_map(|t| t.columns.clone()));
        let last = columns.len();
        columns.push(self.gram.nrows() - 1);
        let all = columns.len();
        let mut left = DMatrix::from_fn(all, all, |i, j| self.gram[(columns[i], columns[j])]);
        let size = left.diagonal();
        let mut without = left[(last, last)];
        // Gauss's elimination leaves in the corner what the columns so far do not explain.
        for k in 0..last {
            let pivot = left[(k, k)];
            if pivot > ALIASED * size[k] {
                // The lower triangle is enough.
                let (done, mut ahead) = left.columns_range_pair_mut(k, k + 1..);
                for i in k + 1..all {
                    let factor = done[i] / pivot;
                    if factor != 0.0 {
                        let mut column = ahead.column_mut(i - k - 1);
                        let mut below = column.rows_range_mut(i..);
                        below.axpy(-factor, &done.rows_range(i..), 1.0);
                    }
                }
            }
            if k + 1 == some {
                without = left[(last, last)];
            }
        }
        (without, left[(last, last)])
    }
}
