//! Measuring a schedule on its instrument, and what rows say about that.

use super::observer::ScheduleKey;
use super::route::{Route, bench, bench_without_limits};
use super::run::Stop;
use crate::brdf::Brdf;
use crate::instrument::{Ideal, Instrument};
use crate::measurement::{Flags, Measurement};

/// The readings of one schedule.
pub(super) struct Readings {
    /// What the instrument reported.
    pub measured: Measurement,
    /// What it would have reported without limits, if that differs and is asked for.
    pub whole: Option<Measurement>,
    /// True if no pose was out of reach.
    pub nothing_lost: bool,
    /// For the row.
    pub facts: Facts,
}

/// What the rows of a schedule share.
#[derive(Clone)]
pub(super) struct Facts {
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
    /// Measures a BRDF along a route.
    pub fn take(
        brdf: &dyn Brdf,
        key: &ScheduleKey<'_>,
        route: &Route,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Self, Stop> {
        let schedule = &route.schedule;
        let (Some(instrument), Some(itinerary)) = (key.instrument, &route.itinerary) else {
            let measured = Ideal.measure(brdf, schedule);
            return Ok(Self {
                facts: Facts::of(&measured, 1.0, String::new(), None),
                measured,
                whole: None,
                nothing_lost: true,
            });
        };
        let machine = bench(instrument, key.seed)?;
        let mut go_on = || !cancelled();
        let session = machine.session(itinerary, key.seed);
        let measured = session.measure_while(brdf, schedule, &mut go_on);
        let measured = measured.ok_or(Stop::Cancelled)?;
        let whole = match &route.whole {
            None => None,
            Some(itinerary) => {
                let machine = bench_without_limits(instrument, key.seed)?;
                let session = machine.session(itinerary, key.seed);
                let whole = session.measure_while(brdf, schedule, &mut go_on);
                Some(whole.ok_or(Stop::Cancelled)?)
            }
        };
        Ok(Self {
            facts: Facts::of(
                &measured,
                itinerary.reachable(),
                itinerary.reasons_text(),
                Some(itinerary.seconds()),
            ),
            nothing_lost: itinerary.unreachable.is_empty(),
            measured,
            whole,
        })
    }
}

impl Facts {
    fn of(
        measured: &Measurement,
        reachable: f64,
        unreachable: String,
        instrument_seconds: Option<f64>,
    ) -> Self {
        let count = |flag: Flags| {
            let flags = measured.details.iter().flat_map(|d| &d.flags);
            flags.filter(|f| f.has(flag)).count()
        };
        Self {
            poses: measured.schedule.poses.len(),
            readings: measured.readings(),
            no_data: measured.no_data(),
            reachable,
            unreachable,
            saturated: count(Flags::SATURATED),
            below_noise: count(Flags::BELOW_NOISE),
            instrument_seconds,
            unphysical_share: measured.schedule.unphysical_share,
        }
    }
}
