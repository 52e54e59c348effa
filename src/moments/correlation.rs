//! Correlation of series with gaps: between orders, between channels, between materials.

use serde::Serialize;

/// Correlation of two series. A coefficient is in [−1, 1]; `None` with fewer than two pairs or
/// if one of the series is constant up to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// Pearson's: ±1 for a straight line.
    pub pearson: Option<f64>,
    /// Spearman's, Pearson's of the ranks: ±1 for a monotonic relation.
    pub spearman: Option<f64>,
    /// Number of pairs in which both have a finite value; the others are left out.
    pub pairs: usize,
}

/// Correlation of two series, place by place; places beyond the shorter one are left out.
pub fn correlate(a: &[Option<f64>], b: &[Option<f64>]) -> Correlation {
    let finite = |v: &Option<f64>| v.filter(|v| v.is_finite());
    let both = a.iter().zip(b);
    let (a, b): (Vec<f64>, Vec<f64>) = both
        .filter_map(|(a, b)| Some((finite(a)?, finite(b)?)))
        .unzip();
    Correlation {
        pearson: pearson(&a, &b),
        spearman: pearson(&ranks(&a), &ranks(&b)),
        pairs: a.len(),
    }
}

/// Σ a b / √(Σ a² Σ b²) of the deviations from the average.
fn pearson(a: &[f64], b: &[f64]) -> Option<f64> {
    let (a, b) = (unit_deviations(a)?, unit_deviations(b)?);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let r = dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt();
    // Only rounding leads out of the interval.
    Some(r.clamp(-1.0, 1.0))
}

/// Deviations from the average in units of the largest, so that no square leaves the range of
/// `f64`; `None` if they are rounding.
fn unit_deviations(values: &[f64]) -> Option<Vec<f64>> {
    let largest = |v: &[f64]| v.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let scale = largest(values);
    // Of unit size before they are summed: large values would overflow.
    let unit: Vec<f64> = values.iter().map(|v| v / scale).collect();
    let mean = unit.iter().sum::<f64>() / unit.len() as f64;
    let deviations: Vec<f64> = unit.iter().map(|v| v - mean).collect();
    let spread = largest(&deviations);
    // The average of n equal numbers is off by up to n/2 roundings.
    let rounding = f64::EPSILON * (2.0 + values.len() as f64);
    // All zeros make NaN, which is not above either.
    (spread > rounding).then(|| deviations.iter().map(|d| d / spread).collect())
}

/// Ranks from 1; equal values share the average of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    // By value, not by bits: −0 equals 0.
    for tie in order.chunk_by(|&i, &j| values[i] == values[j]) {
        let rank = first as f64 + 0.5 * (tie.len() + 1) as f64;
        for &i in tie {
            ranks[i] = rank;
        }
        first += tie.len();
    }
    ranks
}

/// Matrix of the correlations between named columns.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CorrelationMatrix {
    names: Vec<String>,
    rows: Vec<Vec<Correlation>>,
}

impl CorrelationMatrix {
    /// Correlates every two columns, each over the places where both have a value (so that
    /// entries may rest on different places, see [`Correlation::pairs`]).
    pub fn new<N: Into<String>>(columns: impl IntoIterator<Item = (N, Vec<Option<f64>>)>) -> Self {
        let columns = columns.into_iter().map(|(name, v)| (name.into(), v));
        let (names, columns): (Vec<String>, Vec<Vec<Option<f64>>>) = columns.unzip();
        let row = |a: &Vec<Option<f64>>| columns.iter().map(|b| correlate(a, b)).collect();
        let rows = columns.iter().map(row).collect();
        Self { names, rows }
    }

    /// The columns' names, in the order given.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The matrix: one row per column, in the order of the names; symmetric.
    pub fn rows(&self) -> &[Vec<Correlation>] {
        &self.rows
    }

    /// The entry of two columns; `None` if there is no column of that name.
    pub fn get(&self, row: &str, column: &str) -> Option<Correlation> {
        let at = |name: &str| self.names.iter().position(|n| n == name);
        Some(self.rows[at(row)?][at(column)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(a: &[f64], b: &[f64]) -> Correlation {
        let some = |v: &[f64]| v.iter().copied().map(Some).collect::<Vec<_>>();
        correlate(&some(a), &some(b))
    }

    #[test]
    fn coefficients_by_hand() {
        // Deviations (−1, 0, 1) and (−1, 1, 0): Σ ab = 1, Σ a² = Σ b² = 2.
        let c = of(&[1.0, 2.0, 3.0], &[1.0, 3.0, 2.0]);
        assert!((c.pearson.unwrap() - 0.5).abs() < 1e-15);
        assert!((c.spearman.unwrap() - 0.5).abs() < 1e-15);
        // Without ties Spearman's is 1 − 6 Σ d² / (n (n² − 1)), d the differences of ranks:
        // 5, 4, 2, 1, 3 less 1 to 5 gives Σ d² = 16 + 4 + 1 + 9 + 4 = 34; with n = 5, −0.7.
        let c = of(&[0.0, 1.0, 2.0, 3.0, 4.0], &[9.0, 5.5, 1.1, -3.0, 2.0]);
        assert!((c.spearman.unwrap() + 0.7).abs() < 1e-15);
    }

    #[test]
    fn ties_share_their_rank() {
        let r = ranks(&[3.0, 1.0, 3.0, -0.0, 0.0, 3.0]);
        assert_eq!(r, [5.0, 3.0, 5.0, 1.5, 1.5, 5.0]);
    }

    #[test]
    fn coefficients_by_scipy() {
        // scipy.stats.pearsonr and spearmanr of these two lists; 2.5 and 7 are tied.
        let a = [2.5, 0.1, 2.5, 9.0, -4.0, 6.2, 3.3, 8.1];
        let b = [7.0, 1.5, 3.0, 7.0, 2.0, 30.0, 7.0, 4.0];
        let c = of(&a, &b);
        assert!(
            (c.pearson.unwrap() - 0.389_665_190_999_198_8).abs() < 1e-14,
            "{c:?}"
        );
        assert!(
            (c.spearman.unwrap() - 0.674_960_953_801_497).abs() < 1e-14,
            "{c:?}"
        );
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
        let names = matrix.names();
        assert_eq!(matrix.get("line", "wave"), Some(matrix.rows()[0][1]));
        assert!(names.len() == 3 && matrix.get("line", "none").is_none());
    }
}
