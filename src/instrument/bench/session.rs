//! Acquisition: readings of a BRDF along an itinerary, with their uncertainties.
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
//! quadrature over the apertures, which is a bound and divided by √3 (GUM, JCGM 100:2008, 4.3.7).
//! Derivatives are central differences over one standard deviation, to the second order: on top of a
//! peak the first vanishes (the same, 5.1.2). Products of two axes are left out, and so are lobes far
//! narrower than the positions are certain.
//!
//! Every pose is approached anew: also an axis that stays takes another position within its
//! repeatability. A reading in flight is that of its pose, without the smear of its exposure. The tile is
//! read so long that its noise is part of its uncertainty.

use super::{Bench, Errors, NOISE, normal};
use crate::brdf::{Brdf, ChannelValues};
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument::Instrument;
use crate::instrument::detector::Detector;
use crate::instrument::machine::Machine;
use crate::instrument::optics::{Workspace, collected};
use crate::measurement::{Details, Flags, Measurement, Outcome};
use crate::sampling::{Random, RandomStream};
use crate::schedule::{Itinerary, MAX_AXES, Positions, Schedule, Visit};
use rayon::prelude::*;
use std::sync::Arc;

/// A bench on its way along an itinerary.
#[derive(Clone, Copy, Debug)]
pub struct Session<'a> {
    pub(super) bench: &'a Bench,
    pub(super) itinerary: &'a Itinerary,
    pub(super) seed: u64,
}

/// Visits per parallel task: a lobe costs a thousand times as much as its neighbours.
const TASK: usize = 32;

/// Visits between two checks for cancellation.
const SLAB: usize = 16 * TASK;

/// √3: a bound divided by it is a standard uncertainty.
pub(super) const BOUND: f64 = 1.732_050_807_568_877_2;

#[derive(Clone, Debug, Default)]
pub(super) struct Reading {
    pub(super) value: ChannelValues,
    pub(super) type_a: ChannelValues,
    pub(super) type_b: ChannelValues,
    pub(super) flags: Flags,
}

impl Reading {
    /// What the sensor reads of light, the mean of so many pixels, with the relative and absolute uncertainties that all readings share,
    /// and the variances of type A and B that positions cause; 1 sr⁻¹ is a signal of `of_one`.
    pub(super) fn sensed(
        detector: &Detector,
        light: impl Iterator<Item = f64>,
        (of_one, pixels): (f64, f64),
        shared: impl Fn(usize, f64) -> f64,
        positioning: &[ChannelValues; 2],
        noise: &mut RandomStream,
    ) -> Self {
        let mut reading = Reading::default();
        let mut buried = true;
        for (c, light) in light.enumerate() {
            let signal = detector.read(light, pixels, noise);
            let value = signal.value / of_one;
            let scatter = (signal.variance / (of_one * of_one) + positioning[0][c]).sqrt();
            reading.value.push(value);
            reading.type_a.push(scatter);
            reading
                .type_b
                .push((shared(c, value) + positioning[1][c]).sqrt());
            buried &= value < 2.0 * scatter;
            if signal.saturated {
                reading.flags = reading.flags.with(Flags::SATURATED);
            }
        }
        // Of all channels alike, and after all noise: the other readings are those without it.
        let fault = detector.fault(noise);
        for of in [&mut reading.value, &mut reading.type_a, &mut reading.type_b] {
            of.iter_mut().for_each(|x| *x *= fault);
        }
        if buried {
            reading.flags = reading.flags.with(Flags::BELOW_NOISE);
        }
        reading
    }
}

impl Session<'_> {
    /// The reading of one visit, at a stop whose first pose has this number; `None` if the material has no data there.
    fn read(
        &self,
        brdf: &dyn Brdf,
        (pair, symmetry): (&DirectionPair, Symmetry),
        (visit, first): (&Visit, u32),
        random: &Random,
        work: &mut Workspace,
    ) -> Option<Reading> {
        if let Some(camera) = self.bench.machine.camera() {
            return self.read_pixels(camera, brdf, (pair, symmetry), (visit, first), random, work);
        }
        let Some(errors) = &self.bench.errors else {
            let average = self.bench.optics.average(brdf, pair, work)?;
            return Some(Reading {
                type_a: ChannelValues::from_elem(0.0, average.value.len()),
                type_b: average.error.iter().map(|error| error / BOUND).collect(),
                value: average.value,
                flags: clipped(average.clipped),
            });
        };
        let mut noise = random.stream(NOISE + u64::from(visit.pose));
        errors.read(self.bench, brdf, pair, visit, &mut noise, work)
    }
}

pub(super) fn clipped(yes: bool) -> Flags {
    if yes { Flags::CLIPPED } else { Flags::NONE }
}

impl Errors {
    /// Where axes stand that are sent to positions: rounded to their resolution, with the offsets of the instrument and what this
    /// approach adds. Axes that a picture covers do not move.
    pub(super) fn stand(
        &self,
        machine: &Machine,
        asked: &Positions,
        noise: &mut RandomStream,
    ) -> Positions {
        let mut positions = *asked;
        for (i, axis) in machine.axes().iter().enumerate().filter(|(_, a)| !a.imaged) {
            if axis.resolution > 0.0 {
                positions[i] = (positions[i] / axis.resolution).round() * axis.resolution;
            }
            positions[i] += self.offsets[i];
            if axis.repeatability > 0.0 {
                positions[i] += axis.repeatability * normal(noise);
            }
        }
        positions
    }

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
        let positions = self.stand(machine, &visit.positions, noise);
        let actual = match positions != visit.positions {
            true => machine.forward(&positions),
            false => *pair,
        };
        let average = optics.average(brdf, &actual, work)?;
        let cosine = optics.cosine(&actual);
        let hours = visit.since_calibration_seconds / 3600.0;
        let gain = (1.0 + self.drift * hours) / self.tile;
        // Of sample and tile alike: it decides how many electrons there are, and nothing else.
        let seen = collected(&bench.spec, pair);
        let positioning = self.positioning(bench, brdf, &visit.positions, asked, work);
        let light = average.value.iter().map(|mean| mean * cosine * gain * seen);
        let drift = bench.spec.source.drift_per_hour * hours;
        let shared = |c: usize, value: f64| {
            let tile = value * bench.spec.calibration.uncertainty;
            let shared = [tile, value * drift, average.error[c] / BOUND];
            shared.iter().map(|u| u * u).sum()
        };
        let of_one = (asked * seen, 1.0);
        let mut reading =
            Reading::sensed(&self.detector, light, of_one, shared, &positioning, noise);
        reading.flags = reading.flags.with(clipped(average.clipped));
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
    ) -> [ChannelValues; 2] {
        let mut look = |at: &Positions| {
            let pair = bench.machine.forward(at);
            let cosine = self.rough.cosine(&pair);
            let values = self.rough.average(brdf, &pair, work)?.value.into_iter();
            Some(values.map(|v| v * cosine / asked).collect())
        };
        let mut spread = None;
        for (i, axis) in bench.machine.axes().iter().enumerate().take(MAX_AXES) {
            let shared = axis.bias * axis.bias + axis.resolution * axis.resolution / 12.0;
            let scatter = axis.repeatability * axis.repeatability;
            let sigma = (shared + scatter).sqrt();
            if sigma == 0.0 {
                continue;
            }
            let ends = [sigma, -sigma].map(|by| {
                let mut at = *positions;
                at[i] += by;
                look(&at)
            });
            if spread.is_none() {
                spread = look(positions).map(Spread::around);
            }
            if let Some(spread) = &mut spread {
                spread.add(scatter / (sigma * sigma), ends);
            }
        }
        let zero = || ChannelValues::from_elem(0.0, brdf.channels().count());
        spread.map_or_else(|| [zero(), zero()], Spread::variances)
    }
}

/// Variances of what moves a reading, from its values one standard deviation either way.
pub(super) struct Spread {
    centre: ChannelValues,
    variances: [ChannelValues; 2],
    shift: ChannelValues,
}

impl Spread {
    /// Of a reading of these values.
    pub(super) fn around(centre: ChannelValues) -> Self {
        let zero = ChannelValues::from_elem(0.0, centre.len());
        Self {
            centre,
            variances: [zero.clone(), zero.clone()],
            shift: zero,
        }
    }

    /// Adds what moves it to these ends, with its share of type A. At the edge of the data there is nothing to differ from.
    pub(super) fn add(&mut self, share: f64, ends: [Option<ChannelValues>; 2]) {
        let [Some(above), Some(below)] = ends else {
            return;
        };
        for (c, centre) in self.centre.iter().enumerate() {
            // f(q + σz) ≈ f + z slope + z² bend/2 with z normal: the variance is slope² +
            // bend²/2, and the mean moves by bend/2, by the sum of them for all that moves.
            let slope = 0.5 * (above[c] - below[c]);
            let bend = above[c] + below[c] - 2.0 * centre;
            let part = |share: f64| slope * slope * share + 0.5 * (bend * share).powi(2);
            self.variances[0][c] += part(share);
            self.variances[1][c] += part(1.0 - share);
            self.shift[c] += 0.5 * bend;
        }
    }

    /// The variances of type A and of type B.
    pub(super) fn variances(mut self) -> [ChannelValues; 2] {
        for (variance, shift) in self.variances[1].iter_mut().zip(self.shift) {
            *variance += shift * shift;
        }
        self.variances
    }
}

impl Session<'_> {
    /// Measures the poses of the itinerary; `None` if `go_on`, which is asked every few hundred
    /// poses, returned false.
    pub(crate) fn measure_while(
        &self,
        brdf: &dyn Brdf,
        schedule: &Arc<Schedule>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Option<Measurement> {
        let seen = match self.bench.machine.camera() {
            Some(camera) => self.as_seen(camera, schedule),
            None => Arc::clone(schedule),
        };
        let (schedule, poses) = (&seen, &seen.poses);
        let symmetry = schedule.parametrization.symmetry();
        let firsts = self.itinerary.first_poses();
        let random = Random::new(self.seed);
        let mut measured = self.unread(brdf, schedule);
        for slab in self.itinerary.visits.chunks(SLAB) {
            if !go_on() {
                return None;
            }
            let read = |visits: &[Visit]| {
                let mut work = Workspace::default();
                let read = |visit: &Visit| {
                    let pair = &poses[visit.pose as usize].pair;
                    let first = firsts[visit.stop as usize];
                    let (pair, visit) = ((pair, symmetry), (visit, first));
                    self.read(brdf, pair, visit, &random, &mut work)
                };
                visits.iter().map(read).collect::<Vec<_>>()
            };
            let readings: Vec<_> = slab.par_chunks(TASK).flat_map_iter(read).collect();
            for (visit, reading) in slab.iter().zip(readings) {
                put(&mut measured, visit.pose as usize, reading);
            }
        }
        for (pose, reason) in &self.itinerary.unreachable {
            measured.outcomes[*pose as usize] = Outcome::Unreachable(*reason);
        }
        Some(measured)
    }

    /// A measurement before the first visit.
    fn unread(&self, brdf: &dyn Brdf, schedule: &Arc<Schedule>) -> Measurement {
        let poses = schedule.poses.len();
        let none = vec![0.0; poses * brdf.channels().count()];
        let Bench { parts, spec, .. } = self.bench;
        Measurement {
            schedule: Arc::clone(schedule),
            channels: brdf.channels().clone(),
            values: none.clone(),
            outcomes: vec![Outcome::NotVisited; poses],
            details: (parts.noise || parts.apertures).then(|| Details {
                type_a: none.clone(),
                type_b: none,
                flags: vec![Flags::NONE; poses],
            }),
            places: Vec::new(),
            half_angles_deg: parts.half_angles_deg(spec),
        }
    }
}

impl Instrument for Session<'_> {
    fn measure(&self, brdf: &dyn Brdf, schedule: &Arc<Schedule>) -> Measurement {
        let all = self.measure_while(brdf, schedule, &mut || true);
        all.unwrap_or_else(|| unreachable!("nothing stops it"))
    }
}

/// Puts a reading in its place in the order of the schedule.
fn put(measured: &mut Measurement, pose: usize, reading: Option<Reading>) {
    let Some(reading) = reading else {
        measured.outcomes[pose] = Outcome::NoData;
        return;
    };
    measured.outcomes[pose] = Outcome::Reading;
    let channels = reading.value.len();
    let copy = |all: &mut [f64], one: &[f64]| {
        all[pose * channels..][..channels].copy_from_slice(one);
    };
    copy(&mut measured.values, &reading.value);
    if let Some(details) = &mut measured.details {
        copy(&mut details.type_a, &reading.type_a);
        copy(&mut details.type_b, &reading.type_b);
        details.flags[pose] = reading.flags;
    }
}
