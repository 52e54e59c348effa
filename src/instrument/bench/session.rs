//! One acquisition.
//!
//! # What is simulated, and what is stated
//!
//! Axes stand at the position of the itinerary, rounded to their resolution, plus the bench's own
//! offset, plus what this approach adds. The signal there goes through the detector; it is divided by the cosine
//! of the pose that was asked for.
//!
//! Type A (scatter of repeated readings): what the sensor counts, and (∂f/∂q σ)² of every axis with
//! a repeatability. Type B (what repeated readings share): the tile, the lamp since it was last
//! compared with the tile, (∂f/∂q σ)² of offsets and of rounding (resolution²/12), and the error of the
//! quadrature over the apertures. Derivatives are central differences over one standard deviation. On top of a peak the
//! first derivative vanishes, and so does what is stated: the second order is left out
//! (GUM, JCGM 100:2008, 5.1.2).

use super::{Bench, Errors, normal};
use crate::brdf::{Brdf, Channels};
use crate::geometry::DirectionPair;
use crate::instrument::Instrument;
use crate::instrument::optics::Workspace;
use crate::measurement::{Details, Flags, Measurement, Outcome};
use crate::sampling::{Random, RandomStream};
use crate::schedule::{Itinerary, MAX_AXES, Positions, Schedule, Visit};
use rayon::prelude::*;
use std::sync::Arc;

/// A bench on its way along an itinerary.
#[derive(Clone, Copy, Debug)]
pub struct Session<'a> {
    bench: &'a Bench,
    itinerary: &'a Itinerary,
    seed: u64,
}

/// Visits per parallel task: a lobe costs a thousand times as much as its neighbours.
const TASK: usize = 64;

/// One reading.
#[derive(Clone, Copy, Debug, Default)]
struct Reading {
    value: [f64; 3],
    type_a: [f64; 3],
    type_b: [f64; 3],
    flags: Flags,
}

impl<'a> Session<'a> {
    pub(super) fn new(bench: &'a Bench, itinerary: &'a Itinerary, seed: u64) -> Self {
        Self {
            bench,
            itinerary,
            seed,
        }
    }

    /// The reading of one visit; `None` if the material has no data there.
    fn read(
        &self,
        brdf: &dyn Brdf,
        pair: &DirectionPair,
        visit: &Visit,
        random: &Random,
        work: &mut Workspace,
    ) -> Option<Reading> {
        let Some(errors) = &self.bench.errors else {
            let average = self.bench.optics.average(brdf, pair, work)?;
            return Some(Reading {
                value: average.value,
                type_a: [0.0; 3],
                type_b: average.error,
                flags: clipped(average.clipped),
            });
        };
        let mut noise = random.stream(u64::from(visit.pose));
        errors.read(self.bench, brdf, pair, visit, &mut noise, work)
    }
}

fn clipped(yes: bool) -> Flags {
    if yes { Flags::CLIPPED } else { Flags::NONE }
}

impl Errors {
    fn read(
        &self,
        bench: &Bench,
        brdf: &dyn Brdf,
        pair: &DirectionPair,
        visit: &Visit,
        noise: &mut RandomStream,
        work: &mut Workspace,
    ) -> Option<Reading> {
        let (optics, machine) = (&bench.optics, &bench.machine);
        let asked = optics.cosine(pair);
        if asked <= 0.0 {
            return None;
        }
        // A machine may turn the pair about the normal; what is asked for stays what it is unless
        // an axis is wrong.
        let mut positions = visit.positions;
        let mut moved = false;
        for (i, axis) in machine.axes().iter().enumerate() {
            if axis.resolution > 0.0 {
                positions[i] = (positions[i] / axis.resolution).round() * axis.resolution;
            }
            positions[i] += self.offsets[i];
            if axis.repeatability > 0.0 {
                positions[i] += axis.repeatability * normal(noise);
            }
            moved |= positions[i] != visit.positions[i];
        }
        let actual = if moved {
            machine.forward(&positions)
        } else {
            *pair
        };
        let average = optics.average(brdf, &actual, work)?;
        let cosine = optics.cosine(&actual);
        let hours = visit.since_calibration_seconds / 3600.0;
        let gain = (1.0 + self.drift * hours) / self.tile;
        let mut reading = Reading {
            flags: clipped(average.clipped),
            ..Reading::default()
        };
        let positioning = self.positioning(bench, brdf, &visit.positions, asked, work);
        let channels = brdf.channels().count();
        let mut buried = true;
        for c in 0..channels {
            let signal = self.detector.read(average.value[c] * cosine * gain, noise);
            let value = signal.value / asked;
            let shared = [
                value * self.tile_uncertainty,
                value * self.drift_uncertainty * hours,
                average.error[c],
            ];
            let square: f64 = shared.iter().map(|u| u * u).sum();
            reading.value[c] = value;
            reading.type_a[c] = (signal.variance / (asked * asked) + positioning[0][c]).sqrt();
            reading.type_b[c] = (square + positioning[1][c]).sqrt();
            buried &= value < 2.0 * reading.type_a[c];
            if signal.saturated {
                reading.flags = reading.flags.with(Flags::SATURATED);
            }
        }
        if buried {
            reading.flags = reading.flags.with(Flags::BELOW_NOISE);
        }
        Some(reading)
    }

    /// Variances of type A and of type B that the positions of the axes cause.
    fn positioning(
        &self,
        bench: &Bench,
        brdf: &dyn Brdf,
        positions: &Positions,
        asked: f64,
        work: &mut Workspace,
    ) -> [[f64; 3]; 2] {
        let mut variances = [[0.0; 3]; 2];
        for (i, axis) in bench.machine.axes().iter().enumerate().take(MAX_AXES) {
            let shared = axis.bias * axis.bias + axis.resolution * axis.resolution / 12.0;
            let scatter = axis.repeatability * axis.repeatability;
            let sigma = (shared + scatter).sqrt();
            if sigma == 0.0 {
                continue;
            }
            let mut look = |step: f64| {
                let mut at = *positions;
                at[i] += step;
                let pair = bench.machine.forward(&at);
                let cosine = self.rough.cosine(&pair);
                let average = self.rough.average(brdf, &pair, work);
                average.map(|a| a.value.map(|v| v * cosine))
            };
            // At the edge of the data there is nothing to differ from.
            let (Some(above), Some(below)) = (look(sigma), look(-sigma)) else {
                continue;
            };
            for c in 0..3 {
                let slope = (above[c] - below[c]) / (2.0 * sigma * asked);
                variances[0][c] += slope * slope * scatter;
                variances[1][c] += slope * slope * shared;
            }
        }
        variances
    }
}

impl Instrument for Session<'_> {
    fn measure(&self, brdf: &dyn Brdf, schedule: &Arc<Schedule>) -> Measurement {
        let poses = &schedule.poses;
        let random = Random::new(self.seed);
        let readings: Vec<Option<Reading>> = self
            .itinerary
            .visits
            .par_chunks(TASK)
            .flat_map_iter(|visits| {
                let mut work = Workspace::default();
                let read = |visit: &Visit| {
                    let pair = &poses[visit.pose as usize].pair;
                    self.read(brdf, pair, visit, &random, &mut work)
                };
                visits.iter().map(read).collect::<Vec<_>>()
            })
            .collect();
        let mut report = Report::new(brdf.channels(), poses.len());
        for (visit, reading) in self.itinerary.visits.iter().zip(&readings) {
            report.put(visit.pose as usize, reading.as_ref());
        }
        for (pose, reason) in &self.itinerary.unreachable {
            report.outcomes[*pose as usize] = Outcome::Unreachable(*reason);
        }
        let told =
            self.bench.errors.is_some() || report.details.flags.iter().any(|f| *f != Flags::NONE);
        Measurement {
            schedule: Arc::clone(schedule),
            channels: brdf.channels(),
            values: report.values,
            outcomes: report.outcomes,
            details: told.then_some(report.details),
        }
    }
}

/// The parts of a measurement, in the order of the schedule.
struct Report {
    channels: usize,
    values: Vec<f64>,
    outcomes: Vec<Outcome>,
    details: Details,
}

impl Report {
    fn new(channels: Channels, poses: usize) -> Self {
        let channels = channels.count();
        Self {
            channels,
            values: vec![0.0; poses * channels],
            outcomes: vec![Outcome::NotVisited; poses],
            details: Details {
                type_a: vec![0.0; poses * channels],
                type_b: vec![0.0; poses * channels],
                flags: vec![Flags::NONE; poses],
            },
        }
    }

    fn put(&mut self, pose: usize, reading: Option<&Reading>) {
        let Some(reading) = reading else {
            self.outcomes[pose] = Outcome::NoData;
            return;
        };
        self.outcomes[pose] = Outcome::Reading;
        let of_pose = pose * self.channels..(pose + 1) * self.channels;
        let pairs = [
            (&mut self.values, &reading.value),
            (&mut self.details.type_a, &reading.type_a),
            (&mut self.details.type_b, &reading.type_b),
        ];
        for (all, one) in pairs {
            all[of_pose.clone()].copy_from_slice(&one[..self.channels]);
        }
        self.details.flags[pose] = reading.flags;
    }
}
