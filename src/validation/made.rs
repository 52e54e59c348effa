//! From readings to a BRDF in one step, and how good it is.

use super::{Estimate, chosen};
use crate::brdf::Brdf;
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::metrics::{self, Errors, Expected, Measure, MetricsSpec, TestSet, Uncovered, WITHIN};
use crate::reconstruct::{
    Cover, MOST_PREDICTED, Predictive, Reconstruct, ReconstructError, Replicated,
};
use crate::schedule::Schedule;
use std::sync::{Arc, OnceLock};

/// A BRDF made of readings, with what it was made of.
pub struct Reconstruction {
    /// The readings.
    pub measurement: Arc<Measurement>,
    /// The method.
    pub method: Arc<dyn Reconstruct>,
    /// The BRDF.
    pub brdf: Arc<dyn Brdf>,
    /// With the readings that erred otherwise; made when it is first asked for.
    replicated: OnceLock<Result<Option<Replicated>, ReconstructError>>,
}

/// Errors of a reconstruction by name, and a list of them for each measure.
pub struct Against {
    /// Names of the errors.
    pub names: Vec<&'static str>,
    /// An estimate for each name; one list a measure of the test set.
    pub columns: Vec<Vec<Estimate>>,
}

impl Reconstruction {
    /// The BRDF of a measurement by a method; `None`: by the one that the readings choose, see [`chosen`].
    ///
    /// # Errors
    /// As [`Reconstruct::reconstruct`].
    pub fn new(
        measurement: Arc<Measurement>,
        method: Option<Arc<dyn Reconstruct>>,
    ) -> Result<Self, ReconstructError> {
        let method = method.unwrap_or_else(|| chosen(&measurement));
        let brdf = Arc::from(method.reconstruct(&measurement)?);
        Ok(Self {
            measurement,
            method,
            brdf,
            replicated: OnceLock::new(),
        })
    }

    /// The predictive distribution of the method; `None` of one without, and of more than [`MOST_PREDICTED`] readings.
    pub(crate) fn predictive(&self) -> Option<Box<dyn Predictive>> {
        let few = (1..=MOST_PREDICTED).contains(&self.measurement.readings());
        few.then(|| self.method.predictive(&self.measurement).ok().flatten())?
    }

    /// The BRDF with those of readings that erred otherwise; `None` where uncertainties are not known.
    ///
    /// # Errors
    /// As [`Replicated::of`].
    pub fn replicated(&self) -> Result<Option<&Replicated>, ReconstructError> {
        let make = || Replicated::of(&self.measurement, &*self.method);
        let made = self.replicated.get_or_init(make).as_ref();
        made.map(Option::as_ref).map_err(Clone::clone)
    }

    /// How pairs lie to the readings.
    ///
    /// # Errors
    /// As [`Cover::of`].
    pub fn cover(&self) -> Result<Cover, ReconstructError> {
        Cover::of(&self.measurement)
    }

    /// Values and uncertainties of every channel as readings, for light at 0°, 30° and 60°; `None` where uncertainties are not known.
    ///
    /// # Errors
    /// As [`Replicated::of`] and [`Cover::of`].
    pub(crate) fn uncertain_readings(&self) -> Result<Option<Measurement>, ReconstructError> {
        let Some(replicated) = self.replicated()? else {
            return Ok(None);
        };
        let parametrization = Arc::clone(&self.measurement.schedule.parametrization);
        let around = Schedule::of_pairs(parametrization, around()).distinct();
        Ok(Some(replicated.readings(Arc::new(around), &self.cover()?)))
    }

    /// Errors against a truth under the measures of a test set, the shares of it that are not interpolated, and of `uncertain`
    /// readings the share that is within k = 2.
    ///
    /// # Errors
    /// As [`Replicated::of`] and [`Cover::of`].
    pub(crate) fn against(
        &self,
        truth: &dyn Brdf,
        set: &TestSet,
    ) -> Result<Against, ReconstructError> {
        let (cover, replicated) = (self.cover()?, self.replicated()?);
        let compared = set.compare(truth, &*self.brdf);
        let (first, [f, g]) = (&compared.first, &compared.values);
        let counted = Uncovered::counted(first.pairs.len()).map(|i| first.pairs[i]);
        let coverage = cover.coverages(&counted.collect::<Vec<_>>());
        let uncertainty = replicated.map(|r| r.uncertainties(&first.pairs));
        let column = |at: usize| {
            let (weights, tally) = (&first.weights[at], &compared.tally);
            let (errors, standard) = (tally.errors(at), tally.standard_errors(at));
            let both = Errors::QUANTITIES.map(|(_, of)| Estimate::new(of(&errors), of(&standard)));
            let uncovered = Uncovered::among(&coverage, weights, f);
            let shares = Uncovered::QUANTITIES.iter().map(|(_, of)| of(&uncovered));
            let within = |u: &Vec<f64>| metrics::share_within(|i| weights[i], f, g, u);
            let shares = shares.chain(uncertainty.as_ref().map(within));
            let shares = shares.map(|share| Estimate::new(share, None));
            both.into_iter().chain(shares).collect()
        };
        let errors = Errors::QUANTITIES.iter().map(|(quantity, _)| quantity.name);
        let shares = Uncovered::QUANTITIES
            .iter()
            .map(|(quantity, _)| quantity.name);
        let within = replicated.map(|_| WITHIN.name);
        Ok(Against {
            names: errors.chain(shares).chain(within).collect(),
            columns: (0..set.measures.len()).map(column).collect(),
        })
    }
}

/// The errors under the cosine measure that a BRDF expects of itself.
pub fn expected(known: &dyn Predictive) -> Option<Expected> {
    let set = TestSet::new(&[Measure::Cosine], &MetricsSpec::default()).ok()?;
    Expected::per_measure(&set.level(0), known).first().copied()
}

/// Light at 0°, 30° and 60°, and sensors every 5° of elevation and 15° of azimuth.
fn around() -> Vec<DirectionPair> {
    let sensors = (0..18).flat_map(|k| (0..24).map(move |l| [5 * k, 15 * l]));
    let lights = [0, 30, 60].into_iter();
    let all = lights.flat_map(|light| sensors.clone().map(move |[theta, phi]| [light, theta, phi]));
    let pair = |degrees: [i32; 3]| {
        let [light, theta, phi] = degrees.map(|angle| f64::from(angle).to_radians());
        DirectionPair::from_spherical(light, 0.0, theta, phi)
    };
    all.map(pair).collect()
}
