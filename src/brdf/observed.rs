//! A BRDF whose evaluations are observed.

use super::measured::merl::Merl;
use super::{
    Brdf, EstimatedBrdf, LightPath, Part, Presence, SampleBrdf, Source, Split, SplitBrdf,
    of_wrapped,
};
use crate::geometry::{Direction, DirectionPair};

/// A BRDF with `seen`, which is called after each evaluation, of one pair or of many, with the values (laid out
/// as those of [`Brdf::eval_batch`]) and one flag a pair.
///
/// ```
/// use gonio::brdf::{Brdf, Channels, Lambert, Presence, Spectrum, ObservedBrdf};
/// use gonio::geometry::{Direction, DirectionPair};
/// use std::sync::atomic::{AtomicUsize, Ordering};
///
/// let brdf = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
/// let pairs = AtomicUsize::new(0);
/// let seen = |_: &[f64], of: &[Presence]| _ = pairs.fetch_add(of.len(), Ordering::Relaxed);
/// let watched = ObservedBrdf::new(&brdf, seen);
/// let up = Direction::from_spherical(0.0, 0.0);
/// assert!(watched.luminance(&DirectionPair::new(up, up)).is_some());
/// assert_eq!(pairs.into_inner(), 1);
/// ```
pub struct ObservedBrdf<'a, F> {
    brdf: &'a dyn Brdf,
    seen: F,
    stopped: Option<&'a (dyn Fn() -> bool + Sync)>,
}

/// Pairs between two questions whether to stop: a multiple of what vector kernels take at a time.
const BETWEEN: usize = 256;

impl<'a, F: Fn(&[f64], &[Presence]) + Send + Sync> ObservedBrdf<'a, F> {
    /// A BRDF that calls `seen` after each evaluation.
    pub fn new(brdf: &'a dyn Brdf, seen: F) -> Self {
        Self {
            brdf,
            seen,
            stopped: None,
        }
    }

    /// This BRDF, without data once `stopped` is true: a loop over many pairs ends soon, its further pairs without data.
    #[must_use]
    pub fn until(mut self, stopped: &'a (dyn Fn() -> bool + Sync)) -> Self {
        self.stopped = Some(stopped);
        self
    }

    fn is_stopped(&self) -> bool {
        self.stopped.is_some_and(|stopped| stopped())
    }
}

impl<F: Fn(&[f64], &[Presence]) + Send + Sync> Brdf for ObservedBrdf<'_, F> {
    of_wrapped! {
        brdf, is_mirrored -> bool, remarks -> Vec<String>,
        as_estimated -> Option<&dyn EstimatedBrdf>, as_merl -> Option<&Merl>
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let presence = match self.is_stopped() {
            true => {
                out.fill(0.0);
                Presence::Missing
            }
            false => self.brdf.eval(pair, out),
        };
        (self.seen)(out, &[presence]);
        presence
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let between = self.stopped.map_or(pairs.len(), |_| BETWEEN).max(1);
        let values = out.chunks_mut(between * self.channels().count());
        let parts = pairs.chunks(between).zip(values);
        for ((pairs, values), presence) in parts.zip(presence.chunks_mut(between)) {
            if self.is_stopped() {
                values.fill(0.0);
                presence.fill(Presence::Missing);
            } else {
                self.brdf.eval_batch(pairs, values, presence);
            }
        }
        (self.seen)(out, presence);
    }

    fn eval_row(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        if self.is_stopped() {
            return self.eval_batch(pairs, out, presence);
        }
        self.brdf.eval_row(pairs, out, presence);
        (self.seen)(out, presence);
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        self.brdf.as_sample().is_some().then_some(self)
    }

    fn as_split(&self) -> Option<&dyn SplitBrdf> {
        self.brdf.as_split().is_some().then_some(self)
    }
}

/// A value by scattering order is one evaluation; paths are not observed.
impl<F: Fn(&[f64], &[Presence]) + Send + Sync> SplitBrdf for ObservedBrdf<'_, F> {
    fn split(&self, pair: &DirectionPair) -> Split {
        let dark = || Split::dark(self.channels().count());
        let split = self.brdf.as_split().map_or_else(dark, |of| of.split(pair));
        (self.seen)(&split.part(Part::All), &[Presence::Present]);
        split
    }

    fn paths(&self, block: u64, count: usize, each: &mut dyn FnMut(LightPath)) {
        if let Some(of) = self.brdf.as_split() {
            of.paths(block, count, each);
        }
    }

    fn follows_pairs(&self) -> bool {
        self.brdf.as_split().is_some_and(SplitBrdf::follows_pairs)
    }

    fn noise(&self, pair: &DirectionPair, each: &mut dyn FnMut(Source, f64)) {
        if let Some(of) = self.brdf.as_split() {
            of.noise(pair, each);
        }
    }

    fn surfaces(&self) -> usize {
        self.brdf.as_split().map_or(0, SplitBrdf::surfaces)
    }
}

impl<F: Fn(&[f64], &[Presence]) + Send + Sync> SampleBrdf for ObservedBrdf<'_, F> {
    fn sample(&self, omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        self.brdf.as_sample()?.sample(omega_o, u)
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        self.brdf.as_sample().map_or(0.0, |of| of.pdf(pair))
    }
}
