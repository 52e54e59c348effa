//! Sample sets of the physical points of a sequence in the unit cube.

use super::grid::Distinct;
use super::sample_set::{Planned, SampleSet, from_unit, is_visible, place};
use super::{Pose, Schedule};
use crate::geometry::DirectionPair;
use crate::parametrization::Parametrization;
use crate::registry::{Resolved, declare};
use crate::sampling::{Random, Sobol};
use std::sync::Arc;

/// A sequence of points in the unit cube, as a kind of sample set: the first N that are physical.
pub trait PointSet: Resolved + std::fmt::Debug + Send + Sync {
    /// The `kind` a config writes.
    const KIND: &'static str;

    /// The points of a seed, in the unit cube; called with 0, 1, 2 and so on, in order.
    fn points(seed: u64) -> impl FnMut(u64) -> [f64; 4];
}

impl<S: PointSet> SampleSet for S {
    fn plan(&self, form: &Arc<dyn Parametrization>, budget: usize, seed: u64) -> Planned {
        let axes = form.axes();
        let mut point = Self::points(seed);
        let pose = |i: u64| place(&**form, &from_unit(axes, &point(i)));
        accept(form, budget, Self::KIND, pose)
    }
}

declare! {
    impl dyn SampleSet, "sobol": "Owen-scrambled Sobol points", [""]
    /// Scrambled Sobol points.
    pub struct SobolSet {}
}

impl PointSet for SobolSet {
    const KIND: &'static str = Self::KIND;

    fn points(seed: u64) -> impl FnMut(u64) -> [f64; 4] {
        let mut sobol = Sobol::new(seed);
        move |i| sobol.point(i)
    }
}

declare! {
    impl dyn SampleSet, "random": "independent uniform points", [""]
    /// Independent uniform points.
    pub struct RandomSet {}
}

impl PointSet for RandomSet {
    const KIND: &'static str = Self::KIND;

    fn points(seed: u64) -> impl FnMut(u64) -> [f64; 4] {
        let random = Random::new(seed);
        move |i| random.point(i)
    }
}

/// The first `budget` physical poses of a sequence.
pub(super) fn accept(
    parametrization: &Arc<dyn Parametrization>,
    budget: usize,
    kind: &'static str,
    mut pose: impl FnMut(u64) -> Option<Pose>,
) -> Planned {
    // Every parametrization has more than half of its box above the horizon in 3-D and more than
    // a quarter in 4-D; a sequence that misses a thousand times in a row never hits.
    let patience = 1000 * (budget as u64 + 1);
    let mut poses = Vec::with_capacity(budget);
    let mut tried = 0;
    while poses.len() < budget && tried < patience {
        poses.extend(pose(tried));
        tried += 1;
    }
    let unphysical_share = 1.0 - poses.len() as f64 / tried as f64;
    Schedule::chosen(parametrization, kind, budget, poses, unphysical_share)
}

/// The first `budget` poses that differ under the symmetries of the coordinates; directions stay as they are given, for
/// instruments whose arms differ.
pub(super) fn first_of(
    parametrization: &Arc<dyn Parametrization>,
    budget: usize,
    kind: &'static str,
    pairs: impl IntoIterator<Item = DirectionPair>,
) -> Planned {
    let mut distinct = Distinct::new(parametrization.axes());
    let mut poses = Vec::new();
    for pair in pairs {
        if poses.len() == budget {
            break;
        }
        let next = poses.len() as u32;
        let coords = parametrization.canonical(&parametrization.forward(&pair));
        let is_new = |coords: &_| is_visible(&pair) && distinct.first(coords, next) == next;
        let new = coords.filter(is_new);
        poses.extend(new.map(|coords| Pose { coords, pair }));
    }
    Schedule::chosen(parametrization, kind, budget, poses, 0.0)
}
