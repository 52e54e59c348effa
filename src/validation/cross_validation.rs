//! Readings that are predicted from the others.

use super::jury::values;
use super::left_out::{Groups, Left};
use super::{Jury, Scores, ValidationError};
use crate::measurement::Measurement;
use crate::metrics::Values;
use crate::reconstruct::{Readings, Reconstruct, ReconstructError, noise};
use rayon::prelude::*;
use std::sync::Arc;

/// Most readings that take part: of more, every k-th does.
const MOST: usize = 20_000;

/// Readings that are left out in turn.
pub struct CrossValidation<'a> {
    measurement: &'a Measurement,
    /// The poses of the readings that take part.
    poses: Vec<usize>,
    groups: Groups,
    jury: Jury,
}

impl<'a> CrossValidation<'a> {
    /// Of the readings of a measurement. `sheets`: whole sheets are left out, or not; `None`: where most
    /// readings lie in two sheets or more.
    ///
    /// # Errors
    /// If there are fewer than two readings at different places, or no sheets where `sheets` asks for them.
    pub fn new(
        measurement: &'a Measurement,
        sheets: Option<bool>,
    ) -> Result<Self, ValidationError> {
        let readings = (0..measurement.outcomes.len()).filter(|&i| measurement.value(i).is_some());
        let step = measurement.readings().div_ceil(MOST).max(1);
        let poses: Vec<usize> = readings.step_by(step).collect();
        let groups = Groups::new(measurement, &poses, sheets)?;
        let judges = groups.judges(&poses);
        Ok(Self {
            jury: Jury::of(measurement, &judges, groups.count)?,
            measurement,
            poses,
            groups,
        })
    }

    /// What is left out at a time.
    pub fn left(&self) -> Left {
        self.groups.left
    }

    /// The readings.
    pub fn measurement(&self) -> &Measurement {
        self.measurement
    }

    /// Number of reconstructions that [`scores`](Self::scores) makes of this many methods.
    pub fn tasks(&self, methods: usize) -> usize {
        methods * self.groups.count
    }

    /// Number of readings that take part.
    pub fn readings(&self) -> usize {
        self.poses.len()
    }

    /// The errors of methods, each at all readings that were left out once. `done` is told after each of
    /// [`tasks`](Self::tasks).
    pub fn scores(
        &self,
        methods: &[Arc<dyn Reconstruct>],
        done: impl Fn() + Sync,
    ) -> Vec<Result<Scores, ReconstructError>> {
        let groups = self.groups.count;
        let tasks: Vec<_> = methods
            .iter()
            .flat_map(|method| (0..groups).map(move |group| (method, group)))
            .collect();
        let predicted: Vec<_> = tasks
            .into_par_iter()
            .map(|(method, group)| {
                let predicted = self.predict(&**method, group);
                done();
                predicted
            })
            .collect();
        let judges = self.groups.judges(&self.poses);
        predicted
            .chunks(groups)
            .map(|of_groups| {
                let mut of_groups = of_groups
                    .iter()
                    .map(|p| p.as_ref().map(|p| p.iter()).map_err(Clone::clone))
                    .collect::<Result<Vec<_>, _>>()?;
                let next = |&(_, group): &(usize, usize)| of_groups[group].next().copied();
                Ok(self.jury.errors(&Values {
                    luminance: judges.iter().filter_map(next).collect(),
                    missing: Vec::new(),
                }))
            })
            .collect()
    }

    /// What a method makes of the readings of a group without them, in their order: luminance, sr⁻¹.
    fn predict(
        &self,
        method: &dyn Reconstruct,
        group: usize,
    ) -> Result<Vec<f64>, ReconstructError> {
        let Measurement {
            schedule, channels, ..
        } = self.measurement;
        let mut present = vec![false; schedule.poses.len()];
        for (&pose, kept) in self.poses.iter().zip(self.groups.kept(group)) {
            present[pose] = kept;
        }
        let interpolant = method.interpolate(&Readings {
            schedule,
            width: channels.count(),
            values: &self.measurement.values,
            present: &present,
            noise: noise(self.measurement),
        })?;
        let of = self.poses.iter().zip(&self.groups.of);
        let pairs = of.filter(|(_, of)| **of == Some(group));
        let pairs: Vec<_> = pairs.map(|(&pose, _)| schedule.poses[pose].pair).collect();
        let values = values(&*interpolant, &pairs);
        let luminance = values.chunks_exact(channels.count());
        Ok(luminance.map(|v| channels.luminance(v)).collect())
    }
}
