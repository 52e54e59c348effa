//! Readings that are predicted from the others.

use super::left_out::{Groups, Left};
use super::{Estimate, ReferenceReadings, Scores, ValidationError};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::metrics::Measure;
use crate::reconstruct::{
    EPSILON, LeftOut, Predicted, Readings, Reconstruct, ReconstructError, Replicated, Suspect,
    noise, states_uncertainties, suspects, values_at,
};
use rayon::prelude::*;
use std::sync::Arc;

/// Most readings that take part: of more, every k-th does.
const MOST: usize = 20_000;

/// Readings that are left out in turn.
pub struct CrossValidation<'a> {
    pub(crate) measurement: &'a Measurement,
    /// The poses of the readings that take part.
    poses: Vec<usize>,
    groups: Groups,
    jury: ReferenceReadings,
}

impl<'a> CrossValidation<'a> {
    /// Of the readings of a measurement that others do not contradict ([`suspects`]). `sheets`: whole sheets are left out, or not; `None`: where most
    /// readings lie in sheets.
    ///
    /// # Errors
    /// If there are fewer than two readings at different places, or than three sheets where `sheets` asks for
    /// them; of `None` also if the readings are all of one incidence or two, or in the plane of incidence.
    pub fn new(
        measurement: &'a Measurement,
        sheets: Option<bool>,
    ) -> Result<Self, ValidationError> {
        let (poses, groups) = Self::groups(measurement, sheets, &suspects(measurement))?;
        let judges = groups.judges(&poses);
        Ok(Self {
            jury: ReferenceReadings::from_poses(measurement, &judges, groups.count, true)?,
            measurement,
            poses,
            groups,
        })
    }

    /// True if readings can choose their method, without what it takes to do so.
    pub(crate) fn is_possible(measurement: &Measurement) -> bool {
        Self::groups(measurement, None, &[]).is_ok()
    }

    /// The poses that take part, and which of them are left out together.
    fn groups(
        measurement: &Measurement,
        sheets: Option<bool>,
        suspects: &[Suspect],
    ) -> Result<(Vec<usize>, Groups), ValidationError> {
        let is_suspected = |i: usize| suspects.iter().any(|suspect| suspect.pose == i);
        let readings = (0..measurement.outcomes.len())
            .filter(|&i| measurement.value(i).is_some() && !is_suspected(i));
        let step = measurement.readings().div_ceil(MOST).max(1);
        let poses: Vec<usize> = readings.step_by(step).collect();
        let groups = Groups::new(measurement, &poses, sheets)?;
        Ok((poses, groups))
    }

    /// What is left out at a time.
    pub fn left(&self) -> Left {
        self.groups.left
    }

    /// Number of reconstructions that [`scores`](Self::scores) makes of this many methods.
    pub(crate) fn tasks(&self, methods: usize) -> usize {
        methods * self.groups.count
    }

    /// Number of readings that take part.
    pub(crate) fn readings(&self) -> usize {
        self.poses.len()
    }

    /// The errors of methods, each at all readings that were left out once. `done` is called after each
    /// task.
    pub fn scores(
        &self,
        methods: &[Arc<dyn Reconstruct>],
        done: impl Fn() + Sync,
    ) -> Vec<Result<Scores, ReconstructError>> {
        let parts = self.parts();
        let (noise, all) = (noise(self.measurement), self.taking_part());
        let all = Readings::new(self.measurement, &all, noise.as_deref());
        let score = |method: &Arc<dyn Reconstruct>| {
            let predict = |part: &LeftOut| {
                let others = Readings::new(self.measurement, &part.present, noise.as_deref());
                let interpolant = method.interpolate(&others);
                done();
                interpolant.map(|made| values_at(&*made, &self.pairs(part)))
            };
            let predicted = match method.leave_out(&all, &parts)? {
                Some(predicted) => {
                    parts.iter().for_each(|_| done());
                    predicted.into_iter().map(|of| of.values).collect()
                }
                None => {
                    // Of several errors the first one counts.
                    let predicted: Vec<_> = parts.par_iter().map(predict).collect();
                    predicted.into_iter().collect::<Result<_, _>>()?
                }
            };
            let predicted: Vec<Vec<f64>> = predicted;
            let predicted: Vec<_> = predicted.iter().map(|of| self.luminance(of)).collect();
            let predicted = self.in_order_of_judges(&predicted);
            Ok(self.jury.errors(&predicted.into()))
        };
        methods.par_iter().map(score).collect()
    }

    /// The share of the readings left out that a method predicts within k = 2, per [`Measure::USUAL`], by the
    /// uncertainty of type A that those left give it and by their own, see [`ReferenceReadings::within`]: what is shared (type
    /// B) is no difference between them. `None` if more than half of the readings have no uncertainty, or none has one of type A.
    ///
    /// # Errors
    /// As [`Reconstruct::interpolate`].
    pub fn within(
        &self,
        method: &dyn Reconstruct,
    ) -> Result<Option<[Estimate; Measure::USUAL.len()]>, ReconstructError> {
        if !states_uncertainties(self.measurement) {
            return Ok(None);
        }
        let parts = self.parts();
        let (noise, all) = (noise(self.measurement), self.taking_part());
        let all = Readings::new(self.measurement, &all, noise.as_deref());
        if let Some(predicted) = method.leave_out(&all, &parts)? {
            let of = |of: &Predicted| {
                let values = self.luminance(&of.values).into_iter().zip(&of.variances);
                let each = values.map(|(f, v)| (f, (f + EPSILON) * v.sqrt()));
                each.collect::<Vec<_>>()
            };
            let predicted: Vec<_> = predicted.iter().map(of).collect();
            let predicted = self.in_order_of_judges(&predicted).into_iter();
            let (values, uncertainty): (Vec<_>, Vec<_>) = predicted.unzip();
            return Ok(Some(self.jury.within(&values.into(), &uncertainty)));
        }
        let mut predicted = Vec::new();
        for part in parts {
            match Replicated::of_some(self.measurement, &part.present, method)? {
                Some(replicated) => predicted.push(replicated.luminance_at(&self.pairs(&part))),
                None => return Ok(None),
            }
        }
        let predicted = self.in_order_of_judges(&predicted).into_iter();
        let (values, uncertainty): (Vec<_>, Vec<_>) =
            predicted.map(|p| (p.value, p.type_a)).unzip();
        let is_known = uncertainty.iter().any(|u| *u != 0.0);
        Ok(is_known.then(|| self.jury.within(&values.into(), &uncertainty)))
    }

    /// What was predicted of each group, as one list in the order of the jury.
    fn in_order_of_judges<T: Copy>(&self, predicted: &[Vec<T>]) -> Vec<T> {
        let mut of_groups: Vec<_> = predicted.iter().map(|p| p.iter().copied()).collect();
        let judges = self.groups.judges(&self.poses);
        let next = |&(_, group): &(usize, usize)| of_groups[group].next();
        judges.iter().filter_map(next).collect()
    }

    /// The luminance of values, pose after pose, sr⁻¹.
    fn luminance(&self, values: &[f64]) -> Vec<f64> {
        let channels = &self.measurement.channels;
        let values = values.chunks_exact(channels.count());
        values.map(|v| channels.luminance(v)).collect()
    }

    /// One flag per pose: true of those that take part.
    fn taking_part(&self) -> Vec<bool> {
        let mut all = vec![false; self.measurement.outcomes.len()];
        self.poses.iter().for_each(|&pose| all[pose] = true);
        all
    }

    /// All groups of readings, each with what predicts it.
    fn parts(&self) -> Vec<LeftOut> {
        (0..self.groups.count).map(|g| self.part(g)).collect()
    }

    fn part(&self, group: usize) -> LeftOut {
        let mut present = vec![false; self.measurement.outcomes.len()];
        for (&pose, kept) in self.poses.iter().zip(self.groups.kept(group)) {
            present[pose] = kept;
        }
        let of = self.poses.iter().zip(&self.groups.of);
        let left = of.filter(|(_, of)| **of == Some(group));
        LeftOut {
            present,
            poses: left.map(|(&pose, _)| pose).collect(),
        }
    }

    /// The pairs that are predicted.
    fn pairs(&self, part: &LeftOut) -> Vec<DirectionPair> {
        let poses = &self.measurement.schedule.poses;
        part.poses.iter().map(|&pose| poses[pose].pair).collect()
    }
}
