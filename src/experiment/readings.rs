//! Measures a schedule on its instrument, and counts the readings for rows.

use super::counts::{Ledger, Stage, Work};
use super::observer::Stop;
use super::route::{Route, Tour};
use crate::brdf::Brdf;
use crate::instrument::{Ideal, Instrument};
use crate::measurement::{Flags, Measurement};
use crate::schedule::Itinerary;

/// The readings of one schedule.
pub(super) struct Readings {
    /// Measurement by the instrument.
    pub measured: Measurement,
    /// Measurement without limits, if that differs and is asked for.
    pub whole: Option<Measurement>,
    /// True if no pose was out of reach.
    pub nothing_lost: bool,
    /// Counts and shares for the rows.
    pub facts: Facts,
}

/// Columns that all rows of a schedule share.
#[derive(Clone)]
pub(super) struct Facts {
    pub budget: usize,
    pub poses: usize,
    pub readings: usize,
    pub no_data: usize,
    pub reachable: f64,
    pub unreachable: String,
    pub saturated: usize,
    pub below_noise: usize,
    pub instrument_seconds: Option<f64>,
    pub unphysical_share: f64,
}

impl Readings {
    /// Measures a BRDF along a route; the noise depends on the seed.
    pub fn take(
        brdf: &dyn Brdf,
        route: &Route,
        seed: u64,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Self, Stop> {
        let schedule = &route.schedule;
        let Some(tour) = &route.tour else {
            let measured = Ideal.measure(brdf, schedule);
            return Ok(Self {
                facts: Facts::of(&measured, route),
                measured,
                whole: None,
                nothing_lost: true,
            });
        };
        let measure = |tour: &Tour| tour.measure(brdf, schedule, seed, cancelled);
        let measured = measure(tour)?;
        Ok(Self {
            facts: Facts::of(&measured, route),
            nothing_lost: tour.itinerary.unreachable.is_empty(),
            measured,
            whole: route.whole.as_ref().map(measure).transpose()?,
        })
    }

    /// Counts poses that were asked for, and readings; of both measurements.
    pub fn count(&self, ledger: &Ledger) {
        for measured in std::iter::once(&self.measured).chain(&self.whole) {
            ledger.add(Stage::Measure, Work::Poses, measured.outcomes.len());
            ledger.add(Stage::Measure, Work::Readings, measured.readings());
        }
    }
}

impl Facts {
    fn of(measured: &Measurement, route: &Route) -> Self {
        let itinerary = route.itinerary();
        let count = |flag: Flags| {
            let flags = measured.details.iter().flat_map(|d| &d.flags);
            flags.filter(|f| f.has(flag)).count()
        };
        Self {
            budget: route.budget,
            poses: measured.schedule.poses.len(),
            readings: measured.readings(),
            no_data: measured.no_data(),
            reachable: itinerary.map_or(1.0, Itinerary::reachable),
            unreachable: itinerary.map_or(String::new(), Itinerary::reasons_text),
            saturated: count(Flags::SATURATED),
            below_noise: count(Flags::BELOW_NOISE),
            instrument_seconds: itinerary.map(Itinerary::seconds),
            unphysical_share: measured.schedule.unphysical_share,
        }
    }
}
