//! What all accounts of some readings say together.

use super::Kriging;
use super::posterior::Posterior;
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::reconstruct::{LogNormal, Predictive, ReconstructError, Suspect, admit};

/// Pairs that are predicted at once: what is kept of each is as much as there are readings.
const PREDICTED: usize = 2048;

/// The accounts of some readings, each with its share.
pub(crate) struct Mixture {
    accounts: Vec<(f64, Posterior)>,
    suspects: Vec<Suspect>,
}

impl Mixture {
    /// By the luminance of a measurement's readings.
    ///
    /// # Errors
    /// If there are none or too many, or their covariances are singular.
    pub(crate) fn of(
        kriging: &Kriging,
        measurement: &Measurement,
    ) -> Result<Self, ReconstructError> {
        admit(super::KIND, measurement.readings(), super::MOST)?;
        let (accounts, suspects) = Posterior::all(kriging, measurement)?;
        Ok(Self { accounts, suspects })
    }

    /// What is known at pairs once there are readings at others too, each as it is expected; `None` if the covariances
    /// of these are singular.
    pub(crate) fn with(
        &self,
        pairs: &[DirectionPair],
        read: &[DirectionPair],
    ) -> Option<Vec<LogNormal>> {
        let mut known = vec![LogNormal::default(); pairs.len()];
        for (share, process) in &self.accounts {
            let read = process.places(read);
            let chunks = pairs.chunks(PREDICTED);
            for (pairs, known) in chunks.zip(known.chunks_mut(PREDICTED)) {
                let places = process.places(pairs);
                let means = process.means(&places).into_iter();
                let variances = process.variances_with(&places, &read)?;
                let all = means.zip(variances).zip(process.shared(&places));
                for (known, ((mean, variance), shared)) in known.iter_mut().zip(all) {
                    // The mean of squares, for now.
                    let variance = variance * process.scale() + shared * shared;
                    known.mean += share * mean;
                    known.variance += share * (variance + mean * mean);
                    known.shared += share * shared * shared;
                }
            }
        }
        let all = known.iter_mut();
        all.for_each(|k| k.variance = (k.variance - k.mean * k.mean).max(0.0));
        Some(known)
    }
}

impl Predictive for Mixture {
    fn predict(&self, pairs: &[DirectionPair]) -> Vec<LogNormal> {
        let known = self.with(pairs, &[]);
        known.unwrap_or_else(|| unreachable!("nothing is not singular"))
    }

    fn suspects(&self) -> &[Suspect] {
        &self.suspects
    }
}
