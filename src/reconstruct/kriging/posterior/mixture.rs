//! The accounts of some readings, each a posterior with its share.

use super::super::{KIND, Kriging, MOST_COMPARED, MOST_SPARSE};
use super::{LocalPosterior, Posterior};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::reconstruct::{LogNormal, Predictive, ReconstructError, Suspect, admit};
use nalgebra::{DMatrix, DVector};

/// Why no system of readings is singular where that of all, or of a part, was not.
const REGULAR: &str = "the nugget makes covariances regular";

/// Pairs that are predicted at once: what is kept of each is as much as there are readings.
const PREDICTED: usize = 2048;

/// The accounts of some readings, each with its share.
pub(crate) struct Mixture {
    accounts: Accounts,
    suspects: Vec<Suspect>,
}

enum Accounts {
    /// Of readings that are one system.
    Whole(Vec<(f64, Posterior)>),
    /// Of more.
    Local(Box<LocalPosterior>),
}

impl Mixture {
    /// By the luminance of a measurement's readings.
    ///
    /// # Errors
    /// If there are none or too many, or their covariances are singular.
    pub(crate) fn new(
        kriging: &Kriging,
        measurement: &Measurement,
    ) -> Result<Self, ReconstructError> {
        admit(KIND, measurement.readings(), MOST_SPARSE)?;
        if measurement.readings() > MOST_COMPARED {
            let (local, suspects) = LocalPosterior::new(kriging, measurement)?;
            return Ok(Self {
                suspects,
                accounts: Accounts::Local(Box::new(local)),
            });
        }
        let (accounts, suspects) = Posterior::all(kriging, measurement)?;
        Ok(Self {
            accounts: Accounts::Whole(accounts),
            suspects,
        })
    }

    /// Means of ln(f + ε) at pairs.
    pub(crate) fn means(&self, pairs: &[DirectionPair]) -> Vec<f64> {
        let accounts = match &self.accounts {
            Accounts::Whole(accounts) => accounts,
            Accounts::Local(local) => {
                let means = local.means(pairs);
                return means.unwrap_or_else(|| unreachable!("{REGULAR}"));
            }
        };
        let mut all = vec![0.0; pairs.len()];
        for (share, process) in accounts {
            for (pairs, all) in pairs.chunks(PREDICTED).zip(all.chunks_mut(PREDICTED)) {
                let means = process.means(&process.places(pairs)).into_iter();
                all.iter_mut()
                    .zip(means)
                    .for_each(|(z, mean)| *z += share * mean);
            }
        }
        all
    }

    /// What is known at each pair, now and once there are readings at others too, each as it is expected; `None` if the
    /// covariances of these are singular.
    pub(crate) fn with(
        &self,
        pairs: &[DirectionPair],
        read: &[DirectionPair],
    ) -> Option<Vec<[LogNormal; 2]>> {
        let accounts = match &self.accounts {
            Accounts::Whole(accounts) => accounts,
            Accounts::Local(local) => return local.predict(pairs, read),
        };
        let mut known = vec![[LogNormal::default(); 2]; pairs.len()];
        for (share, process) in accounts {
            let read = process.places(read);
            let chunks = pairs.chunks(PREDICTED);
            for (pairs, known) in chunks.zip(known.chunks_mut(PREDICTED)) {
                let places = process.places(pairs);
                let means = process.means(&places).into_iter();
                let now = process.variances(&places);
                let then = process.lowered(&now, &places, &read)?;
                let all = means
                    .zip(now.into_iter().zip(then))
                    .zip(process.shared(&places));
                for (known, ((mean, (now, then)), shared)) in known.iter_mut().zip(all) {
                    for (known, variance) in known.iter_mut().zip([now, then]) {
                        // The mean of squares, for now.
                        let variance = variance * process.scale + shared * shared;
                        known.mean += share * mean;
                        known.variance += share * (variance + mean * mean);
                        known.shared += share * shared * shared;
                    }
                }
            }
        }
        let all = known.iter_mut().flatten();
        all.for_each(|k| k.variance = (k.variance - k.mean * k.mean).max(0.0));
        Some(known)
    }

    /// Variances of sums Σ w ln(f + ε) over some pairs, a list of weights for each, once there are readings at others too; `None`
    /// if the covariances of these are singular.
    pub(crate) fn variances_of_sums_with(
        &self,
        pairs: &[DirectionPair],
        weights: &[Vec<f64>],
        read: &[DirectionPair],
    ) -> Option<Vec<f64>> {
        let near;
        let accounts = match &self.accounts {
            Accounts::Whole(accounts) => accounts,
            Accounts::Local(local) => {
                near = vec![(1.0, local.about(pairs)?)];
                &near
            }
        };
        let weights = DMatrix::from_fn(pairs.len(), weights.len(), |k, of| weights[of][k]);
        let mut all = vec![0.0; weights.ncols()];
        // Of the sums of the means of the accounts: their mean, and that of their squares.
        let mut between = vec![[0.0; 2]; weights.ncols()];
        for (share, process) in accounts {
            let places = process.places(pairs);
            let variances = process.variances_of_sums(&places, &weights, read)?;
            let means = DVector::from_vec(process.means(&places));
            let shared = DVector::from_vec(process.shared(&places));
            for (i, own) in weights.column_iter().enumerate() {
                let variance = variances[i] * process.scale;
                all[i] += share * (variance + own.dot(&shared).powi(2));
                let mean = own.dot(&means);
                between[i][0] += share * mean;
                between[i][1] += share * mean * mean;
            }
        }
        let between = between
            .into_iter()
            .map(|[mean, square]: [f64; 2]| square - mean * mean);
        let both = all.iter().zip(between);
        Some(both.map(|(of, more)| of + more.max(0.0)).collect())
    }
}

impl Predictive for Mixture {
    fn predict(&self, pairs: &[DirectionPair]) -> Vec<LogNormal> {
        let known = self.with(pairs, &[]);
        let known = known.unwrap_or_else(|| unreachable!("{REGULAR}"));
        known.into_iter().map(|[now, _]| now).collect()
    }

    fn variances_of_sums(&self, pairs: &[DirectionPair], weights: &[Vec<f64>]) -> Vec<f64> {
        let known = self.variances_of_sums_with(pairs, weights, &[]);
        known.unwrap_or_else(|| unreachable!("{REGULAR}"))
    }

    fn suspects(&self) -> &[Suspect] {
        &self.suspects
    }
}
