use gonio::statistics::{Shares, variance_shares};

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

#[test]
fn closed_forms_of_balanced_data() {
    // Signs ±1 of two-level factors and of their products are orthogonal: a part c of the value
    // has variance c². Factor 1 has the levels −1, 0, 1 of variance 2/3.
    let sign = |level: usize| [-1.0, 1.0][level];
    let rows = balanced(&[2, 3, 2], |l| {
        let (a, b, c) = (sign(l[0]), l[1] as f64 - 1.0, sign(l[2]));
        7.0 + 3.0 * a + 2.0 * b + a * b + 0.5 * a * c + 0.25 * a * b * c
    });
    let parts = [9.0, 8.0 / 3.0, 0.0, 2.0 / 3.0, 0.25, 0.0, 1.0 / 24.0];
    let total: f64 = parts.iter().sum();
    let e = parts.map(|p| p / total);
    let found = shares(&rows).unwrap();
    assert_shares(&found, &e[..3], &e[3..6], e[6], 1e-14);
    assert!((found.variance / total - 1.0).abs() < 1e-14);
    let order: Vec<_> = found.pairs.iter().map(|p| (p.0, p.1)).collect();
    assert_eq!(order, [(0, 1), (0, 2), (1, 2)]);
    // Rows repeated with scatter: ± d beside each value adds d² to the rest.
    let twice: Vec<_> = rows
        .iter()
        .flat_map(|(l, v)| [(l.clone(), v - 1.0), (l.clone(), v + 1.0)])
        .collect();
    let e = parts.map(|p| p / (total + 1.0));
    let rest = e[6] + 1.0 / (total + 1.0);
    assert_shares(&shares(&twice).unwrap(), &e[..3], &e[3..6], rest, 1e-14);
}

#[test]
fn shares_of_balanced_data_add_up() {
    // Without a closed form: any values at all, large and with a large mean.
    let rows = balanced(&[24, 4, 2, 8, 3], |l| {
        let mix = l.iter().fold(1, |m, l| (m * 37 + l * l + 11 * l) % 10_007);
        1000.0 + f64::from(mix as u32).sin() + l[0] as f64
    });
    let found = shares(&rows).unwrap();
    assert!(found.entangled.abs() < 1e-10, "{}", found.entangled);
    // A main effect is the variance of the means of its levels (the law of total variance).
    for (factor, levels) in [24, 4, 2, 8, 3].into_iter().enumerate() {
        let of = |level| {
            let mine = rows.iter().filter(|(l, _)| l[factor] == level);
            mine.map(|(_, v)| v).sum::<f64>() * levels as f64 / rows.len() as f64
        };
        let means: Vec<f64> = (0..levels).map(of).collect();
        let mean = means.iter().sum::<f64>() / levels as f64;
        let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / levels as f64;
        let share = variance / found.variance;
        assert!((found.mains[factor] - share).abs() < 1e-10);
    }
}

#[test]
fn gaps_as_least_squares_has_them() {
    // A 4 × 3 × 2 table without every fifth row. Expected from numpy.linalg.lstsq with all indicator
    // columns: residual of the others less residual with the term.
    let mut rows = balanced(&[4, 3, 2], |l| {
        let k = (l[0] + 4 * l[1] + 12 * l[2]) as f64;
        (k * k).sin() + 0.5 * l[0] as f64 - 0.3 * (l[1] * l[2]) as f64
    });
    let mut place = 0;
    rows.retain(|_| {
        place += 1;
        place % 5 != 0
    });
    let mains = [
        0.528_547_484_593_268_2,
        0.112_825_739_533_910_97,
        0.130_879_626_585_349_52,
    ];
    let pairs = [
        0.059_114_463_766_886_16,
        0.046_874_542_702_607_73,
        0.016_958_172_103_697_787,
    ];
    let rest = 0.061_296_647_676_429_6;
    let found = shares(&rows).unwrap();
    assert_shares(&found, &mains, &pairs, rest, 1e-13);
    // Neither the order of rows nor the names of levels matter.
    let mut named: Vec<_> = rows
        .iter()
        .map(|(l, v)| (l.iter().map(|l| 100 - 7 * l).collect(), *v))
        .collect();
    named.reverse();
    let named = shares(&named).unwrap();
    assert_shares(&named, &mains, &pairs, rest, 1e-13);
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
