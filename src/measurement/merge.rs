//! Merging of all readings of one configuration into one.

use super::{Details, Flags, Measurement, Outcome};
use crate::schedule::Schedule;
use crate::schedule::grid::Distinct;
use std::sync::Arc;

impl Measurement {
    /// The measurement with each configuration once, and the number of poses that were dropped:
    /// those that name the configuration of an earlier one under the symmetries of the schedule,
    /// as in tables by others (light and sensor exchanged, the sample turned). Readings become
    /// their mean; scatter (type A) averages out, shared errors (type B) do not; every flag stays.
    /// A schedule on a lattice has no such poses.
    #[must_use]
    pub fn merged(self) -> (Self, usize) {
        let schedule = &self.schedule;
        if schedule.lattice.is_some() {
            return (self, 0);
        }
        let n = self.channels.count();
        let mut distinct = Distinct::new(schedule.parametrization.axes());
        let mut poses = Vec::new();
        let mut outcomes: Vec<Outcome> = Vec::new();
        let (mut values, mut rows): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        let mut details = self.details.as_ref().map(|_| Details::default());
        for (i, pose) in schedule.poses.iter().enumerate() {
            let at = distinct.first(&pose.coords, poses.len() as u32) as usize;
            if at == poses.len() {
                poses.push(*pose);
                outcomes.push(self.outcomes[i]);
                rows.push(0.0);
                values.resize(values.len() + n, 0.0);
                if let Some(details) = &mut details {
                    details.type_a.resize(values.len(), 0.0);
                    details.type_b.resize(values.len(), 0.0);
                    details.flags.push(Flags::NONE);
                }
            }
            if let (Some(to), Some(from)) = (&mut details, &self.details) {
                to.flags[at] = to.flags[at].with(from.flags[i]);
            }
            let Some(reading) = self.value(i) else {
                continue;
            };
            outcomes[at] = Outcome::Reading;
            rows[at] += 1.0;
            for (c, value) in reading.iter().enumerate() {
                values[at * n + c] += value;
                if let (Some(to), Some(from)) = (&mut details, &self.details) {
                    let a = &mut to.type_a[at * n + c];
                    *a = a.hypot(from.type_a[i * n + c]);
                    to.type_b[at * n + c] += from.type_b[i * n + c];
                }
            }
        }
        let merged = schedule.poses.len() - poses.len();
        if merged == 0 {
            return (self, 0);
        }
        let divide = |sums: &mut [f64]| {
            for (sums, rows) in sums.chunks_exact_mut(n).zip(&rows) {
                sums.iter_mut().for_each(|sum| *sum /= rows.max(1.0));
            }
        };
        divide(&mut values);
        if let Some(details) = &mut details {
            divide(&mut details.type_a);
            divide(&mut details.type_b);
        }
        let schedule = Arc::new(Schedule {
            poses,
            ..Schedule::clone(schedule)
        });
        let measurement = Self {
            schedule,
            channels: self.channels.clone(),
            values,
            outcomes,
            details,
        };
        (measurement, merged)
    }
}
