//! An instrument and its tour as the page holds them.

use super::packed::Parts;
use crate::instrument::{InstrumentSpec, Machine, classes};
use crate::schedule::{Itinerary, Schedule};
use serde_json::{Value as Json, json};

/// Poses out of reach that are named.
const NAMED: usize = 200;

/// The most visits that a page holds.
pub const MOST_VISITS: usize = 20_000;

/// An error of the reconstruction from the first readings of a tour.
#[derive(Clone, Debug)]
pub struct ErrorSoFar {
    /// Visits that it is made of.
    pub visits: usize,
    /// Time of the instrument until then.
    pub minutes: f64,
    /// nrmse of cosine pairs, and its standard error.
    pub nrmse: [Option<f64>; 2],
    /// The method of reconstruction.
    pub method: String,
}

/// A tour of an instrument.
pub struct Tour<'a> {
    /// The instrument.
    pub spec: &'a InstrumentSpec,
    /// Its poses.
    pub schedule: &'a Schedule,
    /// Its visits.
    pub itinerary: &'a Itinerary,
    /// Errors at some budgets.
    pub errors: Vec<ErrorSoFar>,
    /// A command that carries it out.
    pub command: String,
}

/// For each pose its place on the tour; of one that is out of reach the largest number.
pub(super) fn visits(itinerary: &Itinerary, poses: usize) -> Vec<u32> {
    let mut places = vec![u32::MAX; poses];
    for (place, visit) in (0u32..).zip(&itinerary.visits) {
        places[visit.pose as usize] = place;
    }
    places
}

impl Tour<'_> {
    pub(super) fn facts(&self, parts: &Parts) -> Option<Json> {
        let class = classes()
            .iter()
            .find(|class| class.name == self.spec.class)?;
        let machine = Machine::new(self.spec).ok()?;
        let axes = class
            .axes
            .iter()
            .zip(machine.axes())
            .map(|(template, axis)| {
                let parent = template.parent.map_or(-1, |parent| parent as i64);
                let wraps = axis.motion.wraps;
                json!({"name": axis.name, "parent": parent, "vector": template.vector, "wraps": wraps})
            });
        let axes: Vec<Json> = axes.collect();
        let end = |axis: Option<usize>| axis.map_or(-1, |axis| axis as i64);
        let mut until = 0.0;
        let mut columns = Vec::new();
        for visit in self.itinerary.visits.iter().take(MOST_VISITS) {
            until += visit.seconds;
            let pair = self.schedule.poses[visit.pose as usize].pair;
            columns.extend([visit.pose, visit.stop].map(f64::from));
            columns.push(until);
            columns.extend(pair.omega_i.vector().to_array());
            columns.extend(pair.omega_o.vector().to_array());
            columns.extend(&visit.positions[..axes.len()]);
        }
        let lost = self.itinerary.unreachable.iter().take(NAMED);
        let lost = lost.map(|(pose, why)| json!({"pose": pose, "why": why.name()}));
        let errors = self.errors.iter().map(|e| {
            let [nrmse, error] = e.nrmse;
            json!({
                "visits": e.visits, "minutes": e.minutes, "nrmse": nrmse, "error": error, "method": e.method,
            })
        });
        Some(json!({
            "name": self.itinerary.instrument,
            "ends": {
                "light": end(class.ends.light), "sensor": end(class.ends.sensor), "sample": end(class.ends.sample),
            },
            "columns": 9 + axes.len(),
            "axes": axes,
            "blob": parts.add_numbers("visits", columns),
            "lost": lost.collect::<Vec<_>>(),
            "lostCount": self.itinerary.unreachable.len(),
            "errors": errors.collect::<Vec<_>>(),
            "command": self.command,
        }))
    }
}
