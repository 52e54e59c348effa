//! Poses that are carried out for a page: by an instrument along its tour, or as they are.

use super::facts::metrics;
use super::packed::Parts;
use super::readings::MOST;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::{Plan, PlannedInstrument, Router, Unit};
use crate::geometry::Symmetry;
use crate::instrument::{Ideal, Instrument, Machine, classes};
use crate::measurement::Measurement;
use crate::metrics::{Measure, TestSet, evaluate};
use crate::reconstruct::{Reconstruct, ThinPlate};
use crate::schedule::{Itinerary, Schedule, ScheduleFile};
use serde_json::{Value as Json, json};
use std::sync::Arc;

/// Shares of the visits of a tour that its error is found after.
const BUDGETS: [f64; 8] = [0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0];

/// Poses out of reach that are named.
const NAMED: usize = 200;

/// The most visits that a page holds.
pub(super) const MOST_VISITS: usize = 20_000;

/// Poses, and who visits them.
pub struct Carried {
    schedule: Arc<Schedule>,
    by: Option<(PlannedInstrument, Itinerary)>,
    seed: u64,
    command: String,
}

impl Carried {
    /// The largest schedule of a plan that a page holds all readings of, by its first instrument; `command` carries it out.
    ///
    /// # Errors
    /// As a run's; [`Error::Infeasible`] where all poses are chosen from readings.
    pub fn of_plan(plan: &Plan, symmetry: Symmetry, command: String) -> Result<Self, Error> {
        let given = |unit: &&Unit| !plan.sample_sets[unit.sample_set].learns();
        // The largest that a page holds, else the smallest.
        let size = |unit: &Unit| match unit.allowance.count() {
            Some(n) if n > MOST => -(n as i64),
            n => n.map_or(0, |n| n as i64),
        };
        let units = plan.units();
        let Some(unit) = units.iter().filter(given).max_by_key(|unit| size(unit)) else {
            let message =
                "its poses are chosen from readings; allowed: a sample set whose poses are given";
            return Err(Error::infeasible("sample_set", message));
        };
        let key = plan.schedule_key(unit, symmetry);
        let route = Router::default().find(&key, false)?;
        Ok(Self {
            by: key.instrument.cloned().zip(route.itinerary().cloned()),
            schedule: route.schedule,
            seed: key.seed,
            command,
        })
    }

    /// The poses of a file, in its order; `command` carries them out.
    ///
    /// # Errors
    /// If the instrument cannot be built.
    pub fn of_file(
        file: ScheduleFile,
        instrument: PlannedInstrument,
        command: String,
    ) -> Result<Self, Error> {
        let bench = instrument.bench(instrument.use_of.parts(), 1);
        let bench = bench.map_err(Error::internal)?;
        let mut itinerary = bench.plan_given(&file.schedule, &file.order);
        itinerary.unreachable.extend(&file.unreachable);
        Ok(Self {
            schedule: file.schedule.into(),
            by: Some((instrument, itinerary)),
            seed: 1,
            command,
        })
    }

    /// The readings of a material.
    pub(super) fn read(&self, brdf: &dyn Brdf) -> Result<Measurement, Error> {
        let Some((instrument, itinerary)) = &self.by else {
            return Ok(Ideal.measure(brdf, &self.schedule));
        };
        instrument.check_symmetry(brdf.symmetry(), "the material", || "--instrument".into())?;
        let bench = instrument.bench(instrument.use_of.parts(), self.seed);
        let bench = bench.map_err(Error::internal)?;
        let session = bench.session(itinerary, self.seed);
        Ok(session.measure(brdf, &self.schedule))
    }

    /// Visits of the tour.
    pub(super) fn visits(&self) -> usize {
        self.by.as_ref().map_or(0, |(_, tour)| tour.visits.len())
    }

    /// For each pose its place on the tour; of one that is out of reach the largest number. `None` without an instrument.
    pub(super) fn places(&self) -> Option<Vec<u32>> {
        let (_, itinerary) = self.by.as_ref()?;
        let mut places = vec![u32::MAX; self.schedule.poses.len()];
        for (place, visit) in (0u32..).zip(&itinerary.visits) {
            places[visit.pose as usize] = place;
        }
        Some(places)
    }

    /// The instrument and its tour as the page holds them.
    pub(super) fn facts(&self, errors: &[Json], parts: &Parts) -> Option<Json> {
        let (instrument, itinerary) = self.by.as_ref()?;
        let mut classes = classes().iter();
        let class = classes.find(|class| class.name == instrument.spec.class)?;
        let machine = Machine::new(&instrument.spec).ok()?;
        let axes = class.axes.iter().zip(machine.axes());
        let axes = axes.map(|(template, axis)| {
            let parent = template.parent.map_or(-1, |parent| parent as i64);
            let wraps = axis.motion.wraps;
            json!({"name": axis.name, "parent": parent, "vector": template.vector, "wraps": wraps})
        });
        let axes: Vec<Json> = axes.collect();
        let [light, sensor, sample] = [class.ends.light, class.ends.sensor, class.ends.sample]
            .map(|axis| axis.map_or(-1, |axis| axis as i64));
        let mut until = 0.0;
        let mut columns = Vec::new();
        for visit in itinerary.visits.iter().take(MOST_VISITS) {
            until += visit.seconds;
            let pair = self.schedule.poses[visit.pose as usize].pair;
            columns.extend([f64::from(visit.pose), f64::from(visit.stop), until]);
            columns.extend(pair.omega_i.vector().to_array());
            columns.extend(pair.omega_o.vector().to_array());
            columns.extend(&visit.positions[..axes.len()]);
        }
        parts.add_numbers("visits", columns);
        let lost = itinerary.unreachable.iter().take(NAMED);
        let lost = lost.map(|(pose, why)| json!({"pose": pose, "why": why.name()}));
        Some(json!({
            "name": itinerary.instrument,
            "ends": {"light": light, "sensor": sensor, "sample": sample},
            "columns": 9 + axes.len(),
            "axes": axes,
            "blob": "visits",
            "lost": lost.collect::<Vec<_>>(),
            "lostCount": itinerary.unreachable.len(),
            "errors": errors,
            "command": self.command,
        }))
    }

    /// Errors of reconstructions of a BRDF from its first readings along the tour; of pictures whole ones.
    pub(super) fn errors(&self, truth: &dyn Brdf, measurement: &Measurement) -> Vec<Json> {
        let set = TestSet::new(&[Measure::Cosine], &metrics());
        let (Some((_, itinerary)), Ok(set)) = (&self.by, set) else {
            return Vec::new();
        };
        let level = set.level(0);
        let f = evaluate(truth, &level.pairs);
        let visits = &itinerary.visits;
        let end = |share: f64| {
            let mut n = (share * visits.len() as f64).round() as usize;
            while n > 0 && n < visits.len() && visits[n].stop == visits[n - 1].stop {
                n += 1;
            }
            n
        };
        let mut ends = BUDGETS.map(end).to_vec();
        ends.dedup();
        let so_far = |n: usize| {
            let first: Vec<u32> = visits[..n].iter().map(|visit| visit.pose).collect();
            let part = measurement.clone().of_poses(&first, &itinerary.unreachable);
            let seconds: f64 = visits[..n].iter().map(|visit| visit.seconds).sum();
            // A part of a grid is no grid, and one method for all numbers of readings shows what readings add.
            let method = ThinPlate::default();
            let tally = method.reconstruct(&part).ok().map(|copy| {
                let mut tally = set.tally();
                level.add_to(&mut tally, &f, &evaluate(&*copy, &level.pairs));
                tally
            });
            json!({
                "visits": n, "minutes": seconds / 60.0, "method": method.label(),
                "nrmse": tally.as_ref().and_then(|tally| tally.errors(0).nrmse),
                "error": tally.as_ref().and_then(|tally| tally.standard_errors(0).nrmse),
            })
        };
        ends.into_iter().filter(|n| *n > 0).map(so_far).collect()
    }
}
