//! Poses that are carried out for a page: by an instrument along its tour, or as they are.

use super::facts::metrics;
use super::machine::{ErrorSoFar, Tour};
use super::page::{Exploration, ShownMaterial, ShownReadings};
use super::readings::MOST;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::{Plan, PlannedInstrument, Router, Unit, quoted};
use crate::geometry::Symmetry;
use crate::instrument::{Ideal, Instrument};
use crate::measurement::Measurement;
use crate::metrics::{Measure, TestSet, evaluate};
use crate::reconstruct::{Reconstruct, ThinPlate};
use crate::schedule::{Itinerary, Schedule, ScheduleFile};
use std::sync::Arc;

/// Shares of the visits of a tour that its error is found after.
const BUDGETS: [f64; 8] = [0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0];

/// Poses, and who visits them.
pub(crate) struct Carried {
    schedule: Arc<Schedule>,
    by: Option<(PlannedInstrument, Itinerary)>,
    seed: u64,
}

impl Carried {
    /// The largest schedule of a plan that a page holds all readings of, by its first instrument. Errors: as a run's; [`Error::Infeasible`] where all poses are chosen
    /// from readings.
    pub fn of_plan(plan: &Plan, symmetry: Symmetry) -> Result<Self, Error> {
        let units = plan.units();
        let given = units
            .iter()
            .filter(|unit| !plan.sample_sets[unit.sample_set].learns());
        // The largest that a page holds, else the smallest.
        let size = |unit: &&Unit| match unit.allowance.count() {
            Some(n) if n > MOST => -(n as i64),
            n => n.map_or(0, |n| n as i64),
        };
        let Some(unit) = given.max_by_key(size) else {
            let message =
                "its poses are chosen from readings; allowed: a sample set whose poses are given";
            return Err(Error::infeasible("sample_set", message));
        };
        let key = plan.schedule_key(unit, symmetry);
        let route = Router::default().find(&key, false)?;
        let by = key.instrument.cloned().zip(route.itinerary().cloned());
        let (schedule, seed) = (route.schedule, key.seed);
        Ok(Self { schedule, by, seed })
    }

    /// The poses of a file, in its order.
    pub fn of_file(file: ScheduleFile, instrument: PlannedInstrument) -> Result<Self, Error> {
        let bench = instrument.bench(instrument.use_of.parts(), 1);
        let bench = bench.map_err(Error::internal)?;
        let mut itinerary = bench.plan_given(&file.schedule, &file.order);
        itinerary.unreachable.extend(&file.unreachable);
        Ok(Self {
            schedule: file.schedule.into(),
            by: Some((instrument, itinerary)),
            seed: 1,
        })
    }

    /// The readings of a material.
    pub fn read(&self, brdf: &dyn Brdf) -> Result<Measurement, Error> {
        let Some((instrument, itinerary)) = &self.by else {
            return Ok(Ideal.measure(brdf, &self.schedule));
        };
        instrument.check_symmetry(brdf.symmetry(), "the material", || "--instrument".into())?;
        let bench = instrument.bench(instrument.use_of.parts(), self.seed);
        let bench = bench.map_err(Error::internal)?;
        Ok(bench
            .session(itinerary, self.seed)
            .measure(brdf, &self.schedule))
    }

    /// The tour of the instrument, with the errors of reconstructions of `truth` from the first readings.
    pub fn tour(
        &self,
        truth: Option<(&dyn Brdf, &Measurement)>,
        command: String,
    ) -> Option<Tour<'_>> {
        let (instrument, itinerary) = self.by.as_ref()?;
        let errors = truth.map(|(truth, read)| errors(itinerary, read, truth));
        Some(Tour {
            spec: &instrument.spec,
            schedule: &self.schedule,
            itinerary,
            errors: errors.unwrap_or_default(),
            command,
        })
    }
}

/// The page of a plan: its first material that can be built, the readings of it by the largest schedule, and the tour of the instrument.
/// Errors: as [`Carried::of_plan`]; of no material that can be built the last one's.
pub(crate) fn explored(plan: &Plan) -> Result<String, Error> {
    let mut last = Error::infeasible("material", "there is none");
    for material in &plan.materials {
        let brdf = match material.spec.build(plan.channels.clone()) {
            Ok(brdf) => brdf,
            Err(e) => {
                last = Error::infeasible("material", format!("{}: {e}", material.name));
                continue;
            }
        };
        let carried = Carried::of_plan(plan, material.symmetry)?;
        let measurement = carried.read(&*brdf)?;
        let command = String::from("gonio schedule config.toml -o schedules/");
        let name = &material.name;
        let argument = format!("config.toml --material {}", quoted(name));
        let page = Exploration {
            command: "gonio run config.toml --set output.explore=true".into(),
            materials: vec![ShownMaterial {
                name,
                argument: &argument,
                brdf: &*brdf,
                is_slow: brdf.as_estimated().is_some(),
            }],
            readings: Some(ShownReadings {
                name,
                argument: None,
                measurement: &measurement,
            }),
            tour: carried.tour(Some((&*brdf, &measurement)), command),
            notes: vec![format!("The readings are simulated, of {name}.")],
        };
        return page.html();
    }
    Err(last)
}

/// Errors of reconstructions from the first readings; of pictures whole ones.
fn errors(itinerary: &Itinerary, measurement: &Measurement, truth: &dyn Brdf) -> Vec<ErrorSoFar> {
    let Ok(set) = TestSet::new(&[Measure::Cosine], &metrics()) else {
        return Vec::new();
    };
    let level = set.level(0);
    let f = evaluate(truth, &level.pairs);
    let visits = &itinerary.visits;
    let ends = BUDGETS.map(|share| {
        let mut n = (share * visits.len() as f64).round() as usize;
        while n > 0 && n < visits.len() && visits[n].stop == visits[n - 1].stop {
            n += 1;
        }
        n
    });
    let mut ends = ends.to_vec();
    ends.dedup();
    let so_far = |n: usize| {
        let first: Vec<u32> = visits[..n].iter().map(|visit| visit.pose).collect();
        let part = measurement.clone().of_poses(&first, &itinerary.unreachable);
        let seconds: f64 = visits[..n].iter().map(|visit| visit.seconds).sum();
        // A part of a grid is no grid, and one method for all numbers of readings shows what readings add.
        let method = ThinPlate::default();
        let nrmse = method.reconstruct(&part).ok().map(|copy| {
            let g = evaluate(&*copy, &level.pairs);
            let mut tally = set.tally();
            level.add_to(&mut tally, &f, &g);
            [tally.errors(0).nrmse, tally.standard_errors(0).nrmse]
        });
        ErrorSoFar {
            visits: n,
            minutes: seconds / 60.0,
            nrmse: nrmse.unwrap_or([None; 2]),
            method: method.label(),
        }
    };
    ends.into_iter().filter(|n| *n > 0).map(so_far).collect()
}
