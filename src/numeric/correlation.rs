//! Correlation of series with gaps: between orders, between channels, between materials.

use super::ranks::doubled_ranks;
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

/// Twice the ranks, which correlate as the ranks do.
fn ranks(values: &[f64]) -> Vec<f64> {
    let ranks = doubled_ranks(values).into_iter();
    ranks.map(|rank| rank as f64).collect()
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
}
