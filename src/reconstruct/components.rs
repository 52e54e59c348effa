//! A sum of the functions of a prior: ridge regression on principal components of many materials.
//!
//! ln(f + ε) = mean + Σ_k c_k q_k, where c makes Σ_i (z_i − mean_i − q_i·c)² + ridge |c|² least over the readings i;
//! coefficients of the materials of the prior have variance 1. Nielsen, Jensen & Ramamoorthi 2015, "On optimal, minimal
//! BRDF sampling for reflectance acquisition"; Miandji et al. 2024, "FROST-BRDF". The former's ridge of 40 is for
//! coefficients whose squares sum up to 1 over some 300 columns of materials: 0.13 here. Their logarithm is of f cos θ_i
//! cos θ_o as a share of a median's; this is of f, without the cosines. (The median is in the mean.)
//! Nothing is left for what the functions do not say: readings are missed.

use super::interpolant::{Interpolant, Readings};
use super::kriging::{Mean, Prior, PriorFile};
use super::transform::LOG;
use super::{Reconstruct, ReconstructError, admit};
use crate::error::{ParameterError, in_left_open};
use crate::geometry::DirectionPair;
use crate::registry::declare;
use nalgebra::DMatrix;

/// The ridge of few readings: of materials that a prior was not made of, about the best.
pub(crate) const RIDGE: f64 = 0.01;

/// The ridge of many readings, and the number of them for each unit of the ridge between the two.
const RIDGE_OF_MANY: f64 = 0.3;
const READINGS: f64 = 5000.0;

declare! {
    dyn Reconstruct, "components": "ridge regression of ln f on the functions of a prior; isotropic materials", [
        "",
        "ridge = 0.13",
    ]
    /// Ridge regression on the functions of a prior, as a config writes it.
    pub struct Components {
        /// The materials whose functions these are: `built-in` (materials of formulas), or a file of `gonio train`.
        prior: PriorFile = PriorFile::default();
        /// Variance of a reading of ln f about the functions as a share of that of their coefficients: finite, above 0; by default a 5000th
        /// of the number of readings, at least 0.01 and at most 0.3.
        ridge: Option<f64> = None;
    }
}

impl Components {
    /// The ridge for a number of readings. Few of them are fitted closely; of about as many as there are functions the fit of what the
    /// functions do not say would grow without bound where no reading is.
    fn ridge_of(&self, readings: usize) -> f64 {
        let by_number = (readings as f64 / READINGS).clamp(RIDGE, RIDGE_OF_MANY);
        self.ridge.unwrap_or(by_number)
    }

    /// The coefficients of functions (a column per reading) that explain values (a row per reading); `None` if they are
    /// no numbers. Of the two forms, (QQᵀ + ridge)⁻¹ Q z = Q (QᵀQ + ridge)⁻¹ z, the smaller system is solved.
    fn coefficients(
        &self,
        functions: &DMatrix<f64>,
        values: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        let (k, n) = functions.shape();
        let ridge = |size| DMatrix::identity(size, size) * self.ridge_of(n);
        match k <= n {
            true => {
                let normal = functions * functions.transpose() + ridge(k);
                Some(normal.cholesky()?.solve(&(functions * values)))
            }
            false => {
                let dual = functions.tr_mul(functions) + ridge(n);
                Some(functions * dual.cholesky()?.solve(values))
            }
        }
    }
}

impl Reconstruct for Components {
    fn label(&self) -> String {
        self.ridge
            .map_or(KIND.into(), |ridge| format!("{KIND}-{ridge}"))
    }

    fn prior(&self) -> Option<&PriorFile> {
        Some(&self.prior)
    }

    fn takes_those_of_schedules(&self) -> bool {
        false
    }

    fn check(&self) -> Result<(), ParameterError> {
        if let Some(ridge) = self.ridge {
            in_left_open("ridge", ridge, 0.0, f64::INFINITY)?;
        }
        self.prior.load().map(drop)
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        if !Prior::suits(r.schedule.parametrization.symmetry()) {
            return Err(ReconstructError::Symmetry { method: KIND });
        }
        let present: Vec<usize> = (0..r.present.len()).filter(|&i| r.present[i]).collect();
        admit(KIND, present.len(), usize::MAX)?;
        let pairs = present.iter().map(|&i| r.schedule.poses[i].pair);
        let pairs: Vec<DirectionPair> = pairs.collect();
        let prior = self.prior.load()?;
        let (mean, functions) = prior.basis_at(&pairs);
        let value = |i: usize, c: usize| LOG.forward(r.values[present[i] * r.width + c]) - mean[i];
        let values = DMatrix::from_fn(pairs.len(), r.width, value);
        let coefficients = self.coefficients(&functions, &values);
        let coefficients = coefficients.ok_or(ReconstructError::Singular {
            method: KIND,
            readings: pairs.len(),
        })?;
        Ok(Box::new(Sum {
            mean: prior.mean(&coefficients),
            width: r.width,
        }))
    }
}

/// The mean of a prior and a sum of its functions.
struct Sum {
    mean: Mean,
    width: usize,
}

impl Interpolant for Sum {
    fn width(&self) -> usize {
        self.width
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64]) {
        out.fill(0.0);
        self.mean.add(pairs, out);
        LOG.inverse_above(pairs, self.width, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::testing::made;
    use crate::geometry::Symmetry;
    use crate::instrument::{Ideal, Instrument};
    use crate::measurement::Measurement;
    use crate::parametrization::usual_form;
    use crate::schedule::{SampleSet, SobolSet};
    use std::sync::Arc;

    /// The readings of the mean and the functions of a prior times coefficients, one list per channel.
    fn member(prior: &Prior, c: &DMatrix<f64>, n: usize) -> Measurement {
        let schedule = SobolSet {}.plan(&usual_form(Symmetry::FULL), n, 3);
        let grey = made(Symmetry::FULL, |_| Some([0.0; 3]));
        let mut m = Ideal.measure(&grey, &Arc::new(schedule.unwrap()));
        let pairs: Vec<_> = m.schedule.poses.iter().map(|p| p.pair).collect();
        let (mean, q) = prior.basis_at(&pairs);
        let z = q.tr_mul(c);
        for i in 0..n {
            for j in 0..3 {
                m.values[3 * i + j] = LOG.inverse(mean[i] + z[(i, j)]);
            }
        }
        m
    }

    #[test]
    fn coefficients_solve_the_normal_equations_in_either_form() {
        let q = |k, n| DMatrix::from_fn(k, n, |i, j| ((i * 7 + j * 3) as f64).sin());
        for (k, n) in [(4, 9), (9, 4)] {
            let z = DMatrix::from_fn(n, 2, |i, j| ((i + 5 * j) as f64).cos());
            let method = Components {
                ridge: Some(0.3),
                ..Components::default()
            };
            let c = method.coefficients(&q(k, n), &z).unwrap();
            // The gradient of what is made least is 0.
            let gradient = q(k, n) * (q(k, n).transpose() * &c - z) + &c * 0.3;
            assert!(gradient.amax() < 1e-12 && c.amax() > 0.01, "{gradient}");
        }
    }

    #[test]
    fn a_sum_of_the_functions_is_found_from_as_many_readings() {
        let file = PriorFile::default();
        let prior = file.load().unwrap();
        let k = prior.functions();
        let c = DMatrix::from_fn(k, 3, |i, j| {
            0.6 * ((3 * i + j) as f64).sin() / (1 + i) as f64
        });
        let method = Components {
            ridge: Some(1e-9),
            ..Components::default()
        };
        let copy = method.reconstruct(&member(&prior, &c, 3 * k)).unwrap();
        let all = member(&prior, &c, 500);
        for (i, pose) in all.schedule.poses.iter().enumerate() {
            let mut f = [0.0; 3];
            let _ = copy.eval(&pose.pair, &mut f);
            for (f, want) in f.iter().zip(&all.values[3 * i..]) {
                let off = LOG.forward(*f) - LOG.forward(*want);
                assert!(off.abs() < 1e-2, "{off}");
            }
        }
    }
}
