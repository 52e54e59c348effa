//! Poses on slices, which are refined where the readings are least as predicted: after Vávra & Filip (2017), "Adaptive
//! measurement of anisotropic material appearance", who measure lines of a few kinds and halve their steps.
//!
//! For an isotropic material lines are along θ_h in half/difference coordinates, at several θ_d, in the plane of incidence
//! (φ_d = 0) and across it (φ_d = 90°), up to elevations of 80°, and one along θ_d at θ_h = 0, where lobes peak. An
//! anisotropic one is turned from line to line. First the ends of all lines are read. An interval between two readings is
//! then worth its length times the error of ln(f + 10⁻³) by which a straight line between the neighbours of its ends
//! misses these; lengths are of the square root of θ_h. The interval that is worth most is halved, again and again: an
//! error is taken to fall with the square of the length until it is read.

use super::field::{MASK, MOST, Reach, admit, filled, is_inside, luminances};
use super::{Chosen, Planner, Task, halves};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::measurement::Measurement;
use crate::numeric::hashed;
use crate::parametrization::{Parametrization, usual_form};
use crate::reconstruct::Values;
use crate::registry::declare;
use crate::sampling::Random;
use crate::schedule::{Pose, SampleSet};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Difference angles of lines along θ_h.
const LINES: usize = 4;

/// Poses of the first batch: the peaks, and the ends of all lines.
const FIRST: usize = 3 * LINES + 2;

/// Steps of a line, a power of two: poses are at their ends.
const STEPS: usize = 128;

declare! {
    dyn Planner, "slices": "poses on lines that are refined where readings were mispredicted (Vávra & Filip 2017)", [""]
    /// Poses on slices that are refined; it has no key.
    pub struct Slices {}
}

/// A line, at equal steps of the square root of θ_h or of θ_d.
struct Line {
    /// Poses that can be taken, and were not asked for in vain.
    poses: Vec<Option<Pose>>,
    /// Steps that were read, increasing, and ln(f + 10⁻³) there.
    read: Vec<(usize, f64)>,
}

/// Half/difference coordinates that are nearer than this are one: those of a file have as many digits.
const SAME: f64 = 1e-6;

/// What a straight line is taken to miss at least, so that an interval is never worth nothing.
const LEAST: f64 = 0.01;

impl Line {
    /// All lines of a task, with what was read of them.
    fn all(task: &Task<'_>, reach: &Reach<'_>, so_far: &Measurement) -> Vec<Self> {
        let chart = usual_form(Symmetry::FULL);
        let [shift, turn]: [f64; 2] = Random::new(hashed([task.seed, 0, 6])).point(0);
        let points = asked(&*chart, so_far);
        let line = |number: usize| {
            // The first is along θ_d; the others share its nodes at θ_h = 0.
            let of = |step: usize| match number.checked_sub(1) {
                None => [0.0, angle(step), 0.0],
                Some(k) => {
                    let at = (k / 2) as f64 + 0.25 + 0.5 * shift;
                    let theta_d = angle((at / LINES as f64 * STEPS as f64) as usize);
                    let across = step > 0 && k % 2 > 0;
                    let phi_d = if across { FRAC_PI_2 } else { 0.0 };
                    [step as f64 / STEPS as f64, theta_d, phi_d]
                }
            };
            let about = match task.form.symmetry().isotropic {
                true => 0.0,
                false => TAU * (turn + (number.div_ceil(2)) as f64 / (LINES + 1) as f64),
            };
            let turned = |d: Direction| Direction::from_spherical(d.theta(), d.phi() + about);
            let pose = |step: usize| {
                let [u, theta_d, phi_d] = of(step);
                let pair = chart.inverse(&[u, theta_d, phi_d, 0.0])?;
                let pair = Some(pair).filter(is_inside)?;
                reach.pose(&DirectionPair::new(
                    turned(pair.omega_i),
                    turned(pair.omega_o),
                ))
            };
            let mut poses: Vec<Option<Pose>> = (0..=STEPS).map(pose).collect();
            let there: Vec<Pose> = poses.iter().flatten().copied().collect();
            let mut hopes = reach.hopes(&there).into_iter();
            for pose in &mut poses {
                *pose = pose.filter(|_| hopes.next() == Some(true));
            }
            let mut read = Vec::new();
            for (step, pose) in poses.iter_mut().enumerate() {
                let [u, theta_d, phi_d] = of(step);
                let is_here = |c: &[f64; 3]| {
                    let off = (c[0] - u).abs().max((c[1] - theta_d).abs());
                    off < SAME && (u == 0.0 || (c[2] - phi_d).abs() < SAME)
                };
                match points.iter().find(|(c, _)| is_here(c)) {
                    Some((_, Some(z))) => read.push((step, *z)),
                    Some((_, None)) => *pose = None,
                    None => {}
                }
            }
            Self { poses, read }
        };
        (0..=2 * LINES).map(line).collect()
    }

    /// The first and the last step, of those that can be taken, that are outside of what was read.
    fn ends(&self) -> [Option<usize>; 2] {
        let can = |step: &usize| self.poses[*step].is_some();
        let [first, last] = [self.read.first(), self.read.last()].map(|r| r.map(|r| r.0));
        let start = (0..first.unwrap_or(STEPS)).find(can);
        let end = (last.map_or(0, |l| l + 1)..=STEPS).rfind(can);
        [start, end]
    }

    /// By how much the straight line between its neighbours misses each reading; those at the ends by as much as the next.
    fn misses(&self) -> Vec<f64> {
        let n = self.read.len();
        if n < 3 {
            let first = self.read.first().zip(self.read.last());
            return vec![first.map_or(0.0, |(a, b)| (a.1 - b.1).abs()); n];
        }
        let missed = self.read.windows(3).map(|w| {
            let t = (w[1].0 - w[0].0) as f64 / (w[2].0 - w[0].0) as f64;
            (w[0].1 + t * (w[2].1 - w[0].1) - w[1].1).abs()
        });
        let missed: Vec<f64> = missed.collect();
        (0..n).map(|i| missed[i.clamp(1, n - 2) - 1]).collect()
    }

    /// Intervals between readings, with what each is worth.
    fn intervals(&self) -> Vec<(f64, [usize; 2])> {
        let misses = self.misses();
        let pairs = self.read.windows(2).zip(misses.windows(2));
        let worth = |(read, missed): (&[(usize, f64)], &[f64])| {
            let length = (read[1].0 - read[0].0) as f64 / STEPS as f64;
            let missed = missed[0].max(missed[1]) + LEAST;
            (missed * length, [read[0].0, read[1].0])
        };
        pairs.map(worth).collect()
    }

    /// The step nearest to the middle between two that can be taken.
    fn middle(&self, [low, high]: [usize; 2]) -> Option<usize> {
        let twice = |step: usize| (2 * step).abs_diff(low + high);
        let inside = (low + 1..high).filter(|&step| self.poses[step].is_some());
        inside.min_by_key(|&step| twice(step))
    }
}

/// θ_d of a step of the line along it, rad.
fn angle(step: usize) -> f64 {
    MASK * step as f64 / STEPS as f64
}

/// Coordinates of the poses so far, and ln(f + 10⁻³) where there was a reading.
fn asked(chart: &dyn Parametrization, so_far: &Measurement) -> Vec<([f64; 3], Option<f64>)> {
    let log = Values::Log.with(1e-3);
    luminances(so_far)
        .map(|(pair, f)| {
            let [u, theta_d, phi_d, _] = chart.forward(pair);
            ([u, theta_d, phi_d], f.map(|f| log.forward(f)))
        })
        .collect()
}

/// `n` poses: ends of lines that were not read, those at peaks first, then middles of the intervals that are worth most.
fn refined(lines: &[Line], n: usize, go_on: &dyn Fn() -> bool) -> Vec<Pose> {
    let mut poses: Vec<Pose> = Vec::new();
    let mut add = |pose: Option<Pose>| {
        let new = pose.filter(|p| poses.iter().all(|other| other.coords != p.coords));
        poses.extend(new);
        poses.len()
    };
    let mut count = 0;
    for end in 0..2 {
        for line in lines {
            if count < n {
                count = add(line.ends()[end].and_then(|step| line.poses[step]));
            }
        }
    }
    let mut open: Vec<(f64, usize, [usize; 2])> = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        open.extend(
            line.intervals()
                .into_iter()
                .map(|(worth, ends)| (worth, i, ends)),
        );
    }
    while count < n && go_on() {
        let most = (0..open.len()).reduce(|a, b| if open[b].0 > open[a].0 { b } else { a });
        let Some((worth, i, [low, high])) = most.map(|at| open.swap_remove(at)) else {
            break;
        };
        if let Some(middle) = lines[i].middle([low, high]) {
            count = add(lines[i].poses[middle]);
            // Half as long, with a quarter of the error.
            open.extend([[low, middle], [middle, high]].map(|ends| (worth / 8.0, i, ends)));
        }
    }
    poses
}

impl SampleSet for Slices {
    plans_by_design!();
}

impl Planner for Slices {
    fn nests(&self) -> bool {
        true
    }

    fn batch(&self, asked: usize, budget: usize, _: bool) -> Option<usize> {
        Some(halves(FIRST, asked, budget))
    }

    fn most(&self) -> usize {
        MOST
    }

    fn next(&self, task: &Task<'_>, so_far: &Measurement, most: usize) -> Chosen {
        admit(KIND, so_far.schedule.poses.len() + most, MOST)?;
        let reach = Reach::new(task, so_far);
        let lines = Line::all(task, &reach, so_far);
        let poses = refined(&lines, most, task.go_on);
        filled(KIND, (task, &reach), so_far, most, poses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_worth_what_a_straight_line_misses() {
        let line = Line {
            poses: vec![None; STEPS + 1],
            read: vec![(0, 2.0), (64, 1.5), (96, 0.0), (128, 1.0)],
        };
        // Between 0 and 96 it is 2/3 at 64; between 64 and 128 it is 1.25 at 96.
        let missed = [5.0 / 6.0, 5.0 / 6.0, 1.25, 1.25_f64];
        let lengths = [0.5, 0.25, 0.25];
        for (i, (worth, _)) in line.intervals().into_iter().enumerate() {
            let want = (missed[i].max(missed[i + 1]) + LEAST) * lengths[i];
            assert!((worth - want).abs() < 1e-12, "{i}");
        }
    }
}
