//! Times of the visits along a path.
//!
//! # The model
//!
//! *Start.* The tile is read, which takes `calibration.seconds` with bringing it in and out. Every
//! axis stands at 0, or at the end of its range that is nearest to 0.
//!
//! *Stop and go.* A visit is the [`Travel`] from the one before, `timing.settle_s` of waiting if
//! anything moved, every exposure, and `timing.overhead_s`, one after the other. The exposures are
//! the same everywhere: none depends on the material.
//!
//! *Calibration.* The tile is read again before the first visit that would begin more than
//! `calibration.every_minutes` after the last reading of the tile ended; never if that is 0. The
//! axes return to where they were.
//!
//! *Sweeps* (`timing.scan = "fly"`). A sweep is a maximal run of three visits or more along which one
//! axis alone moves, in one direction. It begins with a stop and a reading at its first visit. From there the
//! arm does not stop, nor wait, nor idle for electronics, before the last visit: a step of d rad
//! takes max(d/u, exposures, 1/`timing.sample_rate_hz`), the exposures at its end. The speed
//! u = min(v, √(a D)) is the highest of one move over all D rad. Half of the ramps' w/a, w the
//! highest speed that a step really needs, is spent on the first step and half on the last;
//! changes of speed in between are free. A calibration that becomes due ends a sweep, and one that
//! would last longer than stopping everywhere is not flown.

mod travel;

pub use travel::{AxisMotion, Travel};

use super::machine::{Axis, Machine};
use super::spec::{DetectorSpec, InstrumentSpec, Scan};
use crate::schedule::{MAX_AXES, Positions, Schedule, Visit};
use glam::DVec3;

/// Differences below this are no motion, rad: below the resolution of any encoder.
pub(super) const STILL: f64 = 1e-9;

/// Length of the difference of two light directions that are one, i.e. nearly its angle in rad.
const SAME_LIGHT: f64 = 1e-9;

/// A visit before its time is known: the number of the pose, and where the axes stand.
pub type Stop = (u32, Positions);

/// Visits of the shortest sweep: two poses are a move and no sweep.
const SWEEP: usize = 3;

/// The durations of moves, settling, exposures and calibrations.
#[derive(Clone, Debug)]
pub struct Motion {
    travel: Travel,
    rest: Positions,
    imaged: [bool; MAX_AXES],
    settle: f64,
    overhead: f64,
    exposure: f64,
    /// Shortest time between readings of a sweep, s; `None` if the arms stop.
    fly: Option<f64>,
    calibration: f64,
    /// Longest time from the end of a calibration to the beginning of a visit, s.
    calibrated_for: f64,
}

impl Motion {
    /// The motion of an instrument.
    pub fn new(spec: &InstrumentSpec, machine: &Machine) -> Self {
        let axes: Vec<AxisMotion> = machine.axes().iter().map(|axis| axis.motion).collect();
        let rest = |axis: &Axis| 0.0_f64.max(axis.range[0]).min(axis.range[1]);
        let rest = |i: usize| machine.axes().get(i).map_or(0.0, rest);
        let (timing, calibration) = (&spec.timing, &spec.calibration);
        let every = 60.0 * calibration.every_minutes;
        Self {
            travel: Travel::new(&axes),
            rest: std::array::from_fn(rest),
            imaged: std::array::from_fn(|i| machine.is_imaged(i)),
            settle: timing.settle_s,
            overhead: timing.overhead_s,
            exposure: exposures(&spec.detector).sum(),
            fly: match timing.scan {
                Scan::Stop => None,
                Scan::Fly => Some(timing.sample_rate_hz.map_or(0.0, |rate| 1.0 / rate)),
            },
            calibration: calibration.seconds,
            calibrated_for: if every > 0.0 { every } else { f64::INFINITY },
        }
    }

    /// Metric of travel times.
    pub fn travel(&self) -> &Travel {
        &self.travel
    }

    /// Positions of the axes after some visits, rad; 0 of axes that are imaged.
    pub fn after(&self, visits: &[Visit]) -> Positions {
        let last = visits.last().map_or(self.rest, |last| last.positions);
        std::array::from_fn(|i| if self.imaged[i] { 0.0 } else { last[i] })
    }

    /// The visits of a path in its order, with their times, after those before, where axes and clock go on. Its
    /// numbers are those of poses.
    pub fn timed(&self, schedule: &Schedule, before: Vec<Visit>, path: &[Stop]) -> Vec<Visit> {
        let start = self.after(&before);
        let mut log = Log::new(self, schedule, before);
        let mut here = &start;
        let mut next = 0;
        // The last visit of the run along one axis, and whether it is better walked than flown.
        let (mut run, mut grounded) = (0, false);
        while next < path.len() {
            if log.visits.is_empty() || log.is_due(log.now) {
                log.calibrate();
            }
            log.visit(path[next], self.stop(here, &path[next].1), self.overhead);
            if let Some(shortest) = self.fly {
                if next >= run {
                    run = next + self.run(&path[next..]);
                    grounded = false;
                }
                if !grounded {
                    let flown = self.flight(&path[next..=run], shortest, &log);
                    grounded = flown.is_none();
                    for step in flown.unwrap_or_default() {
                        next += 1;
                        log.visit(path[next], step, 0.0);
                    }
                }
            }
            here = &path[next].1;
            next += 1;
        }
        log.visits
    }

    /// Travel and settling, s.
    fn stop(&self, from: &Positions, to: &Positions) -> f64 {
        let moves = |j| self.travel.way(j, from, to).abs() > STILL;
        match (0..MAX_AXES).any(moves) {
            true => self.travel.seconds(from, to) + self.settle,
            false => 0.0,
        }
    }

    /// The only axis that moves, and its way, rad; `None` if several or none do.
    fn only_axis(&self, from: &Positions, to: &Positions) -> Option<(usize, f64)> {
        let ways = (0..MAX_AXES).map(|j| (j, self.travel.way(j, from, to)));
        let mut moving = ways.filter(|(_, way)| way.abs() > STILL);
        let first = moving.next()?;
        moving.next().is_none().then_some(first)
    }

    /// Number of steps at the beginning of `path` that go along one axis in one direction.
    fn run(&self, path: &[Stop]) -> usize {
        let mut steps = path.windows(2).map(|w| self.only_axis(&w[0].1, &w[1].1));
        let Some(Some((axis, way))) = steps.next() else {
            return 0;
        };
        let goes_on = |step: &Option<(usize, f64)>| {
            step.is_some_and(|(j, w)| j == axis && (w > 0.0) == (way > 0.0))
        };
        1 + steps.take_while(goes_on).count()
    }

    /// The time of each step of a sweep before its exposures, as far as it goes before a
    /// calibration is due; no steps if it would be no sweep, `None` if it is better not flown.
    fn flight(&self, run: &[Stop], shortest: f64, log: &Log) -> Option<Vec<f64>> {
        if run.len() < SWEEP {
            return Some(Vec::new());
        }
        let axis = self.only_axis(&run[0].1, &run[1].1)?.0;
        let least = self.exposure.max(shortest);
        let speed = self.travel.speed(axis);
        // No sweep is quicker than this one, so none goes further.
        let mut ways = Vec::new();
        let mut begins = log.now;
        for w in run.windows(2) {
            if log.is_due(begins) {
                break;
            }
            let way = self.travel.way(axis, &w[0].1, &w[1].1).abs();
            begins += (way / speed).max(least);
            ways.push(way);
        }
        while ways.len() + 1 >= SWEEP {
            let cruise = self.travel.peak_speed(axis, ways.iter().sum());
            let step = |way: &f64| (way / cruise).max(least);
            let needed = ways.iter().map(|w| w / step(w)).fold(0.0, f64::max);
            let ramp = 0.5 * needed / self.travel.acceleration(axis);
            let mut begins = log.now;
            let mut moves = Vec::with_capacity(ways.len());
            for (i, way) in ways.iter().enumerate() {
                if log.is_due(begins) {
                    break;
                }
                let at_end = i == 0 || i + 1 == ways.len();
                let seconds = step(way) + if at_end { ramp } else { 0.0 };
                begins += seconds;
                moves.push(seconds - self.exposure);
            }
            if moves.len() == ways.len() {
                let stop = |w: &[Stop]| self.stop(&w[0].1, &w[1].1) + self.exposure + self.overhead;
                let stopped: f64 = run[..=moves.len()].windows(2).map(stop).sum();
                return (begins - log.now <= stopped).then_some(moves);
            }
            ways.truncate(moves.len());
        }
        Some(Vec::new())
    }
}

/// The exposures of every pose, s: equal ratios from the shortest to the longest.
pub(super) fn exposures(detector: &DetectorSpec) -> impl Iterator<Item = f64> {
    let (shortest, longest) = (detector.exposure_min_s, detector.exposure_max_s);
    let steps = detector.exposures.saturating_sub(1).max(1) as f64;
    (0..detector.exposures).map(move |k| shortest * (longest / shortest).powf(k as f64 / steps))
}

/// The visits so far, and the clock.
struct Log<'a> {
    motion: &'a Motion,
    schedule: &'a Schedule,
    visits: Vec<Visit>,
    /// The end of the last visit, s.
    now: f64,
    /// The calibration before the next visit, s.
    calibration: f64,
    /// The end of the last calibration, s.
    calibrated: f64,
    /// Light direction of the current block.
    light: DVec3,
}

impl<'a> Log<'a> {
    fn new(motion: &'a Motion, schedule: &'a Schedule, visits: Vec<Visit>) -> Self {
        let of_last = visits.last().map(|last| {
            let light = schedule.poses[last.pose as usize].pair.omega_i.vector();
            (last.at_seconds - last.since_calibration_seconds, light)
        });
        let (calibrated, light) = of_last.unwrap_or_default();
        Self {
            motion,
            schedule,
            now: visits.iter().map(|v| v.seconds).sum(),
            visits,
            calibration: 0.0,
            calibrated,
            light,
        }
    }

    /// True if a visit that begins at `time` needs a calibration.
    fn is_due(&self, time: f64) -> bool {
        time - self.calibrated > self.motion.calibrated_for
    }

    fn calibrate(&mut self) {
        self.calibration = self.motion.calibration;
        self.calibrated = self.now + self.calibration;
    }

    fn visit(&mut self, (pose, positions): Stop, moving: f64, overhead: f64) {
        let light = self.schedule.poses[pose as usize].pair.omega_i.vector();
        let block = match self.visits.last() {
            None => 0,
            Some(last) if light.distance(self.light) <= SAME_LIGHT => last.block,
            Some(last) => last.block + 1,
        };
        if self.visits.last().is_none_or(|last| last.block != block) {
            self.light = light;
        }
        let calibration = std::mem::take(&mut self.calibration);
        let stop = self.visits.last().map_or(0, |last| last.stop + 1);
        let exposure = self.motion.exposure;
        let at_seconds = self.now + calibration + moving + 0.5 * exposure;
        let seconds = calibration + moving + exposure + overhead;
        self.now += seconds;
        self.visits.push(Visit {
            pose,
            block,
            stop,
            positions,
            move_seconds: moving,
            exposure_seconds: exposure,
            seconds,
            at_seconds,
            since_calibration_seconds: at_seconds - self.calibrated,
        });
    }
}

#[cfg(test)]
mod tests;
