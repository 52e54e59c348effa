use crate::common::near;
use gonio::numeric::{Correlation, CorrelationMatrix, correlate};

fn of(a: &[f64], b: &[f64]) -> Correlation {
    let some = |v: &[f64]| v.iter().copied().map(Some).collect::<Vec<_>>();
    correlate(&some(a), &some(b))
}

#[test]
fn coefficients_by_scipy() {
    // scipy.stats.pearsonr and spearmanr of these two lists; 2.5 and 7 are tied.
    let a = [2.5, 0.1, 2.5, 9.0, -4.0, 6.2, 3.3, 8.1];
    let b = [7.0, 1.5, 3.0, 7.0, 2.0, 30.0, 7.0, 4.0];
    let c = of(&a, &b);
    near(c.pearson.unwrap(), 0.389_665_190_999_198_8, 1e-14, c);
    near(c.spearman.unwrap(), 0.674_960_953_801_497, 1e-14, c);
}

#[test]
fn scale_and_offset_do_not_matter() {
    let a = [0.3, -1.2, 4.4, 2.0, 0.9];
    let b = [1.0, 0.2, 2.2, 3.1, -0.4];
    let reference = of(&a, &b);
    for scale in [1e-300, 1e-6, 1e6, 1e200, 1e307] {
        let c = of(&a.map(|x| scale * x), &b.map(|x| 5.0 - x / 7.0));
        assert!((c.pearson.unwrap() + reference.pearson.unwrap()).abs() < 1e-14);
        assert_eq!(c.spearman.unwrap(), -reference.spearman.unwrap());
    }
    // A curved monotonic relation.
    let c = of(&a, &a.map(f64::exp));
    assert!((c.spearman.unwrap() - 1.0).abs() < 1e-15 && c.pearson.unwrap() < 0.95);
}

#[test]
fn constants_and_gaps_are_no_numbers() {
    let c = of(&[0.1; 7], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    assert_eq!((c.pearson, c.spearman, c.pairs), (None, None, 7));
    assert!(of(&[0.0; 3], &[0.0; 3]).pearson.is_none());
    assert!(of(&[1.0], &[2.0]).pearson.is_none() && of(&[], &[]).spearman.is_none());
    let a = [Some(1.0), None, Some(2.0), Some(f64::NAN), Some(3.0)];
    let b = [Some(1.0), Some(9.0), Some(3.0), Some(4.0), Some(2.0)];
    let c = correlate(&a, &b);
    assert!(c.pairs == 3 && (c.pearson.unwrap() - 0.5).abs() < 1e-15);
}

#[test]
fn a_matrix_is_symmetric_with_a_unit_diagonal() {
    let column = |f: fn(f64) -> f64| (0..30).map(|i| Some(f(f64::from(i)))).collect();
    let matrix = CorrelationMatrix::new([
        ("line", column(|x| 2.0 * x)),
        ("wave", column(f64::sin)),
        ("constant", column(|_| 3.0)),
    ]);
    for (i, row) in matrix.rows().iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            assert_eq!(*entry, matrix.rows()[j][i]);
            let defined = i != 2 && j != 2;
            assert_eq!(entry.pearson.is_some(), defined);
            if i == j && defined {
                assert!((entry.pearson.unwrap() - 1.0).abs() < 1e-15);
            }
        }
    }
    assert_eq!(matrix.names(), ["line", "wave", "constant"]);
}
