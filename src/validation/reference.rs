//! Readings that judge a reconstruction.

use super::ValidationError;
use super::left_out::Groups;
use crate::geometry::DirectionPair;
use crate::measurement::{Details, Measurement};
use crate::metrics::{
    Errors, Measure, MetricsSpec, Values, compare_weighted, jackknife, share_within, test_pairs,
};
use crate::parametrization::Warps;
use crate::reconstruct::{Coordinates, NearestReading, Readings, Reconstruct, values_at};

/// Pairs of a measure that look for their nearest reading: ten for each of many readings.
const PAIRS: usize = 100_000;

/// A number with its standard error, `None` where undefined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: Option<f64>,
    /// Its standard error.
    pub standard_error: Option<f64>,
}

impl Estimate {
    /// A number, if it is defined, and its standard error, if that is known.
    pub(crate) fn new(value: impl Into<Option<f64>>, standard_error: Option<f64>) -> Self {
        let value = value.into();
        Self {
            value,
            standard_error,
        }
    }
}

/// Errors of a method: per [`Measure::USUAL`], in the order of [`Errors::QUANTITIES`].
#[derive(Clone, Debug, PartialEq)]
pub struct Scores(pub [[Estimate; Errors::QUANTITIES.len()]; Measure::USUAL.len()]);

impl Scores {
    /// The first error of the first measure that is defined, which methods are ranked by.
    pub(crate) fn ranked_by(&self) -> Option<&Estimate> {
        self.0.iter().flatten().find(|e| e.value.is_some())
    }
}

/// Readings as a truth.
pub struct ReferenceReadings {
    pairs: Vec<DirectionPair>,
    truth: Values,
    /// Standard uncertainty of each reading in luminance, as if its channels erred alike, sr⁻¹.
    uncertainty: Vec<f64>,
    /// Weights of the readings per measure, in pairs of the measure.
    weights: [Vec<f64>; Measure::USUAL.len()],
    /// Group of each reading; the jackknife leaves out one group at a time.
    group: Vec<usize>,
    groups: usize,
}

impl ReferenceReadings {
    /// All readings of a measurement.
    ///
    /// # Errors
    /// If there are fewer than two, at different places.
    pub fn new(measurement: &Measurement) -> Result<Self, ValidationError> {
        let poses = 0..measurement.outcomes.len();
        let all: Vec<usize> = poses.filter(|&i| measurement.value(i).is_some()).collect();
        let groups = Groups::new(measurement, &all, Some(false))?;
        let judges = groups.judges(&all);
        Self::from_poses(measurement, &judges, groups.count, false)
    }

    /// The readings of some poses, each with its group. `share`: what they are compared with has their errors
    /// of type B, which then are no difference.
    pub(super) fn from_poses(
        measurement: &Measurement,
        judges: &[(usize, usize)],
        groups: usize,
        share: bool,
    ) -> Result<Self, ValidationError> {
        let (poses, group): (Vec<usize>, Vec<usize>) = judges.iter().copied().unzip();
        let pair = |&i: &usize| measurement.schedule.poses[i].pair;
        let luminance = |&i: &usize| {
            let value = measurement.value(i);
            value.map_or(0.0, |v| measurement.channels.luminance(v).max(0.0))
        };
        let uncertainty = |&i: &usize| uncertainty(measurement, i, share);
        Ok(Self {
            pairs: poses.iter().map(pair).collect(),
            truth: poses.iter().map(luminance).collect::<Vec<_>>().into(),
            uncertainty: poses.iter().map(uncertainty).collect(),
            weights: weights(measurement, &poses)?,
            group,
            groups,
        })
    }

    /// The pairs of the readings.
    pub fn pairs(&self) -> &[DirectionPair] {
        &self.pairs
    }

    /// Errors of predicted values, one per reading.
    ///
    /// # Panics
    /// If there is another number of them.
    pub fn errors(&self, predicted: &Values) -> Scores {
        Scores(self.estimates(|weights| {
            let errors = compare_weighted(&self.pairs, weights, &self.truth, predicted);
            Errors::QUANTITIES.map(|(_, of)| of(&errors))
        }))
    }

    /// The share of readings that are within k = 2 of predicted values, per [`Measure::USUAL`]; these have
    /// standard uncertainties (sr⁻¹), one per reading, and those of the readings count too, as independent
    /// of them.
    ///
    /// # Panics
    /// If there is another number of them.
    pub fn within(
        &self,
        predicted: &Values,
        uncertainty: &[f64],
    ) -> [Estimate; Measure::USUAL.len()] {
        let both = self.uncertainty.iter().zip(uncertainty);
        let both: Vec<f64> = both.map(|(f, g)| f.hypot(*g)).collect();
        let within = |weights: &[f64]| share_within(|i| weights[i], &self.truth, predicted, &both);
        self.estimates(|weights| [within(weights)])
            .map(|[share]| share)
    }

    /// Numbers that depend on the weights of the readings, with their standard errors, per measure.
    fn estimates<const N: usize>(
        &self,
        of: impl Fn(&[f64]) -> [Option<f64>; N],
    ) -> [[Estimate; N]; Measure::USUAL.len()] {
        self.weights.each_ref().map(|weights| {
            let without = |group| {
                let weights = weights.iter().zip(&self.group);
                let kept = weights.map(|(&w, &of)| if of == group { 0.0 } else { w });
                of(&kept.collect::<Vec<_>>())
            };
            let whole = of(weights);
            let without: Vec<_> = (0..self.groups).map(without).collect();
            std::array::from_fn(|q| {
                let of_groups: Option<Vec<f64>> = without.iter().map(|all| all[q]).collect();
                Estimate::new(whole[q], of_groups.and_then(|values| jackknife(&values)))
            })
        })
    }
}

/// The standard uncertainty of the luminance of reading `i`, sr⁻¹, as if its channels erred alike; of type A only
/// if that of type B is shared.
fn uncertainty(measurement: &Measurement, i: usize, share: bool) -> f64 {
    let of = |types: &[f64]| {
        let n = measurement.channels.count();
        measurement.channels.luminance(&types[i * n..(i + 1) * n])
    };
    let details = measurement.details.as_ref();
    let both = |d: &Details| of(&d.type_a).hypot(if share { 0.0 } else { of(&d.type_b) });
    details.map_or(0.0, both)
}

/// How many pairs of each measure are nearest to each reading, in half/difference coordinates.
fn weights(
    measurement: &Measurement,
    poses: &[usize],
) -> Result<[Vec<f64>; Measure::USUAL.len()], ValidationError> {
    let schedule = &measurement.schedule;
    let mut present = vec![false; schedule.poses.len()];
    let mut number = vec![0.0; schedule.poses.len()];
    for (n, &i) in poses.iter().enumerate() {
        (present[i], number[i]) = (true, n as f64);
    }
    let nearest = NearestReading {
        coordinates: Some(Coordinates {
            kind: "half-difference".into(),
            warp: Warps::default(),
        }),
        stretch: None,
    };
    let nearest = nearest.interpolate(&Readings {
        schedule,
        width: 1,
        values: &number,
        present: &present,
        noise: None,
        half_angles_deg: [0.0; 2],
    })?;
    let spec = MetricsSpec {
        pairs: PAIRS,
        ..MetricsSpec::default()
    };
    Ok(Measure::USUAL.map(|measure| {
        let Ok(pairs) = test_pairs(measure, &spec) else {
            unreachable!("the default pairs of a measure");
        };
        let mut weights = vec![0.0; poses.len()];
        for n in values_at(&*nearest, &pairs) {
            weights[n as usize] += 1.0;
        }
        weights
    }))
}
