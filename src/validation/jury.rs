//! Readings that judge a reconstruction.

use super::ValidationError;
use super::left_out::Groups;
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::metrics::{
    Errors, Measure, MetricsSpec, Values, compare_weighted, share_within, test_pairs,
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
    /// Its standard error; `None` also of a maximum.
    pub standard_error: Option<f64>,
}

/// Errors of a method: per [`Measure::ALL`], in the order of [`Errors::QUANTITIES`].
#[derive(Clone, Debug, PartialEq)]
pub struct Scores(pub [[Estimate; Errors::QUANTITIES.len()]; Measure::ALL.len()]);

impl Scores {
    /// The first error of the first measure that is defined: what methods are ranked by.
    pub fn rank(&self) -> Option<f64> {
        self.0.iter().flatten().find_map(|e| e.value)
    }
}

/// Readings as a truth.
pub struct Jury {
    pairs: Vec<DirectionPair>,
    truth: Values,
    /// Standard uncertainty of each reading in luminance, as if its channels erred alike, sr⁻¹.
    uncertainty: Vec<f64>,
    /// Weights of the readings per measure, in pairs of the measure.
    weights: [Vec<f64>; Measure::ALL.len()],
    /// Group of each reading; the jackknife leaves out one group at a time.
    group: Vec<usize>,
    /// Number of groups.
    groups: usize,
}

impl Jury {
    /// All readings of a measurement.
    ///
    /// # Errors
    /// If there are fewer than two, at different places.
    pub fn new(measurement: &Measurement) -> Result<Self, ValidationError> {
        let all: Vec<usize> = (0..measurement.outcomes.len())
            .filter(|&i| measurement.value(i).is_some())
            .collect();
        let groups = Groups::new(measurement, &all, Some(false))?;
        let judges = groups.judges(&all);
        Self::of(measurement, &judges, groups.count)
    }

    /// The readings of some poses, each with its group.
    pub(super) fn of(
        measurement: &Measurement,
        judges: &[(usize, usize)],
        groups: usize,
    ) -> Result<Self, ValidationError> {
        let poses: Vec<usize> = judges.iter().map(|&(pose, _)| pose).collect();
        let luminance = |&i: &usize| {
            let value = measurement.value(i);
            value.map_or(0.0, |v| measurement.channels.luminance(v).max(0.0))
        };
        Ok(Self {
            pairs: poses
                .iter()
                .map(|&i| measurement.schedule.poses[i].pair)
                .collect(),
            truth: Values {
                luminance: poses.iter().map(luminance).collect(),
                missing: Vec::new(),
            },
            uncertainty: poses.iter().map(|&i| uncertainty(measurement, i)).collect(),
            weights: weights(measurement, &poses)?,
            group: judges.iter().map(|&(_, group)| group).collect(),
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
        let mut scores = self.estimates(|weights| {
            let errors = compare_weighted(&self.pairs, weights, &self.truth, predicted);
            Errors::QUANTITIES.map(|(_, of)| of(&errors))
        });
        for (q, (quantity, _)) in Errors::QUANTITIES.iter().enumerate() {
            if quantity.name == MAXIMUM {
                scores.iter_mut().for_each(|of| of[q].standard_error = None);
            }
        }
        Scores(scores)
    }

    /// The share of readings that are within k = 2 of predicted values, per [`Measure::ALL`]; these have
    /// standard uncertainties (sr⁻¹), one per reading, and those of the readings count too, as independent
    /// of them.
    ///
    /// # Panics
    /// If there is another number of them.
    pub fn within(
        &self,
        predicted: &Values,
        uncertainty: &[f64],
    ) -> [Estimate; Measure::ALL.len()] {
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
    ) -> [[Estimate; N]; Measure::ALL.len()] {
        self.weights.each_ref().map(|weights| {
            let without = |group| {
                let weights = weights.iter().zip(&self.group);
                let kept = weights.map(|(&w, &of)| if of == group { 0.0 } else { w });
                of(&kept.collect::<Vec<_>>())
            };
            let whole = of(weights);
            let without: Vec<_> = (0..self.groups).map(without).collect();
            std::array::from_fn(|q| {
                let of_groups: Option<Vec<f64>> =
                    without.iter().map(|numbers| numbers[q]).collect();
                Estimate {
                    value: whole[q],
                    standard_error: of_groups.map(|values| jackknife(&values)),
                }
            })
        })
    }
}

/// The standard uncertainty of the luminance of reading `i`, sr⁻¹, as if its channels erred alike.
fn uncertainty(measurement: &Measurement, i: usize) -> f64 {
    let of = |types: &[f64]| {
        let n = measurement.channels.count();
        measurement.channels.luminance(&types[i * n..(i + 1) * n])
    };
    let details = measurement.details.as_ref();
    details.map_or(0.0, |d| of(&d.type_a).hypot(of(&d.type_b)))
}

/// The error whose spread says nothing.
const MAXIMUM: &str = "max_relative";

/// Standard error of an estimate from those without one group each, of which there are two or more.
fn jackknife(without: &[f64]) -> f64 {
    let n = without.len() as f64;
    let mean = without.iter().sum::<f64>() / n;
    let spread = without.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    ((n - 1.0) / n * spread).sqrt()
}

/// How many pairs of each measure are nearest to each reading, in half/difference coordinates.
fn weights(
    measurement: &Measurement,
    poses: &[usize],
) -> Result<[Vec<f64>; Measure::ALL.len()], ValidationError> {
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
    })?;
    let spec = MetricsSpec {
        pairs: PAIRS,
        ..MetricsSpec::default()
    };
    let mut weights = [(); Measure::ALL.len()].map(|()| vec![0.0; poses.len()]);
    for (measure, weights) in Measure::ALL.into_iter().zip(&mut weights) {
        let Ok(pairs) = test_pairs(measure, &spec) else {
            unreachable!("the default pairs of a measure");
        };
        for n in values_at(&*nearest, &pairs) {
            weights[n as usize] += 1.0;
        }
    }
    Ok(weights)
}
