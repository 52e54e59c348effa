//! Errors beside those that reconstructions expected of themselves.

use super::super::choices::Choice;
use super::super::row::Row;
use super::Metric;
use super::index::Index;
use crate::metrics::{Expected, Measure};
use crate::statistics::{geometric_mean, median, upper_quantile};

/// How errors of a choice are beside those that were expected, at every allowance.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The error.
    pub metric: Metric,
    /// Distribution of the test pairs.
    pub measure: String,
    /// The choice.
    pub choice: Choice,
    /// One cell per allowance; `None` where nothing was expected.
    pub cells: Vec<Option<Calibrated>>,
}

impl Calibration {
    /// True if both are of the same error under the same measure.
    pub(crate) fn is_of_same_error(&self, other: &Self) -> bool {
        self.metric == other.metric && self.measure == other.measure
    }
}

/// Ratios of errors and expected errors: of each material the geometric mean over seeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibrated {
    /// Number of materials.
    pub count: usize,
    /// Geometric mean of their readings.
    pub readings: f64,
    /// The median.
    pub median: f64,
    /// What a further one is below with a probability of at least 0.9; `None` of fewer than nine.
    pub ninth: Option<f64>,
    /// Share of the materials that are below the bound for nine of ten; `None` of measures that have none.
    pub below: Option<f64>,
}

/// The share of errors that a bound is for.
const SHARE: f64 = 0.9;

impl Calibrated {
    fn new(
        index: &Index<'_>,
        metric: Metric,
        [measure, choice, allowance]: [usize; 3],
    ) -> Option<Self> {
        let materials = 0..index.materials.list.len();
        let over = |of: &dyn Fn(&Row) -> Option<f64>| -> Vec<f64> {
            let mean = |m| index.mean([measure, choice, allowance, m], of);
            materials.clone().filter_map(mean).collect()
        };
        let ratios = over(&|row| Some(metric.error(row)? / metric.expected_error(&expected(row))?));
        let bound = |row: &Row| metric.expected_error(&expected(row).bound(row.readings));
        let of_bound = over(&|row| Some(metric.error(row)? / bound(row)?));
        let below = of_bound.iter().filter(|ratio| **ratio <= 1.0).count();
        let has_bound = index.measures.list[measure] == Measure::Cosine.name();
        Some(Self {
            count: ratios.len(),
            readings: geometric_mean(&over(&|row| Some(row.readings as f64)))?,
            median: median(&ratios)?,
            ninth: upper_quantile(&ratios, SHARE),
            below: has_bound.then(|| below as f64 / ratios.len() as f64),
        })
    }
}

/// The errors that the reconstruction of a row expects.
fn expected(row: &Row) -> Expected {
    let [nrmse, log_relative, shared @ ..] = Expected::QUANTITIES.map(|(q, _)| row.value(q.name));
    Expected {
        nrmse,
        log_relative,
        shared,
    }
}

/// The calibrations of all choices that expect errors.
pub(super) fn calibrations(index: &Index<'_>) -> Vec<Calibration> {
    let mut all = Vec::new();
    for metric in Metric::OF_PAIRS {
        for (m, measure) in index.measures.list.iter().enumerate() {
            for (c, choice) in index.choices.list.iter().enumerate() {
                let cell = |a| Calibrated::new(index, metric, [m, c, a]);
                let cells: Vec<_> = (0..index.allowances.list.len()).map(cell).collect();
                if cells.iter().any(Option::is_some) {
                    all.push(Calibration {
                        metric,
                        measure: (*measure).into(),
                        choice: choice.clone(),
                        cells,
                    });
                }
            }
        }
    }
    all
}
