//! Merging of all readings of one configuration into one.
//!
//! Of readings x_1 … x_n of one configuration with uncertainties a_j (type A) and b_j (type B)
//!
//! - the value is their mean;
//! - type A is the larger of √(Σ a_j²) / n, which the rows claim, and of the standard error of the
//!   mean, √(Σ (x_j − mean)² / (n (n − 1))), which they show (0 if n = 1). Their scatter holds what
//!   they claim already, so the two are not added;
//! - where nothing is claimed, fewer than eleven readings are pooled with the other repeated configurations of values between half and
//!   twice theirs: s² is the mean of Σ (x_j − mean)² / mean² over all degrees of freedom ν, and type A is
//!   s · mean / √n, times t₉₅(ν) / 2, so that k = 2 covers 95 % (GUM, G.3 and G.6.4);
//! - type B, which all readings share, is the mean of b_j.
//!
//! A type A of 0 is one that is not known.

use super::{Details, Flags, Measurement, Outcome};
use crate::brdf::Channels;
use crate::error::count;
use crate::numeric::tree::{Squared, Tree};
use crate::parametrization::Parametrization;
use crate::schedule::grid::Distinct;
use crate::schedule::{Pose, Schedule};
use std::cell::LazyCell;
use std::cmp::Ordering;
use std::f64::consts::PI;
use std::sync::Arc;

/// Fewest configurations from which symmetries are judged.
const FEWEST_COMPARED: usize = 10;

/// Median scatter of the readings of one configuration up to which they are noisy, as a share of their mean.
const LARGEST_SCATTER: f64 = 0.1;

/// Median scatter up to which they are noisy, in units of the uncertainty that they state.
const CLAIMED: f64 = 3.0;

/// Scatter that is rounding, as a share of the mean.
const ROUNDING: f64 = 1e-12;

/// Degrees of freedom from which on readings of one configuration say how they scatter without others.
const FREEDOM: u32 = 10;

/// Largest distance of repeats of one pose along an axis of the directions of light and sensor, rad: .005°, as encoders err.
const REPEATED: f64 = 0.005 * PI / 180.0;

/// The nearest other pose is at least so many times as far as repeated poses are from each other: a fine scan repeats none.
const APART: f64 = 10.0;

/// Readings of one channel of one configuration.
#[derive(Clone, Copy, Default)]
struct Mean {
    count: u32,
    mean: f64,
    /// Sum of the squared differences to the mean.
    squares: f64,
    /// Root of the sum of the squared type A, and how many are known.
    type_a: (f64, u32),
    /// Sum of type B, and how many are known.
    type_b: (f64, u32),
}

impl Mean {
    fn add(&mut self, [value, type_a, type_b]: [f64; 3]) {
        self.count += 1;
        if self.count == 1 {
            self.mean = value;
        } else {
            let step = value - self.mean;
            self.mean += step / f64::from(self.count);
            self.squares += step * (value - self.mean);
        }
        self.type_a.0 = self.type_a.0.hypot(type_a);
        self.type_a.1 += u32::from(type_a > 0.0);
        self.type_b.0 += type_b;
        self.type_b.1 += u32::from(type_b > 0.0);
    }

    /// What the rows claim of one reading: those that claim nothing are as the others.
    fn claimed(&self) -> f64 {
        let (root, known) = self.type_a;
        root / f64::from(known.max(1)).sqrt()
    }

    /// Type A, by readings of like values if it has to; `most`: most poses were repeated.
    fn type_a(&self, pooled: &Pooled, most: bool) -> f64 {
        let n = f64::from(self.count.max(1));
        let freedom = self.count.saturating_sub(1);
        let alone = (self.squares / (n * f64::from(freedom.max(1)))).sqrt();
        let shown = match (self.claimed() > 0.0, freedom) {
            (true, _) => alone,
            (false, FREEDOM..) => alone,
            (false, 0) if !most => 0.0,
            (false, _) => match pooled.around(self.mean) {
                Some((variance, all)) if freedom > 0 || all >= FREEDOM => {
                    coverage_factor(all) * (variance / n).sqrt() * self.mean
                }
                _ => coverage_factor(freedom.max(1)) * alone,
            },
        };
        // Equal numbers that were rounded differently are equal.
        let differ = shown > ROUNDING * self.mean.abs();
        let shown = if differ { shown } else { 0.0 };
        shown.max(self.claimed() / n.sqrt())
    }

    fn type_b(&self) -> f64 {
        let (sum, known) = self.type_b;
        sum / f64::from(known.max(1))
    }
}

/// Half of the t that 95.45 % of Student's distribution are within, by its degrees of freedom (GUM, table G.2).
fn coverage_factor(freedom: u32) -> f64 {
    const T95: [f64; 10] = [13.97, 4.53, 3.31, 2.87, 2.65, 2.52, 2.43, 2.37, 2.32, 2.28];
    let t = T95.get(freedom.saturating_sub(1) as usize);
    // The first terms of Fisher and Cornish, from 11 degrees on good to 1 %.
    0.5 * t.copied().unwrap_or(2.0 + 2.5 / f64::from(freedom))
}

/// The scatter of repeated readings of one channel that claim none, by their values.
struct Pooled {
    /// Means above 0, ascending.
    means: Vec<f64>,
    /// Up to each: the sums of Σ (x_j − mean)² / mean², and of the degrees of freedom.
    sums: Vec<(f64, u32)>,
}

impl Pooled {
    fn new<'a>(means: impl Iterator<Item = &'a Mean>) -> Self {
        // Equal numbers, as of rows that were copied, say nothing.
        let differ = |m: &Mean| m.squares.sqrt() > ROUNDING * m.mean;
        let silent = |m: &&Mean| m.count > 1 && m.mean > 0.0 && m.claimed() == 0.0 && differ(m);
        let mut silent: Vec<&Mean> = means.filter(silent).collect();
        silent.sort_by(|a, b| a.mean.total_cmp(&b.mean));
        let mut sum = (0.0, 0);
        let sums = silent.iter().map(|m| {
            sum.0 += m.squares / (m.mean * m.mean);
            sum.1 += m.count - 1;
            sum
        });
        Self {
            sums: std::iter::once((0.0, 0)).chain(sums).collect(),
            means: silent.iter().map(|m| m.mean).collect(),
        }
    }

    /// The variance of readings between half and twice a value as a share of its square, and its degrees of freedom.
    fn around(&self, value: f64) -> Option<(f64, u32)> {
        let up_to = |most: f64| self.sums[self.means.partition_point(|m| *m <= most)];
        let (low, high) = (up_to(0.5 * value), up_to(2.0 * value));
        let freedom = high.1 - low.1;
        (value > 0.0 && freedom > 0)
            .then(|| ((high.0 - low.0).max(0.0) / f64::from(freedom), freedom))
    }
}

/// Configurations, and all readings of each.
pub(super) struct Pool {
    channels: usize,
    outcomes: Vec<Option<Outcome>>,
    flags: Vec<Flags>,
    means: Vec<Mean>,
}

impl Pool {
    /// So many configurations, none of which was visited.
    pub(crate) fn new(poses: usize, channels: usize) -> Self {
        Self {
            channels,
            outcomes: vec![None; poses],
            flags: vec![Flags::NONE; poses],
            means: vec![Mean::default(); poses * channels],
        }
    }

    /// Adds an outcome. A reading goes before every reason why there is none, the first reason
    /// before others; every flag stays.
    pub(crate) fn see(&mut self, pose: usize, outcome: Outcome, flags: Flags) {
        let before = &mut self.outcomes[pose];
        if before.is_none() || outcome == Outcome::Reading {
            *before = Some(outcome);
        }
        self.flags[pose] = self.flags[pose].with(flags);
    }

    /// Adds a reading of one channel: the value, and its uncertainties of type A and type B.
    pub(crate) fn add(&mut self, pose: usize, channel: usize, reading: [f64; 3]) {
        self.means[pose * self.channels + channel].add(reading);
    }

    /// Adds what was read at a pose of a measurement.
    pub(crate) fn take(&mut self, pose: usize, from: &Measurement, i: usize) {
        let (n, details) = (self.channels, from.details.as_ref());
        let flags = details.map_or(Flags::NONE, |d| d.flags[i]);
        self.see(pose, from.outcomes[i], flags);
        for (c, &value) in from.value(i).into_iter().flatten().enumerate() {
            let of = |types: &[f64]| types[i * n + c];
            let [a, b] = details.map_or([0.0; 2], |d| [of(&d.type_a), of(&d.type_b)]);
            self.add(pose, c, [value, a, b]);
        }
    }

    /// The first channel of a configuration that was read, but not in this channel.
    pub(crate) fn missing(&self, pose: usize) -> Option<usize> {
        let read = self.outcomes[pose] == Some(Outcome::Reading);
        let means = &self.means[pose * self.channels..(pose + 1) * self.channels];
        means.iter().position(|m| read && m.count == 0)
    }

    pub(crate) fn lose(&mut self, pose: usize) {
        self.outcomes[pose] = Some(Outcome::NoData);
    }

    pub(crate) fn has_readings(&self) -> bool {
        self.outcomes.contains(&Some(Outcome::Reading))
    }

    /// Readings beyond the first of each channel of each configuration.
    pub(crate) fn repeats(&self) -> usize {
        let beyond = self.means.iter().map(|m| m.count.saturating_sub(1));
        beyond.map(|n| n as usize).sum()
    }

    /// How much the readings of one configuration differ, of its first channel.
    fn folded(&self, [poses, repeated]: [usize; 2]) -> Folded {
        let several = self.means.iter().step_by(self.channels);
        let several = several.filter(|m| m.count > 1 && m.mean > 0.0);
        let (mut scatter, mut claimed) = (Vec::new(), Vec::new());
        for m in several {
            let n = f64::from(m.count);
            scatter.push((m.squares / (n - 1.0)).sqrt() / m.mean);
            claimed.push(m.claimed() / m.mean);
        }
        let median = |values: &mut [f64]| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0)
        };
        Folded {
            poses,
            repeated,
            compared: scatter.len(),
            scatter: median(&mut scatter),
            claimed: median(&mut claimed),
        }
    }

    /// The measurement; it has details if `detailed`, or if there are flags or repeats.
    pub(crate) fn measurement(
        self,
        schedule: Arc<Schedule>,
        channels: Channels,
        detailed: bool,
    ) -> Measurement {
        let flagged = self.flags.iter().any(|f| *f != Flags::NONE);
        let detailed = detailed || flagged || self.repeats() > 0;
        let means = &self.means;
        let of_channel = |c| Pooled::new(means.iter().skip(c).step_by(self.channels));
        let pooled: Vec<Pooled> = (0..self.channels).map(of_channel).collect();
        let read = means.iter().filter(|m| m.count > 0).count();
        let most = 2 * means.iter().filter(|m| m.count > 1).count() > read;
        let each = means.iter().zip(pooled.iter().cycle());
        let type_a = each.map(|(m, pooled)| m.type_a(pooled, most)).collect();
        let outcomes = self.outcomes.iter();
        Measurement {
            schedule,
            channels,
            values: means.iter().map(|m| m.mean).collect(),
            outcomes: outcomes.map(|o| o.unwrap_or(Outcome::NotVisited)).collect(),
            details: detailed.then(|| Details {
                type_a,
                type_b: means.iter().map(Mean::type_b).collect(),
                flags: self.flags,
            }),
            places: Vec::new(),
            half_angles_deg: [0.0; 2],
        }
    }
}

/// Poses that symmetries made one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Folded {
    /// Poses that were dropped as symmetries make them others.
    pub poses: usize,
    /// Poses that were dropped as they repeat others within what encoders err by.
    pub repeated: usize,
    /// Configurations of which several poses have readings.
    pub compared: usize,
    /// Median over these of the standard deviation of the readings, as a share of their mean.
    pub scatter: f64,
    /// Median over these of the uncertainty of type A that the readings state, as a share of their mean.
    pub claimed: f64,
}

impl Folded {
    /// Poses that were dropped.
    pub(crate) fn dropped(&self) -> usize {
        self.poses + self.repeated
    }

    /// The sentence that doubts the symmetries, if readings that they make one differ by far more than noise.
    pub fn warning(&self) -> Option<String> {
        let differ = self.poses >= FEWEST_COMPARED
            && self.compared >= FEWEST_COMPARED
            && self.scatter > LARGEST_SCATTER.max(CLAIMED * self.claimed);
        differ.then(|| {
            format!(
                "readings that these symmetries make one scatter by {:.0} % (median of {}), and their mean is \
                 taken: unless that is noise, the sample does not have them all; allowed: --symmetry with \
                 those that it has, or none",
                100.0 * self.scatter,
                count(self.compared, "configuration")
            )
        })
    }
}

/// For each pose the first of those that repeat it, itself if none does, and the one that stands for them. Poses repeat each other
/// if they lie within [`REPEATED`] and all others [`APART`] times as far from them; the one with the least directions stands for all,
/// whatever their order.
fn repeated(poses: &[Pose], parametrization: &dyn Parametrization) -> (Vec<usize>, Vec<usize>) {
    // Of the pairs that the symmetries make one the same.
    let point = |pose: &Pose| {
        let pair = parametrization.inverse(&pose.coords).unwrap_or(pose.pair);
        let [i, o] = [pair.omega_i, pair.omega_o].map(|d| d.vector());
        [i.x, i.y, i.z, o.x, o.y, o.z]
    };
    let points: Vec<[f64; 6]> = poses.iter().map(point).collect();
    // Few files have repeats, of which alone it is asked.
    let all = LazyCell::new(|| Tree::new(Squared, &points));
    let mut rest = Tree::new(Squared, &points);
    let leaves = rest.leaves();
    let (mut firsts, mut standing): (Vec<usize>, Vec<usize>) =
        (0..poses.len()).map(|k| (k, k)).unzip();
    let mut is_seen = vec![false; poses.len()];
    let (mut found, mut cluster) = (Vec::new(), Vec::new());
    for i in 0..points.len() {
        if is_seen[i] {
            continue;
        }
        // Each of the chain of near poses is taken out once.
        rest.remove(i as u32, leaves[i]);
        cluster.clear();
        cluster.push(i);
        let mut next = 0;
        while next < cluster.len() {
            let from = &points[cluster[next]];
            rest.nearest(from, points.len(), REPEATED * REPEATED, &mut found);
            for near in &found {
                rest.remove(near.number, leaves[near.number as usize]);
                cluster.push(near.number as usize);
            }
            next += 1;
        }
        let width = |d: usize| {
            let of = cluster.iter().map(|k| points[*k][d]);
            of.clone().fold(f64::MIN, f64::max) - of.fold(f64::MAX, f64::min)
        };
        let width = (0..6).map(width).fold(0.0, f64::max);
        cluster.iter().for_each(|k| is_seen[*k] = true);
        if cluster.len() == 1 || width > REPEATED {
            continue;
        }
        all.nearest(&points[i], cluster.len() + 1, f64::MAX, &mut found);
        let beyond = found.get(cluster.len());
        if beyond.is_some_and(|near| near.distance.sqrt() < APART * width) {
            continue;
        }
        let order = |a: &&usize, b: &&usize| points[**a].partial_cmp(&points[**b]);
        let least = cluster
            .iter()
            .min_by(|a, b| order(a, b).unwrap_or(Ordering::Equal));
        let least = *least.unwrap_or(&i);
        for k in &cluster {
            (firsts[*k], standing[*k]) = (i, least);
        }
    }
    (firsts, standing)
}

impl Measurement {
    /// The measurement with each configuration once, and what was folded: poses are dropped that name the configuration of an earlier one
    /// under the symmetries of the schedule, as in tables by others (light and sensor exchanged, the sample turned), or repeat one within
    /// what encoders err by. Readings become
    /// their mean with the larger of the type A that they claim and that they show; shared errors
    /// (type B) stay, and so does every flag. A schedule on a lattice has no such poses.
    #[must_use]
    pub fn merged(self) -> (Self, Folded) {
        let schedule = &self.schedule;
        if schedule.lattice.is_some() {
            return (self, Folded::default());
        }
        let mut distinct = Distinct::new(schedule.parametrization.axes());
        let mut poses = Vec::new();
        let mut firsts = Vec::new();
        let mut place = |(i, pose): (usize, &Pose)| {
            let at = distinct.first(&pose.coords, poses.len() as u32) as usize;
            if at == poses.len() {
                poses.push(*pose);
                firsts.push(i);
            }
            at
        };
        let mut places: Vec<usize> = schedule.poses.iter().enumerate().map(&mut place).collect();
        // Of those that are one the same stands for all, in whatever order they are.
        for (i, &at) in places.iter().enumerate() {
            let pose = &schedule.poses[i];
            if firsts[at] != i && pose.pair.rank() < poses[at].pair.rank() {
                poses[at] = *pose;
            }
        }
        let (first, standing) = repeated(&poses, &*schedule.parametrization);
        let kept: Vec<usize> = (0..poses.len()).filter(|k| first[*k] == *k).collect();
        let joined = poses.len() - kept.len();
        if joined > 0 {
            let mut place = vec![0; poses.len()];
            kept.iter().enumerate().for_each(|(at, k)| place[*k] = at);
            places.iter_mut().for_each(|p| *p = place[first[*p]]);
            poses = kept.iter().map(|k| poses[standing[*k]]).collect();
            firsts = kept.iter().map(|k| firsts[*k]).collect();
        }
        let merged = places.len() - poses.len();
        if merged == 0 {
            return (self, Folded::default());
        }
        let n = self.channels.count();
        let mut pool = Pool::new(poses.len(), n);
        for (i, at) in places.into_iter().enumerate() {
            pool.take(at, &self, i);
        }
        let schedule = Arc::new(Schedule {
            poses,
            ..Schedule::clone(schedule)
        });
        let detailed = self.details.is_some();
        let folded = pool.folded([merged - joined, joined]);
        let half_angles_deg = self.half_angles_deg;
        let mut merged = pool.measurement(schedule, self.channels, detailed);
        if !self.places.is_empty() {
            merged.places = firsts.iter().map(|&i| self.places[i]).collect();
        }
        merged.half_angles_deg = half_angles_deg;
        (merged, folded)
    }
}
