//! Merging of all readings of one configuration into one.
//!
//! Of readings x_1 … x_n of one configuration with uncertainties a_j (type A) and b_j (type B)
//!
//! - the value is their mean;
//! - type A is the larger of √(Σ a_j²) / n, which the rows claim, and of the standard error of the
//!   mean, √(Σ (x_j − mean)² / (n (n − 1))), which they show (0 if n = 1). Their scatter holds what
//!   they claim already, so the two are not added;
//! - type B, which all readings share, is the mean of b_j.

use super::{Details, Flags, Measurement, Outcome};
use crate::brdf::Channels;
use crate::error::count;
use crate::schedule::grid::Distinct;
use crate::schedule::{Pose, Schedule};
use std::sync::Arc;

/// Configurations that tell whether symmetries hold, at least.
const FEWEST_COMPARED: usize = 10;

/// Median scatter of the readings of one configuration up to which they are noisy, as a share of their mean.
const LARGEST_SCATTER: f64 = 0.1;

/// The same in units of the uncertainty that they claim.
const CLAIMED: f64 = 3.0;

/// Scatter that is rounding, as a share of the mean.
const ROUNDING: f64 = 1e-12;

/// Readings of one channel of one configuration.
#[derive(Clone, Copy, Default)]
struct Mean {
    count: u32,
    mean: f64,
    /// Sum of the squared differences to the mean.
    squares: f64,
    /// Root of the sum of the squared type A.
    type_a: f64,
    /// Sum of type B.
    type_b: f64,
}

impl Mean {
    fn add(&mut self, value: f64, type_a: f64, type_b: f64) {
        self.count += 1;
        if self.count == 1 {
            self.mean = value;
        } else {
            let step = value - self.mean;
            self.mean += step / f64::from(self.count);
            self.squares += step * (value - self.mean);
        }
        self.type_a = self.type_a.hypot(type_a);
        self.type_b += type_b;
    }

    fn type_a(&self) -> f64 {
        let n = f64::from(self.count.max(1));
        let shown = (self.squares / (n * (n - 1.0).max(1.0))).sqrt();
        // Equal numbers that were rounded differently are equal.
        let shown = if shown > ROUNDING * self.mean.abs() {
            shown
        } else {
            0.0
        };
        shown.max(self.type_a / n)
    }

    fn type_b(&self) -> f64 {
        self.type_b / f64::from(self.count.max(1))
    }
}

/// Configurations, and all readings of each.
pub(super) struct Pool {
    channels: usize,
    outcomes: Vec<Option<Outcome>>,
    flags: Vec<Flags>,
    means: Vec<Mean>,
}

impl Pool {
    /// So many configurations, none of which was visited.
    pub fn new(poses: usize, channels: usize) -> Self {
        Self {
            channels,
            outcomes: vec![None; poses],
            flags: vec![Flags::NONE; poses],
            means: vec![Mean::default(); poses * channels],
        }
    }

    /// Adds an outcome. A reading goes before every reason why there is none, the first reason
    /// before others; every flag stays.
    pub fn see(&mut self, pose: usize, outcome: Outcome, flags: Flags) {
        let before = &mut self.outcomes[pose];
        if before.is_none() || outcome == Outcome::Reading {
            *before = Some(outcome);
        }
        self.flags[pose] = self.flags[pose].with(flags);
    }

    /// Adds a reading of one channel.
    pub fn add(&mut self, pose: usize, channel: usize, value: f64, type_a: f64, type_b: f64) {
        self.means[pose * self.channels + channel].add(value, type_a, type_b);
    }

    /// The first channel of a configuration that was read, but not in this channel.
    pub fn missing(&self, pose: usize) -> Option<usize> {
        let read = self.outcomes[pose] == Some(Outcome::Reading);
        let means = &self.means[pose * self.channels..(pose + 1) * self.channels];
        means.iter().position(|m| read && m.count == 0)
    }

    /// Readings beyond the first of each channel of each configuration.
    pub fn repeats(&self) -> usize {
        let beyond = self.means.iter().map(|m| m.count.saturating_sub(1));
        beyond.map(|n| n as usize).sum()
    }

    /// How much the readings of one configuration differ, of its first channel.
    fn folded(&self, poses: usize) -> Folded {
        let several = self.means.iter().step_by(self.channels);
        let several = several.filter(|m| m.count > 1 && m.mean > 0.0);
        let (mut scatter, mut claimed) = (Vec::new(), Vec::new());
        for m in several {
            let n = f64::from(m.count);
            scatter.push((m.squares / (n - 1.0)).sqrt() / m.mean);
            claimed.push(m.type_a / n.sqrt() / m.mean);
        }
        let median = |values: &mut [f64]| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0)
        };
        Folded {
            poses,
            compared: scatter.len(),
            scatter: median(&mut scatter),
            claimed: median(&mut claimed),
        }
    }

    /// The measurement; it has details if `detailed`, or if there are flags or repeats.
    pub fn measurement(
        self,
        schedule: Arc<Schedule>,
        channels: Channels,
        detailed: bool,
    ) -> Measurement {
        let flagged = self.flags.iter().any(|f| *f != Flags::NONE);
        let detailed = detailed || flagged || self.repeats() > 0;
        let means = &self.means;
        let outcomes = self.outcomes.iter();
        Measurement {
            schedule,
            channels,
            values: means.iter().map(|m| m.mean).collect(),
            outcomes: outcomes.map(|o| o.unwrap_or(Outcome::NotVisited)).collect(),
            details: detailed.then(|| Details {
                type_a: means.iter().map(Mean::type_a).collect(),
                type_b: means.iter().map(Mean::type_b).collect(),
                flags: self.flags,
            }),
            places: Vec::new(),
            half_angles_deg: [0.0; 2],
        }
    }
}

/// Poses that symmetries made one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Folded {
    /// Poses that were dropped.
    pub poses: usize,
    /// Configurations of which several poses have readings.
    pub compared: usize,
    /// Median over these of the standard deviation of the readings, as a share of their mean.
    pub scatter: f64,
    /// The same of the uncertainty of type A that the readings claim.
    pub claimed: f64,
}

impl Folded {
    /// The sentence that doubts the symmetries, if readings that they make one differ by far more than noise.
    pub fn warning(&self) -> Option<String> {
        let differ = self.compared >= FEWEST_COMPARED
            && self.scatter > LARGEST_SCATTER.max(CLAIMED * self.claimed);
        differ.then(|| {
            format!(
                "readings that these symmetries make one scatter by {:.0} % (median of {}), and their mean is \
                 taken: unless that is noise, the sample does not have them all; allowed: --symmetry with \
                 those that it has, or none",
                100.0 * self.scatter,
                count(self.compared, "configuration")
            )
        })
    }
}

impl Measurement {
    /// The measurement with each configuration once, and what was folded: poses are dropped that name the configuration of an earlier one under the symmetries of the schedule,
    /// as in tables by others (light and sensor exchanged, the sample turned). Readings become
    /// their mean with the larger of the type A that they claim and that they show; shared errors
    /// (type B) stay, and so does every flag. A schedule on a lattice has no such poses.
    #[must_use]
    pub fn merged(self) -> (Self, Folded) {
        let schedule = &self.schedule;
        if schedule.lattice.is_some() {
            return (self, Folded::default());
        }
        let mut distinct = Distinct::new(schedule.parametrization.axes());
        let mut poses = Vec::new();
        let mut firsts = Vec::new();
        let mut place = |(i, pose): (usize, &Pose)| {
            let at = distinct.first(&pose.coords, poses.len() as u32) as usize;
            if at == poses.len() {
                poses.push(*pose);
                firsts.push(i);
            }
            at
        };
        let places: Vec<usize> = schedule.poses.iter().enumerate().map(&mut place).collect();
        let merged = places.len() - poses.len();
        if merged == 0 {
            return (self, Folded::default());
        }
        let n = self.channels.count();
        let mut pool = Pool::new(poses.len(), n);
        for (i, at) in places.into_iter().enumerate() {
            let details = self.details.as_ref();
            pool.see(
                at,
                self.outcomes[i],
                details.map_or(Flags::NONE, |d| d.flags[i]),
            );
            for (c, &value) in self.value(i).into_iter().flatten().enumerate() {
                let of = |types: &[f64]| types[i * n + c];
                let [a, b] = details.map_or([0.0; 2], |d| [of(&d.type_a), of(&d.type_b)]);
                pool.add(at, c, value, a, b);
            }
        }
        let schedule = Arc::new(Schedule {
            poses,
            ..Schedule::clone(schedule)
        });
        let detailed = self.details.is_some();
        let folded = pool.folded(merged);
        let half_angles_deg = self.half_angles_deg;
        let mut merged = pool.measurement(schedule, self.channels, detailed);
        if !self.places.is_empty() {
            merged.places = firsts.iter().map(|&i| self.places[i]).collect();
        }
        merged.half_angles_deg = half_angles_deg;
        (merged, folded)
    }
}
