//! Measures a schedule on its instrument, and counts the readings for rows.

use super::counts::{Counters, Spent, Stage, Work};
use super::observer::{GoOn, Stop};
use super::route::{Route, Tour};
use super::row::Row;
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
    /// Columns that all rows of these readings share; the others have no value.
    pub facts: Row,
    /// Wall time of making the schedule and the way through it.
    pub planned: Spent,
}

impl Readings {
    /// Measures a BRDF along a route; the noise depends on the seed.
    pub(crate) fn take(
        brdf: &dyn Brdf,
        route: &Route,
        seed: u64,
        go_on: GoOn<'_>,
    ) -> Result<Self, Stop> {
        let measure = |tour: Option<&Tour>| match tour {
            None => Ok(Ideal.measure(brdf, &route.schedule)),
            Some(tour) => tour.measure(brdf, &route.schedule, seed, go_on),
        };
        let measured = measure(route.tour.as_ref())?;
        let whole = route.whole.as_ref().map(|whole| measure(Some(whole)));
        let itinerary = route.itinerary();
        Ok(Self {
            facts: facts(&measured, route),
            planned: route.spent,
            nothing_lost: itinerary.is_none_or(|itinerary| itinerary.unreachable.is_empty()),
            measured,
            whole: whole.transpose()?,
        })
    }

    /// Counts poses that were asked for, and readings; of both measurements.
    pub(crate) fn count(&self, counters: &Counters) {
        for measured in std::iter::once(&self.measured).chain(&self.whole) {
            counters.add(Stage::Measure, Work::Poses, measured.outcomes.len());
            counters.add(Stage::Measure, Work::Readings, measured.readings());
        }
    }
}

/// A row of a measurement along a route: the columns of schedule and readings alone.
fn facts(measured: &Measurement, route: &Route) -> Row {
    let itinerary = route.itinerary();
    let count = |flag: Flags| {
        let flags = measured.details.iter().flat_map(|d| &d.flags);
        flags.filter(|f| f.has(flag)).count()
    };
    Row {
        budget: route.budget,
        poses: measured.schedule.poses.len(),
        readings: measured.readings(),
        no_data: measured.no_data(),
        reachable: itinerary.map_or(1.0, Itinerary::reachable),
        unreachable: itinerary.map_or(String::new(), Itinerary::reasons_text),
        saturated: count(Flags::SATURATED),
        below_noise: count(Flags::BELOW_NOISE),
        stops: itinerary.map(Itinerary::stops),
        instrument_seconds: itinerary.map(Itinerary::seconds),
        unphysical_share: measured.schedule.unphysical_share,
        plan_seconds: Some(route.spent.seconds),
        ..Row::default()
    }
}
