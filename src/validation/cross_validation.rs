//! Readings that are predicted from the others.

use super::left_out::{Groups, Left};
use super::{Estimate, ReferenceReadings, Scores, ValidationError};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::metrics::Measure;
use crate::reconstruct::{
    Readings, Reconstruct, ReconstructError, Replicated, Suspect, noise, suspects, values_at,
};
use rayon::prelude::*;
use std::sync::Arc;

/// Most readings that take part: of more, every k-th does.
const MOST: usize = 20_000;

/// Readings that are predicted together.
struct Part {
    /// One flag per pose: true of the readings that predict.
    present: Vec<bool>,
    /// Pairs of the readings that are predicted.
    pairs: Vec<DirectionPair>,
}

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
        let parts: Vec<Part> = (0..self.groups.count).map(|g| self.part(g)).collect();
        let score = |method: &Arc<dyn Reconstruct>| {
            let predict = |part: &Part| {
                let predicted = self.predict(&**method, part);
                done();
                predicted
            };
            // Of several errors the first one counts.
            let predicted: Vec<Result<_, _>> = parts.par_iter().map(predict).collect();
            let predicted = predicted.into_iter().collect::<Result<Vec<_>, _>>()?;
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
        let mut predicted = Vec::new();
        for group in 0..self.groups.count {
            let part = self.part(group);
            match Replicated::of_some(self.measurement, &part.present, method)? {
                Some(replicated) => predicted.push(replicated.luminance_at(&part.pairs)),
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

    /// A group of readings and what predicts it.
    fn part(&self, group: usize) -> Part {
        let poses = &self.measurement.schedule.poses;
        let mut present = vec![false; poses.len()];
        for (&pose, kept) in self.poses.iter().zip(self.groups.kept(group)) {
            present[pose] = kept;
        }
        let of = self.poses.iter().zip(&self.groups.of);
        let left = of.filter(|(_, of)| **of == Some(group));
        Part {
            present,
            pairs: left.map(|(&pose, _)| poses[pose].pair).collect(),
        }
    }

    /// What a method makes of the pairs of a part, in their order: luminance, sr⁻¹.
    fn predict(&self, method: &dyn Reconstruct, part: &Part) -> Result<Vec<f64>, ReconstructError> {
        let channels = &self.measurement.channels;
        let noise = noise(self.measurement);
        let readings = Readings::new(self.measurement, &part.present, noise.as_deref());
        let interpolant = method.interpolate(&readings)?;
        let values = values_at(&*interpolant, &part.pairs);
        let luminance = values.chunks_exact(channels.count());
        Ok(luminance.map(|v| channels.luminance(v)).collect())
    }
}
