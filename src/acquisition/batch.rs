//! One step of a laboratory: the poses to read next.

use super::{Forecast, Planner, Task, nothing, scheduled};
use crate::geometry::Symmetry;
use crate::instrument::Machine;
use crate::measurement::Measurement;
use crate::parametrization::usual_form;
use crate::schedule::{PlanError, Schedule};

/// What is asked of a planner.
pub struct Request<'a> {
    /// Number of poses, at most.
    pub batch: usize,
    /// Symmetries of the material, by which poses are folded.
    pub symmetry: Symmetry,
    /// Seed of whatever is random.
    pub seed: u64,
    /// The machine that is to reach every pose; `None`: each can be taken.
    pub machine: Option<&'a Machine>,
    /// Asked before each choice: false ends the batch with the poses so far.
    pub go_on: &'a dyn Fn() -> bool,
}

/// The answer of a planner.
pub struct Batch {
    /// The next poses, the most telling first; none if the readings are enough.
    pub schedule: Schedule,
    /// True if the readings so far have reached the target.
    pub is_enough: bool,
    /// Poses that were asked for before.
    pub asked: usize,
    /// Readings so far.
    pub readings: usize,
    /// Errors expected now, and with readings at these poses too; `None` where they are not known.
    pub forecast: Option<Forecast>,
}

impl<'a> Request<'a> {
    /// The task of an acquisition that goes on from a measurement.
    fn task(&self, so_far: Option<&Measurement>) -> Task<'a> {
        Task {
            form: usual_form(self.symmetry),
            budget: so_far.map_or(0, |m| m.schedule.poses.len()) + self.batch,
            seed: self.seed,
            machine: self.machine,
            go_on: self.go_on,
            truth: None,
        }
    }

    /// The poses that a planner chooses after the readings so far; `None`: after none.
    ///
    /// # Errors
    /// As [`Planner::next`].
    pub fn ask(
        &self,
        planner: &dyn Planner,
        so_far: Option<&Measurement>,
    ) -> Result<Batch, PlanError> {
        let task = self.task(so_far);
        let nothing = nothing(&task);
        let so_far = so_far.unwrap_or(&nothing);
        let is_enough = planner.is_enough(&task, so_far);
        let poses = match is_enough {
            true => Vec::new(),
            false => planner.next(&task, so_far, self.batch)?,
        };
        Ok(Batch {
            forecast: planner.forecast(&task, so_far, &poses),
            schedule: scheduled(&task, planner, poses),
            is_enough,
            asked: so_far.schedule.poses.len(),
            readings: so_far.readings(),
        })
    }

    /// The errors that a planner expects of readings, in the task that goes on from others.
    pub(crate) fn forecast(
        &self,
        planner: &dyn Planner,
        from: Option<&Measurement>,
        of: &Measurement,
    ) -> Option<Forecast> {
        planner.forecast(&self.task(from), of, &[])
    }
}
