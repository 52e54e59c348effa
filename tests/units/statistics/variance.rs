use gonio::statistics::{Shares, variance_shares};
use nalgebra::DVector;
use std::collections::BTreeSet;

/// All combinations of these numbers of levels, with values of theirs.
fn balanced(counts: &[usize], value: impl Fn(&[usize]) -> f64) -> Vec<(Vec<usize>, f64)> {
    let rows = counts.iter().product();
    let row = |mut i: usize| {
        let levels: Vec<usize> = counts
            .iter()
            .map(|c| {
                let level = i % c;
                i /= c;
                level
            })
            .collect();
        let value = value(&levels);
        (levels, value)
    };
    (0..rows).map(row).collect()
}

fn borrowed(rows: &[(Vec<usize>, f64)]) -> Vec<(&[usize], f64)> {
    rows.iter().map(|(l, v)| (l.as_slice(), *v)).collect()
}

fn shares(rows: &[(Vec<usize>, f64)]) -> Option<Shares> {
    variance_shares(&borrowed(rows))
}

fn assert_shares(found: &Shares, mains: &[f64], pairs: &[f64], rest: f64, tolerance: f64) {
    let got = found.mains.iter().chain(found.pairs.iter().map(|p| &p.2));
    let got: Vec<f64> = got.copied().chain([found.rest]).collect();
    let expected = [mains, pairs, &[rest]].concat();
    assert_eq!(got.len(), expected.len());
    for (g, e) in got.iter().zip(&expected) {
        assert!((g - e).abs() < tolerance, "{found:?}: {expected:?}");
    }
    let told: f64 = expected.iter().sum();
    assert!((found.entangled - (1.0 - told)).abs() < 10.0 * tolerance);
}

/// The residual sum of squares of a least-squares fit by the means of the levels of some factors, or of their combinations.
fn left(rows: &[(Vec<usize>, f64)], terms: &[Vec<usize>]) -> f64 {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let off = |mut column: DVector<f64>, basis: &[DVector<f64>]| {
        // Once more for what rounding has left.
        for b in basis.iter().chain(basis) {
            column.axpy(-b.dot(&column), b, 1.0);
        }
        column
    };
    for term in terms {
        let of = |(levels, _): &(Vec<usize>, f64)| term.iter().map(|f| levels[*f]).collect();
        let cells: Vec<Vec<usize>> = rows.iter().map(of).collect();
        for cell in cells.iter().collect::<BTreeSet<_>>() {
            let is = cells.iter().map(|c| f64::from(u8::from(c == cell)));
            let column = off(DVector::from_iterator(rows.len(), is), &basis);
            if column.norm() > 1e-6 {
                basis.push(column.normalize());
            }
        }
    }
    let values = DVector::from_iterator(rows.len(), rows.iter().map(|(_, v)| *v));
    off(values, &basis).norm_squared()
}

/// Asserts that each term has the share of the residual that it takes off that of the others: a factor of those without
/// it, a pair of all.
fn assert_least_squares(rows: &[(Vec<usize>, f64)]) {
    let factors = rows[0].0.len();
    let pairs = (0..factors).flat_map(|b| (0..b).map(move |a| vec![a, b]));
    let terms: Vec<_> = (0..factors).map(|f| vec![f]).chain(pairs).collect();
    let (total, rest) = (left(rows, &[vec![]]), left(rows, &terms));
    let share = |term: &Vec<usize>| {
        let mut others = terms.clone();
        others.retain(|t| match term[..] {
            [factor] => !t.contains(&factor),
            _ => t != term,
        });
        others.push(vec![]);
        let without = left(rows, &others);
        others.push(term.clone());
        (without - left(rows, &others)) / total
    };
    let found = shares(rows).unwrap();
    let named = found.pairs.iter().map(|p| vec![p.0, p.1]);
    assert!(terms[factors..].iter().cloned().eq(named), "{found:?}");
    assert!((found.variance * rows.len() as f64 / total - 1.0).abs() < 1e-12);
    let shares = found.mains.iter().chain(found.pairs.iter().map(|p| &p.2));
    for (term, got) in terms.iter().zip(shares) {
        let want = share(term);
        assert!((got - want).abs() < 1e-12, "{term:?}: {got} {want}");
    }
    let told: f64 = terms.iter().map(share).sum::<f64>() + rest / total;
    assert!((found.rest - rest / total).abs() < 1e-12);
    assert!((found.entangled + told - 1.0).abs() < 1e-11);
}

#[test]
fn data_with_gaps_and_without_are_as_least_squares_has_them() {
    let value = |l: &[usize], [a, b, c]: [usize; 3]| {
        let k = (l[a] + 5 * l[b] + 15 * l[c]) as f64;
        3.0 + (k * k).sin() + 0.5 * l[a] as f64 - 0.3 * (l[b] * l[c]) as f64
    };
    // Without every fifth row.
    let gaps = balanced(&[4, 3, 2], |l| value(l, [0, 1, 2]));
    let gaps = gaps.into_iter().enumerate().filter(|(i, _)| i % 5 != 4);
    let mut gaps: Vec<_> = gaps.map(|(_, row)| row).collect();
    assert_least_squares(&gaps);
    let found = shares(&gaps).unwrap();
    // Neither the order of rows nor the names of levels matter.
    gaps.iter_mut()
        .for_each(|(l, _)| l.iter_mut().for_each(|l| *l = 100 - 7 * *l));
    gaps.reverse();
    let named = shares(&gaps).unwrap();
    let pairs: Vec<f64> = found.pairs.iter().map(|p| p.2).collect();
    assert_shares(&named, &found.mains, &pairs, found.rest, 1e-13);
    // Balanced, twice every row, with scatter; then a row too many, one too few, one in the place of another.
    let mut twice = balanced(&[5, 3, 1, 4], |l| value(l, [0, 1, 3]));
    twice.extend(twice.clone().into_iter().map(|(l, v)| (l, v + v.cos())));
    assert_least_squares(&twice);
    // Then they add up.
    assert!(shares(&twice).unwrap().entangled.abs() < 1e-10);
    assert_least_squares(&twice[1..]);
    let more = [&twice[..], &twice[7..8]].concat();
    assert_least_squares(&more);
    twice[3].0 = twice[4].0.clone();
    assert_least_squares(&twice);
    // The second factor alone is crossed; the others lack combinations, have some twice, and one is named by another.
    let mut rows = balanced(&[5, 7, 4, 2], |l| value(l, [0, 1, 2]));
    rows.retain(|(l, _)| (3 * l[0] + 5 * l[2] + l[3]) % 4 != 0);
    let again = rows.clone().into_iter().filter(|(l, _)| l[0] == 2);
    rows.extend(again.map(|(l, v)| (l, v + v.cos())));
    rows.iter_mut().for_each(|(l, _)| l.push(9 - l[2]));
    assert_least_squares(&rows);
}

#[test]
fn factors_that_cannot_be_told_apart() {
    // The second factor is the first by another name: neither explains what the other does not.
    let rows: Vec<_> = (0..12)
        .map(|i| (vec![i % 3, 2 - i % 3], f64::from(i as u32 % 3)))
        .collect();
    let found = shares(&rows).unwrap();
    assert_shares(&found, &[0.0, 0.0], &[0.0], 0.0, 1e-14);
    assert!((found.entangled - 1.0).abs() < 1e-13);
    // A factor of one level explains nothing.
    let rows: Vec<_> = (0..4).map(|i| (vec![i, 5], i as f64)).collect();
    let found = shares(&rows).unwrap();
    assert_shares(&found, &[1.0, 0.0], &[0.0], 0.0, 1e-14);
}

#[test]
fn nothing_to_explain() {
    let same: Vec<_> = (0..9).map(|i| (vec![i % 3, i / 3], 0.1)).collect();
    assert_eq!(shares(&same), None);
    assert_eq!(shares(&[]), None);
    assert_eq!(shares(&[(vec![0], 1.0)]), None);
    assert_eq!(shares(&[(vec![0], 1.0), (vec![1, 0], 2.0)]), None);
    assert_eq!(shares(&[(vec![0], 1.0), (vec![1], f64::NAN)]), None);
    // No factors: all is rest.
    let found = shares(&[(vec![], 1.0), (vec![], 2.0)]).unwrap();
    assert_shares(&found, &[], &[], 1.0, 1e-15);
}
