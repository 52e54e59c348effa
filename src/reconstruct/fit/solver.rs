//! The search for the numbers that suit readings best.

use super::parameters::{Parameter, Parameters};
use crate::geometry::DirectionPair;
use crate::reconstruct::transform::EPSILON;
use crate::sampling::Random;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rayon::prelude::*;

/// Standard deviation of what is known of each place t beforehand: nothing between the ends, but that numbers that the
/// readings say nothing of stay where they are.
const PRIOR: f64 = 10.0;

/// Standard error of t above which a number is not determined: its scale from a twentieth to the rest.
const UNKNOWN: f64 = 3.0;

/// Step of t for slopes.
const STEP: f64 = 1e-4;

/// Residual of each reading where the numbers of a model do not go together.
const REFUSED: f64 = 1e3;

/// Seed of the starts.
const SEED: u64 = 1;

/// Readings that a model is fitted to, and a place.
#[derive(Clone)]
pub(super) struct Problem<'a> {
    parameters: &'a Parameters,
    pairs: &'a [DirectionPair],
    /// ln(f + ε) of each reading.
    logs: &'a [f64],
    /// 1 / standard uncertainty of each.
    weights: &'a [f64],
    start: DVector<f64>,
    place: DVector<f64>,
}

/// What was found.
pub(super) struct Found {
    pub place: DVector<f64>,
    /// Standard errors of the places.
    errors: Vec<f64>,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        parameters: &'a Parameters,
        pairs: &'a [DirectionPair],
        logs: &'a [f64],
        weights: &'a [f64],
    ) -> Self {
        let start = parameters.start();
        Self {
            parameters,
            pairs,
            logs,
            weights,
            place: start.clone(),
            start,
        }
    }

    /// The best of searches from the model and from `starts` − 1 other places.
    pub(crate) fn solve(&self, starts: usize) -> Found {
        let random = Random::new(SEED);
        let search = |s: usize| {
            let mut problem = self.clone();
            if s > 0 {
                let mut stream = random.stream(s as u64);
                problem.place = self.parameters.around(|| stream.next());
            }
            let (problem, _) = LevenbergMarquardt::new().minimize(problem);
            (
                problem.weighted_residuals(&problem.place).norm_squared(),
                problem.place,
            )
        };
        let found: Vec<_> = (0..starts).into_par_iter().map(search).collect();
        let first = (f64::INFINITY, self.start.clone());
        // The first of those that are equally good.
        let better = |a: (f64, DVector<f64>), b: (f64, DVector<f64>)| if b.0 < a.0 { b } else { a };
        let (cost, place) = found.into_iter().fold(first, better);
        let errors = self.errors(&place, cost);
        Found { place, errors }
    }

    /// Standard errors of the places: of residuals that scatter as they do, not less than they should.
    fn errors(&self, place: &DVector<f64>, cost: f64) -> Vec<f64> {
        let slopes = self.slopes(place);
        let spare = self.pairs.len().saturating_sub(place.len()).max(1);
        let scatter = (cost / spare as f64).max(1.0);
        let information = slopes.tr_mul(&slopes);
        match information.cholesky() {
            Some(factor) => {
                let covariance = factor.inverse();
                (0..place.len())
                    .map(|i| (scatter * covariance[(i, i)]).sqrt().min(PRIOR))
                    .collect()
            }
            None => vec![PRIOR; place.len()],
        }
    }

    /// Weighted residuals of the readings, and of what is known beforehand.
    fn weighted_residuals(&self, place: &DVector<f64>) -> DVector<f64> {
        let n = self.pairs.len();
        let mut out = DVector::from_element(n + place.len(), REFUSED);
        if let Some(model) = self.parameters.model(place) {
            let (values, _) = model.values(self.pairs);
            for i in 0..n {
                let log = (values[i] + EPSILON).ln();
                out[i] = (log - self.logs[i]) * self.weights[i];
            }
        }
        for i in 0..place.len() {
            out[n + i] = (place[i] - self.start[i]) / PRIOR;
        }
        out
    }

    /// Derivatives of the residuals, by central differences.
    fn slopes(&self, place: &DVector<f64>) -> DMatrix<f64> {
        let columns: Vec<_> = (0..place.len())
            .map(|i| {
                let moved = |step: f64| {
                    let mut place = place.clone();
                    place[i] += step;
                    self.weighted_residuals(&place)
                };
                (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
            })
            .collect();
        DMatrix::from_columns(&columns)
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, place: &DVector<f64>) {
        self.place.copy_from(place);
    }

    fn params(&self) -> DVector<f64> {
        self.place.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.weighted_residuals(&self.place))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(self.slopes(&self.place))
    }
}

impl Found {
    /// The numbers with their standard errors, a sentence each; `several`: of which value they are.
    pub(crate) fn remarks(&self, parameters: &Parameters, several: Option<usize>) -> Vec<String> {
        let of = several.map_or(String::new(), |c| format!("value {c}: "));
        let said = |(i, p): (usize, &Parameter)| {
            let [x, slope] = p.value(self.place[i]);
            let name = &p.name;
            match self.errors[i] {
                error if error > UNKNOWN => {
                    format!("{of}the readings do not determine {name}: it stands at {x:.4}")
                }
                error => format!("{of}{name} = {x:.5} ± {:.1e}", slope * error),
            }
        };
        parameters.free.iter().enumerate().map(said).collect()
    }
}
